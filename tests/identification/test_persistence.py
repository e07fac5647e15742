# SPDX-License-Identifier: BSD-3-Clause
import pickle

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.identification import RBDRegressor


@pytest.fixture(scope="module")
def log():
    return make_hidden_effect_log(load_planar_arm(), "stribeck", n_trajectories=2, duration=3.0)


@pytest.fixture(scope="module")
def model(log):
    return RBDRegressor(log.robot, ("viscous", "coulomb", "stribeck")).fit(log.X, log.y)


def same(loaded, model, X):
    assert np.array_equal(loaded.predict(X), model.predict(X))
    assert list(loaded.effect_coefficients_) == list(model.effect_coefficients_)
    for key, factor in model.evidence_.factors.items():
        assert np.array_equal(loaded.evidence_.factors[key], factor)


def test_skops_stores_a_fitted_model(model, log):
    skops = pytest.importorskip("skops.io")
    data = skops.dumps(model)
    same(skops.loads(data, trusted=skops.get_untrusted_types(data=data)), model, log.X)


def test_pickle_of_fitted_and_unfitted(model, log):
    same(pickle.loads(pickle.dumps(model)), model, log.X)
    unfitted = pickle.loads(pickle.dumps(RBDRegressor(log.robot)))
    assert not hasattr(unfitted, "coef_")
