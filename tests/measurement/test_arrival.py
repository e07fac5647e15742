# SPDX-License-Identifier: BSD-3-Clause
"""Gaps in time that the motion does not have."""

import numpy as np
import pytest

from skidyn.logs import read_log


def in_batches(frame, size):
    """Stamps of arrival: every recording in batches, whose samples follow each other in 0.1 ms."""
    stamps = frame["time"].to_numpy().copy()
    for rows in frame.groupby("trajectory").indices.values():
        number = np.arange(len(rows))
        last = np.minimum(number // size * size + size - 1, len(rows) - 1)
        stamps[rows] = stamps[rows][last] + 1e-4 * (number % size)
    return frame.assign(time=stamps)


@pytest.mark.parametrize("size", [pytest.param(12, marks=pytest.mark.slow), 40])
def test_stamps_of_arrival_in_batches(recorded, arm, told_of, tmp_path, size):
    frame = in_batches(recorded.frame, size)

    told = told_of(frame)

    assert told["false_gaps"].certainty == "certain"
    assert "batches" in told["false_gaps"].suspicion
    assert {name for name, one in told.items() if one.certainty != "noted"} == {"false_gaps"}

    frame.to_parquet(tmp_path / "log.parquet")
    with pytest.warns(UserWarning, match="were moved to even steps"):
        mended = read_log(tmp_path / "log.parquet", robot=arm, clock="regular")
    steps = np.diff(mended["time"])[np.diff(mended["trajectory"]) == 0]
    np.testing.assert_allclose(steps, np.diff(recorded.frame["time"])[0], rtol=1e-6)
    assert "false_gaps" not in told_of(mended)


def test_a_clock_that_was_set_within_a_recording(recorded, told_of):
    time = recorded.frame["time"].to_numpy().copy()
    first = recorded.frame["trajectory"].to_numpy() == 0
    for row in (300, 500):
        time[row:] += 7.0
    time[~first] += 100.0
    told = told_of(recorded.frame.assign(time=time))["false_gaps"]
    assert told.suspicion == "the clock was set while joints moved"
    assert told.remedy.option == "--clock regular"


def test_gaps_that_the_motion_has(recorded, told_of):
    frame, row = recorded.frame, np.arange(len(recorded.frame)) % 400
    kept = frame[(row < 200) | (row > 260)].reset_index(drop=True)
    told = told_of(kept)
    assert "false_gaps" not in told
    assert told["gaps"].certainty == "noted"
