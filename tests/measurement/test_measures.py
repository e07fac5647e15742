# SPDX-License-Identifier: BSD-3-Clause
"""Plain measures of recorded columns."""

import numpy as np
from scipy.ndimage import median_filter

from skidyn.measurement import (
    is_held,
    rest_share,
    reversals,
)
from skidyn.measurement._measures import equal_values, held_share, longest_plateau_share

TIME = np.arange(2000) * 0.01
WAVE = np.sin(TIME)


def test_torques_that_are_held_together():
    torque = np.random.default_rng(0).normal(size=(2000, 2))
    assert not is_held(torque, np.ones(1999, dtype=bool)).any()
    held = torque[np.arange(2000) // 4 * 4]
    assert is_held(held, np.ones(1999, dtype=bool)).mean() > 0.7


def test_rest_and_reversals():
    assert rest_share(np.zeros(5)) == 1.0
    assert rest_share(np.cos(TIME)) < 0.01
    assert reversals(np.cos(TIME), [slice(0, 2000)]) == 6


def test_parts_of_one_value_end_with_their_recording():
    begins, ends = equal_values(np.array([3.0, 3, 1, 1, 1, 2]), np.array([0, 0, 0, 0, 1, 1]))
    assert begins.tolist() == [0, 2, 4, 5] and ends.tolist() == [2, 4, 5, 6]


def test_few_rows_hold_no_position():
    for n in range(2, 12):
        assert held_share(WAVE[:n], np.ones(n - 1, dtype=bool), np.nan) == 0.0


def test_plateaus_at_a_limit_recur_or_are_the_longest():
    whole = [slice(0, 2000)]
    assert longest_plateau_share(np.clip(WAVE, -2.0, 0.9), whole) > 0.1
    once = np.clip(WAVE[:300], -2.0, 0.9)
    assert longest_plateau_share(once, [slice(0, 300)]) > 0.1


def test_a_median_filter_is_no_limit():
    noisy = 2 * WAVE + np.random.default_rng(0).normal(0, 0.1, 2000)
    filtered = median_filter(noisy, 41, mode="nearest")
    assert longest_plateau_share(filtered, [slice(0, 2000)]) == 0.0
