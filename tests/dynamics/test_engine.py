# SPDX-License-Identifier: BSD-3-Clause
"""Chunks, memory and precision of batched dynamics."""

import numpy as np
import pytest

from skidyn.datasets import load_panda, load_scara


def states(robot, n_samples=50, seed=0):
    return np.random.default_rng(seed).normal(size=(3, n_samples, robot.n_joints))


@pytest.mark.parametrize("n_samples", [0, 1, 8, 9, 63, 64, 65, 5000, 5121, 12000])
def test_any_number_of_samples_gives_the_same_torques(n_samples):
    robot = load_panda()
    q, dq, ddq = states(robot, n_samples)
    tau = robot.inverse_dynamics(q, dq, ddq)
    assert tau.shape == (n_samples, 7)
    for k in range(0, n_samples, max(1, n_samples // 7)):
        one = robot.inverse_dynamics(q[[k]], dq[[k]], ddq[[k]])
        np.testing.assert_allclose(tau[[k]], one, atol=1e-12)


@pytest.mark.parametrize("n_samples", [1, 3, 100, 6000])
def test_regressor_chunks_equal_the_whole(n_samples):
    robot = load_scara()
    q, dq, ddq = states(robot, n_samples)
    Y = robot.torque_regressor(q, dq, ddq)
    covered = 0
    for rows, part in robot.iter_torque_regressor(q, dq, ddq, chunk=64):
        assert part.shape == (4, 40, rows.stop - rows.start) and part.shape[-1] <= 64
        np.testing.assert_allclose(np.moveaxis(part, -1, 0), Y[rows], atol=1e-12)
        covered += part.shape[-1]
    assert covered == n_samples


def test_the_columns_of_one_body_are_those_of_the_whole_regressor():
    robot = load_panda()
    motion = states(robot, 100)
    Y = robot.torque_regressor(*motion)
    for body in (0, 3, robot.n_bodies - 1):
        (part,) = (part.copy() for _, part in robot.iter_torque_regressor(*motion, body=body))
        own = Y[:, :, 10 * body : 10 * body + 10]
        np.testing.assert_allclose(np.moveaxis(part, -1, 0), own, atol=1e-12)


def test_two_iterations_at_once_do_not_disturb_each_other():
    robot = load_scara()
    one, other = states(robot, 300, seed=1), states(robot, 300, seed=2)
    pairs = zip(
        robot.iter_torque_regressor(*one, chunk=100),
        robot.iter_torque_regressor(*other, chunk=100),
        strict=True,
    )
    expected_one, expected_other = robot.torque_regressor(*one), robot.torque_regressor(*other)
    for (rows, a), (_, b) in pairs:
        np.testing.assert_allclose(np.moveaxis(a, -1, 0), expected_one[rows], atol=1e-12)
        np.testing.assert_allclose(np.moveaxis(b, -1, 0), expected_other[rows], atol=1e-12)


def test_regressor_into_given_memory():
    robot = load_scara()
    q, dq, ddq = states(robot)
    out = np.full((4, 40, 50), np.nan)
    Y = robot.torque_regressor(q, dq, ddq, out=out)
    assert np.shares_memory(Y, out)
    np.testing.assert_array_equal(Y, robot.torque_regressor(q, dq, ddq))
    with pytest.raises(ValueError, match="out has shape"):
        robot.torque_regressor(q, dq, ddq, out=np.empty((4, 40, 51)))


def test_float32_error_is_as_stated():
    robot = load_panda()
    q, dq, ddq = states(robot, 500)
    exact, single = (robot.inverse_dynamics(q, dq, ddq, dtype=t) for t in (float, np.float32))
    assert single.dtype == np.float32
    assert np.abs(single - exact).max() < 2e-6 * np.abs(exact).max()


@pytest.mark.parametrize("n_samples", [1, 100, 7000])
def test_given_memory_of_full_chunks_and_a_remainder(n_samples):
    robot = load_panda()
    q, dq, ddq = states(robot, n_samples)
    Y = robot.torque_regressor(q, dq, ddq, out=np.full((7, 70, n_samples), np.nan))
    tau = robot.inverse_dynamics(q, dq, ddq)
    np.testing.assert_allclose(Y @ robot.inertial_parameters.ravel(), tau, atol=1e-10)
