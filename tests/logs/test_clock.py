# SPDX-License-Identifier: BSD-3-Clause
"""The clock of a log: its unit, its gaps, channels with clocks of their own, and rests."""

import warnings

import numpy as np
import pandas as pd
import pytest

from skidyn.exceptions import LogError, LogWarning
from skidyn.logs import check_log, read_log


@pytest.fixture
def read(tmp_path):
    """Reads a table, or channels with clocks of their own: the log, and the notes of the reader."""

    def read_channels(*tables, **options):
        path = tmp_path / ("log.csv" if len(tables) == 1 else "log.h5")
        if len(tables) == 1:
            tables[0].to_csv(path, index=False)
        else:
            h5py = pytest.importorskip("h5py")
            with h5py.File(path, "w") as file:
                for channel, table in zip("abc", tables, strict=False):
                    for name in table:
                        file[f"{channel}/{name}"] = table[name].to_numpy()
        options = {"check": False, "needs_torque": False, **options}
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", LogWarning)
            log = read_log(path, **options)
        return log, [note for note in log.attrs["notes"] if "velocities" not in note]

    return read_channels


def test_nanoseconds_since_1970_keep_their_differences(read):
    stamps = 1_700_000_000_000_000_000 + np.arange(5) * 1_000_001
    log, _ = read(pd.DataFrame({"time": stamps, "q1": 0.0}), units={"time": "ns"})
    np.testing.assert_allclose(np.diff(log["time"]), 1.000001e-3, rtol=1e-9)


def test_durations_as_text(read):
    log, _ = read(pd.DataFrame({"time": pd.to_timedelta([5.0, 5.01, 5.02], unit="s"), "q1": 0.0}))
    np.testing.assert_allclose(log["time"], [0.0, 0.01, 0.02])


@pytest.mark.parametrize("kind", ["ns", "dates", "durations"])
def test_channels_keep_the_distance_of_their_first_stamps(tmp_path, kind):
    time = np.arange(200) * 0.01
    stamps = 1_700_000_000_000_000_000 + np.arange(200) * 10_000_000
    if kind != "ns":
        to_time = pd.to_datetime if kind == "dates" else pd.to_timedelta
        stamps = to_time(stamps)
    table = pd.DataFrame({"time": stamps, "q1": np.sin(time), "tau1": time})
    table[["time", "q1"]].to_csv(tmp_path / "q.csv", index=False)
    table.loc[50:, ["time", "tau1"]].to_csv(tmp_path / "tau.csv", index=False)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", LogWarning)
        units = {"time": "ns"} if kind == "ns" else None
        log = read_log(tmp_path, units=units, check=False)
    np.testing.assert_allclose(log["q1"], np.sin(log["tau1"]), atol=1e-9)


def test_unreadable_clock(read):
    with pytest.raises(LogError, match="neither numbers nor dates"):
        read(pd.DataFrame({"time": ["noon", "later"], "q1": 0.0}))


def test_channels_at_a_rate_of_their_own_are_not_filled_across_gaps(read):
    fast = pd.DataFrame({"time": np.arange(0, 2, 0.01), "q1": 0.0})
    t = np.r_[np.arange(0, 0.5, 0.02), np.arange(1.5, 2, 0.02)]
    log, notes = read(fast, pd.DataFrame({"time": t, "tau1": 3 * t}))
    assert not ((log["time"] > 0.485) & (log["time"] < 1.495)).any()
    np.testing.assert_allclose(log["tau1"], 3 * log["time"])
    assert any("row(s) outside their common time and 101 in gaps left out" in n for n in notes)


def test_common_rate(read):
    t = np.arange(0, 1, 0.013)
    log, _ = read(pd.DataFrame({"time": t, "q1": 2 * t}), resample_rate=50.0)
    np.testing.assert_allclose(np.diff(log["time"]), 0.02)
    np.testing.assert_allclose(log["q1"], 2 * log["time"])


def test_runs_with_a_clock_of_their_own_are_resampled_apart(read):
    t = np.r_[np.arange(0, 1, 0.013), np.arange(0, 1, 0.017)]
    run = np.r_[np.zeros(77, dtype=int), np.ones(59, dtype=int)]
    table = pd.DataFrame({"time": t, "trajectory": run, "q1": 2 * t + 10 * run})
    log, notes = read(table, resample_rate=50.0)
    assert log["trajectory"].value_counts().to_list() == [50, 50]
    first = log["trajectory"] == log["trajectory"].iloc[0]
    np.testing.assert_allclose(log["q1"], 2 * log["time"] + 10 * ~first)
    told = "resample: interpolated to 50 Hz within 2 run(s) without a gap, 100 rows in place of 136"
    assert told in notes


def test_resampling_does_not_fill_a_gap(read):
    t = np.r_[np.arange(0, 1, 0.01), np.arange(3, 4, 0.01), 9.0]
    log, notes = read(pd.DataFrame({"time": t, "q1": t}), resample_rate=20.0)
    np.testing.assert_allclose(log["q1"], log["time"])
    assert not ((log["time"] > 0.991) & (log["time"] < 2.99)).any()
    (note,) = [note for note in notes if note.startswith("resample:")]
    assert "1 isolated row(s) left out" in note
    assert note.endswith(
        "2 gap(s) in time, the longest of 5.01 s from 3.99 s on, cannot be resampled and remain"
    )


def test_a_slower_clock_averages_vibration_away(read):
    t = np.arange(0, 2, 0.001)
    vibration = np.sin(2 * np.pi * 260 * t)  # single samples at 50 Hz would show 10 Hz
    table = pd.DataFrame({"time": t, "q1": t**2 + vibration})
    log, notes = read(table, resample_rate=50.0)
    inside = log.iloc[1:-1]
    np.testing.assert_allclose(inside["q1"], inside["time"] ** 2, atol=0.07)
    told = "resample: averaged to 50 Hz within 1 run(s) without a gap, 100 rows in place of 2000"
    assert told in notes
    other = pd.DataFrame({"time": t, "tau1": 3 * t + vibration})
    positions = pd.DataFrame({"time": np.arange(0.004, 2, 0.02), "q1": 1.0})
    both, notes = read(positions, other)
    both = both.iloc[1:-1]
    np.testing.assert_allclose(both["tau1"], 3 * both["time"], atol=0.07)
    assert any("interpolated to the clock of a (b averaged over its" in note for note in notes)


def test_a_mean_reaches_into_no_gap_and_over_no_missing_value(read):
    t = np.r_[np.arange(0, 1, 0.01), np.arange(3, 4, 0.01)]
    tau = np.where(t < 2, 1.0, 5.0)
    tau[40] = np.nan
    positions = pd.DataFrame({"time": np.arange(0, 4, 0.05), "q1": 1.0})
    both, _ = read(positions, pd.DataFrame({"time": t, "tau1": tau}), missing="drop")
    early = both["time"] < 2
    assert np.abs(both["time"] - 0.4).min() > 0.04  # the row of the missing value
    np.testing.assert_allclose(both["tau1"], np.where(early, 1.0, 5.0))


def test_channels_whose_clock_starts_anew_cannot_be_brought_together(read):
    fast = pd.DataFrame({"time": np.tile(np.arange(5) / 10, 2), "q1": 0.0})
    slow = pd.DataFrame({"time": np.arange(3) / 5, "tau1": 0.0})
    with pytest.raises(LogError, match="the clock of .*a goes back in row 5.*separate file"):
        read(fast, slow)
    unread = fast.assign(time=np.r_[np.nan, np.arange(9)])
    with pytest.raises(LogError, match="the clock of .* is not a number in row 0"):
        read(unread, resample_rate=10.0)


@pytest.mark.parametrize(
    ("rate", "speed", "noise"),
    [(1000, 0.05, 0), (1000, 0.05, 2e-5), (500, 0.02, 1e-4), (100, 0.3, 5e-4)],
)
def test_rests_are_told_from_slow_motion_whatever_the_rate_and_the_noise(read, rate, speed, noise):
    third = 3 * rate
    move = speed * np.arange(third) / rate
    rest = np.ones(third)
    q = np.r_[move, move[-1] * rest, move[-1] + move, 2 * move[-1] * rest, 2 * move[-1] - move]
    q = q + noise * np.random.default_rng(0).normal(size=len(q))
    table = pd.DataFrame({"time": np.arange(len(q)) / rate, "q1": q, "q2": q})
    log, _ = read(table, split_dwells=2.0)
    cuts = log["time"][np.flatnonzero(np.diff(log["trajectory"]))]
    np.testing.assert_allclose(cuts, [4.5, 10.5], atol=0.05)


def test_a_clock_that_restarts_begins_a_trajectory(read):
    again = pd.DataFrame({"time": [0.0, 1.0, 2.0, 0.0, 1.0], "q1": 0.0})
    assert read(again)[0]["trajectory"].tolist() == [1, 1, 1, 2, 2]
    with pytest.raises(LogError, match="time goes backwards in 1 place"):
        read(again.assign(time=[0.0, 1.0, 2.0, 1.9, 2.1]))


def test_velocity_does_not_cross_trajectories(read):
    t = np.tile(np.arange(4) / 10, 2)
    table = pd.DataFrame({"time": t, "trajectory": np.repeat([1, 2], 4)})
    log, _ = read(table.assign(q1=np.r_[5 * t[:4], 100 - t[4:]]))
    np.testing.assert_allclose(log["dq1"], [5] * 4 + [-1] * 4)
    with pytest.raises(LogError, match="row 4 is isolated"):
        read(table[:5].assign(q1=0.0))


@pytest.fixture
def jittering():
    """Stamps of the receiving computer, some of which are earlier than those before them."""
    t = np.arange(500) * 0.01
    late = np.random.default_rng(1).exponential(0.003, len(t))
    assert np.any(np.diff(t + late) < 0)
    return pd.DataFrame({"time": t + late, "q1": np.sin(t)})


@pytest.mark.parametrize("own", [False, True])
def test_stamps_that_go_back_by_jitter(read, jittering, own):
    if own:
        jittering = jittering.assign(trajectory=np.arange(500) // 250)
    with pytest.raises(LogError, match="the stamps jitter.*--clock regular"):
        read(jittering)
    log, notes = read(jittering, clock="regular")
    assert len(log) == 500 and log["trajectory"].nunique() == 1 + own
    for _, run in log.groupby("trajectory"):
        np.testing.assert_allclose(np.diff(run["time"]), 0.01, rtol=0.02)
    np.testing.assert_allclose(log["q1"], jittering["q1"])  # in the same order
    assert any("the order of the rows was kept" in note for note in notes)


def test_a_new_recording_is_no_jitter(read, jittering):
    half = pd.concat([jittering[200:400], jittering[300:500]])
    with pytest.raises(LogError, match="If a new recording begins there"):
        read(half, clock="regular")


@pytest.mark.parametrize("own", [False, True])
def test_shuffled_rows_are_no_jitter(read, jittering, own):
    rows = jittering.assign(trajectory=np.arange(500) // 250) if own else jittering
    with pytest.raises(LogError, match="if the rows are out of order, sort them by time") as error:
        read(rows.sample(frac=1.0, random_state=0))
    assert "jitter" not in str(error.value)


def test_a_log_that_repeats_its_trajectories_is_refused(read):
    t = np.arange(200) * 0.01
    log = pd.DataFrame({"time": t, "trajectory": np.arange(200) // 100, "q1": np.sin(t)})
    with pytest.raises(LogError, match=r"trajectory 0 comes again in row 200, at 0 s, after 0.9"):
        read(pd.concat([log, log]))
    with pytest.raises(LogError, match="trajectory 0 comes again"):
        check_log(pd.concat([log, log]).assign(dq1=1.0, tau1=1.0))
    later = log.assign(time=t + 2.0)  # the second part of each trajectory
    assert len(read(pd.concat([log, later]))[0]) == 400


def test_recordings_that_alternate(read):
    t = np.arange(0, 4, 0.01)
    runs = [pd.DataFrame({"time": t, "trajectory": k, "q1": np.sin(t + k)}) for k in range(4)]
    merged = pd.concat(runs).sort_values("time", kind="stable")
    with pytest.raises(LogError, match="about 4 rows share each time.*names the recording"):
        read(merged.drop(columns="trajectory"))
    log, notes = read(merged)
    np.testing.assert_allclose(log["q1"], pd.concat(runs)["q1"])
    assert any("4 trajectories alternate" in note for note in notes)


def test_stamps_that_are_rounded_to_the_step_of_the_samples(read):
    t = np.arange(600) * 0.01 + 0.005 + 2e-4 * np.sin(np.arange(600) / 7)
    rounded = pd.DataFrame({"time": np.round(t, 2), "q1": np.sin(t)})
    same = int(np.sum(np.diff(rounded["time"]) == 0))
    assert 5 < same < 60
    with pytest.raises(LogError, match=f"{same} of 600 rows have the time of the previous row"):
        read(rounded)
    log, _ = read(rounded, clock="regular")
    assert len(log) == 600
    np.testing.assert_allclose(np.diff(log["time"]), 0.01, rtol=0.01)


def test_repeated_rows_are_no_coarse_stamps(read):
    t = np.arange(300) * 0.01
    table = pd.DataFrame({"time": t, "q1": np.sin(t)})
    again = table.loc[np.sort(np.r_[np.arange(300), np.arange(0, 300, 20)])]
    log, notes = read(again)
    assert len(log) == 300 and any("repeat the time" in note for note in notes)
