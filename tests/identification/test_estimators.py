# SPDX-License-Identifier: BSD-3-Clause
"""What each estimator is for: broken rows, poor logs, noisy motion, data in parts."""

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.effects import Term
from skidyn.exceptions import SkidynError
from skidyn.identification import ESTIMATORS, RBDRegressor

ROBOT = load_planar_arm()
#: They need more than motion and torque without a clock: instruments, time.
SPECIAL = ("instrumental", "output_error")
LOG = make_hidden_effect_log(ROBOT, None, n_trajectories=8, duration=4.0, random_state=2)


def motion(n=600, seed=0, speed=2.0):
    return np.random.default_rng(seed).uniform(-speed, speed, (n, 6))


def torque(X, parameters=None):
    rigid = ROBOT.inverse_dynamics(X[:, :2], X[:, 2:4], X[:, 4:], parameters=parameters)
    return rigid + 0.3 * X[:, 2:4] + 0.5 * np.tanh(X[:, 2:4] / 0.003)


def error(model):
    """Error on new motion, relative to the torque."""
    X = motion(300, seed=9)
    return float(np.linalg.norm(model.predict(X) - torque(X)) / np.linalg.norm(torque(X)))


@pytest.mark.parametrize("estimator", [e for e in ESTIMATORS if e not in SPECIAL])
def test_exact_data_gives_the_exact_model(estimator):
    X = motion()
    model = RBDRegressor(ROBOT, estimator=estimator).fit(X, torque(X))
    assert error(model) < 1e-6
    assert len(model.coef_std_) == len(model.coef_names_) == len(model.coef_)


def test_ordinary_lets_a_noisy_joint_spoil_the_others():
    X = motion()
    y = torque(X) + np.random.default_rng(1).normal(0, (3.0, 0.01), (600, 2))
    weighted, ordinary = (
        RBDRegressor(ROBOT, estimator=e).fit(X, y) for e in ("weighted", "ordinary")
    )
    at = weighted.coef_names_.index("viscous.Fv[2]")
    X = motion(300, seed=9)
    errors = [np.abs(m.predict(X) - torque(X))[:, 1].mean() for m in (weighted, ordinary)]
    assert errors[0] < errors[1] / 5
    assert weighted.coef_std_[at] < ordinary.coef_std_[at]


@pytest.mark.parametrize("share", [0.05, 0.2])
def test_robust_survives_broken_rows(share):
    X, rng = motion(), np.random.default_rng(3)
    y = torque(X) + rng.normal(0, 0.1, (600, 2))
    broken = rng.random(600) < share
    y[broken] += 40.0
    robust = RBDRegressor(ROBOT, estimator="robust").fit(X, y)
    clean = RBDRegressor(ROBOT).fit(X[~broken], y[~broken])
    assert error(robust) < 1.2 * error(clean) < 0.05 * error(RBDRegressor(ROBOT).fit(X, y))
    # Rows are sorted by fold, which without time and trajectories is their order.
    weights = robust.row_weights_[0]
    assert np.median(weights[broken]) < 0.01 < 0.5 < np.median(weights[~broken])


def test_parts_give_what_the_whole_gives():
    whole = RBDRegressor(ROBOT).fit(LOG.X, LOG.y)
    number = LOG.X["trajectory"].to_numpy()
    for order in (range(1, 9), [6, 3, 8, 1, 4, 2, 7, 5]):
        model = RBDRegressor(ROBOT)
        for k in order:
            model.partial_fit(LOG.X[number == k], LOG.y[number == k])
        np.testing.assert_allclose(model.coef_, whole.coef_, rtol=1e-7)
        np.testing.assert_allclose(model.coef_std_, whole.coef_std_, rtol=1e-5)
        assert model.coef_names_ == whole.coef_names_


@pytest.mark.parametrize("estimator", ["ordinary", "ridge", "entropic"])
def test_parts_of_samples_give_what_the_whole_gives(estimator):
    X = motion()
    y = torque(X) + np.random.default_rng(1).normal(0, 0.1, (600, 2))
    whole = RBDRegressor(ROBOT, estimator=estimator, prior_std=1.0, consistent=True).fit(X, y)
    model = RBDRegressor(ROBOT, estimator=estimator, prior_std=1.0, consistent=True)
    for part in np.split(np.arange(600), [100, 350]):
        model.partial_fit(X[part], y[part])
    np.testing.assert_allclose(model.predict(X), whole.predict(X), rtol=1e-5, atol=1e-5)


def test_memory_of_parts_does_not_grow():
    X = motion(40)
    model = RBDRegressor(ROBOT)
    for _ in range(25):
        model.partial_fit(X, torque(X))
    assert len(model.evidence_.trajectories) == 20
    assert sum(model.evidence_.counts.values()) == 25 * 40 * 2


def test_forgetting_follows_a_change():
    X = motion(200)
    models = [RBDRegressor(ROBOT, forgetting=f) for f in (1.0, 0.5)]
    for friction in (0.0, 0.0, 0.0, 0.4, 0.4, 0.4, 0.4):
        for model in models:
            model.partial_fit(X, torque(X) + friction * X[:, 2:4])
    name = models[0].coef_names_.index("viscous.Fv[1]")
    kept, followed = (model.coef_[name] for model in models)
    assert kept < 0.55 < 0.65 < followed < 0.7 + 1e-9


def test_shape_parameters_of_a_fit_are_kept_by_parts():
    log = make_hidden_effect_log(ROBOT, "stribeck", n_trajectories=4, duration=4.0)
    model = RBDRegressor(ROBOT, ("viscous", "coulomb", ("stribeck", [1])))
    with pytest.raises(SkidynError, match="unspecified shape parameters"):
        model.partial_fit(log.X, log.y)
    model.fit(log.X, log.y)
    terms = list(model.effect_terms_)
    assert model.partial_fit(log.X, log.y).effect_terms_ == terms
    assert isinstance(terms[0], Term)


def test_parameters_without_meaning_are_refused():
    X = motion(50)
    y = torque(X)
    for wrong, message in (
        ({"estimator": "best"}, "'weighted'"),
        ({"prior_std": 0.0}, "prior_std"),
        ({"forgetting": 1.5}, "forgetting"),
        ({"estimator": "instrumental"}, "instruments"),
    ):
        with pytest.raises(ValueError, match=message):
            RBDRegressor(ROBOT, **wrong).fit(X, y)
    with pytest.raises(ValueError, match="does not accept instruments"):
        RBDRegressor(ROBOT).fit(X, y, instruments=X)
    with pytest.raises(AttributeError):
        RBDRegressor(ROBOT, estimator="robust").partial_fit(X, y)
