# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import pandas as pd
import pytest
from sklearn.linear_model import LinearRegression
from sklearn.model_selection import ShuffleSplit

from skidyn.preprocessing import average_repetitions, cross_fitted_residual


def test_averaging_lowers_noise_and_keeps_the_motion():
    rng = np.random.default_rng(0)
    t = np.arange(200) * 0.01
    runs = [
        pd.DataFrame({"time": t + 5 * k, "trajectory": k, "q1": np.sin(3 * t)}) for k in range(9)
    ]
    log = pd.concat(runs, ignore_index=True)
    log["tau1"] = np.tile(np.cos(3 * t), 9) + rng.normal(size=len(log))
    average = average_repetitions(log)
    assert average.shape == (200, 4)
    assert (average["tau1"] - np.cos(3 * t)).std() == pytest.approx(1 / 3, rel=0.2)
    with pytest.raises(ValueError, match="199 to 200 rows"):
        average_repetitions(log[1:])


def test_periods_of_one_recording():
    t = np.arange(0, 10.4, 0.013)
    log = pd.DataFrame({"time": t, "trajectory": 0, "q1": np.sin(2 * np.pi * t / 2.5)})
    average = average_repetitions(log, period=2.5)
    assert average["time"].max() < 2.5
    np.testing.assert_allclose(average["q1"], np.sin(2 * np.pi * average["time"] / 2.5), atol=1e-3)
    with pytest.raises(ValueError, match="fewer than two periods"):
        average_repetitions(log, period=9.0)
    with pytest.raises(ValueError, match="not a whole period"):
        average_repetitions(log, period=6.0 / 1.0 - 0.5 - 1.5)


def test_other_motions_are_not_averaged():
    time = np.arange(0, 8, 0.01)
    motions = [
        pd.DataFrame({"time": time, "trajectory": k, "q1": np.sin((1 + k) * time), "tau1": 1.0})
        for k in range(3)
    ]
    log = pd.concat(motions, ignore_index=True)
    with pytest.raises(ValueError, match="different motions: q1 differs between them by 0.5"):
        average_repetitions(log)
    with pytest.raises(ValueError, match="cuts one trajectory into repetitions, and the log has 3"):
        average_repetitions(log, period=2.0)
    with pytest.raises(ValueError, match="different motions.*period=2.6 is none"):
        average_repetitions(motions[0], period=2.6)
    rest = np.random.default_rng(0).normal(0, 1e-5, len(log))
    assert len(average_repetitions(log.assign(q1=rest))) == len(time)


def test_residual_is_honest():
    rng = np.random.default_rng(0)
    X = pd.DataFrame(rng.normal(size=(40, 30))).rename(columns=str)
    X["trajectory"] = np.repeat(np.arange(8), 5)
    y = rng.normal(size=(40, 2))
    in_sample = y - LinearRegression().fit(X, y).predict(X)
    assert cross_fitted_residual(LinearRegression(), X, y).std() > 2 * in_sample.std()
    with pytest.raises(ValueError, match="exactly once"):
        cross_fitted_residual(LinearRegression(), X, y, cv=ShuffleSplit(2))
