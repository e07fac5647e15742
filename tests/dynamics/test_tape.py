# SPDX-License-Identifier: BSD-3-Clause
"""Simplification of symbolic scalars, and equality of the back ends that read a tape."""

import math

import numpy as np
import pytest

from skidyn.datasets import load_panda, load_scara
from skidyn.dynamics import (
    BoundProgram,
    Program,
    ScalarFunction,
    Tape,
    chunk_size,
    evaluate_torch,
    python_function,
)


def test_trivial_arithmetic_leaves_nothing_behind():
    tape = Tape()
    x, y = tape.input("q", 0), tape.input("q", 1)
    assert (x * 0.0).is_zero() and (x - x).is_zero()
    assert (x * 1.0).index == x.index == (x + 0.0).index == (x * -1.0 * -1.0).index
    assert (x + y).index == (y + x).index and (x * y).index == (y * x).index
    assert (-(x - y)).index == (y - x).index
    assert ((-x) * (-y)).index == (x * y).index
    assert (x - (-y)).index == (x + y).index
    assert (2.0 * tape.constant(3.0) - 1.0).value == 5.0


def random_program(seed):
    """A program of random operations, evaluated by ordinary arithmetic as well."""
    rng = np.random.default_rng(seed)
    tape = Tape()
    values = rng.normal(size=(3, 40))
    terms = [(tape.input("q", i), values[i]) for i in range(3)]
    terms += [(tape.constant(c), np.full(40, c)) for c in (0.0, 1.0, -1.0, 2.5)]
    for _ in range(60):
        (a, x), (b, y) = (terms[k] for k in rng.integers(len(terms), size=2))
        terms.append(
            [(a + b, x + y), (a - b, x - y), (a * b, x * y), (-a, -x), (a.sin(), np.sin(x))][
                rng.integers(5)
            ]
        )
    chosen = terms[-6:]
    outputs = {(k,): scalar for k, (scalar, _) in enumerate(chosen)}
    expected = np.array([np.broadcast_to(value, 40) for _, value in chosen]).T
    return Program(tape, outputs, (6,)), values.T.copy(), expected


@pytest.mark.parametrize("seed", range(20))
def test_back_ends_agree_with_plain_arithmetic(seed):
    torch = pytest.importorskip("torch")
    program, q, expected = random_program(seed)
    tolerance = {"rtol": 1e-10, "atol": 1e-10}
    np.testing.assert_allclose(ScalarFunction(program)({"q": q}), expected, **tolerance)
    np.testing.assert_allclose(
        evaluate_torch(program, {"q": torch.tensor(q)}), expected, **tolerance
    )
    bound = BoundProgram(program, 64, np.dtype(float))
    bound.run({"q": q}, slice(0, 40))
    np.testing.assert_allclose(bound.outputs[:, :40].T, expected, **tolerance)


@pytest.mark.parametrize("kinds", [("sin",), ("cos",), ("sin", "cos"), ("cos", "sin", "cos")])
def test_sines_and_cosines_are_exact_at_any_angle(kinds):
    tape = Tape()
    x = tape.input("q", 0)
    functions = {"sin": x.sin, "cos": x.cos}
    outputs = {(k,): functions[kind]() * (1.0 + k) for k, kind in enumerate(kinds)}
    angles = np.concatenate(
        [np.pi / 2 * np.arange(-8, 9), [0.0, 1e-300, 1e-8], np.linspace(-1e4, 1e4, 40)]
    )[:, None]
    bound = BoundProgram(Program(tape, outputs, (len(kinds),)), 64, np.dtype(float))
    bound.run({"q": angles}, slice(0, 60))
    for k, kind in enumerate(kinds):
        expected = (1.0 + k) * getattr(np, kind)(angles[:, 0])
        np.testing.assert_allclose(bound.outputs[k, :60], expected, rtol=0, atol=2e-15)


def test_program_text_is_plain_python():
    program = load_scara()._engine.fixed_inverse_dynamics(load_scara().inertial_parameters)
    text = python_function(program, "torque")
    namespace = {"sin": math.sin, "cos": math.cos}
    exec(text, namespace)
    q, dq, ddq = [[0.1, 0.2, -0.1, 0.4]], [[1.0, 2.0, 0.3, 0.4]], [[0.5, 0.0, 1.0, 2.0]]
    torque = namespace["torque"](q[0], dq[0], ddq[0])
    np.testing.assert_allclose(torque, load_scara().inverse_dynamics(q, dq, ddq)[0], atol=1e-12)


@pytest.mark.parametrize(("n_samples", "limit"), [(0, 64), (100, 128), (50_000, 4096), (7, 3)])
def test_chunks_are_even_and_within_the_limit(n_samples, limit):
    size = chunk_size(n_samples, limit)
    assert size <= limit
    n_chunks = max(1, -(-n_samples // limit))
    assert size * n_chunks < n_samples + 64 * (n_chunks + 1)


def test_right_angles_are_not_snapped():
    """An angle written with few digits is taken as written (1.5708 is 3.7e-6 rad off)."""
    robot = load_panda()
    matrix = robot.tree.rotations[1]
    assert set(np.unique(matrix)) == {-1.0, 0.0, 1.0}  # the double nearest to pi/2 is exact
    from skidyn.robots._description import rotation_from_rpy

    assert rotation_from_rpy(np.array([1.57079632679, 0, 0]))[1, 1] == np.cos(1.57079632679) != 0
