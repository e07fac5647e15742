# SPDX-License-Identifier: BSD-3-Clause
"""What matters most is reported first."""

import numpy as np
import pytest

from skidyn.datasets import load_ur5, make_hidden_effect_log
from skidyn.logs import check_log

UR5 = make_hidden_effect_log(load_ur5(), None, n_trajectories=4, duration=6.0, random_state=3)


def spoiled(zero, jitter):
    """A log with two mistakes."""
    rng = np.random.default_rng(0)
    time = UR5.frame["time"] + rng.uniform(-jitter, jitter, len(UR5.frame))
    return UR5.frame.assign(q4=UR5.frame["q4"] + zero, time=time)


def test_the_mistake_that_changes_more_is_reported_first():
    first, second = check_log(spoiled(zero=0.8, jitter=0.001), UR5.robot).checks[:2]
    assert (first.check, first.remedy.option[:9]) == ("reading", "--zero q4")
    assert second.check == "clock_jitter"
    assert first.influence > 0.3 and first.influence > second.influence


@pytest.mark.slow
def test_the_order_follows_the_influence():
    flipped = UR5.frame.assign(tau2=-UR5.frame["tau2"], q4=UR5.frame["q4"] + 0.3)
    told = [c for c in check_log(flipped, UR5.robot).checks if c.certainty == "certain"]
    shares = [c.influence for c in told]
    assert len(told) == 2 and shares == sorted(shares, reverse=True)


@pytest.mark.slow
def test_gravity_of_a_robot_on_a_wall_has_an_influence():
    wall = UR5.robot.with_gravity([0.0, -9.81, 0.0])
    log = make_hidden_effect_log(wall, None, n_trajectories=4, duration=6.0, random_state=3)
    quality = check_log(log.frame, UR5.robot)
    told = quality.checks[0]
    assert told.remedy.arguments.keys() == {"gravity"} and told.influence > 0.3
    assert "of the error of the robot's model)" in str(quality)


def test_without_a_robot_nothing_is_fitted():
    checks = check_log(spoiled(zero=0.8, jitter=0.002)).checks
    assert all(c.influence is None for c in checks)


@pytest.mark.slow
def test_limitations_of_a_log_have_no_influence():
    coarse = UR5.frame.assign(q1=UR5.frame["q1"].round(2))
    noted = [c for c in check_log(coarse, UR5.robot).checks if c.certainty == "noted"]
    assert noted and all(c.influence is None for c in noted)


def test_the_log_is_left_as_it_was():
    frame = spoiled(zero=0.5, jitter=0.001)
    before = frame.copy()
    check_log(frame, UR5.robot)
    assert frame.equals(before)
