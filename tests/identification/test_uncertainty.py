# SPDX-License-Identifier: BSD-3-Clause
"""Bootstrapped coefficients and bands around predictions, whose coverage is checked."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.evidence import evidence_from_motion
from skidyn.exceptions import SkidynError
from skidyn.identification import RBDRegressor, bootstrap_coefficients, regressor_from_evidence

FRICTION = ("viscous", "coulomb")


@pytest.fixture(scope="module")
def log():
    return make_hidden_effect_log(
        load_planar_arm(), None, base=FRICTION, n_trajectories=12, duration=6.0, random_state=2
    )


@pytest.fixture(scope="module")
def new(log):
    """Which samples belong to the trajectories that no model sees."""
    return (log.frame["trajectory"] > 8).to_numpy()


@pytest.fixture(scope="module")
def model(log, new):
    return RBDRegressor(log.robot).fit(log.X[~new], log.y[~new])


@pytest.mark.parametrize("level", [0.5, 0.95])
def test_bands_hold_their_share_of_new_measurements(log, new, model, level):
    low, high = model.predict_interval(log.X[new], level)
    measured = np.asarray(log.y)[new]
    inside = (low <= measured) & (measured <= high)
    np.testing.assert_allclose(inside.mean(0), level, atol=0.05)
    resting = np.abs(log.X[new][["dq1", "dq2"]].to_numpy()) < 0.01
    if level > 0.9:
        assert inside[resting].mean() > 0.85


def test_bands_widen_outside_the_motion_of_the_log(log, model):
    states = log.X.iloc[:400].copy()
    fast = states.copy()
    for name in ("dq1", "dq2"):
        fast[name] *= 10
    for name in ("ddq1", "ddq2"):
        if name in fast:
            fast[name] *= 100
    if "ddq1" not in states:
        pytest.skip("the log has no accelerations to scale")
    moving = np.abs(states["dq1"]) > 0.05
    slow, quick = (model.predict(X, return_std=True)[1][moving, 0] for X in (states, fast))
    assert np.median(quick) > 1.2 * np.median(slow)


def test_one_joint_and_pickle(log, new, model):
    copy = pickle.loads(pickle.dumps(model))
    for a, b in zip(
        copy.predict_interval(log.X[new]), model.predict_interval(log.X[new]), strict=True
    ):
        np.testing.assert_array_equal(a, b)
    with pytest.raises(ValueError, match="level=95"):
        model.predict_interval(log.X[new], 95)


def test_no_bands_without_samples(log):
    robot = log.robot
    rng = np.random.default_rng(0)
    states = rng.uniform(-2, 2, (3, 300, 2))
    evidence = evidence_from_motion(robot, *states, robot.inverse_dynamics(*states), FRICTION)
    names = [f"{s}{j}" for s in ("q", "dq", "ddq") for j in (1, 2)]
    from_evidence = regressor_from_evidence(robot, evidence, FRICTION, feature_names=names)
    with pytest.raises(SkidynError, match="has no errors of single samples"):
        from_evidence.predict_interval(np.hstack(list(states)))


def test_bootstrap_agrees_with_the_jackknife(model):
    draws = bootstrap_coefficients(model, random_state=0)
    assert draws.shape == (1000, len(model.coef_))
    ratio = draws.std(axis=0) / model.coef_std_
    assert 0.6 < np.median(ratio) < 1.6
    middle = np.abs(np.median(draws, axis=0) - model.coef_)
    assert np.median(middle / model.coef_std_) < 0.5
    again = bootstrap_coefficients(model, random_state=0)
    np.testing.assert_array_equal(draws, again)


def test_bootstrap_wants_trajectories(log, new):
    few = (log.frame["trajectory"] <= 3).to_numpy()
    model = RBDRegressor(log.robot).fit(log.X[few], log.y[few])
    with pytest.raises(SkidynError, match="fitted to 3 trajectories"):
        bootstrap_coefficients(model)
