# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import pytest

from skidyn.datasets import load_panda, load_planar_arm, load_scara


@pytest.mark.parametrize("load", [load_panda, load_planar_arm, load_scara])
def test_a_robot_evaluated_once_gives_the_torque_of_its_program(load):
    robot, rng = load(), np.random.default_rng(0)
    q, dq, ddq = rng.normal(size=(3, 50, robot.n_joints))
    other = robot.inertial_parameters * rng.uniform(0.5, 2.0, (robot.n_bodies, 1))
    for options in ({}, {"parameters": other}, {"gravity": (1.0, 2.0, 3.0)}):
        program = robot.inverse_dynamics(q, dq, ddq, **options)
        once = robot.inverse_dynamics(q, dq, ddq, backend="once", **options)
        np.testing.assert_allclose(once, program, rtol=1e-11, atol=1e-11)


def test_a_robot_evaluated_once_has_double_precision():
    robot = load_planar_arm()
    q = np.zeros((2, 2))
    with pytest.raises(ValueError, match="'once' works in float64"):
        robot.inverse_dynamics(q, q, q, backend="once", dtype=np.float32)
