# SPDX-License-Identifier: BSD-3-Clause
"""Local polynomials and their derivatives, on short and long stretches."""

import numpy as np
import pytest
from scipy.signal import savgol_filter

from skidyn.effects import Signals
from skidyn.evidence import smooth_motion

ORDER = 6


def smoothed(values, step, cutoff=None):
    values = np.reshape(values, (len(values), -1))
    time = np.arange(len(values)) * step
    none = np.zeros_like(values)
    return smooth_motion(Signals(values, none, none, np.zeros(len(values)), time), cutoff)


@pytest.mark.parametrize("step", [0.02, 0.01, 0.002])
@pytest.mark.parametrize("length", [130, 400])
@pytest.mark.parametrize("columns", [1, 3])
def test_agrees_with_the_filter_of_scipy(step, length, columns):
    values = np.random.default_rng(0).normal(size=(length, columns))
    found = smoothed(values, step)
    width = 2 * found.half_width + 1
    for k, derivative in enumerate((found.q, found.dq, found.ddq)):
        expected = savgol_filter(values, width, ORDER, deriv=k, delta=step, axis=0)
        np.testing.assert_allclose(derivative, expected, atol=1e-9 * np.abs(expected).max())


def test_a_quartic_is_kept_with_its_derivatives():
    t = np.arange(200) * 0.01
    found = smoothed(t**4 - t, 0.01, cutoff=5.0)
    np.testing.assert_allclose(found.q[:, 0], t**4 - t, atol=1e-10)
    np.testing.assert_allclose(found.dq[:, 0], 4 * t**3 - 1, atol=1e-8)
    np.testing.assert_allclose(found.ddq[:, 0], 12 * t**2, atol=1e-6)
