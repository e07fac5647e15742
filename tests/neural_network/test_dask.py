# SPDX-License-Identifier: BSD-3-Clause
"""Bagged members and grid search on a cluster give the very numbers of one process."""

import os
from itertools import chain

import joblib
import numpy as np
import pytest
from sklearn.model_selection import GridSearchCV

from skidyn.model_selection import TrajectoryKFold
from skidyn.neural_network import BLLRegressor, LSTMRegressor

distributed = pytest.importorskip("distributed")


@pytest.fixture(scope="module")
def client():
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield client


def test_bagged_members_are_bit_equal(client, log):
    X, y = log
    member = LSTMRegressor(window=4, hidden_size=4, max_epochs=2)
    model = BLLRegressor(member, n_estimators=2, random_state=0)
    wanted = model.fit(X, y).predict(X)
    with joblib.parallel_backend("dask"):
        got = model.set_params(n_jobs=2).fit(X, y).predict(X)
    np.testing.assert_array_equal(got, wanted)


def test_grid_search_is_bit_equal(client, log):
    X, y = log
    member = LSTMRegressor(window=4, hidden_size=4, max_epochs=2, random_state=0)
    search = GridSearchCV(member, {"hidden_size": [3, 4]}, cv=TrajectoryKFold(2))
    wanted = search.fit(X, y).cv_results_["mean_test_score"]
    with joblib.parallel_backend("dask"):
        got = search.set_params(n_jobs=2).fit(X, y).cv_results_["mean_test_score"]
    np.testing.assert_array_equal(got, wanted)


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
