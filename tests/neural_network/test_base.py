# SPDX-License-Identifier: BSD-3-Clause
"""What all recurrent regressors share."""

import pickle

import numpy as np
import polars as pl
import pytest
import torch
from sklearn.base import clone
from sklearn.ensemble import BaggingRegressor
from sklearn.model_selection import GridSearchCV, GroupKFold, cross_val_predict
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from skidyn.model_selection import LeakageWarning, TrajectoryKFold
from skidyn.neural_network import LSTMRegressor, NDLRegressor

SMALL = {"window": 8, "hidden_size": 12, "max_epochs": 15, "random_state": 0}


@pytest.mark.slow
def test_bit_equal_for_any_number_of_processes_and_global_state_untouched(log):
    X, y = log[0].to_numpy(), log[1]
    member = NDLRegressor(**SMALL | {"max_epochs": 2}, trajectory=0, time=1, resample="trajectory")
    before = torch.get_rng_state()
    one, two = (
        BaggingRegressor(member, 2, bootstrap=False, random_state=0, n_jobs=n).fit(X, y).predict(X)
        for n in (1, 2)
    )
    np.testing.assert_array_equal(one, two)
    assert torch.equal(before, torch.get_rng_state())


def test_rows_of_weight_zero_are_not_learned_but_read(log):
    X, y = log
    spoiled = y.copy()
    out = (X["trajectory"] >= 6).to_numpy()
    spoiled[out] += 1000.0
    model = LSTMRegressor(**SMALL)
    weighted = clone(model).fit(X, spoiled, sample_weight=(~out).astype(float))
    assert np.abs(weighted.predict(X) - y).mean() < 1.0


def test_shuffled_rows_are_sorted_with_a_warning(log):
    X, y = log
    model = LSTMRegressor(**SMALL | {"max_epochs": 2})
    expected = model.fit(X, y).predict(X)
    order = np.random.default_rng(0).permutation(len(X))
    with pytest.warns(LeakageWarning, match="predicts a row from the rows before it"):
        shuffled = clone(model).fit(X.iloc[order], y[order])
    np.testing.assert_array_equal(shuffled.predict(X), expected)
    np.testing.assert_array_equal(shuffled.predict(X.iloc[order]), expected[order])


def test_tables_pipelines_and_searches(log):
    X, y = log
    model = LSTMRegressor(**SMALL | {"max_epochs": 3})
    expected = model.fit(X, y).predict(X)
    polars = pl.from_pandas(X)
    np.testing.assert_array_equal(clone(model).fit(polars, y).predict(polars), expected)
    velocities = [k for k, name in enumerate(X) if name.startswith("dq")]
    by_position = model.set_params(trajectory=0, time=1, direction=velocities)
    by_position.fit(X.to_numpy(), y)
    np.testing.assert_array_equal(by_position.predict(X.to_numpy()), expected)
    assert "LSTMRegressor" in model._repr_html_()
    pipeline = make_pipeline(StandardScaler().set_output(transform="pandas"), clone(model))
    pipeline.set_params(lstmregressor__trajectory="trajectory", lstmregressor__time=None)
    search = GridSearchCV(pipeline, {"lstmregressor__window": [2, 8]}, cv=TrajectoryKFold(2))
    assert search.fit(X, y).best_params_["lstmregressor__window"] in (2, 8)
    by_group = cross_val_predict(pipeline, X, y, cv=GroupKFold(2), groups=X["trajectory"])
    np.testing.assert_array_equal(
        by_group, cross_val_predict(pipeline, X, y, cv=TrajectoryKFold(2))
    )


def test_stored_as_plain_arrays(log):
    X, y = log
    model = NDLRegressor(**SMALL | {"max_epochs": 2}, per_joint=True).fit(X, y)
    expected = model.predict(X)
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(model)).predict(X), expected)
    skops = pytest.importorskip("skops.io")
    text = skops.dumps(model)
    types = skops.get_untrusted_types(data=text)
    assert all(name.startswith("skidyn.") for name in types)
    np.testing.assert_array_equal(skops.loads(text, trusted=types).predict(X), expected)
