# SPDX-License-Identifier: BSD-3-Clause
"""Zeros that were added at the ends of recordings."""

import numpy as np
import pandas as pd
import pytest

from skidyn.logs import check_log, read_log

CHANNELS = [f"{name}{k}" for name in ("q", "dq", "tau") for k in (1, 2)]


@pytest.fixture(scope="module")
def padded(short):
    """A log of which each recording but one got rows of zeros, and their number."""
    parts, count = [], 0
    for number, own in short.groupby("trajectory"):
        step = own["time"].iloc[1] - own["time"].iloc[0]
        more = (
            own.tail(1)
            .loc[own.tail(1).index.repeat(10 * number)]
            .assign(**dict.fromkeys(CHANNELS, 0.0))
        )
        more["time"] += step * np.arange(1, len(more) + 1)
        parts += [own, more]
        count += len(more)
    return pd.concat(parts, ignore_index=True), count


def test_rows_of_zeros_are_counted_and_nothing_else_is_suspected(padded, told_of, only):
    frame, count = padded
    told = told_of(frame)
    only(told.values(), "padded", "certain", "--placeholder q=0")
    assert f"in {count} rows" in told["padded"].evidence


def test_the_option_reads_them_as_missing(padded, arm, tmp_path):
    frame, count = padded
    frame.to_csv(tmp_path / "log.csv", index=False)
    log = read_log(tmp_path / "log.csv", robot=arm, placeholder={"q": 0})
    assert (log[["q1", "q2"]] != 0).all(axis=None)
    assert len(frame) - count - 1 <= len(log) <= len(frame) - count  # one begins at zero


def test_without_logged_velocities(padded, arm, tmp_path):
    """Velocities are derived, so that they jump at the first row of zeros."""
    frame, count = padded
    frame.drop(columns=["dq1", "dq2", "ddq1", "ddq2"], errors="ignore").to_csv(
        tmp_path / "log.csv", index=False
    )
    told = check_log(read_log(tmp_path / "log.csv", robot=arm, check=False), arm).checks
    assert [s.check for s in told if s.certainty != "noted"] == ["padded"]
    assert f"in {count} rows" in told[0].evidence


def test_a_log_that_begins_at_zero_is_not_padded(short, told_of):
    assert "padded" not in told_of(short.assign(q1=short["q1"] - short["q1"].iloc[0]))
