# SPDX-License-Identifier: BSD-3-Clause
"""Instruments take the noise of the motion out of the estimate."""

import numpy as np
import pandas as pd
import polars
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.exceptions import SkidynError
from skidyn.identification import RBDRegressor, repetition_instruments

ROBOT = load_planar_arm()


def torque(X, parameters=None):
    rigid = ROBOT.inverse_dynamics(X[:, :2], X[:, 2:4], X[:, 4:], parameters=parameters)
    return rigid + 0.3 * X[:, 2:4] + 0.5 * np.tanh(X[:, 2:4] / 0.003)


def noisy_motion(seed, noise):
    """Torque of a reference motion, and the motion as noisy sensors see it."""
    rng = np.random.default_rng(seed)
    reference = rng.uniform(-2, 2, (2000, 6))
    X = reference + rng.normal(0, noise, reference.shape) * [0, 0, 1, 1, 1, 1]
    y = ROBOT.inverse_dynamics(reference[:, :2], reference[:, 2:4], reference[:, 4:])
    return X, y + 0.5 * reference[:, 2:4] + rng.normal(0, 0.1, y.shape), reference


def test_instruments_undo_the_bias_of_noisy_motion():
    X, y, reference = noisy_motion(0, 0.5)
    plain = RBDRegressor(ROBOT, ("viscous",)).fit(X, y)
    model = RBDRegressor(ROBOT, ("viscous",), estimator="instrumental")
    model.fit(X, y, instruments=reference)
    at = model.coef_names_.index("viscous.Fv[1]")
    assert plain.coef_[at] < 0.95 * 0.5
    assert abs(model.coef_[at] - 0.5) < 3 * model.coef_std_[at] < 0.1
    table = model.durbin_wu_hausman()
    assert min(row["p_value"] for row in table) * len(table) < 0.01


def test_clean_motion_needs_no_instruments():
    least = []
    for seed in range(6):
        X, y, reference = noisy_motion(seed, 0.0)
        other = reference + np.random.default_rng(seed + 50).normal(0, 0.3, X.shape)
        model = RBDRegressor(ROBOT, ("viscous",), estimator="instrumental")
        table = model.fit(X, y, instruments=other).durbin_wu_hausman()
        least.append(min(row["p_value"] for row in table) * len(table))
    assert np.median(least) > 0.05


def test_runs_of_one_motion_are_instruments_of_each_other():
    truth = np.random.default_rng(0).uniform(-2, 2, (400, 6))
    y = ROBOT.inverse_dynamics(truth[:, :2], truth[:, 2:4], truth[:, 4:]) + 0.5 * truth[:, 2:4]
    names = [f"{s}{j}" for s in ("q", "dq", "ddq") for j in (1, 2)]
    rng = np.random.default_rng(1)
    runs = [pd.DataFrame(truth + rng.normal(0, 0.4, truth.shape), columns=names) for _ in range(8)]
    X = pd.concat([run.assign(trajectory=k) for k, run in enumerate(runs)], ignore_index=True)
    torque = np.vstack([y] * 8)
    torque += rng.normal(0, 0.1, torque.shape)
    model = RBDRegressor(ROBOT, ("viscous",), estimator="instrumental")
    model.fit(X, torque, instruments=repetition_instruments(X))
    plain = RBDRegressor(ROBOT, ("viscous",)).fit(X, torque)
    at = model.coef_names_.index("viscous.Fv[1]")
    assert abs(model.coef_[at] - 0.5) < 0.02 < 0.04 < abs(plain.coef_[at] - 0.5)
    same = repetition_instruments(polars.DataFrame(dict(X.items())))
    np.testing.assert_allclose(same["dq2"].to_numpy(), repetition_instruments(X)["dq2"])
    with pytest.raises(SkidynError, match="400 and 399 rows|399 and 400 rows"):
        repetition_instruments(X.iloc[:-1])


def test_instruments_of_other_rows_are_refused():
    X, y, reference = noisy_motion(0, 0.1)
    with pytest.raises(ValueError, match="rows of X"):
        RBDRegressor(ROBOT, estimator="instrumental").fit(X, y, instruments=reference[:-1])


def test_shuffled_instruments_are_refused():
    log = make_hidden_effect_log(ROBOT, None, n_trajectories=2, duration=3.0)
    model = RBDRegressor(ROBOT, estimator="instrumental")
    with pytest.raises(ValueError, match="rows of X, in the same order"):
        model.fit(log.X, log.y, instruments=log.X.sample(frac=1.0, random_state=0))
