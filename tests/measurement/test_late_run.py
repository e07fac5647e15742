# SPDX-License-Identifier: BSD-3-Clause
"""Torque of one recording that is late, beside a load that differs between recordings."""

import numpy as np

from skidyn.datasets import load_ur5, make_hidden_effect_log
from skidyn.logs import check_log

ROBOT = load_ur5()
FRAME = make_hidden_effect_log(
    ROBOT, "payload", n_trajectories=5, duration=6.0, random_state=5
).frame


def told(frame):
    return [s for s in check_log(frame, ROBOT).checks if s.check == "torque_delay"]


def test_one_recording_is_late_beside_a_load():
    run = int(FRAME["trajectory"].unique()[1])
    own = FRAME["trajectory"] == run
    time, frame = FRAME.loc[own, "time"], FRAME.copy()
    for k in range(6):
        name = f"tau{k + 1}"
        frame.loc[own, name] = np.interp(time - 0.03, time, FRAME.loc[own, name])
    (one,) = told(frame)
    assert one.suspicion.startswith(f"in trajectory {run} torque is late by about ")
    lag = float(one.suspicion.split("about ")[1].split(" ")[0])
    assert abs(lag - 30) < 5 and one.certainty == "suspected" and one.remedy is None


def test_a_load_is_no_lag():
    assert told(FRAME) == []
