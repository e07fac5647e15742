# SPDX-License-Identifier: BSD-3-Clause
"""The meaning of columns, by name and by position."""

import numpy as np
import pandas as pd
import polars
import pytest

from skidyn.datasets import load_planar_arm
from skidyn.exceptions import ColumnError
from skidyn.identification import RBDRegressor

ROBOT = load_planar_arm()
STATE = [f"{s}_{j}" for s in ("q", "dq", "ddq") for j in ROBOT.joint_names]
ROWS = np.random.default_rng(0).uniform(-2, 2, (60, 6))
TORQUE = ROBOT.inverse_dynamics(ROWS[:, :2], ROWS[:, 2:4], ROWS[:, 4:]) + 0.5 * ROWS[:, 2:4]


def fitted(X, **keys):
    return RBDRegressor(ROBOT, ("viscous",), smooth=False, **keys).fit(X, TORQUE)


def test_names_in_any_order():
    table = pd.DataFrame(ROWS, columns=STATE).assign(noise=1.0, temp1=20.0, temp2=20.0)
    mixed = table[["noise", *reversed(STATE), "temp1", "temp2"]]
    for X in (table, mixed, polars.from_pandas(mixed)):
        np.testing.assert_allclose(fitted(X).predict(X), TORQUE, atol=1e-6)


def test_by_position_around_the_keys():
    X = np.column_stack([np.ones(60), ROWS, np.arange(60) / 100])
    np.testing.assert_allclose(fitted(X, trajectory=0, time=-1).predict(X), TORQUE, atol=1e-6)


@pytest.mark.parametrize(
    ("names", "n", "keys", "words"),
    [
        (None, 7, {}, "7 columns; a robot with 2 joints needs 6"),
        (None, 6, {"time": "t"}, "no column names"),
        (None, 6, {"trajectory": 9}, "out of range"),
        (STATE, 6, {"time": "stamp"}, "'stamp' is not in X"),
        (["q1", "q2", "dq1", "qd2"], 4, {}, "lacks the column.*dq2.*did you mean"),
        (STATE[:5], 5, {}, "ddq_joint2"),
        (STATE[:4], 4, {}, "ddq_joint1, ddq_joint2"),
        (None, 7, {"trajectory": 0, "time": -7}, "both the column 0 of X"),
        ([*STATE, "t"], 7, {"trajectory": "t", "time": "t"}, "both the column 't' of X"),
    ],
)
def test_errors_say_what_is_wrong(names, n, keys, words):
    X = np.column_stack([ROWS, np.arange(60)])[:, :n]
    with pytest.raises(ColumnError, match=words):
        fitted(X if names is None else pd.DataFrame(X, columns=names), **keys)


def test_a_name_that_stands_twice_is_refused():
    with pytest.raises(ValueError, match="more than once|unique|duplicate"):
        fitted(pd.DataFrame(np.column_stack([ROWS, ROWS[:, 1]]), columns=[*STATE, STATE[1]]))
