# SPDX-License-Identifier: BSD-3-Clause
"""The table of log formats, and a user's own among them."""

import pandas as pd
import pytest

from skidyn.exceptions import LogError
from skidyn.logs import Channel, read_log, register_reader

TEXT = "time*q1*dq1*tau1\n0.0*1.0*0.1*2.0\n0.1*1.1*0.1*2.0\n"


@pytest.fixture
def stars(tmp_path):
    path = tmp_path / "log.stars"
    path.write_text(TEXT)
    yield path
    register_reader(".stars", None)


def test_a_users_own_format_is_read_like_any_other(stars):
    register_reader(".stars", lambda path, *_: [Channel("arm", pd.read_csv(path, sep="*"))])
    assert read_log(stars, check=False)["q1"].tolist() == [1.0, 1.1]
    assert read_log(stars.parent, check=False)["q1"].tolist() == [1.0, 1.1]


def test_an_unknown_format_is_refused_with_those_that_are_known(stars):
    with pytest.raises(LogError, match=r"unknown kind of log '\.stars'.*\.csv .*\.mcap"):
        read_log(stars)


def test_what_a_reader_says_about_a_damaged_file_becomes_an_error_of_the_log(stars):
    register_reader(".stars", lambda *_: 1 / 0)
    with pytest.raises(LogError, match="log.stars: damaged"):
        read_log(stars)


@pytest.mark.parametrize("suffix", ["tdms", ".TDMS", "."])
def test_a_suffix_is_one(suffix):
    with pytest.raises(LogError, match="expected one in lower case"):
        register_reader(suffix, None)
