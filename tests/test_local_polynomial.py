# SPDX-License-Identifier: BSD-3-Clause
"""Local polynomials and their derivatives, on short and long stretches."""

import numpy as np
import pytest
from scipy.signal import savgol_filter

from skidyn._local_polynomial import local_polynomial


@pytest.mark.parametrize(("width", "order"), [(7, 4), (21, 4), (81, 4), (5, 2), (3, 2)])
@pytest.mark.parametrize("length", [81, 200])
@pytest.mark.parametrize("columns", [(), (3,)])
def test_agrees_with_the_filter_of_scipy(width, order, length, columns):
    values = np.random.default_rng(0).normal(size=(length, *columns))
    for k, found in enumerate(local_polynomial(values, width, order, 0.01)):
        expected = savgol_filter(values, width, order, deriv=k, delta=0.01, axis=0)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * np.abs(expected).max())


def test_a_quartic_is_kept_with_its_derivatives():
    t = np.linspace(0.0, 2.0, 41)
    value, first, second = local_polynomial(t**4 - t, 11, 4, 0.05)
    np.testing.assert_allclose(value, t**4 - t, atol=1e-11)
    np.testing.assert_allclose(first, 4 * t**3 - 1, atol=1e-9)
    np.testing.assert_allclose(second, 12 * t**2, atol=1e-7)
