# SPDX-License-Identifier: BSD-3-Clause
"""Velocities and positions that are late relative to each other."""

import numpy as np
import pytest


def test_late_velocities(signals, torque, found, only):
    late = np.stack([np.interp(signals.time - 0.03, signals.time, dq) for dq in signals.dq.T], 1)
    only(found(signals.with_(dq=late), torque), "velocity_delay", "suspected", "--late dq=0.03")


def test_commanded_velocities_are_early(recorded, told_of):
    """The torque is in time with the position, so that this one is not late."""
    frame = recorded.frame.copy()
    for rows in frame.groupby("trajectory").groups.values():
        time, values = frame.loc[rows, "time"], frame.loc[rows, ["dq1", "dq2"]].to_numpy()
        early = [np.interp(time + 0.05, time, own) for own in values.T]
        frame.loc[rows, ["dq1", "dq2"]] = np.stack(early, axis=1)
    told = told_of(frame)["velocity_delay"]
    assert told.remedy.option == "--derive dq" and "the torque is not" in told.suspicion


def test_the_commanded_velocity_of_one_joint(recorded, told_of):
    frame = recorded.frame.copy()
    for rows in frame.groupby("trajectory").groups.values():
        time, values = frame.loc[rows, "time"], frame.loc[rows, "dq2"]
        frame.loc[rows, "dq2"] = np.interp(time + 0.05, time, values)
    told = told_of(frame)["velocity_delay"]
    assert told.joints == (2,) and told.remedy.option == "--derive dq2"


def test_the_velocity_of_one_joint_is_late(recorded, told_of):
    frame = recorded.frame.copy()
    for rows in frame.groupby("trajectory").groups.values():
        time, values = frame.loc[rows, "time"], frame.loc[rows, "dq2"]
        frame.loc[rows, "dq2"] = np.interp(time - 0.03, time, values)
    told = told_of(frame)["velocity_delay"]
    name, _, lag = told.remedy.option.partition("=")
    assert told.joints == (2,) and name == "--late dq2"
    assert float(lag) == pytest.approx(0.03, abs=0.004)


@pytest.mark.parametrize("late", ["q", "dq"])
def test_a_channel_that_is_very_late(signals, torque, found, late):
    rows = np.maximum(np.arange(len(signals.q)) - 18, 0)
    told = found(signals.with_(**{late: getattr(signals, late)[rows]}), torque)
    told = {s.check: s for s in told if s.certainty != "noted"}
    assert set(told) == {"velocity_delay"}
    assert told["velocity_delay"].remedy.option == f"--late {late}=0.18"
