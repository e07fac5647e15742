# SPDX-License-Identifier: BSD-3-Clause
"""Clocks of logs."""

import numpy as np
import pandas as pd
import pytest

from skidyn.exceptions import LogError
from skidyn.logs._clock import (
    align_channels,
    derive_velocity,
    seconds,
    split_at_restarts,
    split_trajectories,
)


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
    assert not ((table["time"] > 0.485) & (table["time"] < 1.495)).any()
    np.testing.assert_allclose(table["tau1"], 3 * table["time"])
    assert "row(s) outside their common time and 101 in gaps left out" in notes[0]


def test_common_rate():
    t = np.arange(0, 1, 0.013)
    table = align_channels([pd.DataFrame({"time": t, "q1": 2 * t})], ["a"], 50.0, [])
    np.testing.assert_allclose(np.diff(table["time"]), 0.02)
    np.testing.assert_allclose(table["q1"], 2 * table["time"])


def test_runs_with_a_clock_of_their_own_are_resampled_apart():
    t = np.r_[np.arange(0, 1, 0.013), np.arange(0, 1, 0.017)]
    run = np.r_[np.zeros(77), np.ones(59)]
    notes = []
    table = align_channels(
        [pd.DataFrame({"time": t, "trajectory": run, "q1": 2 * t + 10 * run})], ["a"], 50.0, notes
    )
    assert table["trajectory"].value_counts().to_dict() == {0: 50, 1: 50}
    np.testing.assert_allclose(table["q1"], 2 * table["time"] + 10 * table["trajectory"])
    assert notes == ["interpolated to 50 Hz within 2 run(s) without a gap"]


def test_resampling_does_not_fill_a_gap():
    t = np.r_[np.arange(0, 1, 0.01), np.arange(3, 4, 0.01), 9.0]
    notes = []
    table = align_channels([pd.DataFrame({"time": t, "q1": t})], ["a"], 20.0, notes)
    np.testing.assert_allclose(table["q1"], table["time"])
    assert not ((table["time"] > 0.991) & (table["time"] < 2.99)).any()
    assert notes[0].endswith("1 isolated row(s) left out")


def test_a_slower_clock_averages_vibration_away():
    t = np.arange(0, 2, 0.001)
    vibration = np.sin(2 * np.pi * 260 * t)  # single samples at 50 Hz would show 10 Hz
    table = pd.DataFrame({"time": t, "q1": t**2 + vibration})
    notes = []
    slow = align_channels([table], ["a"], 50.0, notes)
    inside = slow.iloc[1:-1]
    np.testing.assert_allclose(inside["q1"], inside["time"] ** 2, atol=0.07)
    assert notes == ["averaged to 50 Hz within 1 run(s) without a gap"]
    other = pd.DataFrame({"time": t, "tau1": 3 * t + vibration})
    positions = pd.DataFrame({"time": np.arange(0.004, 2, 0.02), "q1": 1.0})
    notes = []
    both = align_channels([positions, other], ["a", "b"], None, notes).iloc[1:-1]
    np.testing.assert_allclose(both["tau1"], 3 * both["time"], atol=0.07)
    assert notes[0].startswith("channels a, b interpolated to the clock of a (b averaged over its")


def test_a_mean_reaches_into_no_gap_and_over_no_missing_value():
    t = np.r_[np.arange(0, 1, 0.01), np.arange(3, 4, 0.01)]
    tau = np.where(t < 2, 1.0, 5.0)
    tau[40] = np.nan
    channel = pd.DataFrame({"time": t, "tau1": tau})
    positions = pd.DataFrame({"time": np.arange(0, 4, 0.05), "q1": 1.0})
    both = align_channels([positions, channel], ["a", "b"], None, [])
    early = both["time"] < 2
    missing = np.isnan(both["tau1"])
    np.testing.assert_allclose(both["time"][missing], 0.4)
    np.testing.assert_allclose(both["tau1"][early & ~missing], 1)
    np.testing.assert_allclose(both["tau1"][~early], 5)


def test_channels_whose_clock_starts_anew_cannot_be_brought_together():
    fast = pd.DataFrame({"time": np.tile(np.arange(5) / 10, 2), "q1": 0.0})
    slow = pd.DataFrame({"time": np.arange(3) / 5, "tau1": 0.0})
    with pytest.raises(LogError, match="the clock of a goes back in row 5.*separate file"):
        align_channels([fast, slow], ["a", "b"], None, [])
    unread = fast.assign(time=np.r_[np.nan, np.arange(9)])
    with pytest.raises(LogError, match="the clock of a is not a number in row 0"):
        align_channels([unread], ["a"], 10.0, [])


@pytest.mark.parametrize(
    ("rate", "speed", "noise"),
    [(1000, 0.05, 0), (1000, 0.05, 2e-5), (500, 0.02, 1e-4), (100, 0.3, 5e-4)],
)
def test_rests_are_told_from_slow_motion_whatever_the_rate_and_the_noise(rate, speed, noise):
    third = 3 * rate
    move = speed * np.arange(third) / rate
    rest = np.ones(third)
    q = np.r_[move, move[-1] * rest, move[-1] + move, 2 * move[-1] * rest, 2 * move[-1] - move]
    q = q + noise * np.random.default_rng(0).normal(size=len(q))
    time = np.arange(len(q)) / rate
    number = split_trajectories(time, np.zeros(len(q), int), np.c_[q, q], None, 2.0)
    cuts = time[np.flatnonzero(np.diff(number))]
    np.testing.assert_allclose(cuts, [4.5, 10.5], atol=0.05)


def test_small_step_back_is_no_restart():
    assert split_at_restarts(np.array([0.0, 1.0, 2.0, 1.9, 2.1]))[1] == 0
    assert split_at_restarts(np.array([0.0, 1.0, 2.0, 0.0, 1.0]))[1] == 1


def test_velocity_does_not_cross_trajectories():
    t = np.tile(np.arange(4) / 10, 2)
    q = np.r_[5 * t[:4], 100 - t[4:]][:, None]
    dq = derive_velocity(q, t, np.repeat([0, 1], 4))
    np.testing.assert_allclose(dq[:, 0], [5] * 4 + [-1] * 4)
    with pytest.raises(LogError, match="row 4 is isolated"):
        derive_velocity(q[:5], t[:5], np.array([0, 0, 0, 0, 1]))
