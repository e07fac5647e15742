# SPDX-License-Identifier: BSD-3-Clause
"""Torque whose lag differs between recordings."""

import numpy as np
import pandas as pd
import pytest

from skidyn.datasets import load_ur5, make_hidden_effect_log
from skidyn.logs import check_log

ROBOT = load_ur5()
OPTIONS = {"n_trajectories": 6, "duration": 5.0, "random_state": 3}


def late(frame, lags):
    """A log whose torques are late, by recording, where both were recorded."""
    runs = []
    for lag, (_, run) in zip(lags, frame.groupby("trajectory"), strict=True):
        time = run["time"].to_numpy()
        torques = {f"tau{k + 1}": np.interp(time - lag, time, run[f"tau{k + 1}"]) for k in range(6)}
        both = (time - lag >= time[0]) & (time - lag <= time[-1])
        runs.append(run.assign(**torques)[both])
    return pd.concat(runs, ignore_index=True)


def told_of(frame):
    return [s for s in check_log(frame, ROBOT).checks if s.certainty != "noted"]


@pytest.mark.parametrize(
    "kind", [None, *(pytest.param(k, marks=pytest.mark.slow) for k in ("payload", "stribeck"))]
)
def test_a_logger_that_is_started_by_hand_has_a_lag_in_every_recording(kind):
    lags = (-0.12, 0.05, 0.21, -0.03, 0.09, 0.16)
    (told,) = told_of(late(make_hidden_effect_log(ROBOT, kind, **OPTIONS).frame, lags))
    assert told.check == "torque_delay" and "in every trajectory" in told.suspicion
    words = told.evidence.split(" late by ")[1].split(";")[0].split(", ")
    found = [float(word.split(" ms")[0]) / 1e3 for word in words]
    np.testing.assert_allclose(found, lags, atol=0.015)


def test_a_single_recording_that_is_far_late_is_told_alone():
    frame = make_hidden_effect_log(ROBOT, None, **OPTIONS).frame
    (told,) = told_of(late(frame, (0.0, 0.0, 0.0, 0.3, 0.0, 0.0)))
    assert told.suspicion.startswith("in trajectory 4 torque is late by about 30")


@pytest.mark.parametrize(
    "kind", ["friction_drift", pytest.param("payload", marks=pytest.mark.slow)]
)
def test_effects_that_differ_between_recordings_are_no_lags(kind):
    assert not told_of(make_hidden_effect_log(ROBOT, kind, **OPTIONS).frame)
