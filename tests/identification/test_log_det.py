# SPDX-License-Identifier: BSD-3-Clause
"""The relative change of bodies."""

from dataclasses import replace

import numpy as np
import pytest

from skidyn.datasets import load_panda, load_planar_arm
from skidyn.identification import RBDRegressor, is_consistent


@pytest.mark.parametrize("load", [load_planar_arm, load_panda])
@pytest.mark.parametrize("std", [10.0, 1.4, 0.01])
def test_ridge_minimises_residual_and_squared_relative_change(load, std, slope):
    left, _ = slope(load(), "ridge", std)
    assert left < 1e-4


@pytest.mark.parametrize("estimator", ["entropic", "ridge"])
def test_links_without_mass_become_small_bodies(estimator, poor_log):
    robot = load_panda()
    stated = robot.inertial_parameters.copy()
    stated[2] = 0.0
    robot = replace(robot, inertial_parameters=stated)
    found = RBDRegressor(robot, estimator=estimator, prior_std=1e-6).fit(*poor_log(robot))
    bodies = found.inertial_parameters_
    assert is_consistent(bodies) and bodies[2, 0] > 0
    np.testing.assert_allclose(np.delete(bodies, 2, 0), np.delete(stated, 2, 0), atol=1e-6)
