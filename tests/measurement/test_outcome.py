# SPDX-License-Identifier: BSD-3-Clause
"""Gains of one fit over another, by column of the torque."""

import numpy as np

from skidyn.measurement._outcome import Outcome
from skidyn.measurement._robust import RobustFit


def test_a_gain_is_that_of_independent_rows():
    slow = np.repeat([1.0, -1.0] * 10, 20)
    fits = [RobustFit(np.zeros(1), 1.0, slow, value) for value in (10.0, 4.0)]
    here, there = (Outcome.of(2, [1], [fit]) for fit in fits)
    assert here.likelihood.tolist() == [0.0, 10.0]
    assert here.inflation[0] == 1.0 and here.inflation_of(1) > 5
    assert here.margin(there)[1] == 6.0 / here.inflation_of(1)
    np.testing.assert_array_equal(here.margin(there), -there.margin(here))
