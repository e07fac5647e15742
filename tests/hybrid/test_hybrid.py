# SPDX-License-Identifier: BSD-3-Clause
import pickle

import numpy as np
import pytest
from sklearn.base import clone
from sklearn.ensemble import ExtraTreesRegressor
from sklearn.linear_model import LinearRegression, Ridge
from sklearn.model_selection import (
    GridSearchCV,
    GroupKFold,
    KFold,
    LeaveOneGroupOut,
    cross_val_predict,
)
from sklearn.neighbors import KNeighborsRegressor
from sklearn.pipeline import Pipeline
from sklearn.preprocessing import FunctionTransformer
from sklearn.utils.estimator_checks import parametrize_with_checks

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.hybrid import HybridRegressor, OwnJointRegressor
from skidyn.identification import RBDRegressor
from skidyn.model_selection import TrajectoryKFold
from skidyn.neural_network import LSTMRegressor

FEATURES = ["q1", "q2", "dq1", "dq2"]  # what learners without key columns see
TREES = ExtraTreesRegressor(15, min_samples_leaf=5, random_state=0)


@parametrize_with_checks(
    [
        HybridRegressor(Ridge(), learner, cv=3)
        for learner in (ExtraTreesRegressor(10, random_state=0), OwnJointRegressor(Ridge()))
    ]
)
def test_scikit_learn_contract(estimator, check):
    check(estimator)


def rmse(y, prediction):
    return np.sqrt(((y - prediction) ** 2).mean(axis=0))


def test_learns_the_joint_that_hides_something_and_leaves_the_other_alone(make_log):
    X, y = make_log()
    hybrid = HybridRegressor(LinearRegression(), TREES).fit(X, y)
    assert hybrid.learned_weight_[0] > 0.8 and hybrid.learned_weight_[1] == 0
    assert hybrid.gain_[0] > 0.5 and hybrid.p_value_[0] < 0.01
    held_out, truth = make_log(seed=1)
    before = rmse(truth, hybrid.physics_.predict(held_out[FEATURES]))
    after = rmse(truth, hybrid.predict(held_out))
    assert after[0] < 0.5 * before[0] and after[1] == before[1]
    np.testing.assert_allclose(
        hybrid.predict(held_out) - hybrid.physics_.predict(held_out[FEATURES]),
        hybrid.learned_torque(held_out),
    )


def test_adds_nothing_to_complete_physics(make_log):
    kept = 0
    for seed in range(10):
        X, y = make_log(6, 60, seed=seed, hidden=(0.0, 0.0))
        hybrid = HybridRegressor(LinearRegression(), KNeighborsRegressor(5), cv=3).fit(X, y)
        kept += (hybrid.learned_weight_ > 0).any()
    assert kept <= 1  # of 10 robots, at a level of 5 % for all joints of a robot


class RowsSeen(LinearRegression):
    """Physics that predicts which trajectories it was fitted to, as the digits of a number."""

    def fit(self, X, y):
        self.seen_ = sum(10.0**k for k in np.unique(X[:, 0]))
        return self

    def predict(self, X):
        return np.full(len(X), -self.seen_)


class Listener(LinearRegression):
    """Notes the trajectories and the targets of every fit."""

    told = []

    def fit(self, X, y):
        self.told.append((X[:, 0].astype(int), np.ravel(y)))
        return super().fit(X, y)


def test_no_residual_betrays_the_fold_that_is_held_out():
    trajectory = np.repeat(np.arange(4), 3)
    folds = [(np.flatnonzero(trajectory != k), np.flatnonzero(trajectory == k)) for k in range(4)]
    Listener.told.clear()
    HybridRegressor(RowsSeen(), Listener(), cv=folds).fit(trajectory[:, None], np.zeros(12))
    held_out = [set(range(4)) - set(own) for own, _ in Listener.told]
    assert [{k} in held_out for k in range(4)] == [True] * 4
    for out, (own, residual) in zip(held_out, Listener.told, strict=True):
        for k, seen in zip(own, residual, strict=True):
            assert seen == sum(10.0**other for other in range(4) if other not in {k, *out})


def test_tables_searches_and_storage(make_log):
    X, y = make_log(12, 60)
    hybrid = HybridRegressor(LinearRegression(), TREES, cv=3)
    expected = hybrid.fit(X, y).predict(X)
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(hybrid)).predict(X), expected)
    grid = {"learner__min_samples_leaf": [5, 50], "physics__fit_intercept": [True]}
    search = GridSearchCV(hybrid, grid, cv=TrajectoryKFold(2)).fit(X, y)
    assert search.best_params_["learner__min_samples_leaf"] == 5
    assert cross_val_predict(hybrid, X, y[:, 0], cv=TrajectoryKFold(2)).shape == (len(X),)
    assert "HybridRegressor" in hybrid._repr_html_()
    array = clone(hybrid).set_params(trajectory=4, time=5, cv=KFold(3)).fit(X.to_numpy(), y)
    assert array.predict(X.to_numpy()).shape == y.shape


def test_one_search_over_physics_effects_and_network():
    log = make_hidden_effect_log(
        load_planar_arm(), "spring", n_trajectories=8, duration=4.0, rate=25.0
    )
    hybrid = HybridRegressor(
        RBDRegressor(log.robot), LSTMRegressor(max_epochs=1, random_state=0), cv=2
    )
    scale = FunctionTransformer(feature_names_out="one-to-one").set_output(transform="pandas")
    pipeline = Pipeline([("units", scale), ("hybrid", hybrid)])
    friction = ("viscous", "coulomb")
    grid = {
        "hybrid__physics__effects": [friction, (*friction, "spring")],
        "hybrid__learner__window": [4, 8],
        "hybrid__learner__hidden_size": [4],
    }
    search = GridSearchCV(pipeline, grid, cv=TrajectoryKFold(2)).fit(log.X, log.y)
    assert search.best_params_["hybrid__physics__effects"] == (*friction, "spring")
    assert "HybridRegressor" in search._repr_html_()


def test_joints_are_known_by_the_names_of_the_robot():
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=3, duration=2.0, rate=25.0)
    named = {f"q{j + 1}": f"q_{name}" for j, name in enumerate(log.robot.joint_names)}
    named |= {f"d{old}": f"d{new}" for old, new in named.items()}
    named |= {f"d{old}": f"d{new}" for old, new in named.items()}
    hybrid = HybridRegressor(RBDRegressor(log.robot), cv=2)
    by_number = hybrid.fit(log.X, log.y).gain_
    np.testing.assert_allclose(hybrid.fit(log.X.rename(columns=named), log.y).gain_, by_number)


@pytest.mark.skipif(
    not hasattr(HybridRegressor, "set_callbacks"), reason="scikit-learn has no callbacks"
)
def test_progress_counts_every_fit(make_log):
    class Count:
        def __init__(self):
            self.ended, self.most = 0, 0

        def setup(self, estimator, context):
            pass

        def on_fit_task_begin(self, estimator, context, **_):
            self.most = max(self.most, context.max_subtasks or 0)

        def on_fit_task_end(self, estimator, context, **_):
            self.ended += context.task_name != "fit"

        def teardown(self, estimator, context):
            pass

    X, y = make_log(6, 60)
    count = Count()
    hybrid = HybridRegressor(LinearRegression(), TREES, cv=3).set_callbacks(count).fit(X, y)
    assert count.most == 11  # physics 3 pairs + 3 + 1, learner 3 + 1
    assert count.ended == count.most - (hybrid.learner_ is None)


def test_weights_need_learners_that_take_them(make_log):
    X, y = make_log(4, 30)
    hybrid = HybridRegressor(LinearRegression(), KNeighborsRegressor(), cv=2)
    with pytest.raises(ValueError, match="KNeighborsRegressor does not accept sample_weight"):
        hybrid.fit(X, y, sample_weight=np.ones(len(X)))


class Reads(Ridge):
    """Remembers how many columns it was shown."""

    def fit(self, X, y, sample_weight=None):
        self.shown_ = np.shape(X)[1]
        return super().fit(X, y, sample_weight)


def test_learners_do_not_see_key_columns(make_log):
    X, y = make_log(6, 60)
    hybrid = HybridRegressor(Reads(), Reads(), alpha=1).fit(X, y)
    assert hybrid.physics_.shown_ == 4
    assert hybrid.learner_ is None or hybrid.learner_.shown_ == 4
    array = X.to_numpy()
    by_position = HybridRegressor(Reads(), Reads(), alpha=1, trajectory=4, time=5).fit(array, y)
    np.testing.assert_allclose(by_position.predict(array), hybrid.predict(X))


def test_groups_and_lists_of_splits_make_the_folds(make_log):
    X, y = make_log(6, 60)
    groups = X["trajectory"].to_numpy()
    by_group = HybridRegressor(Ridge(), Ridge(), cv=GroupKFold(3), alpha=1)
    expected = by_group.fit(X, y, groups=groups).gain_
    splits = list(GroupKFold(3).split(X, y, groups))
    given = HybridRegressor(Ridge(), Ridge(), cv=splits, alpha=1).fit(X, y)
    np.testing.assert_allclose(given.gain_, expected)
    each = HybridRegressor(Ridge(), Ridge(), cv=LeaveOneGroupOut(), alpha=1)
    assert each.fit(X, y, groups=groups).predict(X).shape == y.shape
    with pytest.raises(ValueError, match="exactly once"):
        HybridRegressor(Ridge(), Ridge(), cv=splits[:2]).fit(X, y)
