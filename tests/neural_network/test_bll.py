# SPDX-License-Identifier: BSD-3-Clause
import os
import pickle
from itertools import chain

import joblib
import numpy as np
import pytest
from sklearn.base import clone
from sklearn.linear_model import HuberRegressor, LassoCV, LinearRegression, Ridge, SGDRegressor
from sklearn.model_selection import GridSearchCV, GroupKFold, cross_val_score
from sklearn.utils.estimator_checks import parametrize_with_checks
from skorch.callbacks import Callback

from skidyn.model_selection import LeakageWarning, TrajectoryKFold
from skidyn.neural_network import BLLRegressor, LSTMRegressor

MEMBER = LSTMRegressor(window=6, hidden_size=8, max_epochs=3)
SEQUENCE = {
    "check_methods_sample_order_invariance": "the order of rows is time, so it matters",
    "check_methods_subset_invariance": "a row is predicted from the rows before it as well",
    "check_sample_weight_equivalence_on_dense_data": (
        "a removed row is missing from the history of its successors, a row of weight 0 is not"
    ),
}


@parametrize_with_checks(
    [
        BLLRegressor(
            LSTMRegressor(window=2, stride=2, hidden_size=8, max_epochs=8, learning_rate=0.1),
            n_estimators=2,
            random_state=0,
        )
    ],
    expected_failed_checks=lambda estimator: SEQUENCE,
)
def test_scikit_learn_contract(estimator, check):
    check(estimator)


@pytest.mark.parametrize("resample", ["trajectory", pytest.param("window", marks=pytest.mark.slow)])
def test_bit_equal_for_any_number_of_processes(log, resample):
    X, y = log
    # more members than are trained side by side
    bll = BLLRegressor(MEMBER, n_estimators=12, resample=resample, random_state=0)
    torque, spread = bll.fit(X, y).predict(X, return_std=True)
    assert spread.shape == y.shape and (spread >= 0).all() and spread.max() > 0
    parallel = clone(bll).set_params(n_jobs=2).fit(X, y)
    np.testing.assert_array_equal(parallel.predict(X), torque)
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(bll)).predict(X), torque)


def test_meta_regressor_sees_honest_predictions_only(log):
    """On pure noise an honest head learns to predict nothing."""
    X, y = log
    noise = np.random.default_rng(0).normal(size=y.shape)
    member = LSTMRegressor(window=6, hidden_size=32, max_epochs=40, learning_rate=0.03)
    bll = BLLRegressor(member, LinearRegression(), n_estimators=3, random_state=0).fit(X, noise)
    members = np.mean([m.predict(X.to_numpy()) for m in bll.bagging_.estimators_], axis=0)
    assert members.std() > 0.3  # the members learned the noise by heart
    assert np.abs(bll.final_estimator_.coef_).max() < 0.4
    assert 0 < bll.n_stacked_ < len(X)


def test_folds_for_the_meta_regressor(log):
    X, y = log
    bll = BLLRegressor(MEMBER, n_estimators=2, cv=2, random_state=0)
    assert bll.fit(X, y).n_stacked_ == len(X)
    assert clone(bll).set_params(cv=TrajectoryKFold(2)).fit(X, y).n_stacked_ == len(X)
    one = X["trajectory"] == 0
    assert clone(bll).set_params(cv=None).fit(X[one], y[one]).n_stacked_ == one.sum()


def test_searches_reach_into_the_member(log):
    X, y = log
    bll = BLLRegressor(MEMBER, n_estimators=2, random_state=0)
    search = GridSearchCV(bll, {"estimator__window": [2, 6]}, cv=TrajectoryKFold(2)).fit(X, y)
    assert search.best_estimator_.bagging_.estimators_[0].window in (2, 6)
    assert np.isfinite(cross_val_score(bll, X, y, cv=TrajectoryKFold(2))).all()


def test_table_iii():
    bll = BLLRegressor.from_table_iii(n_estimators=4)
    assert bll.n_estimators == 4 and bll.resample == "window"
    member = bll.estimator
    assert (member.hidden_size, member.max_epochs, member.batch_size) == (32, 130, 32)
    assert member.learning_rate == 0.01 and member.per_joint
    head = bll.final_estimator.regressor[-1]
    assert head.hidden_layer_sizes == (100, 50, 25) and head.activation == "relu"
    assert (head.max_iter, head.batch_size, head.learning_rate_init) == (130, 32, 0.01)


def test_paper_head_and_weights(log):
    X, y = log
    bll = BLLRegressor.from_table_iii(n_estimators=1, random_state=0)
    bll.set_params(estimator__max_epochs=2, final_estimator__regressor__mlpregressor__max_iter=5)
    with pytest.warns(UserWarning, match="Maximum iterations"):
        found = bll.fit(X, y).predict(X)
        np.testing.assert_array_equal(clone(bll).fit(X, y).predict(X), found)  # seeds the head too
    assert found.shape == y.shape
    with pytest.raises(ValueError, match="does not accept sample_weight"):
        bll.fit(X, y, sample_weight=np.ones(len(X)))


def test_members_that_cannot_draw_trajectories(log):
    with pytest.raises(ValueError, match="use resample='window'"):
        BLLRegressor(Ridge(), resample="trajectory").fit(*log)


@pytest.mark.parametrize("head", [LassoCV(), HuberRegressor(), SGDRegressor(), LinearRegression()])
def test_any_linear_regressor_on_top(head, log):
    X, y = log
    bll = BLLRegressor(Ridge(), head, n_estimators=2, random_state=0).fit(X, y)
    assert bll.predict(X).shape == y.shape
    assert BLLRegressor(Ridge(), head, n_estimators=2).fit(X, y[:, 0]).predict(X).ndim == 1


def test_members_trained_one_by_one_come_out_the_same(log):
    """A callback that does nothing keeps members from being trained as one computation."""
    X, y = log
    bll = BLLRegressor(MEMBER, n_estimators=3, random_state=0).fit(X, y)
    single = clone(bll).set_params(estimator__callbacks=[Callback()]).fit(X, y)
    assert len(single.bagging_.estimators_[0].net_.history) == 3
    assert bll.bagging_.estimators_[0].net_.initialized_
    np.testing.assert_allclose(single.predict(X), bll.predict(X), rtol=1e-4, atol=1e-4)


def test_shuffled_rows_are_sorted_with_a_warning(log):
    X, y = log
    splits = list(TrajectoryKFold(2).split(X, y))
    order = np.random.default_rng(0).permutation(len(X))
    place = np.argsort(order)
    for cv, same in ((None, None), (splits, [(place[a], place[b]) for a, b in splits])):
        bll = BLLRegressor(MEMBER, n_estimators=2, cv=cv, random_state=0).fit(X, y)
        with pytest.warns(LeakageWarning, match="BLLRegressor predicts a row from the rows before"):
            shuffled = clone(bll).set_params(cv=same).fit(X.iloc[order], y[order])
        np.testing.assert_allclose(shuffled.predict(X.iloc[order]), bll.predict(X)[order])


def test_members_without_keys_do_not_see_them(log):
    X, y = log
    bll = BLLRegressor(Ridge(), n_estimators=2, random_state=0).fit(X, y)
    assert bll.bagging_.estimators_[0].n_features_in_ == X.shape[1] - 2


def test_groups_and_lists_of_splits(log):
    X, y = log
    groups = X["trajectory"].to_numpy()
    cv = GroupKFold(2)
    bll = BLLRegressor(Ridge(), n_estimators=2, cv=cv, random_state=0).fit(X, y, groups=groups)
    given = BLLRegressor(Ridge(), n_estimators=2, cv=list(cv.split(X, y, groups)), random_state=0)
    np.testing.assert_allclose(given.fit(X, y).predict(X), bll.predict(X))


def test_default_meta_regressor_does_not_spoil_the_mean_of_the_members():
    # A path in few trajectories: what single members miss on one says nothing about another.
    t = np.linspace(0, 12, 360)
    q = np.c_[np.sin(t), np.cos(1.7 * t), np.sin(2.3 * t + 1)]
    X, y = np.c_[np.arange(360) // 60, q], np.c_[q[:, 0] * q[:, 1], q[:, 2] ** 2, q[:, 0]]
    train, test = X[:, 0] != 3, X[:, 0] == 3
    member = LSTMRegressor(window=2, hidden_size=6, max_epochs=15)
    bll = BLLRegressor(member, n_estimators=4, trajectory=0, random_state=0)
    bll.fit(X[train], y[train])
    members = [each.predict(X[test]) for each in bll.bagging_.estimators_]
    alone = np.sqrt(np.mean((y[test] - np.mean(members, axis=0)) ** 2))
    stacked = np.sqrt(np.mean((y[test] - bll.predict(X[test])) ** 2))
    assert stacked < 1.1 * alone


@pytest.fixture(scope="module")
def client():
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield client


@pytest.mark.slow
def test_bagged_members_are_bit_equal(client, log):
    X, y = log
    member = LSTMRegressor(window=4, hidden_size=4, max_epochs=2)
    model = BLLRegressor(member, n_estimators=2, random_state=0)
    wanted = model.fit(X, y).predict(X)
    with joblib.parallel_backend("dask"):
        got = model.set_params(n_jobs=2).fit(X, y).predict(X)
    np.testing.assert_array_equal(got, wanted)


@pytest.mark.slow
def test_grid_search_is_bit_equal(client, log):
    X, y = log
    member = LSTMRegressor(window=4, hidden_size=4, max_epochs=2, random_state=0)
    search = GridSearchCV(member, {"hidden_size": [3, 4]}, cv=TrajectoryKFold(2))
    wanted = search.fit(X, y).cv_results_["mean_test_score"]
    with joblib.parallel_backend("dask"):
        got = search.set_params(n_jobs=2).fit(X, y).cv_results_["mean_test_score"]
    np.testing.assert_array_equal(got, wanted)


@pytest.mark.slow
def test_a_search_that_loses_a_worker_is_bit_equal(client, log, tmp_path):
    X, y = log

    class Deadly(LSTMRegressor):  # known within the test alone, so it is sent to the workers whole
        """Kills the first worker that trains it, amid the work."""

        def fit(self, X, y):
            import os
            import signal

            if os.getpid() != self.spared:
                try:
                    os.close(os.open(self.flag, os.O_CREAT | os.O_EXCL))
                except FileExistsError:
                    pass
                else:
                    os.kill(os.getpid(), signal.SIGKILL)
            return super().fit(X, y)

    Deadly.flag, Deadly.spared = str(tmp_path / "killed"), os.getpid()
    member = Deadly(window=4, hidden_size=4, max_epochs=2, random_state=0)
    folds = list(TrajectoryKFold(2).split(X, y))
    search = GridSearchCV(member, {"hidden_size": [3, 4]}, cv=folds, refit=False)
    wanted = search.fit(X, y).cv_results_["mean_test_score"]
    # Given to every worker; what joblib hands out by itself is lost with the one that holds it.
    with joblib.parallel_backend("dask", scatter=[X, y, *chain.from_iterable(folds)]):
        got = search.set_params(n_jobs=2).fit(X, y).cv_results_["mean_test_score"]
    assert (tmp_path / "killed").exists()
    np.testing.assert_array_equal(got, wanted)


@pytest.mark.slow
def test_bagging_that_loses_a_worker_is_bit_equal(client, log, tmp_path):
    X, y = log
    member = LSTMRegressor(window=4, hidden_size=4, max_epochs=2)
    model = BLLRegressor(member, n_estimators=2, random_state=0)
    wanted = model.fit(X, y).predict(X)

    def kill_own_worker(flag):
        import os
        import signal

        if os.path.exists(flag):
            return "done"
        with open(flag, "w"):
            pass
        os.kill(os.getpid(), signal.SIGKILL)

    killer = client.submit(kill_own_worker, str(tmp_path / "killed"), pure=False)
    with joblib.parallel_backend("dask"):
        got = model.set_params(n_jobs=2).fit(X, y).predict(X)
    assert killer.result() == "done"
    np.testing.assert_array_equal(got, wanted)
