# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import pytest
from sklearn.base import clone
from sklearn.model_selection import GroupKFold
from sklearn.utils.estimator_checks import parametrize_with_checks

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import EffectSearchCV
from skidyn.identification import RBDRegressor
from skidyn.robots import Robot

pytestmark = pytest.mark.usefixtures("diagnosed_once")
PENDULUM = Robot.from_urdf(
    '<robot name="pendulum"><link name="base"/><link name="rod"><inertial>'
    '<origin xyz="0.2 0 0"/><mass value="1.5"/>'
    '<inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    '<joint name="j1" type="revolute"><parent link="base"/><child link="rod"/><axis xyz="0 1 0"/>'
    '<limit lower="-3" upper="3" effort="50" velocity="3"/></joint></robot>'
)


def pendulum_log():
    """Two swings of two seconds: trajectory, time, q, dq, ddq; and the torque."""
    t, swings = np.arange(50) * 0.04, []
    for k, w in enumerate((2.0, 2.7)):
        q = np.sin(w * t)
        swings.append(np.c_[np.full(50, k), t, q, w * np.cos(w * t), -(w**2) * q])
    X = np.concatenate(swings)
    torque = PENDULUM.inverse_dynamics(X[:, [2]], X[:, [3]], X[:, [4]])[:, 0]
    return X, torque + 0.5 * np.sign(X[:, 3]) + 0.05 * np.random.default_rng(0).normal(size=100)


class SearchOfPendulum(EffectSearchCV):
    """Searches a log of its own, since the checks bring random rows and no motion; tests only."""

    def _log(self, X, torque, weight):
        return *pendulum_log(), None

    def _table(self, X, array):
        motion = array[:, [k % array.shape[1] for k in range(3)]]
        return np.c_[np.zeros(len(array)), np.arange(len(array)), motion]

    def __sklearn_tags__(self):
        tags = super().__sklearn_tags__()
        tags.regressor_tags.poor_score = True
        return tags


@parametrize_with_checks(
    [SearchOfPendulum(RBDRegressor(PENDULUM, trajectory=0, time=1), effects=(), cv=2)],
    expected_failed_checks=lambda estimator: {
        "check_regressor_multioutput": "the robot and not y says how many outputs there are"
    },
)
def test_scikit_learn_contract(estimator, check):
    check(estimator)


@pytest.fixture(scope="module")
def log():
    return make_hidden_effect_log(
        load_planar_arm(), "spring", joints=[2], n_trajectories=6, duration=3.0
    )


def test_finds_adds_and_predicts_better(log):
    start = RBDRegressor(log.robot)
    search = clone(EffectSearchCV(start, effects=("spring", "dahl"))).fit(log.X, log.y)
    assert [(t.kind, t.joints) for t in search.best_effects_] == [("spring", (2,))]
    assert search.cv_results_["added"].tolist() == [None, "spring"]
    assert np.all(np.diff(search.cv_results_["mean_rmse"]) < 0)
    assert search.score(log.X, log.y) > start.fit(log.X, log.y).score(log.X, log.y)
    assert not hasattr(search.estimator, "coef_")


def test_keeps_findings_only_as_far_as_they_raise_the_score(log):
    search = EffectSearchCV(RBDRegressor(log.robot), effects=("spring",), cv=3)

    def against(estimator, X, y):
        return -float(len(estimator.effects))

    kept = clone(search).fit(log.X, log.y)
    assert kept.best_index_ == 1 and kept.best_estimator_ is kept.diagnosis_.model
    search.set_params(scoring=against).fit(log.X, log.y)
    assert len(search.diagnosis_.findings) == 1
    assert search.best_index_ == 0 and search.best_effects_ == []
    results = search.cv_results_
    assert results["rank_test_score"].tolist() == [1, 2]
    assert search.best_score_ == results["mean_test_score"][0] == -2.0
    assert search.best_params_ == results["params"][0]
    alone = RBDRegressor(log.robot).fit(log.X, log.y)
    np.testing.assert_allclose(search.predict(log.X), alone.predict(log.X), rtol=1e-12)


@pytest.mark.slow
def test_the_gain_of_a_single_fold_keeps_nothing(log):
    folds = list(GroupKFold(5).split(log.X, groups=log.X["trajectory"]))

    def in_folds(*gains):
        """Scores that rise by these gains with an effect, fold by fold."""
        numbers = {tuple(log.y[test[0]]): k for k, (_, test) in enumerate(folds)}

        def score(estimator, X, y):
            return gains[numbers[tuple(y[0])]] * (len(estimator.effects) > 2)

        return score

    search = EffectSearchCV(RBDRegressor(log.robot), effects=("spring",), cv=folds)
    for gains, kept in (
        ((0.001, -0.01, -0.02, 0.003, 9.0), 0),
        ((0.01, 0.001, 0.002, 0.003, 9.0), 1),
        ((0.01, 0.001, -0.002, 0.003, 9.0), 0),
        ((0.01, 0.01, 0.02, 0.02, -9.0), 0),
    ):
        search.set_params(scoring=in_folds(*gains)).fit(log.X, log.y)
        assert search.best_index_ == kept


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"effects": "viscous"}, r"effects=\['viscous'\]"),
        ({"smooth": "x"}, "expected True or False"),
        ({"refit": "x"}, "expected True or False"),
        ({"fade_out": "x"}, "expected True or False"),
        ({"settings": "x"}, r"expected Settings\(\.\.\.\)"),
    ],
)
def test_parameters_of_another_kind_are_refused(wrong, message, log):
    with pytest.raises(ValueError, match=message):
        EffectSearchCV(RBDRegressor(log.robot), **wrong).fit(log.X, log.y)
