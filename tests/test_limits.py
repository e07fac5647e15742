# SPDX-License-Identifier: BSD-3-Clause
"""Columns and names without end are refused before anything is made of them."""

import pytest

from skidyn.exceptions import LogError
from skidyn.logs import read_log


@pytest.mark.parametrize(
    ("header", "told"),
    [
        (",".join(f"c{k}" for k in range(20_000)), "20003 columns; at most 10000 are read"),
        ("a_" * 8000, "name has 16000 letters; at most 250"),
    ],
    ids=["columns", "letters"],
)
def test_columns_and_names_without_end_are_refused(tmp_path, header, told):
    path = tmp_path / "log.csv"
    row = "1," * (2 + len(header.split(","))) + "1\n"
    path.write_text(f"time,q1,tau1,{header}\n{row}")
    with pytest.raises(LogError, match=told):
        read_log(path, check=False)
