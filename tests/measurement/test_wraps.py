# SPDX-License-Identifier: BSD-3-Clause
"""The size of the jumps of positions."""

import numpy as np
import pytest

from skidyn.measurement import wrap_period

TIME = np.arange(0, 20, 0.01)
ONE = np.zeros(len(TIME), dtype=int)


def test_a_turn_is_exact():
    wrapped = (8 * np.sin(TIME) + np.pi) % (2 * np.pi) - np.pi
    assert wrap_period(wrapped, ONE) == 2 * np.pi


def test_smooth_positions_have_no_period():
    assert wrap_period(np.sin(TIME), ONE) is None


def test_values_that_were_not_read_are_no_range():
    failed = np.sin(TIME)
    failed[::100] = 9999.0
    assert wrap_period(failed, ONE) is None


def test_unequal_jumps_have_no_period():
    joined = np.sin(TIME) + 5.0 * (np.arange(len(TIME)) // 300 % 2)
    joined += 0.3 * (np.arange(len(TIME)) // 600)
    assert wrap_period(joined, ONE) is None


def test_jumps_between_recordings_do_not_count():
    number = np.arange(len(TIME)) // 200
    apart = np.sin(TIME) + 7.0 * (number % 2)
    assert wrap_period(apart, number) is None
    assert wrap_period(8 * np.sin(TIME) % 5.0, number) == pytest.approx(5.0, abs=1e-3)
