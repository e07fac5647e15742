# SPDX-License-Identifier: BSD-3-Clause
"""Scaling of columns."""

import numpy as np
import pytest

from skidyn.preprocessing import SignalScaler

X = np.column_stack([[0.0, 2.0, 4.0], [5.0, 5.0, 5.0], [1e9, 1e9, 1e9 + 1e-7]])


@pytest.mark.parametrize("kind", ["minmax", "standard"])
def test_columns_that_are_constant_but_for_rounding_are_not_blown_up(kind):
    scaled = SignalScaler(kind, trajectory=None, time=None).fit_transform(X)
    assert np.abs(scaled[:, 1:]).max() < 1e-6
    assert np.ptp(scaled[:, 0]) > 0.9


def test_the_range_is_from_zero_to_one():
    scaled = SignalScaler(trajectory=None, time=None).fit_transform(X)
    np.testing.assert_allclose(scaled[:, 0], [0.0, 0.5, 1.0])
