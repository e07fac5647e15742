# SPDX-License-Identifier: BSD-3-Clause
import warnings

import numpy as np
import pandas as pd
import pytest
from sklearn.model_selection import KFold
from sklearn.neighbors import KNeighborsRegressor

from skidyn.model_selection import (
    LeakageGuard,
    LeakageWarning,
    PhaseKFold,
    TrajectoryKFold,
    leakage_report,
)


def motion(n_trajectories=5, repeat=False):
    t = np.arange(0, 10, 0.02)
    rng = np.random.default_rng(1)
    frames = []
    for k in range(n_trajectories):
        w, phase = (1.0, 0.0) if repeat else (rng.uniform(0.5, 2), rng.uniform(0, 6))
        q = np.stack([np.sin(w * r * t + phase * r) for r in (1.0, 1.7, 2.3)], axis=1)
        dq = np.gradient(q, 0.02, axis=0)
        names = ["q1", "q2", "q3", "dq1", "dq2", "dq3"]
        frames.append(pd.DataFrame(np.c_[q, dq], columns=names).assign(trajectory=k, time=t))
    return pd.concat(frames, ignore_index=True)


def test_random_rows_are_reported_and_trajectories_are_not():
    X = motion()
    with pytest.warns(LeakageWarning, match="5 trajectories .* use TrajectoryKFold"):
        list(LeakageGuard(KFold(3, shuffle=True, random_state=0)).split(X))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        folds = list(LeakageGuard(TrajectoryKFold(5)).split(X))
    assert len(folds) == 5


def test_repeated_motion_is_reported_although_trajectories_differ():
    X = motion(repeat=True)
    with pytest.warns(LeakageWarning, match="100% of the test rows"):
        list(LeakageGuard(TrajectoryKFold(5)).split(X))


def test_phases_of_one_recording_pass_unless_the_period_is_overlooked():
    t = np.arange(0, 20, 0.02)
    w = 2 * np.pi / 10
    X = pd.DataFrame({"time": t, "q1": np.sin(w * t), "q2": np.cos(2 * w * t + 1)})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        list(LeakageGuard(PhaseKFold(4, period=10.0)).split(X))
    with pytest.warns(LeakageWarning, match="repeat a motion"):
        list(LeakageGuard(PhaseKFold(4)).split(X))


def test_report_shows_what_leaking_folds_would_have_claimed():
    X = motion()
    y = X["q1"] + np.random.default_rng(0).normal(size=5)[X["trajectory"]] * 2
    model = KNeighborsRegressor(3)
    report = leakage_report(
        model, X.drop(columns="time"), y, cv=KFold(3, shuffle=True, random_state=0)
    )
    assert report.shared_trajectories == [0, 1, 2, 3, 4]
    assert report.claimed.mean() > 0.95 > report.honest.mean()
    assert "leak" in report.message
