# SPDX-License-Identifier: BSD-3-Clause
"""Several effects at once, and effects that become each other."""

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, load_scara, make_hidden_effect_log


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
