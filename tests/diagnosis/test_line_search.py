# SPDX-License-Identifier: BSD-3-Clause
"""Ripple and vibration among other explanations."""

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log


@pytest.mark.slow
def test_what_the_formula_of_a_spring_leaves_is_no_ripple(found_in):
    """A counterweight on a four-bar linkage pulls by the slope of its height."""
    log = make_hidden_effect_log(load_planar_arm(), None, noise="low", random_state=3)
    x = log.X["q1"].to_numpy()
    rocker = 0.39 * np.sin(x) + np.arcsin(0.45 * np.sin(1.17 + 1.6 * x))
    torque = log.y + 12.0 * (rocker - rocker.mean())[:, None] * [1.0, 0.0]
    assert "torque_ripple" not in found_in(log.robot, log.X, torque)


@pytest.mark.slow
def test_a_ripple_with_harmonics_is_one_finding_of_one_joint(found_in):
    log = make_hidden_effect_log(load_planar_arm(), None, noise="low", random_state=3)
    angle = 9 * log.X["q1"].to_numpy()
    wave = 0.8 * np.sin(angle) + 0.4 * np.sin(2 * angle + 1.0)
    torque = log.y + wave[:, None] * [1.0, 0.0]
    assert found_in(log.robot, log.X, torque) == {"torque_ripple": {1}}
