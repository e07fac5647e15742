# SPDX-License-Identifier: BSD-3-Clause
"""Effects on several joints, compared on each of them."""

import numpy as np

from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor


def test_a_finding_is_as_uncertain_as_the_comparison_on_its_own_joint(without_friction):
    """In noise, other effects than a nonlinear spring explain the same torque."""
    arm = without_friction
    torque = arm.torque + np.array([0.05, 0.5]) * arm.size * (arm.q - arm.q.mean(0)) ** 3

    findings = diagnose(RBDRegressor(arm.robot, ()), arm.X, torque, checks=()).findings

    found = {f.joints: f for f in findings if f.kind == "nonlinear_spring"}
    assert set(found) == {(1,), (2,)}
    assert set(found[1,].rivals) > set(found[2,].rivals)
    assert found[1,].margin < found[2,].margin
