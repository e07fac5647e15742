# SPDX-License-Identifier: BSD-3-Clause
"""Torque of one recording that is late, beside a load that differs between recordings."""

import numpy as np
import pytest

from skidyn.datasets import load_ur5, make_hidden_effect_log
from skidyn.logs import check_log


@pytest.mark.slow
def test_one_recording_is_late_beside_a_load(loaded):
    frame = loaded.frame.copy()
    run = int(frame["trajectory"].unique()[1])
    own = frame["trajectory"] == run
    time = frame.loc[own, "time"]
    for k in range(6):
        name = f"tau{k + 1}"
        frame.loc[own, name] = np.interp(time - 0.03, time, frame.loc[own, name])
    (one,) = [s for s in check_log(frame, loaded.robot).checks if s.check == "torque_delay"]
    assert one.suspicion.startswith(f"in trajectory {run} torque is late by about ")
    lag = float(one.suspicion.split("about ")[1].split(" ")[0])
    assert abs(lag - 30) < 5 and one.certainty == "suspected" and one.remedy is None


def test_a_load_is_no_lag(loaded):
    assert "torque_delay" not in {s.check for s in loaded.checks}


def test_friction_of_a_cold_start_is_no_lag():
    log = make_hidden_effect_log(load_ur5(), None, n_trajectories=5, duration=6.0, random_state=2)
    frame = log.frame.copy()
    first = frame["trajectory"] == frame["trajectory"].iloc[0]
    for k in range(1, 7):
        friction = 0.5 * frame[f"tau{k}"].std() * np.tanh(frame.loc[first, f"dq{k}"] / 0.02)
        frame.loc[first, f"tau{k}"] += friction
    assert "torque_delay" not in {s.check for s in check_log(frame, log.robot).checks}
