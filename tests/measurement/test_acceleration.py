# SPDX-License-Identifier: BSD-3-Clause
"""Logged accelerations against velocities."""

import numpy as np
import pytest

from skidyn.logs import check_log


def told(frame, arm):
    return [s for s in check_log(frame, arm).checks if s.check == "acceleration"]


@pytest.fixture(scope="module")
def frame(recorded):
    """A log with accelerations that were differentiated with their noise."""
    table = recorded.frame.copy()
    for rows in table.groupby("trajectory").groups.values():
        for k in (1, 2):
            own = table.loc[rows]
            table.loc[rows, f"ddq{k}"] = np.gradient(own[f"dq{k}"], own["time"])
    return table


def test_noisy_accelerations_and_none_are_no_mistake(frame, recorded, arm):
    assert told(frame, arm) == told(recorded.frame, arm) == []


@pytest.mark.parametrize(
    ("change", "joints", "remedy"),
    [
        ({"ddq2": -1.0}, (2,), "--flip ddq2"),
        ({"ddq1": 180 / np.pi, "ddq2": 180 / np.pi}, (1, 2), "--units ddq=deg/s^2"),
        ({"ddq1": 0.01}, (1,), None),
    ],
)
def test_sign_unit_and_scale(change, joints, remedy, frame, arm):
    spoiled = frame.assign(**{name: size * frame[name] for name, size in change.items()})
    (one,) = told(spoiled, arm)
    assert one.joints == joints and one.certainty == "suspected"
    assert (one.remedy and one.remedy.option) == remedy


def test_a_column_of_zeros_beside_logged_accelerations(frame, arm):
    (one,) = told(frame.assign(ddq2=0.0), arm)
    assert one.joints == (2,) and "never changes" in one.suspicion


def test_accelerations_from_differences_of_past_velocities_are_late(frame, arm):
    late = frame.copy()
    for rows in frame.groupby("trajectory").groups.values():
        dq, time = frame.loc[rows, ["dq1", "dq2"]].to_numpy(), frame.loc[rows, "time"].to_numpy()
        before = np.maximum(np.arange(len(rows)) - 20, 0)
        span = np.maximum(time - time[before], np.diff(time)[0])[:, None]
        late.loc[rows, ["ddq1", "ddq2"]] = (dq - dq[before]) / span

    (one,) = told(late, arm)

    assert one.joints == (1, 2) and "is late by about" in one.suspicion
    assert float(one.remedy.option.removeprefix("--late ddq=")) == pytest.approx(0.1, abs=0.015)


def test_the_remedies_give_back_the_accelerations(frame, arm, tmp_path):
    from skidyn.logs import read_log

    frame.assign(ddq1=np.rad2deg(frame["ddq1"]), ddq2=np.rad2deg(frame["ddq2"])).to_parquet(
        tmp_path / "log.parquet"
    )
    read = read_log(tmp_path / "log.parquet", robot=arm, units={"ddq": "deg/s^2"}, check=False)
    np.testing.assert_allclose(read["ddq2"], frame["ddq2"])
