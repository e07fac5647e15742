# SPDX-License-Identifier: BSD-3-Clause
"""Functions that motions are sums of."""

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

from skidyn.excitation._basis import FourierBasis, QuinticBasis


@pytest.mark.parametrize("basis", [FourierBasis(7.0, 0.2, 3, 0.5), QuinticBasis(7.0, 4)])
def test_derivatives_are_those_of_the_values_and_the_ends_are_at_rest(basis):
    time = np.linspace(0.0, 7.0, 7001)
    values = basis(time)
    for k in range(2):
        gone = cumulative_trapezoid(values[k + 1], time, axis=0, initial=0.0)
        np.testing.assert_allclose(gone, values[k], atol=1e-4)
    np.testing.assert_allclose(values[:, [0, -1]], 0.0, atol=1e-12)


def test_quintics_pass_their_points_with_the_motion_that_is_asked():
    basis = QuinticBasis(10.0, 4)
    at_points = basis(np.array([2.0, 4.0, 6.0, 8.0]))
    asked = np.random.default_rng(0).normal(size=(4, 3))
    q, dq, ddq = at_points @ asked.ravel()
    np.testing.assert_allclose(np.column_stack([q, 2 * dq, 4 * ddq]), asked, atol=1e-12)
