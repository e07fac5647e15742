# SPDX-License-Identifier: BSD-3-Clause
"""Position and velocity of one joint on another clock than the others."""

import numpy as np
import pytest

from skidyn.datasets import load_scara, load_ur5, make_hidden_effect_log
from skidyn.logs import check_log

ROBOT = load_ur5()


def late(frame, joint, lag, channels=("q", "dq")):
    """Channels of a joint that are late."""
    frame = frame.copy()
    for rows in frame.groupby("trajectory").groups.values():
        time = frame.loc[rows, "time"].to_numpy()
        for name in (f"{channel}{joint}" for channel in channels):
            frame.loc[rows, name] = np.interp(time - lag, time, frame.loc[rows, name])
    return frame


@pytest.mark.parametrize("joint", [2, pytest.param(4, marks=pytest.mark.slow)])
def test_the_motion_of_one_joint_is_late(joint):
    frame = make_hidden_effect_log(
        ROBOT, None, n_trajectories=5, duration=6.0, random_state=4
    ).frame
    (told,) = [
        s for s in check_log(late(frame, joint, 0.025), ROBOT).checks if s.check == "torque_delay"
    ]
    assert told.joints == (joint,) and told.suspicion.startswith("position and velocity of joint")
    first, second = told.remedy.option.removeprefix("--late ").split(",")
    assert first.startswith(f"q{joint}=") and second.startswith(f"dq{joint}=")
    assert float(first.split("=")[1]) == pytest.approx(0.025, abs=1.5e-3)


@pytest.mark.slow
def test_play_of_a_gear_is_no_late_motion():
    log = make_hidden_effect_log(ROBOT, "backlash", n_trajectories=5, duration=6.0, random_state=5)
    told = [s.suspicion for s in check_log(log.frame, ROBOT).checks if s.check == "torque_delay"]
    assert not any(words.startswith("position and velocity") for words in told)


@pytest.mark.slow
def test_a_load_of_some_recordings_does_not_hide_it(loaded):
    told = check_log(late(loaded.frame, 4, 0.03), ROBOT).checks
    (told,) = [s for s in told if s.check == "torque_delay"]
    assert told.joints == (4,) and told.remedy.option.startswith("--late q4=0.0")


def test_of_a_joint_that_no_other_feels_either_is_late():
    """The torque of a slider depends on its own motion alone."""
    robot = load_scara()
    log = make_hidden_effect_log(robot, None, n_trajectories=5, duration=6.0, random_state=6610230)
    (told,) = [
        s for s in check_log(late(log.frame, 3, 0.035), robot).checks if s.check == "torque_delay"
    ]
    assert told.joints == (3,) and "position and velocity are late" in told.suspicion
    assert told.remedy.option.startswith("--late tau3=-0.03")


@pytest.mark.parametrize("joint", [3, pytest.param(2, marks=pytest.mark.slow)])
def test_all_channels_of_one_joint_are_late(joint):
    frame = make_hidden_effect_log(
        ROBOT, None, n_trajectories=5, duration=6.0, random_state=4
    ).frame
    changed = late(frame, joint, 0.04, ("q", "dq", "tau"))
    (told,) = [s for s in check_log(changed, ROBOT).checks if s.check == "torque_delay"]
    assert told.joints == (joint,)
    assert told.suspicion.startswith("position, velocity and torque of joint")
    option = told.remedy.option
    assert [part.split("=")[0] for part in option.removeprefix("--late ").split(",")] == [
        f"q{joint}",
        f"dq{joint}",
        f"tau{joint}",
    ]
    assert float(option.split("=")[1].split(",")[0]) == pytest.approx(0.04, abs=2e-3)
