# SPDX-License-Identifier: BSD-3-Clause
"""Time stamps that jitter, and rows that repeat."""

import numpy as np
import pytest

from skidyn.datasets import make_hidden_effect_log
from skidyn.effects import Signals


def test_repeated_rows(signals, torque, found):
    held = np.arange(len(signals.q)) // 2 * 2
    repeated = signals.with_(q=signals.q[held], dq=signals.dq[held])
    told = {s.check: s for s in found(repeated, torque)}
    assert told["repeated_rows"].remedy.option == "--drop-repeated"


def test_clock_that_jitters(signals, torque, found):
    stamps = signals.time + np.random.default_rng(1).uniform(-1e-3, 1e-3, len(signals.time))
    told = {s.check: s for s in found(signals.with_(time=stamps), torque)}
    assert told["clock_jitter"].certainty == "certain"
    assert told["clock_jitter"].remedy.option == "--clock regular"


def test_samples_that_really_were_uneven(found):
    rng = np.random.default_rng(2)
    t = np.cumsum(rng.uniform(0.004, 0.016, 3000))
    phase = t[:, None] * [0.7, 1.3]
    motion = Signals(
        np.sin(phase), np.cos(phase) * [0.7, 1.3], 0 * phase, np.zeros(3000, int), time=t
    )
    told = {s.check: s for s in found(motion, phase, None)}
    assert told["clock_jitter"].certainty == "noted" and told["clock_jitter"].remedy is None


def test_stamps_are_certain_only_where_they_do_harm(arm, told_of):
    log = make_hidden_effect_log(arm, None, n_trajectories=4, random_state=6)
    noise = np.random.default_rng(0).uniform(-1, 1, len(log.frame))
    certainties = {
        size: told_of(log.frame.assign(time=log.frame["time"] + size * noise))["clock_jitter"]
        for size in (2e-5, 1e-3)
    }
    assert certainties[2e-5].certainty == "noted"
    assert "influence of the stamps is small" in certainties[2e-5].evidence
    assert certainties[1e-3].certainty == "certain"
    assert "fit of the torque changes by +" in certainties[1e-3].evidence


def test_torques_of_a_slower_clock(recorded, told_of):
    frame = recorded.frame.copy()
    for rows in frame.groupby("trajectory").groups.values():
        t = frame.loc[rows, "time"].to_numpy()
        for name in ("tau1", "tau2"):
            frame.loc[rows, name] = np.interp(t, t[::4], frame.loc[rows, name].to_numpy()[::4])
    told = told_of(frame)["interpolated_rows"]
    assert told.certainty == "noted" and told.suspicion.startswith("torques were interpolated")


def test_equal_steps_of_coarse_sensors_are_not_interpolated(arm, told_of):
    """Two joints that move alike make the same steps at the same time."""
    log = make_hidden_effect_log(arm, None, n_trajectories=3, rate=1000, random_state=4)
    step = 2 * np.pi / 2**14
    position = (log.frame["q1"] / step).round() * step
    frame = log.frame.assign(q1=position, q2=position)
    assert "interpolated_rows" not in told_of(frame)


@pytest.mark.parametrize("unit", [0.007, 0.009, 0.0125, 0.025])
def test_stamps_that_are_rounded(recorded, told_of, unit):
    frame = recorded.frame
    stamps = np.round(np.floor((frame["time"] + 1e-4) / unit) * unit, 9)
    told = told_of(frame.assign(time=stamps))
    assert told["clock_jitter"].certainty == "certain"
    assert told["clock_jitter"].remedy.option == "--clock regular"


def test_positions_that_are_reported_less_often_than_torque(recorded, told_of):
    frame = recorded.frame.copy()
    names = [f"{q}{k}" for q in ("q", "dq") for k in (1, 2)]
    for rows in frame.groupby("trajectory").groups.values():
        held = frame.loc[rows, names].to_numpy()
        frame.loc[rows, names] = held[np.arange(len(rows)) // 4 * 4]
    told = told_of(frame)
    assert told["repeated_rows"].certainty == "certain"
    assert not {"clock_unit", "velocity"} & set(told)


@pytest.mark.parametrize("rate, decimals", [(7.7, 15), (12.5, 15), (7.7, 6)])
def test_the_rate_of_a_slower_clock_whose_samples_lie_between_rows(
    recorded, told_of, rate, decimals
):
    frame = recorded.frame.copy()
    channels = [f"{name}{k}" for name in ("q", "dq", "tau") for k in (1, 2)]
    for rows in frame.groupby("trajectory").groups.values():
        t = frame.loc[rows, "time"].to_numpy()
        slow = np.arange(t[0], t[-1], 1 / rate)
        for name in channels:
            slower = np.interp(t, slow, np.interp(slow, t, frame.loc[rows, name]))
            frame.loc[rows, name] = np.round(slower, decimals)
    option = told_of(frame)["interpolated_rows"].remedy.option
    assert abs(float(option.split()[1]) / rate - 1) < 0.08
