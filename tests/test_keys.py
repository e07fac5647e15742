# SPDX-License-Identifier: BSD-3-Clause
"""Key columns and features of a table."""

import numpy as np
import pandas as pd
import pytest
from sklearn.linear_model import Ridge

from skidyn._keys import keys_of, knows_keys, resolve_keys
from skidyn.exceptions import ColumnError
from skidyn.preprocessing import DropKeys


def test_names_and_positions_give_the_same_keys():
    by_name = resolve_keys(["q1", "time", "trajectory"], 3)
    by_position = resolve_keys(None, 3, trajectory=-1, time=1)
    assert by_name == by_position and by_name.features == (0,)


def test_a_column_has_one_meaning():
    with pytest.raises(ColumnError, match="trajectory='time' and time='auto' .* column 'time'"):
        resolve_keys(["q1", "time"], 2, trajectory="time")


def test_segments_end_with_the_trajectory_and_where_time_goes_back():
    X = np.c_[[1, 1, 1, 2, 2], [0.0, 0.1, 0.05, 0.0, 0.1], np.arange(5)]
    keys = resolve_keys(None, 3, trajectory=0, time=1)
    assert [(s.start, s.stop) for s in keys.segments(X)] == [(0, 2), (2, 3), (3, 5)]


def test_only_learners_that_know_keys_see_them():
    X = pd.DataFrame({"trajectory": [1, 2], "q1": [0.1, 0.2]})
    keys = keys_of(X)
    assert not knows_keys(Ridge()) and knows_keys(DropKeys())
    assert list(keys.for_learner(X, Ridge())) == ["q1"]
    assert keys.for_learner(X, DropKeys()) is X


def test_a_table_of_keys_alone_is_refused():
    with pytest.raises(ColumnError, match="0 feature"):
        resolve_keys(["time"], 1)
