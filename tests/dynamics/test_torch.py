# SPDX-License-Identifier: BSD-3-Clause
"""Dynamics in torch: the same numbers, with gradients."""

import numpy as np
import pytest

from skidyn.datasets import load_scara


def states(robot, n_samples=50, seed=0):
    return np.random.default_rng(seed).normal(size=(3, n_samples, robot.n_joints))


def test_torch_equals_numpy_and_has_gradients():
    torch = pytest.importorskip("torch")
    robot = load_scara()
    arrays = states(robot, 4)
    q, dq, ddq = (torch.tensor(a, requires_grad=True) for a in arrays)
    parameters = torch.tensor(robot.inertial_parameters.copy(), requires_grad=True)
    tau = robot.inverse_dynamics_torch(q, dq, ddq, parameters)
    np.testing.assert_allclose(tau.detach(), robot.inverse_dynamics(*arrays), atol=1e-12)
    np.testing.assert_allclose(
        robot.inverse_dynamics_torch(q, dq, ddq).detach(), tau.detach(), atol=1e-12
    )
    Y = robot.torque_regressor_torch(q, dq, ddq)
    np.testing.assert_allclose(Y.detach(), robot.torque_regressor(*arrays), atol=1e-12)
    assert torch.autograd.gradcheck(robot.inverse_dynamics_torch, (q, dq, ddq, parameters))
    (gradient,) = torch.autograd.grad(tau.sum(), parameters)
    np.testing.assert_allclose(gradient.ravel(), Y.sum((0, 1)).detach(), atol=1e-10)
