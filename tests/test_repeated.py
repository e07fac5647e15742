# SPDX-License-Identifier: BSD-3-Clause
"""Rows that repeat the one before, and what is derived from the positions of the others."""

import numpy as np

from skidyn._repeated import is_repeated, stale_rows
from skidyn.effects import Signals
from skidyn.evidence import smooth_motion

TIME = np.arange(2000) * 0.01
NUMBER = np.zeros(2000, dtype=int)


def logged(positions, velocities):
    return Signals(positions, velocities, np.zeros_like(positions), NUMBER, time=TIME)


def test_rows_that_repeat_while_the_joint_moves():
    held = np.sin(TIME)[np.arange(2000) // 2 * 2][:, None]
    again = is_repeated(held, np.cos(TIME)[:, None], np.zeros(2000))
    assert again[1::2].mean() > 0.9 and not again[::2].any()


def test_a_joint_that_begins_to_move_by_one_step_of_its_sensor_repeats_no_row():
    position = np.repeat([[0.0], [1.0], [3.0], [6.0], [9.0], [12.0]], [20, 1, 1, 1, 1, 1], axis=0)
    velocity = np.linspace(0.05, 3.0, len(position))[:, None]
    again = is_repeated(position, velocity, np.zeros(len(position), dtype=int))
    assert not again.any()


def test_repeated_rows_do_not_spoil_accelerations():
    q = np.column_stack([np.sin(2 * TIME), np.cos(3 * TIME)])
    dq = np.column_stack([2 * np.cos(2 * TIME), -3 * np.sin(3 * TIME)])
    late = np.arange(4, 1990, 7)
    held, still = q.copy(), dq.copy()
    held[late], still[late] = q[late - 1], dq[late - 1]

    smoothed = smooth_motion(logged(held, still))

    assert not smoothed.usable[late].all(axis=1).any()
    use = smoothed.usable.all(axis=1)
    true = -np.column_stack([4 * q[:, 0], 9 * q[:, 1]])
    assert np.abs(smoothed.ddq - true)[use].max() < 0.1


def test_a_coarse_sensor_repeats_no_row():
    step = 2 * np.pi / 2**10
    q = np.round(np.column_stack([np.sin(0.3 * TIME), np.cos(0.2 * TIME)]) / step) * step
    dq = np.column_stack([0.3 * np.cos(0.3 * TIME), -0.2 * np.sin(0.2 * TIME)])
    assert not stale_rows(logged(q, dq)).any()
