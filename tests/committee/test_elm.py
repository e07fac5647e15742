# SPDX-License-Identifier: BSD-3-Clause
import pickle

import numpy as np
import pandas as pd
import pytest
from sklearn.linear_model import Ridge
from sklearn.model_selection import GridSearchCV
from sklearn.utils.estimator_checks import parametrize_with_checks

from skidyn.committee import ELMCommittee
from skidyn.model_selection import TrajectoryKFold


@parametrize_with_checks(
    [
        ELMCommittee(n_estimators=3, n_hidden=60, random_state=0),
        # single precision could not tell weights from repetition to the digits checked
        ELMCommittee(n_estimators=3, n_hidden=60, p=0.999, scaling=None, random_state=0),
    ],
    expected_failed_checks=lambda estimator: (
        {
            "check_sample_weight_equivalence_on_dense_data": (
                "the inputs are scaled by rows of positive weight, whatever the weight, and sums "
                "are in single precision"
            )
        }
        if estimator.scaling
        else {}
    ),
)
def test_scikit_learn_contract(estimator, check):
    check(estimator)


@pytest.fixture
def data():
    rng = np.random.default_rng(0)
    X = rng.uniform(-1, 1, size=(900, 6))
    return X, np.stack([np.sin(2 * X[:, 0]) * X[:, 1], 50 + 5 * X[:, 2] ** 2], axis=1)


@pytest.mark.parametrize("p", [0.5, 0.9999])
def test_partial_fit_is_exact(data, p):
    X, y = data
    committee = ELMCommittee(3, n_hidden=80, p=p, scaling=None, random_state=0).fit(X, y)
    online = ELMCommittee(3, n_hidden=80, p=p, scaling=None, random_state=0)
    for part in np.array_split(np.arange(len(X)), 7):
        online.partial_fit(X[part], y[part])
    np.testing.assert_allclose(online.predict(X), committee.predict(X), rtol=1e-4, atol=1e-4)


@pytest.mark.parametrize("intercept", [True, False])
def test_output_layer_is_the_ridge_of_the_paper(data, intercept):
    X, y = data
    y, p = y + 3.0, 0.999
    committee = ELMCommittee(
        1, n_hidden=50, p=p, fit_intercept=intercept, scaling=None, random_state=0
    ).fit(X, y)
    hidden = np.maximum(X @ committee.hidden_weights_[0] + committee.hidden_bias_[0], 0)
    ridge = Ridge(alpha=len(X) * (1 - p) / p, fit_intercept=intercept).fit(hidden, y)
    np.testing.assert_allclose(committee.predict(X), ridge.predict(hidden), rtol=1e-6, atol=1e-6)


def test_spread_grows_away_from_the_data(data):
    X, y = data
    committee = ELMCommittee(p=0.999, n_hidden=100, random_state=0).fit(X, y)
    _, inside = committee.predict(X, return_std=True)
    _, outside = committee.predict(5 * X, return_std=True)
    assert np.median(outside) > 5 * np.median(inside)


def test_keys_are_no_features_and_threads_change_nothing(data):
    X, y = data
    frame = pd.DataFrame(X, columns=[f"q{i}" for i in range(6)])
    frame["trajectory"] = np.repeat(np.arange(9), 100)
    committee = ELMCommittee(3, n_hidden=40, random_state=0)
    expected = committee.fit(frame, y).predict(frame)
    frame["trajectory"] += 1000
    np.testing.assert_array_equal(committee.predict(frame), expected)
    np.testing.assert_array_equal(
        committee.set_params(n_jobs=2).fit(frame, y).predict(frame), expected
    )
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(committee)).predict(frame), expected)
    search = GridSearchCV(committee, {"p": [0.5, 0.99]}, cv=TrajectoryKFold(3)).fit(frame, y)
    assert search.best_params_ == {"p": 0.99}


def test_later_rows_must_have_as_many_outputs(data):
    X, y = data
    committee = ELMCommittee(2, n_hidden=10).partial_fit(X, y)
    with pytest.raises(ValueError, match="y has 1 outputs; the rows learned before had 2"):
        committee.partial_fit(X, y[:, 0])
