# SPDX-License-Identifier: BSD-3-Clause
"""Torque on another clock than the motion."""

import numpy as np
import pytest

from skidyn.datasets import load_ur5, make_hidden_effect_log
from skidyn.logs import check_log

ROBOT = load_ur5()
FRAME = make_hidden_effect_log(ROBOT, None, n_trajectories=5, duration=10.0, random_state=4).frame
TORQUES = [f"tau{k + 1}" for k in range(6)]


def late(lag):
    """Torque that is late by a lag (s) that depends on the time since the recording began."""
    frame = FRAME.copy()
    for rows in FRAME.groupby("trajectory").groups.values():
        time = FRAME.loc[rows, "time"].to_numpy()
        for name in TORQUES:
            values = FRAME.loc[rows, name].to_numpy()
            frame.loc[rows, name] = np.interp(time - lag(time - time[0]), time, values)
    return [s for s in check_log(frame, ROBOT).checks if s.check == "torque_delay"]


def test_torque_on_the_clock_of_the_motion():
    assert late(np.zeros_like) == []


def test_torque_that_is_late():
    (told,) = late(lambda since: np.full_like(since, 0.02))
    name, value = told.remedy.option.split("=")
    assert name == "--late tau" and float(value) == 0.02  # a whole number of samples


@pytest.mark.slow
def test_a_delay_of_a_fraction_of_a_sample():
    (told,) = late(lambda since: np.full_like(since, 0.0237))
    assert float(told.remedy.option.split("=")[1]) == pytest.approx(0.0237, abs=5e-4)


@pytest.mark.slow
def test_clocks_of_other_rates():
    (told,) = late(lambda since: 0.005 * since)
    what = "the clock of the torque runs at a different rate than that of the motion"
    assert told.suspicion == what
    assert told.remedy.option.startswith("--late tau=") and told.remedy.option.endswith("*t")
    assert told.remedy.code.startswith("late={'tau': (")


def test_one_recording_that_is_late():
    frame = make_hidden_effect_log(ROBOT, None, duration=8.0, random_state=0).frame
    run = int(frame["trajectory"].unique()[3])
    own = frame["trajectory"] == run
    for name in TORQUES:
        frame.loc[own, name] = frame.loc[own, name].shift(3).bfill()
    (told,) = [s for s in check_log(frame, ROBOT).checks if s.check == "torque_delay"]
    words = told.suspicion.split(" ")
    assert told.suspicion.startswith(f"in trajectory {run} torque is late by about ")
    assert float(words[words.index("ms") - 1]) == pytest.approx(30, abs=4)
    assert told.certainty == "suspected" and told.remedy is None


@pytest.mark.slow
def test_torque_that_is_late_by_more_than_the_usual_lags():
    (told,) = late(lambda t: np.full_like(t, 0.11))
    assert float(told.remedy.option.partition("=")[2]) == pytest.approx(0.11, abs=0.01)


@pytest.mark.slow
def test_one_recording_that_is_late_by_more_than_the_usual_lags():
    robot = load_ur5()
    frame = make_hidden_effect_log(robot, None, n_trajectories=5, random_state=3).frame
    rows = frame["trajectory"] == 2
    for k in range(1, 7):
        clock = frame.loc[rows, "time"]
        frame.loc[rows, f"tau{k}"] = np.interp(clock - 0.055, clock, frame.loc[rows, f"tau{k}"])
    (told,) = [s for s in check_log(frame, robot).checks if s.certainty != "noted"]
    text, _, lag = told.suspicion.removesuffix(" ms relative to the others").rpartition(" ")
    assert text == "in trajectory 2 torque is late by about" and abs(float(lag) - 55) < 10
