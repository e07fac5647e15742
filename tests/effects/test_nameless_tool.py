# SPDX-License-Identifier: BSD-3-Clause
"""Columns of nameless torques that depend on the position of the tool."""

import numpy as np

from skidyn.datasets import load_ur5
from skidyn.effects import Signals, Term, get_effect


def test_a_drag_takes_energy_from_the_tool(signals, robot):
    position = robot.forward_kinematics(signals.q)[0][:, 2]
    shape = {"low": position.min() - 0.01, "high": position.max() + 0.01}
    term = Term("drag_on_tool", (1, 2), shape)
    columns = term.torque_columns(signals)
    power = sum(c.sum(axis=1) * signals.dq[:, j] for j, c in columns.items())
    jacobian = robot.jacobian(signals.q)[:, :3]
    velocity = np.einsum("ian,in->ia", jacobian, signals.dq)
    np.testing.assert_allclose(power, np.sum(velocity**2, axis=1), atol=1e-9)


def test_a_torque_of_one_joint_may_depend_on_the_place_of_the_tool(signals):
    effect = get_effect("function_of_tool_position")
    assert effect.grid(signals, (0,)) == []  # of two joints, their positions tell as much
    q = np.random.default_rng(0).uniform(-0.8, 0.8, (800, 6))
    robot = load_ur5()
    many = Signals(q, q, q, trajectory=np.zeros(800, dtype=int), robot=robot)
    (shape,) = effect.grid(many, (2,))
    columns = Term("function_of_tool_position", (3,), shape).torque_columns(many)
    assert set(columns) == {2}
    place = robot.forward_kinematics(q)[0]
    # a spring to a point, as the length of a hose
    torque = np.sqrt(1.0 + np.sum((place - [0.3, 0.2, 0.4]) ** 2, axis=1))
    rest = torque - columns[2] @ np.linalg.lstsq(columns[2], torque, rcond=None)[0]
    assert np.std(rest) < 0.05 * np.std(torque)
    assert effect.variables(2, shape) == ("tool position",)
