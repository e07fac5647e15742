# SPDX-License-Identifier: BSD-3-Clause
"""Simulation errors, the scorer, and the verdict on a change."""

import json

import numpy as np
import pytest
from sklearn.model_selection import cross_val_score

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.effects import Coefficient, Effect, Term, register_effect, unregister_effect
from skidyn.exceptions import SkidynError
from skidyn.identification import RBDRegressor
from skidyn.model_selection import TrajectoryKFold
from skidyn.simulation import judge_by_simulation, neg_simulation_error, simulation_errors


@pytest.fixture(scope="module")
def log():
    return make_hidden_effect_log(load_planar_arm(), "spring", joints=[1], n_trajectories=4)


@pytest.fixture(scope="module")
def models(log):
    train = log.frame["trajectory"] <= 3
    plain = RBDRegressor(log.robot).fit(log.X[train], log.y[train])
    with_spring = plain.with_effects([("spring", [1])]).fit(log.X[train], log.y[train])
    return plain, with_spring


def test_errors_are_small_where_the_model_is_right_and_are_json(log, models):
    test = log.frame["trajectory"] == 4
    errors = simulation_errors(models[1], log.X[test], log.y[test])
    assert errors.position.shape == errors.velocity.shape == (2,)
    assert np.all(errors.position < 0.1 * errors.resting)
    assert errors.n_lost == 0 and errors.score < 0.1
    assert json.loads(json.dumps(errors.to_dict()))["joints"] == ["joint1", "joint2"]
    assert "joint2" in errors.text and "rad/s" in str(errors)


def test_verdict_on_an_effect_that_is_there_and_its_contrary(log, models):
    test = log.frame["trajectory"] == 4
    better = judge_by_simulation(*models, log.X[test], log.y[test])
    worse = judge_by_simulation(*models[::-1], log.X[test], log.y[test])
    assert better.improves and not better.worsens and better.change < np.log(0.7)
    assert worse.worsens and "grows" in worse.text
    np.testing.assert_allclose(better.change, -worse.change, rtol=0.3)


def test_verdict_is_left_open_where_nothing_changes(log, models):
    test = log.frame["trajectory"] == 4
    same = judge_by_simulation(models[1], models[1], log.X[test], log.y[test])
    assert not same.improves and not same.worsens and "does not change significantly" in same.text


def test_one_piece_is_no_evidence(log, models):
    test = log.frame["trajectory"] == 4
    with pytest.raises(SkidynError, match="one piece"):
        judge_by_simulation(*models, log.X[test], log.y[test], horizon=None)


@pytest.mark.slow
def test_motion_that_explodes_is_infinite_not_silent(log, models):
    test = log.frame["trajectory"] == 4
    broken = RBDRegressor(log.robot, [Term("spring", (1,))]).fit(log.X, log.y)
    term = broken.effect_terms_[0]
    broken.effect_coefficients_[term] = np.array([-1e5, 0.0])
    errors = simulation_errors(broken, log.X[test], log.y[test])
    assert errors.n_lost > 0 and not np.isfinite(errors.score)
    assert "without bound" in errors.text
    verdict = judge_by_simulation(models[0], broken, log.X[test], log.y[test])
    assert "without bound" in verdict.text


@pytest.mark.slow
def test_an_effect_that_refuses_motion_without_bound_does_not_stop_the_rest(log):
    class Wary(Effect):
        kind = "wary"
        title = "Spring that looks at numbers only"
        formula = "k q"
        coefficients = (Coefficient("k", "N m/rad"),)

        def columns(self, signals, joint, **shape):
            if not np.isfinite(np.asarray(signals.q, dtype=float)).all():
                raise ValueError("positions without bound")
            return np.asarray(signals.q[:, joint], dtype=float)[:, None]

    register_effect(Wary)
    try:
        model = RBDRegressor(log.robot, [Term("wary", (1,))]).fit(log.X, log.y)
        model.effect_coefficients_[model.effect_terms_[0]] = np.array([-1e5])
        test = log.frame["trajectory"] == 4
        errors = simulation_errors(model, log.X[test], log.y[test])
        assert errors.n_lost > 0
    finally:
        unregister_effect("wary")


@pytest.mark.slow
def test_scorer_prefers_the_model_that_moves_like_the_robot(log):
    cv = TrajectoryKFold(2)
    scores = [
        cross_val_score(
            RBDRegressor(log.robot, effects), log.X, log.y, scoring=neg_simulation_error, cv=cv
        ).mean()
        for effects in (["viscous", "coulomb"], ["viscous", "coulomb", ("spring", [1])])
    ]
    assert scores[1] > scores[0]
