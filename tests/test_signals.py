# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import pytest

from skidyn._columns import resolve_columns
from skidyn._signals import find_segments, signals_from
from skidyn.datasets import load_scara


def test_segments_end_at_trajectories_gaps_and_steps_back():
    trajectory = np.array([0, 0, 0, 1, 1, 1, 1, 0, 0])
    time = np.array([0, 0.1, 0.2, 0.3, 0.4, 2.0, 2.1, 0.0, 0.1])
    expected = [slice(0, 3), slice(3, 5), slice(5, 7), slice(7, 9)]
    assert find_segments(trajectory, time) == expected
    assert find_segments(trajectory) == [slice(0, 3), slice(3, 7), slice(7, 9)]
    assert find_segments(np.zeros(4), np.array([0, 1.0, 0.5, 1.5])) == [slice(0, 2), slice(2, 4)]
    assert find_segments(np.array([])) == []


def test_reads_a_table():
    X = np.random.default_rng(0).normal(size=(20, 13))
    X[:, 0] = np.repeat([5, 6], 10)
    signals = signals_from(X, resolve_columns(None, 13, list("abcd"), trajectory=0), load_scara())
    np.testing.assert_array_equal(signals.dq, X[:, 5:9])
    assert signals.prismatic.tolist() == [False, False, True, False]
    assert signals.unit.tolist() == [1, 1, 0.1, 1]
    np.testing.assert_array_equal(signals.clock, np.arange(20))
    part = signals.take(slice(5, 15))
    np.testing.assert_array_equal(part.q, signals.q[5:15])
    assert part.segments == [slice(0, 5), slice(5, 10)]


def test_refuses_to_invent_accelerations():
    names = ["q1", "dq1"]
    columns = resolve_columns(names, 2, ["a"], require_acceleration=False)
    with pytest.raises(ValueError, match="accelerations"):
        signals_from(np.zeros((3, 2)), columns)
