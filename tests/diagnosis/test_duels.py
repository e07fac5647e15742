# SPDX-License-Identifier: BSD-3-Clause
"""Effects on several joints, compared on each of them."""

from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor


def of_springs(arm, linear, cubic):
    """Findings with a linear and a cubic spring on each joint, of some share of its torque."""
    away = arm.q - arm.q.mean(0)
    torque = arm.torque + arm.size * (linear * away + cubic * away**3)
    return diagnose(RBDRegressor(arm.robot, ()), arm.X, torque, checks=()).findings


def test_an_effect_is_not_found_on_a_joint_that_a_simpler_one_explains(without_friction):
    """A nonlinear spring explains a linear one, too."""
    findings = of_springs(without_friction, linear=(0.3, 0.0), cubic=(0.0, 0.3))

    assert {(f.kind, f.joints) for f in findings} == {("spring", (1,)), ("nonlinear_spring", (2,))}


def test_a_finding_is_as_uncertain_as_the_comparison_on_its_own_joint(without_friction):
    """In noise, other effects than a nonlinear spring explain the same torque."""
    findings = of_springs(without_friction, linear=(0.0, 0.0), cubic=(0.05, 0.5))

    found = {f.joints: f for f in findings if f.kind == "nonlinear_spring"}
    assert set(found) == {(1,), (2,)}
    assert set(found[1,].rivals) > set(found[2,].rivals)
    assert found[1,].margin < found[2,].margin
