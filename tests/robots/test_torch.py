# SPDX-License-Identifier: BSD-3-Clause
"""Dynamics in torch on the devices of this machine; on a CPU, `test_chain` has more robots."""

import numpy as np
import pytest

from skidyn.datasets import load_panda

torch = pytest.importorskip("torch")
DEVICES = [
    "cpu",
    pytest.param(
        "cuda",
        marks=pytest.mark.skipif(not torch.cuda.is_available(), reason="torch sees no GPU"),
    ),
]


@pytest.fixture
def motion():
    return np.random.default_rng(1).uniform(-1.5, 1.5, (3, 50, 7))


@pytest.mark.parametrize("device", DEVICES)
def test_torque_and_regressor_stay_on_the_device_of_the_motion(device, motion):
    robot = load_panda()
    tensors = torch.tensor(motion, device=device)
    torque = robot.inverse_dynamics_torch(*tensors)
    regressor = robot.torque_regressor_torch(*tensors)
    assert torque.device == regressor.device == tensors.device
    np.testing.assert_allclose(torque.cpu(), robot.inverse_dynamics(*motion), atol=1e-11)
    np.testing.assert_allclose(regressor.cpu(), robot.torque_regressor(*motion), atol=1e-11)


@pytest.mark.parametrize("device", DEVICES)
def test_inertial_parameters_have_gradients_on_any_device(device, motion):
    robot = load_panda()
    tensors = torch.tensor(motion, device=device)
    parameters = torch.tensor(robot.inertial_parameters, device=device, requires_grad=True)
    robot.inverse_dynamics_torch(*tensors, parameters=parameters).sum().backward()
    expected = robot.torque_regressor(*motion).sum((0, 1)).reshape(robot.n_bodies, 10)
    np.testing.assert_allclose(parameters.grad.cpu(), expected, atol=1e-9)


@pytest.mark.parametrize("device", DEVICES)
def test_the_chain_serves_several_devices_in_turn(device, motion):
    robot = load_panda()
    before = robot.inverse_dynamics_torch(*torch.tensor(motion))
    robot.inverse_dynamics_torch(*torch.tensor(motion, device=device))
    np.testing.assert_array_equal(robot.inverse_dynamics_torch(*torch.tensor(motion)), before)


def test_dynamics_on_the_chain_follow_the_precision_of_the_motion():
    robot = load_panda()
    motion = torch.rand(3, 5, 7, dtype=torch.float32)
    torque = robot.inverse_dynamics_torch(*motion)
    assert torque.dtype == torch.float32
    exact = robot.inverse_dynamics(*motion.numpy())
    np.testing.assert_allclose(torque, exact, atol=1e-5 * np.abs(exact).max())
