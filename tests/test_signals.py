# SPDX-License-Identifier: BSD-3-Clause
"""Signals out of tables, and the segments that nothing may cross."""

import pickle

import numpy as np
import pandas as pd
import pytest

from skidyn._signals import rates_of, runs_of, scatter
from skidyn.datasets import load_planar_arm, load_scara
from skidyn.diagnosis import diagnose
from skidyn.effects import Signals
from skidyn.exceptions import ColumnError, LogError
from skidyn.identification import RBDRegressor


def segments(trajectory, time=None):
    still = np.zeros((len(trajectory), 1))
    return Signals(still, still, still, np.asarray(trajectory), time=time).segments


def test_segments_end_at_trajectories_gaps_and_steps_back():
    trajectory = np.array([0, 0, 0, 1, 1, 1, 1, 0, 0])
    time = np.array([0, 0.1, 0.2, 0.3, 0.4, 2.0, 2.1, 0.0, 0.1])
    expected = [slice(0, 3), slice(3, 5), slice(5, 7), slice(7, 9)]
    assert segments(trajectory, time) == expected
    assert segments(trajectory) == [slice(0, 3), slice(3, 7), slice(7, 9)]
    assert segments(np.zeros(4), np.array([0, 1.0, 0.5, 1.5])) == [slice(0, 2), slice(2, 4)]


def test_signals_know_their_units_and_can_be_taken_in_part():
    q, dq, ddq = np.random.default_rng(0).normal(size=(3, 20, 4))
    slides = np.array([kind == "prismatic" for kind in load_scara().joint_types])
    signals = Signals(q, dq, ddq, np.repeat([5, 6], 10), prismatic=slides)
    assert signals.unit.tolist() == [1, 1, 0.1, 1]
    np.testing.assert_array_equal(signals.clock, np.arange(20))
    part = signals.take(slice(5, 15))
    np.testing.assert_array_equal(part.q, q[5:15])
    np.testing.assert_array_equal(part.within, np.arange(9) != 4)
    assert part.segments == [slice(0, 5), slice(5, 10)]


def table(**columns):
    time = np.arange(400) / 100
    motion = {f"q{j}": np.sin((1 + j) * time) for j in (1, 2)}
    motion |= {f"dq{j}": (1 + j) * np.cos((1 + j) * time) for j in (1, 2)}
    return pd.DataFrame({"time": time, **motion, **columns})


def diagnosed(X):
    torque = np.random.default_rng(0).normal(1.0, 0.1, (len(X), 2))
    return diagnose(RBDRegressor(load_planar_arm()), X, torque, effects=["spring"])


def test_refuses_to_invent_accelerations():
    with pytest.raises(ColumnError, match="neither accelerations nor time"):
        RBDRegressor(load_planar_arm()).fit(table().drop(columns="time"), np.ones((400, 2)))


@pytest.mark.filterwarnings("ignore::skidyn.exceptions.LogWarning")
def test_a_table_is_read_in_any_order_beside_columns_of_anything():
    names = ["remark", "q2", "time", "dq1", "q1", "dq2", "trajectory"]
    X = table(remark="slow", trajectory=7)
    signals = diagnosed(X[names]).comparison.signals
    np.testing.assert_allclose(signals.q, X[["q1", "q2"]], atol=1e-9)
    assert set(signals.trajectory) == {7}
    np.testing.assert_array_equal(signals.time, X["time"])


def test_what_is_not_finite_is_named_with_its_row_and_joint():
    X = table()
    X.loc[1, "dq2"] = np.nan
    with pytest.raises(LogError, match=r"dq of joint 2 \(joint2\) is not finite in row 1"):
        diagnosed(X)


def test_a_torque_of_the_model_is_computed_when_it_is_first_read():
    calls = []

    def torque():
        calls.append(1)
        return np.arange(12.0).reshape(6, 2)

    motion = Signals(*np.zeros((3, 6, 2)), trajectory=np.zeros(6), model_torque=torque)
    moved = motion.with_(load=np.ones((6, 2))).take(np.array([1, 3]))
    assert not calls and motion.smooth_torque is None
    np.testing.assert_array_equal(moved.model_torque, [[2.0, 3.0], [6.0, 7.0]])
    assert moved.model_torque is moved.model_torque and len(calls) == 1
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(motion)).named("tau2"), torque()[:, 1])


def test_only_what_depends_on_the_fit_is_computed_again_after_a_fit():
    q, dq, ddq = np.random.default_rng(0).normal(size=(3, 20, 2))
    signals = Signals(q, dq, ddq, np.repeat([5, 6], 10), load=q)
    assert signals.once("sum", lambda: 1) == signals.once("loaded", lambda: 1, of_fit=True) == 1
    again = signals.with_(load=2 * q)
    assert again.once("sum", lambda: 2) == 1
    assert again.once("loaded", lambda: 2, of_fit=True) == 2
    assert again.with_(q=2 * q).once("sum", lambda: 3) == 3
    index, few = again.thinned(3)
    np.testing.assert_array_equal(few.load, 2 * q[index])
    np.testing.assert_array_equal(signals.thinned(3)[1].load, q[index])


def test_a_motion_that_is_no_table_is_refused():
    robot = load_planar_arm()
    with pytest.raises(LogError, match="X has 1 dimensions"):
        diagnose(RBDRegressor(robot), np.zeros(10), np.zeros((10, 2)))


def test_rates_within_segments():
    time = np.array([0.0, 1.0, 3.0, 4.0, 9.0])
    values = np.array([[0.0], [1.0], [3.0], [9.0], [7.0]])
    rates = rates_of(values, time, [slice(0, 3), slice(3, 4), slice(4, 5)])
    assert rates.ravel().tolist() == [1.0, 1.0, 1.0, 0.0, 0.0]


def test_runs_of_true_rows():
    begins, ends = runs_of(np.array([False, True, True, False, True]))
    assert (begins.tolist(), ends.tolist()) == ([1, 4], [3, 5])
    assert runs_of(np.zeros(3, bool))[0].tolist() == []


def test_scatter_of_normal_values_beside_outliers():
    values = np.random.default_rng(0).normal(scale=2.0, size=(4000, 2))
    values[::20] = 100.0
    np.testing.assert_allclose(scatter(values, axis=0), 2.0, rtol=0.12)
