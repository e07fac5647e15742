# SPDX-License-Identifier: BSD-3-Clause
"""Plain measures of recorded columns."""

import numpy as np

from skidyn.measurement import (
    is_held,
    is_repeated,
    position_step,
    rest_share,
    reversals,
)
from skidyn.measurement._measures import equal_values

TIME = np.arange(2000) * 0.01
WAVE = np.sin(TIME)


def test_the_step_of_a_coarse_sensor_is_found_and_none_is_made_up():
    assert np.isclose(position_step(np.round(WAVE / 0.01) * 0.01), 0.01)
    assert np.isnan(position_step(WAVE + 1e-4 * np.random.default_rng(0).normal(size=2000)))


def test_rows_that_repeat_while_the_joint_moves():
    held = WAVE[np.arange(2000) // 2 * 2][:, None]
    again = is_repeated(held, np.cos(TIME)[:, None], np.zeros(2000))
    assert again[1::2].mean() > 0.9 and not again[::2].any()


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


def test_a_joint_that_begins_to_move_by_one_step_of_its_sensor_repeats_no_row():
    position = np.repeat([[0.0], [1.0], [3.0], [6.0], [9.0], [12.0]], [20, 1, 1, 1, 1, 1], axis=0)
    velocity = np.linspace(0.05, 3.0, len(position))[:, None]
    again = is_repeated(position, velocity, np.zeros(len(position), dtype=int))
    assert not again.any()
