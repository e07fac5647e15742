# SPDX-License-Identifier: BSD-3-Clause
"""Rows that are not in the order of time, or between which others are missing."""

from dataclasses import replace

import numpy as np

from skidyn.datasets import load_planar_arm, load_scara, make_hidden_effect_log
from skidyn.logs import check_log

ROBOT = load_scara()
FRAME = make_hidden_effect_log(ROBOT, None, n_trajectories=3, random_state=7).frame


def told_of(frame, robot=ROBOT):
    return {s.check: s for s in check_log(frame, robot).checks}


def test_rows_in_order_are_not_told():
    assert "lost_rows" not in told_of(FRAME)
    arm = load_planar_arm()
    frame = make_hidden_effect_log(arm, "stribeck", n_trajectories=3, random_state=2).frame
    assert "lost_rows" not in told_of(frame, arm)


def test_shuffled_rows():
    signals = [c for c in FRAME if c not in ("time", "trajectory")]
    far = FRAME.copy()
    order = np.random.default_rng(0).permutation(len(FRAME))
    far[signals] = FRAME[signals].to_numpy()[order]
    near = FRAME.copy()
    order = np.argsort(np.arange(len(FRAME)) + np.random.default_rng(1).uniform(0, 6, len(FRAME)))
    near[signals] = FRAME[signals].to_numpy()[order]

    for frame in (far, near):
        told = told_of(frame)["lost_rows"]
        assert told.certainty == "certain" and "not in the order of time" in told.suspicion


def test_shuffled_rows_are_in_no_other_unit():
    """Positions within their limits seem to run over many turns from row to row."""
    arm = replace(load_planar_arm(), position_limits=np.array([[-2.09, 2.09]] * 2))
    frame = make_hidden_effect_log(arm, None, n_trajectories=3, duration=4.0, random_state=0).frame
    frame["q2"] -= (frame["q2"].max() + frame["q2"].min()) / 2
    frame[["q2", "dq2"]] *= 1.839 / frame["q2"].max()
    mixed = frame.sample(frac=1, random_state=0).reset_index(drop=True)
    mixed = mixed.assign(time=np.arange(len(mixed)) / 100).drop(columns="trajectory")
    assert [*told_of(mixed, arm)] == ["lost_rows"]


def test_rows_that_were_lost_under_an_even_clock():
    kept = FRAME[np.random.default_rng(2).random(len(FRAME)) > 0.05].reset_index(drop=True)
    step = np.where(np.diff(kept["trajectory"]) != 0, 1.0, np.median(np.diff(FRAME["time"])))
    kept["time"] = np.r_[0.0, np.cumsum(step)]

    told = told_of(kept)

    assert told["lost_rows"].certainty == "certain"
    assert "rows are missing" in told["lost_rows"].suspicion
    assert "clock_unit" not in told and "velocity" not in told


def test_rows_that_the_clock_says_are_missing():
    kept = FRAME[np.random.default_rng(2).random(len(FRAME)) > 0.05]
    assert "lost_rows" not in told_of(kept.reset_index(drop=True))


def test_rows_that_are_exchanged_with_their_neighbours():
    order = np.arange(len(FRAME))
    for row in np.random.default_rng(3).choice(len(FRAME) - 4, len(FRAME) // 20, replace=False):
        order[[row, row + 3]] = order[[row + 3, row]]
    signals = [c for c in FRAME if c not in ("time", "trajectory")]
    frame = FRAME.copy()
    frame[signals] = FRAME[signals].to_numpy()[order]
    assert "exchanged with others" in told_of(frame)["lost_rows"].suspicion


def test_rows_that_were_lost_in_bursts_under_an_even_clock():
    kept, stamps = [], []
    for _, own in FRAME.groupby("trajectory"):
        lost = np.zeros(len(own), dtype=bool)
        for start in range(80, len(own) - 100, 120):
            lost[start : start + 20] = True
        kept.append(own.index[~lost])
        stamps.append(own["time"].to_numpy()[: (~lost).sum()])
    frame = FRAME.loc[np.concatenate(kept)].reset_index(drop=True)
    told = told_of(frame.assign(time=np.concatenate(stamps)))
    assert {name for name, one in told.items() if one.certainty != "noted"} == {"lost_rows"}
    assert "in bursts" in told["lost_rows"].suspicion


def test_packets_whose_values_were_held_are_neither_lost_rows_nor_joined_recordings():
    held, values = FRAME.copy(), [c for c in FRAME if c not in ("time", "trajectory")]
    for start in range(150, len(FRAME) - 100, 300):
        held.loc[start : start + 10, values] = FRAME.loc[start, values].to_numpy()

    told = told_of(held)

    assert {"lost_rows", "joined"}.isdisjoint(told)
    assert "disagrees with the velocity" in told["broken_samples"].suspicion


def test_recordings_in_reversed_order():
    signals = [c for c in FRAME if c not in ("time", "trajectory")]
    frame = FRAME.copy()
    rows = np.flatnonzero(FRAME["trajectory"] == 1)
    frame.loc[rows, signals] = FRAME[signals].to_numpy()[rows[::-1]]

    told = told_of(frame)["lost_rows"]

    assert told.certainty == "certain"
    assert "trajectory 1 are in reversed order" in told.suspicion


def test_velocities_of_the_other_sign_in_one_recording_are_not_rows_in_reversed_order():
    frame = FRAME.copy()
    rows = FRAME["trajectory"] == 1
    velocities = [c for c in FRAME if c.startswith("dq")]
    frame.loc[rows, velocities] *= -1
    told = told_of(frame)
    assert "lost_rows" not in told
    assert "velocity" in " ".join(s.suspicion for s in told.values())


def test_velocities_in_turns_are_not_lost_rows():
    velocities = [c for c in FRAME if c.startswith("dq")]
    told = told_of(FRAME.assign(**{c: FRAME[c] / (2 * np.pi) for c in velocities}))
    assert "lost_rows" not in told and "constant_torque" not in told
    assert told["velocity"].remedy.option == "--units dq=rev/s"


def test_speeds_without_a_sign_are_not_rows_in_another_order():
    speeds = [c for c in FRAME if c.startswith("dq")]
    told = told_of(FRAME.assign(**{name: FRAME[name].abs() for name in speeds}))
    assert "lost_rows" not in told


def test_a_second_source_in_every_other_row():
    """Commands that are ahead of the motion and differ from it."""
    frame = FRAME.copy()
    motion = [f"{symbol}{k + 1}" for symbol in ("q", "dq") for k in range(4)]
    for rows in frame.groupby("trajectory").groups.values():
        ahead = np.minimum(np.arange(len(rows)) + 12, len(rows) - 1)
        commands = frame.loc[rows, motion].to_numpy()[ahead]
        frame.loc[rows[1::2], motion] = commands[1::2]

    told = told_of(frame)["lost_rows"]

    assert told.certainty == "certain" and told.suspicion.startswith("every second row")
