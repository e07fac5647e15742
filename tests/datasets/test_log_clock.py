# SPDX-License-Identifier: BSD-3-Clause
"""Clocks of logs."""

import numpy as np
import pandas as pd
import pytest

from skidyn._exceptions import LogError
from skidyn.datasets._log_clock import align_channels, derive_velocity, seconds, split_at_restarts


def test_nanoseconds_since_1970_keep_their_differences():
    stamps = 1_700_000_000_000_000_000 + np.arange(5) * 1_000_001
    clock = seconds(pd.DataFrame({"time": stamps}), None, "log")
    np.testing.assert_array_equal(np.diff(clock), 1_000_001)


def test_unreadable_clock():
    with pytest.raises(LogError, match="neither numbers nor dates"):
        seconds(pd.DataFrame({"time": ["noon", "later"]}), None, "log")


def test_channels_at_a_rate_of_their_own_are_not_filled_across_gaps():
    fast = pd.DataFrame({"time": np.arange(0, 2, 0.01), "q1": 0.0})
    t = np.r_[np.arange(0, 0.5, 0.02), np.arange(1.5, 2, 0.02)]
    slow = pd.DataFrame({"time": t, "tau1": 3 * t})
    notes = []
    table = align_channels([fast, slow], ["a", "b"], None, notes)
    inside = (table["time"] > 0.485) & (table["time"] < 1.495)
    assert table.loc[inside, "tau1"].isna().all()
    np.testing.assert_allclose(table.loc[~inside, "tau1"], 3 * table.loc[~inside, "time"])
    assert "2 row(s)" in notes[0] or "1 row(s)" in notes[0]


def test_common_rate():
    t = np.arange(0, 1, 0.013)
    table = align_channels([pd.DataFrame({"time": t, "q1": 2 * t})], ["a"], 50.0, [])
    np.testing.assert_allclose(np.diff(table["time"]), 0.02)
    np.testing.assert_allclose(table["q1"], 2 * table["time"])


def test_small_step_back_is_no_restart():
    assert split_at_restarts(np.array([0.0, 1.0, 2.0, 1.9, 2.1]))[1] == 0
    assert split_at_restarts(np.array([0.0, 1.0, 2.0, 0.0, 1.0]))[1] == 1


def test_velocity_does_not_cross_trajectories():
    t = np.tile(np.arange(4) / 10, 2)
    q = np.r_[5 * t[:4], 100 - t[4:]][:, None]
    dq = derive_velocity(q, t, np.repeat([0, 1], 4))
    np.testing.assert_allclose(dq[:, 0], [5] * 4 + [-1] * 4)
    with pytest.raises(LogError, match="row 4 stands alone"):
        derive_velocity(q[:5], t[:5], np.array([0, 0, 0, 0, 1]))
