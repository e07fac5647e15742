# SPDX-License-Identifier: BSD-3-Clause
from dataclasses import replace

import numpy as np
import pytest

from skidyn.datasets import load_panda, load_planar_arm, load_scara, load_ur5
from skidyn.identification import RBDRegressor
from skidyn.robots import find_base_parameters


@pytest.mark.parametrize("load", [load_planar_arm, load_scara, load_ur5, load_panda])
def test_base_parameters_carry_all_torque(load):
    robot = load()
    base = find_base_parameters(robot)
    q, dq, ddq = np.random.default_rng(3).uniform(-2, 2, (3, 60, robot.n_joints))
    regressor = np.asarray(robot.torque_regressor(q, dq, ddq))
    assert np.linalg.matrix_rank(regressor.reshape(-1, 10 * robot.n_bodies)) == len(base.index)
    torque = regressor[:, :, base.index] @ base.values(robot.inertial_parameters)
    np.testing.assert_allclose(torque, robot.inverse_dynamics(q, dq, ddq), atol=1e-6)


def test_names_say_the_combination():
    robot = load_planar_arm()
    base = find_base_parameters(robot)
    assert len(set(base.expressions)) == len(base.expressions) == 6
    for expression, column in zip(base.expressions, base.index, strict=True):
        assert expression.startswith(robot.parameter_names[column])


def test_rounded_angles_identify_no_masses():
    robot = load_panda()
    few = np.array([[1, 0, 0], [0, 1, 2.65e-6], [0, -2.65e-6, 1]])  # half a turn, as 3.14159
    rotations = robot.tree.rotations.copy()
    rotations[0] = rotations[0] @ few
    rounded = replace(robot, tree=replace(robot.tree, rotations=rotations))
    assert np.abs(rounded.gravity_torque(np.ones((1, 7))))[0, 0] > 0
    base = find_base_parameters(rounded)
    np.testing.assert_array_equal(base.index, find_base_parameters(robot).index)

    # torque that no weight explains, of a tilted base, does not become masses of tons
    q, dq, ddq = np.random.default_rng(1).uniform(-1, 1, (3, 2000, 7))
    torque = rounded.inverse_dynamics(q, dq, ddq, gravity=(0.5, -0.5, -9.79))
    model = RBDRegressor(rounded, (), smooth=False).fit(np.hstack([q, dq, ddq]), torque)
    own = robot.inertial_parameters
    assert np.abs(model.inertial_parameters_ - own).max() < 10 * np.abs(own).max()
