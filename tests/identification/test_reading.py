# SPDX-License-Identifier: BSD-3-Clause
"""Rows in any order, few rows, weights; recordings known again by their motion."""

import warnings

import numpy as np
import pytest
from sklearn.ensemble import BaggingRegressor
from sklearn.experimental import enable_halving_search_cv  # noqa: F401
from sklearn.model_selection import (
    HalvingGridSearchCV,
    ShuffleSplit,
    cross_val_score,
    train_test_split,
)

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.exceptions import ColumnError, LogWarning
from skidyn.identification import RBDRegressor
from skidyn.model_selection import LeakageWarning, TrajectoryKFold

ROBOT = load_planar_arm()
LOG = make_hidden_effect_log(ROBOT, None, n_trajectories=8, duration=4.0, random_state=2)
N = ROBOT.n_joints


def with_acceleration(X):
    motion = RBDRegressor(ROBOT).fit(LOG.X, LOG.y)._motion(X)[0]
    return X.assign(**{f"ddq{j + 1}": motion.ddq[:, j] for j in range(N)})


FULL = with_acceleration(LOG.X)


def rmse(model, X, y):
    return float(np.sqrt(np.mean((model.predict(X) - y) ** 2)))


@pytest.mark.parametrize("X", [LOG.X, FULL], ids=["positions", "accelerations"])
def test_shuffled_rows_fit_and_predict_as_ordered_ones(X):
    rng = np.random.default_rng(0)
    mixed = rng.permutation(len(X))
    ordered = RBDRegressor(ROBOT).fit(X, LOG.y)
    with pytest.warns(LeakageWarning, match="TrajectoryKFold"):
        shuffled = RBDRegressor(ROBOT).fit(X.iloc[mixed], LOG.y[mixed])
    np.testing.assert_allclose(shuffled.coef_, ordered.coef_, rtol=1e-9)
    expected = ordered.predict(X)
    np.testing.assert_allclose(shuffled.predict(X.iloc[mixed]), expected[mixed], atol=1e-9)
    low, high = shuffled.predict_interval(X.iloc[mixed])
    assert np.mean((low < LOG.y[mixed]) & (LOG.y[mixed] < high)) > 0.9


def test_a_random_split_of_rows():
    X_train, X_test, y_train, y_test = train_test_split(FULL, LOG.y, random_state=0)
    with pytest.warns(LeakageWarning):
        model = RBDRegressor(ROBOT).fit(X_train, y_train)
    whole = RBDRegressor(ROBOT).fit(FULL, LOG.y)
    assert rmse(model, X_test, y_test) < 1.2 * rmse(whole, X_test, y_test)


@pytest.mark.filterwarnings("ignore::skidyn.model_selection.LeakageWarning")
@pytest.mark.filterwarnings("ignore::skidyn.exceptions.LogWarning")
def test_tools_of_scikit_learn_that_draw_rows():
    model = RBDRegressor(ROBOT)
    scores = cross_val_score(model, FULL, LOG.y, cv=ShuffleSplit(2, random_state=0))
    assert scores.min() > 0.9
    X = FULL.to_numpy()
    time, trajectory = (list(FULL.columns).index(name) for name in ("time", "trajectory"))
    bare = RBDRegressor(ROBOT, time=time, trajectory=trajectory)
    names = ("q", "dq", "ddq")
    order = [
        time,
        trajectory,
        *(FULL.columns.get_loc(f"{s}{j + 1}") for s in names for j in (0, 1)),
    ]
    X, bare = X[:, order], bare.set_params(time=0, trajectory=1)
    bag = BaggingRegressor(bare, n_estimators=3, random_state=0).fit(X, LOG.y)
    assert bag.score(X, LOG.y) > 0.9
    search = HalvingGridSearchCV(
        model, {"estimator": ["weighted", "ordinary"]}, cv=2, random_state=0, error_score="raise"
    )
    assert search.fit(FULL, LOG.y).best_score_ > 0.9


def test_forty_rows_give_a_model_or_say_why_not():
    few = np.sort(np.random.default_rng(1).choice(len(FULL), 40, replace=False))
    with pytest.warns(LogWarning, match="40 samples make"):
        model = RBDRegressor(ROBOT).fit(FULL.iloc[few], LOG.y[few])
    assert np.any(model.coef_[-4:] != 0)
    assert rmse(model, FULL, LOG.y) < 0.5 * LOG.y.std()


def test_weights_are_repetitions_where_there_is_no_clock():
    X = np.random.default_rng(0).uniform(-2, 2, (200, 6))
    y = ROBOT.inverse_dynamics(X[:, :2], X[:, 2:4], X[:, 4:]) + 0.3 * X[:, 2:4]
    y += np.random.default_rng(1).normal(0, 0.1, y.shape)
    weight = np.random.default_rng(2).integers(0, 4, 200)
    weighted = RBDRegressor(ROBOT).fit(X, y, sample_weight=weight)
    rows = np.repeat(np.arange(200), weight)
    repeated = RBDRegressor(ROBOT).fit(X[rows], y[rows])
    np.testing.assert_allclose(weighted.coef_, repeated.coef_, rtol=1e-5, atol=1e-6)


def test_rows_of_weight_zero_do_not_count_but_are_neighbours():
    y = LOG.y.copy()
    weight = np.ones(len(y))
    weight[1000:1200] = 0.0
    y[1000:1200] += 100.0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", LogWarning)
        model = RBDRegressor(ROBOT).fit(LOG.X, y, sample_weight=weight)
    clean = RBDRegressor(ROBOT).fit(LOG.X, LOG.y)
    rest = np.ones(len(y), bool)
    rest[1000:1200] = False
    assert rmse(model, LOG.X[rest], LOG.y[rest]) < 1.1 * rmse(clean, LOG.X[rest], LOG.y[rest])
    with pytest.raises(ValueError, match="zero"):
        RBDRegressor(ROBOT).fit(LOG.X, LOG.y, sample_weight=np.zeros(len(y)))


def test_folds_of_trajectories_are_no_shuffled_rows():
    with warnings.catch_warnings():
        warnings.simplefilter("error", LeakageWarning)
        cross_val_score(RBDRegressor(ROBOT), LOG.X, LOG.y, cv=TrajectoryKFold(4))


@pytest.mark.slow
def test_a_clock_as_the_column_of_trajectories_is_named():
    with pytest.raises(ColumnError, match="trajectory='time' and time='auto' .* column 'time'"):
        RBDRegressor(ROBOT, trajectory="time").fit(FULL, LOG.y)
    array = FULL[[c for c in FULL if c[0] != "t" or c == "time"]].to_numpy()
    with pytest.raises(ColumnError, match="trajectory=0 and time=0 are both the column 0"):
        RBDRegressor(ROBOT, trajectory=0, time=0).fit(array, LOG.y)
    named = FULL.drop(columns="trajectory")
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        with pytest.warns(LogWarning, match="column 'time' of X.* not whole") as caught:
            RBDRegressor(ROBOT, trajectory="time", time=None).fit(named, LOG.y)
        assert [w.category for w in caught] == [LogWarning]
        counted = FULL.assign(trajectory=np.arange(len(FULL)))
        with pytest.warns(LogWarning, match="column 'trajectory' of X.* in every row"):
            RBDRegressor(ROBOT).fit(counted, LOG.y)


def test_few_rows_bring_no_bare_warnings_of_numpy():
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        with pytest.warns(LogWarning, match="5 samples make"):
            RBDRegressor(ROBOT).fit(FULL[:5], LOG.y[:5])


@pytest.mark.parametrize(
    ("time", "told"),
    [
        (
            np.zeros(len(FULL)),
            "'time' of X are equal to those of the row before in all .* rows of trajectory 1, 0 s",
        ),
        (np.float32(FULL["time"] + 1.7e9), "float32 cannot hold seconds since 1970"),
        (np.float32(FULL["time"] + 1e6), "in at least 8.% of the rows"),
    ],
    ids=["constant", "since 1970", "coarse"],
)
def test_times_that_do_not_advance_are_refused(time, told):
    X = FULL.assign(time=time)
    with pytest.raises(ColumnError, match=told):
        RBDRegressor(ROBOT).fit(X, LOG.y)
    with pytest.raises(ColumnError, match=told):
        diagnose(RBDRegressor(ROBOT), X, LOG.y)
