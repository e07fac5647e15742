# SPDX-License-Identifier: BSD-3-Clause
"""Shares of a torque in the channels of other joints."""

import pytest

from skidyn.datasets import load_planar_arm, load_ur5, make_hidden_effect_log
from skidyn.logs import check_log

ARM, UR5 = load_planar_arm(), load_ur5()
OPTIONS = {"n_trajectories": 4, "duration": 6.0, "random_state": 3}


def told(frame, robot):
    return [s for s in check_log(frame, robot).checks if s.certainty != "noted"]


@pytest.mark.parametrize(
    "joint, source, share", [(3, 2, 0.2), pytest.param(4, 3, -0.15, marks=pytest.mark.slow)]
)
def test_a_share_of_another_torque_is_told_alone(joint, source, share):
    frame = make_hidden_effect_log(UR5, "stribeck", joints=[2], **OPTIONS).frame
    mixed = frame[f"tau{joint}"] + share * frame[f"tau{source}"]
    checks = check_log(frame.assign(**{f"tau{joint}": mixed}), UR5).checks
    (one,) = [s for s in checks if s.check == "crosstalk"]
    assert one.joints == (joint, source)
    # drives of neighbouring joints may be coupled
    assert one.certainty == "noted" and "drives are coupled" in one.suspicion
    found = float(one.suspicion.split(" contains ")[1].split(" %")[0])
    assert found == pytest.approx(100 * share, rel=0.25)


@pytest.mark.parametrize("effect", ["coupled_friction", "coupled_inertia", "coupling_spring"])
def test_effects_that_couple_joints_are_no_crosstalk(effect):
    frame = make_hidden_effect_log(ARM, effect, **OPTIONS).frame
    assert "crosstalk" not in {s.check for s in told(frame, ARM)}
