# SPDX-License-Identifier: BSD-3-Clause
"""Recordings that were merged by a clock that restarts."""

import numpy as np
import pytest

from skidyn.measurement import find_interleaved

TIME = np.arange(0, 5, 0.01)


def merged(n):
    """Positions of recordings in the order of a time that restarts, and this time."""
    q = np.concatenate([np.sin(np.array([1.0, 1.7]) * TIME[:, None] + k) for k in range(n)])
    time = np.tile(TIME, n)
    order = np.argsort(time, kind="stable")
    return time[order], q[order]


@pytest.mark.parametrize("n", [2, 5])
def test_recordings_in_the_order_of_a_clock_that_restarts(n):
    time, q = merged(n)
    found = find_interleaved(time, q, np.zeros(len(time), dtype=int))
    assert found.rows == pytest.approx(n) and found.leap > 0.1


def test_coarse_stamps_of_one_recording():
    q = np.sin(np.array([1.0, 1.7]) * TIME[:, None])
    assert find_interleaved(np.floor(TIME / 0.05), q, np.zeros(len(TIME), dtype=int)) is None
