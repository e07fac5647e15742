# SPDX-License-Identifier: BSD-3-Clause
"""Signals out of tables, and the segments that nothing may cross."""

import numpy as np
import pandas as pd
import pytest

from skidyn._columns import resolve_columns
from skidyn._signals import find_segments, read_signals, signals_from
from skidyn.datasets import load_planar_arm, load_scara
from skidyn.exceptions import ColumnError, LogError


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


def table(**columns):
    motion = {"time": [0.0, 0.1, 0.2], "q1": 0.1, "q2": 0.2, "dq1": 0.0, "dq2": 0.0}
    return pd.DataFrame(motion | columns)


def test_a_table_is_read_in_any_order_beside_columns_of_anything():
    names = ["remark", "q2", "time", "dq1", "q1", "dq2", "trajectory"]
    X = table(remark="slow", trajectory=7)[names]
    signals, torque = read_signals(X, np.ones((3, 2)), load_planar_arm())
    assert signals.q.tolist() == [[0.1, 0.2]] * 3
    assert signals.trajectory.tolist() == [7, 7, 7]
    assert signals.time.tolist() == [0.0, 0.1, 0.2] and torque.shape == (3, 2)


def test_accelerations_are_derived_only_where_they_may_be():
    assert not read_signals(table(), np.ones((3, 2)), load_planar_arm())[0].ddq.any()
    with pytest.raises(ColumnError, match="ddq"):
        read_signals(table(), np.ones((3, 2)), load_planar_arm(), to_derive=False)


def test_what_is_not_finite_is_named_with_its_row_and_joint():
    with pytest.raises(LogError, match=r"dq of joint 2 \(joint2\) is not finite in row 1"):
        read_signals(table(dq2=[0.0, np.nan, 0.0]), np.ones((3, 2)), load_planar_arm())
