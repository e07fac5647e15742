# SPDX-License-Identifier: BSD-3-Clause
"""A robot and an effect run on symbols give the program of their numbers."""

import numpy as np
import pytest

from skidyn.datasets import load_panda, load_planar_arm
from skidyn.dynamics import BoundProgram, Program, Tape, evaluate_rows
from skidyn.effects import get_effect
from skidyn.robots import Instant, SymbolicRobot, symbols


def run(tape, values, **given):
    """Values of scalars on a tape, for rows of its inputs."""
    flat = np.asarray(values, dtype=object).ravel()
    outputs = {(k,): tape.constant(0.0) + value for k, value in enumerate(flat)}
    n_rows = len(next(iter(given.values())))
    bound = BoundProgram(Program(tape, outputs, (len(flat),)), n_rows, np.dtype(float))
    return evaluate_rows(bound, given, n_rows)


@pytest.mark.parametrize("load", [load_planar_arm, load_panda])
def test_dynamics_and_kinematics_are_those_of_numbers(load):
    robot, tape = load(), Tape()
    n = robot.n_joints
    given = dict(
        zip(("q", "dq", "ddq"), np.random.default_rng(0).normal(size=(3, 5, n)), strict=True)
    )
    inputs = [symbols(tape, name, n) for name in given]
    recorded = SymbolicRobot(robot, tape)
    torque = run(tape, recorded.inverse_dynamics(*inputs), **given)
    np.testing.assert_allclose(torque, robot.inverse_dynamics(*given.values()), atol=1e-9)
    jacobian = run(tape, recorded.jacobian(inputs[0]), **given)
    np.testing.assert_allclose(jacobian.reshape(5, 6, n), robot.jacobian(given["q"]), atol=1e-9)
    position, rotation = recorded.forward_kinematics(inputs[0])
    for found, expected in zip(
        (position, rotation), robot.forward_kinematics(given["q"]), strict=True
    ):
        np.testing.assert_allclose(run(tape, found, **given), expected.reshape(5, -1), atol=1e-9)


def test_an_effect_of_one_sample_is_recorded_and_one_with_memory_is_refused():
    robot, tape = load_planar_arm(), Tape()
    q, dq, ddq = (symbols(tape, name, 2) for name in ("q", "dq", "ddq"))
    instant = Instant(q, dq, ddq, np.zeros(1, dtype=int), robot=SymbolicRobot(robot, tape))
    column = get_effect("nonlinear_viscous").columns(instant, 1, power=2.0)
    rows = np.random.default_rng(0).normal(size=(4, 2))
    found = run(tape, column, q=rows, dq=rows, ddq=rows)
    np.testing.assert_allclose(found[:, 0], np.abs(rows[:, 1]) * rows[:, 1], rtol=1e-6)
    with pytest.raises(TypeError, match="depends on the motion before"):
        get_effect("dahl").columns(instant, 1, presliding=0.01)
