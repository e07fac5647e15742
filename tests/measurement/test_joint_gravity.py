# SPDX-License-Identifier: BSD-3-Clause
"""Gravity that was removed from the torque of a single joint."""

import pytest

from skidyn.datasets import load_planar_arm, load_ur5, make_hidden_effect_log
from skidyn.logs import check_log

ROBOT = load_ur5()
OPTIONS = {"n_trajectories": 4, "duration": 6.0, "random_state": 4}


def told(frame):
    return [s for s in check_log(frame, ROBOT).checks if s.certainty != "noted"]


@pytest.mark.parametrize("joint", [pytest.param(2, marks=pytest.mark.slow), 3])
def test_one_joint_without_gravity_is_told_alone(joint):
    frame = make_hidden_effect_log(ROBOT, "stribeck", joints=[5], **OPTIONS).frame
    pull = ROBOT.gravity_torque(frame[[f"q{k + 1}" for k in range(6)]].to_numpy())
    name = f"tau{joint}"
    (one,) = told(frame.assign(**{name: frame[name] - pull[:, joint - 1]}))
    assert (one.check, one.joints, one.certainty) == ("joint_gravity", (joint,), "suspected")


@pytest.mark.slow
@pytest.mark.parametrize("effect", ["payload", "gravity_compensator", "spring"])
def test_effects_that_change_gravity_are_no_mistake(effect):
    frame = make_hidden_effect_log(ROBOT, effect, **OPTIONS).frame
    assert "joint_gravity" not in {s.check for s in told(frame)}


def test_a_small_torque_without_gravity_is_no_scale():
    arm = load_planar_arm()
    frame = make_hidden_effect_log(arm, None, **OPTIONS).frame
    pull = arm.gravity_torque(frame[["q1", "q2"]].to_numpy())
    found = check_log(frame.assign(tau2=frame["tau2"] - pull[:, 1]), arm).checks
    (one,) = [s for s in found if s.certainty != "noted"]
    assert one.check == "joint_gravity" and one.joints == (2,)
