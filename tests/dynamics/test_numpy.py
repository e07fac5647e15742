# SPDX-License-Identifier: BSD-3-Clause
"""Programs run by NumPy, chunk by chunk."""

import numpy as np
import pytest

from skidyn.dynamics import BoundProgram, Program, Tape, chunk_size


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


@pytest.mark.parametrize(("n_samples", "limit"), [(0, 64), (100, 128), (50_000, 4096), (7, 3)])
def test_chunks_are_even_and_within_the_limit(n_samples, limit):
    size = chunk_size(n_samples, limit)
    assert size <= limit
    n_chunks = max(1, -(-n_samples // limit))
    assert size * n_chunks < n_samples + 64 * (n_chunks + 1)
