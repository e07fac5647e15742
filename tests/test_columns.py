# SPDX-License-Identifier: BSD-3-Clause
import pandas as pd
import polars
import pytest

from skidyn._columns import column_names, resolve_columns
from skidyn.exceptions import ColumnError

JOINTS = ["shoulder", "elbow"]
STATE = [f"{s}_{j}" for s in ("q", "dq", "ddq") for j in JOINTS]


def test_names_in_any_order():
    names = ["noise", *reversed(STATE), "time", "trajectory", "temp1", "temp2"]
    columns = resolve_columns(names, len(names), JOINTS)
    assert [names[i] for i in columns.state()] == STATE
    assert (names[columns.time], names[columns.trajectory]) == ("time", "trajectory")
    assert [names[i] for i in columns.temperature] == ["temp1", "temp2"]


def test_by_position_around_the_keys():
    columns = resolve_columns(None, 8, JOINTS, trajectory=0, time=-1)
    assert columns.state() == [1, 2, 3, 4, 5, 6]
    assert (columns.trajectory, columns.time) == (0, 7)
    assert columns.temperature is None


@pytest.mark.parametrize(
    ("names", "n", "keys", "words"),
    [
        (None, 7, {}, "7 columns; a robot with 2 joints needs 6"),
        (None, 6, {"time": "t"}, "no column names"),
        (None, 6, {"trajectory": 9}, "out of range"),
        (STATE, 6, {"time": "stamp"}, "'stamp' is not in X"),
        ([*STATE, "q_elbow"], 7, {}, "more than once"),
        (["q1", "q2", "dq1", "qd2"], 4, {}, "lacks the column.*dq2.*did you mean"),
        (STATE[:4], 4, {}, "ddq"),
        (None, 7, {"trajectory": 0, "time": -7}, "both the column 0 of X"),
        ([*STATE, "t"], 7, {"trajectory": "t", "time": "t"}, "both the column 't' of X"),
    ],
)
def test_errors_say_what_is_wrong(names, n, keys, words):
    with pytest.raises(ColumnError, match=words):
        resolve_columns(names, n, JOINTS, **keys)


def test_accelerations_may_be_missing_but_not_some_of_them():
    assert resolve_columns(STATE[:4], 4, JOINTS, require_acceleration=False).ddq is None
    with pytest.raises(ColumnError, match="ddq_elbow"):
        resolve_columns(STATE[:5], 5, JOINTS, require_acceleration=False)


def test_names_of_tables():
    assert column_names(pd.DataFrame({"a": [1]})) == column_names(polars.DataFrame({"a": [1]}))
    assert column_names([[1.0]]) is None
