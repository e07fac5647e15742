# SPDX-License-Identifier: BSD-3-Clause
"""Factors of positions that differ from joint to joint."""

import numpy as np

from skidyn.datasets import load_ur5, make_hidden_effect_log
from skidyn.logs import check_log


def test_ratios_of_gears_on_each_joint_are_not_degrees():
    robot = load_ur5()
    log = make_hidden_effect_log(robot, None, n_trajectories=4, duration=6.0, random_state=4)
    ratios = (100.0, 120.0, -100.0, 80.0, 100.0, -50.0)
    frame = log.frame.assign(
        **{
            f"{q}{k + 1}": x * log.frame[f"{q}{k + 1}"]
            for q in ("q", "dq")
            for k, x in enumerate(ratios)
        }
    )
    (told,) = [s for s in check_log(frame, robot).checks if s.certainty == "certain"]
    assert told.check == "position_unit" and told.remedy is None
    assert "another factor on each joint" in told.suspicion
    both = {n: np.rad2deg(log.frame[n]) for k in range(6) for n in (f"q{k + 1}", f"dq{k + 1}")}
    (told,) = [
        s for s in check_log(log.frame.assign(**both), robot).checks if s.certainty != "noted"
    ]
    assert told.remedy.option == "--units q=deg,dq=deg/s"
