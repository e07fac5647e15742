# SPDX-License-Identifier: BSD-3-Clause
"""Positions that jump and remain there."""

import numpy as np

from skidyn.measurement import find_leaps

TIME = np.arange(2000) * 0.01


def leaps(q):
    return find_leaps(q[:, None], TIME, np.zeros(2000, dtype=int)).tolist()


def test_a_position_that_remains_where_it_jumps():
    wave = np.sin(TIME)
    assert leaps(wave) == []
    assert leaps(wave + 2.0 * (np.arange(2000) >= 1200)) == [1200]


def test_a_position_that_returns_at_once_does_not_leap():
    assert leaps(np.sin(TIME) + 2.0 * (np.arange(2000) == 1200)) == []


def test_a_position_that_is_wrong_for_a_moment_does_not_leap():
    wave = np.sin(TIME)
    wrong = (np.arange(2000) >= 1200) & (np.arange(2000) < 1210)
    assert leaps(np.where(wrong, 1e-3 * wave, wave)) == []
    assert leaps(wave + 2.0 * (np.arange(2000) >= 1200) - 1.0 * (np.arange(2000) >= 1210)) != []


def test_a_joint_that_rests_and_moves_by_a_step_of_its_encoder_does_not_leap():
    resting = np.zeros(2000)
    resting[1200:1600] = 1.2e-5
    assert leaps(resting) == []
