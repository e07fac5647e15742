# SPDX-License-Identifier: BSD-3-Clause
"""Bagged members and grid search on a cluster give the very numbers of one process."""

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
