# SPDX-License-Identifier: BSD-3-Clause
"""Rows that were shuffled are told from recordings that begin again."""

import numpy as np

from skidyn._order import has_one_motion, order_in_time

TIME = np.tile(np.arange(50) * 0.01, 4)
RUN = np.repeat([1, 2, 3, 4], 50)


def test_recordings_one_after_the_other_are_in_order():
    assert order_in_time(RUN, TIME) is None
    assert order_in_time(RUN, None) is None


def test_shuffled_rows_are_sorted_by_recording_and_time():
    mixed = np.random.default_rng(0).permutation(len(TIME))
    order = order_in_time(RUN[mixed], TIME[mixed])
    np.testing.assert_array_equal(RUN[mixed][order], RUN)
    np.testing.assert_array_equal(TIME[mixed][order], TIME)


def test_rows_at_the_same_time_belong_to_several_motions():
    same = np.zeros(len(TIME), dtype=int)
    order = np.argsort(TIME, kind="stable")
    assert has_one_motion(RUN, TIME)
    assert not has_one_motion(same, TIME[order])
