# SPDX-License-Identifier: BSD-3-Clause
"""Parquet and Feather: what pandas and Arrow write besides numbers."""

import numpy as np
import pandas
import pandas as pd
import pytest

from skidyn.exceptions import LogError
from skidyn.logs import read_log


@pytest.mark.parametrize("unit", ["s", "ms", "us", "ns"])
@pytest.mark.parametrize("kind", ["timestamp", "duration"])
@pytest.mark.parametrize("suffix", ["parquet", "feather"])
def test_dates_and_durations_of_arrow_are_seconds(tmp_path, unit, kind, suffix):
    pa = pytest.importorskip("pyarrow")
    from pyarrow import feather, parquet

    steps = (
        1_700_000_000 * {"s": 1, "ms": 10**3, "us": 10**6, "ns": 10**9}[unit]
        + np.array([0, 1, 2]) * {"s": 1, "ms": 10**3, "us": 10**6, "ns": 10**9}[unit]
    )
    table = pa.table(
        {
            "time": pa.array(steps, getattr(pa, kind)(unit)),
            "q1": [0.1, 0.2, 0.3],
            "tau1": [1.0, 2.0, 3.0],
        }
    )
    path = tmp_path / f"log.{suffix}"
    {"parquet": parquet.write_table, "feather": feather.write_feather}[suffix](table, path)
    frame = read_log(path, check=False)
    np.testing.assert_array_equal(frame["time"], [0.0, 1.0, 2.0])


def test_the_index_of_pandas_is_a_column_like_others(tmp_path):
    pytest.importorskip("pyarrow")
    frame = pandas.DataFrame({"q1": [0.1, 0.2, 0.3], "tau1": [1.0, 2.0, 3.0]})
    frame.index = pandas.Index([0.0, 0.5, 1.0], name="time")
    frame.to_parquet(tmp_path / "log.parquet")
    read = read_log(tmp_path / "log.parquet", check=False)
    np.testing.assert_array_equal(read["time"], [0.0, 0.5, 1.0])


def test_lists_of_differing_length(tmp_path):
    rows = [[0.0, 0.0]] * 5 + [[0.0]]
    pd.DataFrame({"time": range(6), "position": rows, "effort": rows}).to_parquet(
        tmp_path / "log.parquet"
    )
    with pytest.raises(LogError, match="position has 1 values in row 5, 2 in most"):
        read_log(tmp_path / "log.parquet")
