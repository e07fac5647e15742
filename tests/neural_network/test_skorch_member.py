# SPDX-License-Identifier: BSD-3-Clause
"""Nets of skorch as members."""

import numpy as np
import pytest
import skorch
import torch
from sklearn.base import clone
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from skorch.callbacks import EarlyStopping

from skidyn.neural_network import BLLRegressor


@pytest.mark.slow
@pytest.mark.parametrize("one", [False, True])
def test_any_skorch_network_is_a_member(one):
    rng = np.random.default_rng(0)
    X = np.c_[np.repeat(np.arange(6), 50), rng.normal(size=(300, 4))]
    y = X[:, 1:3] if not one else X[:, 1]
    member = skorch.NeuralNetRegressor(
        torch.nn.Linear,  # any module; workers must be able to import it
        module__in_features=4,
        module__out_features=1 if one else 2,
        max_epochs=20,
        lr=0.1,
        train_split=None,
        verbose=0,
    )
    bll = BLLRegressor(member, n_estimators=2, trajectory=0, random_state=0).fit(X, y)
    assert bll.score(X, y) > 0.95
    again = clone(bll).set_params(n_jobs=2).fit(X, y)
    np.testing.assert_array_equal(again.predict(X), bll.predict(X))


def test_a_net_of_skorch_inside_a_pipeline():
    rng = np.random.default_rng(0)
    X = np.c_[np.repeat(np.arange(6), 50), 100 * rng.normal(size=(300, 4))]
    net = skorch.NeuralNetRegressor(
        torch.nn.Linear,
        module__in_features=4,
        module__out_features=2,
        max_epochs=20,
        lr=0.1,
        callbacks=[EarlyStopping(patience=5)],
        verbose=0,
    )
    y = X[:, 1:3] / 100
    member = make_pipeline(StandardScaler(), net)
    bll = BLLRegressor(member, n_estimators=2, trajectory=0, random_state=0).fit(X, y)
    assert bll.score(X, y) > 0.95
