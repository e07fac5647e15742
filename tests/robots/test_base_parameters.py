# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import pytest

from skidyn.datasets import load_panda, load_planar_arm, load_scara, load_ur5
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
