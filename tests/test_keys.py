# SPDX-License-Identifier: BSD-3-Clause
"""Key columns and features of a table."""

import numpy as np
import pandas as pd
import pytest

from skidyn.exceptions import ColumnError
from skidyn.preprocessing import DropKeys, TimeDerivative

TIME = np.arange(40) / 10


def test_names_and_positions_give_the_same_keys():
    X = pd.DataFrame({"q1": TIME**2, "time": TIME, "trajectory": 0.0})
    by_name = DropKeys().fit_transform(X)
    by_position = DropKeys(trajectory=-1, time=1).fit_transform(X.to_numpy())
    np.testing.assert_array_equal(by_name, by_position)
    np.testing.assert_array_equal(by_position, X[["q1"]])


def test_a_column_has_one_meaning():
    X = pd.DataFrame({"q1": TIME, "time": TIME})
    with pytest.raises(ColumnError, match="trajectory='time' and time='auto' .* column 'time'"):
        DropKeys(trajectory="time").fit(X)


def test_segments_end_with_the_trajectory_and_where_time_goes_back():
    signal = np.repeat([3.0, 7.0, -1.0, 2.0], 10) * np.tile(TIME[:10], 4)
    X = pd.DataFrame(
        {
            "trajectory": np.repeat([1, 1, 2, 2], 10),
            "time": np.r_[TIME[:10], TIME[:10] - 0.5, TIME[:10], TIME[:10] - 0.5],
            "x": signal,
        }
    )
    slopes = TimeDerivative(["x"]).fit_transform(X)[:, -1]
    np.testing.assert_allclose(slopes, np.repeat([3.0, 7.0, -1.0, 2.0], 10))


def test_a_table_of_keys_alone_is_refused():
    with pytest.raises(ColumnError, match="0 feature"):
        DropKeys().fit(pd.DataFrame({"time": TIME}))
