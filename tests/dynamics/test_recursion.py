# SPDX-License-Identifier: BSD-3-Clause
"""The recursions obey mechanics."""

import numpy as np
import pytest

from skidyn.datasets import load_panda, load_scara, load_srs_arm
from skidyn.robots import Robot


def states(robot, n_samples=50, seed=0):
    return np.random.default_rng(seed).normal(size=(3, n_samples, robot.n_joints))


@pytest.mark.parametrize("load", [load_panda, load_scara])
def test_torque_is_linear_in_the_parameters(load):
    robot = load()
    q, dq, ddq = states(robot)
    a, b = np.random.default_rng(1).normal(size=(2, robot.n_bodies, 10))
    torque = {
        name: robot.inverse_dynamics(q, dq, ddq, parameters=p)
        for name, p in (("a", a), ("b", b), ("mix", 2 * a - 3 * b))
    }
    np.testing.assert_allclose(torque["mix"], 2 * torque["a"] - 3 * torque["b"], atol=1e-10)
    Y = robot.torque_regressor(q, dq, ddq)
    np.testing.assert_allclose(Y @ a.ravel(), torque["a"], atol=1e-10)


@pytest.mark.parametrize("load", [load_panda, load_scara, load_srs_arm])
def test_mass_matrix_is_symmetric_positive_definite(load):
    robot = load()
    M = robot.mass_matrix(states(robot)[0])
    np.testing.assert_array_equal(M, M.transpose(0, 2, 1))
    assert np.linalg.eigvalsh(M).min() > 0


def test_power_balance():
    """Work of the torques is the change of kinetic and potential energy."""
    robot = load_srs_arm()
    q, dq, ddq = states(robot, 1)
    step = 1e-6

    def energy(t):
        position, velocity = q + t * dq + t * t / 2 * ddq, dq + t * ddq
        M = robot.mass_matrix(position)[0]
        return 0.5 * velocity[0] @ M @ velocity[0]

    power = (robot.inverse_dynamics(q, dq, ddq) - robot.gravity_torque(q))[0] @ dq[0]
    assert (energy(step) - energy(-step)) / (2 * step) == pytest.approx(power, rel=1e-6)


def test_long_chain():
    """A chain of 200 equal pendulums, each hanging on the one before."""
    parts = ['<robot name="chain"><link name="l0"/>']
    for i in range(200):
        parts.append(
            f'<link name="l{i + 1}"><inertial><mass value="1"/></inertial></link>'
            f'<joint name="j{i}" type="continuous"><parent link="l{i}"/><child link="l{i + 1}"/>'
            '<origin xyz="0 0.1 0"/></joint>'
        )
    robot = Robot.from_urdf("".join([*parts, "</robot>"]))
    torque = robot.gravity_torque(np.zeros((2, 200)))[0]
    # Bodies k, k+1, .. 199 hang 0, 0.1, .. m out from joint k; turning about x lifts them.
    expected = [9.81 * 0.1 * sum(range(200 - k)) for k in range(200)]
    np.testing.assert_allclose(torque, expected, rtol=1e-12)
