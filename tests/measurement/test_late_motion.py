# SPDX-License-Identifier: BSD-3-Clause
"""Position and velocity of one joint on another clock than the others."""

import numpy as np
import pytest

from skidyn.datasets import load_ur5, make_hidden_effect_log
from skidyn.logs import check_log

ROBOT = load_ur5()


@pytest.mark.parametrize("joint", [2, 4])
def test_the_motion_of_one_joint_is_late(joint):
    frame = make_hidden_effect_log(
        ROBOT, None, n_trajectories=5, duration=6.0, random_state=4
    ).frame
    for rows in frame.groupby("trajectory").groups.values():
        time = frame.loc[rows, "time"].to_numpy()
        for name in (f"q{joint}", f"dq{joint}"):
            frame.loc[rows, name] = np.interp(time - 0.025, time, frame.loc[rows, name])
    (told,) = [s for s in check_log(frame, ROBOT).checks if s.check == "torque_delay"]
    assert told.joints == (joint,) and told.suspicion.startswith("position and velocity of joint")
    first, second = told.remedy.option.removeprefix("--late ").split(",")
    assert first.startswith(f"q{joint}=") and second.startswith(f"dq{joint}=")
    assert float(first.split("=")[1]) == pytest.approx(0.025, abs=1.5e-3)


def test_play_of_a_gear_is_no_late_motion():
    log = make_hidden_effect_log(ROBOT, "backlash", n_trajectories=5, duration=6.0, random_state=5)
    told = [s.suspicion for s in check_log(log.frame, ROBOT).checks if s.check == "torque_delay"]
    assert not any(words.startswith("position and velocity") for words in told)
