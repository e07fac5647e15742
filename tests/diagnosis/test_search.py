# SPDX-License-Identifier: BSD-3-Clause
"""Several effects at once, and effects that become each other."""

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, load_scara, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor


@pytest.mark.slow
def test_fast_motion_under_a_precise_torque_makes_no_joint_elastic(found_in):
    log = make_hidden_effect_log(load_scara(), None, noise="low", random_state=1022)

    assert found_in(load_scara(), log.X, log.y) == {}


@pytest.mark.slow
def test_a_cable_that_only_pulls_between_two_joints(arm_log, found_in):
    q = arm_log.X[["q1", "q2"]].to_numpy()
    x = q[:, 0] - 0.8 * q[:, 1]
    torque = np.array(arm_log.y)
    pull = np.std(torque[:, 1]) * np.maximum(0.0, x - np.median(x))
    torque += pull[:, None] * [1.0, -0.8]

    assert found_in(load_planar_arm(), arm_log.X, torque) == {"coupling_spring": {1, 2}}


@pytest.mark.parametrize(
    "kind",
    [
        "temperature_offset",
        pytest.param("dahl", marks=pytest.mark.slow),
        pytest.param("coupled_friction", marks=pytest.mark.slow),
    ],
)
def test_what_the_formula_of_an_added_effect_leaves_is_no_other_effect(kind):
    """The log is diagnosed again after each effect that is added."""
    options = {"n_trajectories": 10, "duration": 6.0, "rate": 200.0, "random_state": 3}
    log = make_hidden_effect_log(load_planar_arm(), kind, noise="low", **options)
    first = diagnose(RBDRegressor(log.robot), log.X, log.y, checks=())
    again = diagnose(first.model, log.X, log.y, checks=())

    assert [f.kind for f in first.findings] == [kind]
    assert (again.verdict, again.findings) == ("complete", [])
