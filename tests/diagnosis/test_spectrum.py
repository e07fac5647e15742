# SPDX-License-Identifier: BSD-3-Clause
"""Lines in the spectrum over the angle."""

import numpy as np
import pytest

from skidyn.diagnosis import find_lines


def test_a_ripple_is_found_with_its_waves_and_size(missing):
    problem = missing.problem
    q, rng = problem.signals.q, np.random.default_rng(0)
    residual = 0.05 * rng.normal(size=q.shape)
    residual[:, 1] += 0.2 * np.sin(53.0 * q[:, 1] + 0.3)

    best = min(find_lines(problem, residual), key=lambda line: line.chance)

    assert best.joint == 1 and best.chance < 1e-9
    assert abs(best.term.shape["N"] - 53.0) < 0.1
    assert np.abs(best.torque).max() == pytest.approx(0.2, rel=0.1)


def test_noise_has_no_line(missing):
    residual = np.random.default_rng(1).normal(size=missing.problem.signals.q.shape)
    assert all(line.chance > 1e-3 for line in find_lines(missing.problem, residual))
