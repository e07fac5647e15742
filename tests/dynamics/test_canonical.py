# SPDX-License-Identifier: BSD-3-Clause
"""Frames of the fewest operations change no torque."""

import numpy as np
import pytest

from skidyn.datasets import load_panda, load_scara
from skidyn.dynamics import Engine


@pytest.mark.parametrize("load", [load_panda, load_scara])
def test_mass_that_no_torque_notices_may_be_anywhere(load):
    """A mass on the axis of the first joint, and a thin rod along it, move nothing."""
    robot = load()
    state = np.random.default_rng(0).uniform(-1, 1, (3, 5, robot.n_joints))
    heavier = robot.inertial_parameters.copy()
    axis = robot.tree.axes[0]
    heavier[0, 0] += 3.0
    heavier[0, 1:4] += 0.5 * axis
    np.testing.assert_allclose(
        robot.inverse_dynamics(*state, parameters=heavier),
        robot.inverse_dynamics(*state),
        atol=1e-9,
    )


def test_an_engine_gives_what_its_robot_gives():
    robot = load_scara()
    q, dq, ddq = np.random.default_rng(1).uniform(-1, 1, (3, 4, robot.n_joints))
    engine = Engine(robot.tree, robot.inertial_parameters, robot.gravity)
    torque = engine.inverse_dynamics({"q": q, "dq": dq, "ddq": ddq})
    np.testing.assert_array_equal(torque, robot.inverse_dynamics(q, dq, ddq))
