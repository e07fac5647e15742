# SPDX-License-Identifier: BSD-3-Clause
"""Simplification of symbolic scalars, and equality of the back ends that read a tape."""

import numpy as np
import pytest

from skidyn.dynamics import BoundProgram, Program, ScalarFunction, Tape, evaluate_torch


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
