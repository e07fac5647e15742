# SPDX-License-Identifier: BSD-3-Clause
"""Effects on several joints, compared on each of them."""

import numpy as np
import pytest

from skidyn.datasets import load_ur5, make_hidden_effect_log
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


@pytest.mark.parametrize("free", [pytest.param(0.0, marks=pytest.mark.slow), 0.3])
def test_a_gravity_compensator_is_no_nonlinear_spring(without_friction, free):
    """With a free length or without, within the travel of an arm."""
    arm = without_friction
    angle = arm.q[:, 1] - arm.q[:, 1].mean() + 1.0
    length = np.sqrt(0.3**2 + 0.4**2 - 2 * 0.3 * 0.4 * np.cos(angle))
    torque = arm.torque.copy()
    torque[:, 1] += 3.0 * arm.size[1] * np.sin(angle) * (1 - free / length)

    findings = diagnose(RBDRegressor(arm.robot, ()), arm.X, torque, checks=()).findings

    assert [(f.kind, f.joints) for f in findings] == [("gravity_compensator", (2,))]


@pytest.mark.slow
def test_a_spring_of_one_joint_is_not_a_coupling_of_a_large_ratio():
    """A coupling of several pairs explains more than springs, but not on each of the pairs."""
    log = make_hidden_effect_log(load_ur5(), None, random_state=0, n_trajectories=6, duration=5.0)
    q = log.X[[f"q{k}" for k in range(1, 7)]].to_numpy()
    torque = np.array(log.y, dtype=float)
    torque[:, [2, 5]] += [2.0, 0.5] * (q[:, [2, 5]] - [0.1, 0.2])
    coupling = 0.3 * (q[:, 3] - q[:, 4] + 1.0)
    torque[:, [3, 4]] += np.column_stack([coupling, -coupling])

    model = RBDRegressor(log.robot, ("viscous", "coulomb"))
    findings = diagnose(model, log.X, torque, checks=()).findings

    assert {(f.kind, f.joints) for f in findings} == {
        ("coupling_spring", (4, 5)),
        ("spring", (3,)),
        ("spring", (6,)),
    }
