# SPDX-License-Identifier: BSD-3-Clause

import numpy as np
import pandas as pd
import pytest
import torch
from sklearn.base import clone
from sklearn.ensemble import ExtraTreesRegressor
from sklearn.model_selection import cross_val_score
from sklearn.utils.estimator_checks import parametrize_with_checks

from skidyn.exceptions import ColumnError
from skidyn.model_selection import TrajectoryKFold
from skidyn.neural_network import BLLRegressor, LSTMRegressor, NDLRegressor

SMALL = {"window": 8, "hidden_size": 12, "max_epochs": 15, "random_state": 0}

SEQUENCE = {
    "check_methods_sample_order_invariance": "the order of rows is time, so it matters",
    "check_methods_subset_invariance": "a row is predicted from the rows before it as well",
    "check_sample_weight_equivalence_on_dense_data": (
        "a removed row is missing from the history of its successors, a row of weight 0 is not"
    ),
}


@parametrize_with_checks(
    [
        LSTMRegressor(
            window=3, stride=3, hidden_size=8, max_epochs=12, learning_rate=0.1, random_state=0
        ),
        NDLRegressor(
            window=3,
            stride=3,
            hidden_size=8,
            dropout=0,
            max_epochs=12,
            learning_rate=0.1,
            random_state=0,
        ),
    ],
    expected_failed_checks=lambda estimator: SEQUENCE,
)
def test_scikit_learn_contract(estimator, check):
    check(estimator)


def test_learns_what_needs_memory(make_log):
    X, y = make_log(n_trajectories=18)
    cv = TrajectoryKFold(2)
    model = LSTMRegressor(**SMALL | {"max_epochs": 40, "learning_rate": 0.02})
    recurrent = cross_val_score(model, X, y, cv=cv).mean()
    static = cross_val_score(ExtraTreesRegressor(20, random_state=0), X, y, cv=cv).mean()
    assert recurrent > 0.95 and 1 - recurrent < 0.5 * (1 - static)


def test_prediction_depends_on_the_past_of_the_segment_alone(log):
    X, y = log
    model = LSTMRegressor(**SMALL).fit(X, y)
    whole = model.predict(X)
    assert whole.dtype == np.float64 and whole.shape == y.shape
    for n in (1, 60, 121, 500):
        np.testing.assert_allclose(model.predict(X[:n]), whole[:n], atol=1e-6)
    alone = X["trajectory"] == 3
    np.testing.assert_allclose(model.predict(X[alone]), whole[alone], atol=1e-6)
    # a gap in time separates as a new trajectory number does
    gap = X[X["trajectory"] == 0].copy()
    gap.loc[60:, "time"] += 9.0
    np.testing.assert_allclose(model.predict(gap)[60:], model.predict(gap[60:]), atol=1e-6)


@pytest.mark.skipif(not torch.cuda.is_available(), reason="torch sees no GPU")
@pytest.mark.parametrize("kind", [LSTMRegressor, NDLRegressor])
def test_a_gpu_learns_what_a_cpu_learns(kind, log):
    X, y = log
    there = kind(**SMALL, device="cuda").fit(X, y)
    torque = there.predict(X)
    np.testing.assert_allclose(there.set_params(device="cpu").predict(X), torque, atol=1e-3)
    here = kind(**SMALL).fit(X, y)
    errors = [np.sqrt(np.mean((np.asarray(y) - p) ** 2)) for p in (torque, here.predict(X))]
    assert errors[0] < 1.2 * errors[1]


@pytest.mark.slow
def test_the_direction_of_velocities_is_an_input():
    rng = np.random.default_rng(0)
    X = pd.DataFrame({"trajectory": np.repeat(np.arange(4), 150), "dq1": rng.normal(size=600)})
    X["dq1"] += 3.0  # a turn is rare, and far from the mean
    y = np.sign(X["dq1"].to_numpy())
    named = LSTMRegressor(max_epochs=40, random_state=0).fit(X, y)
    assert named.weights_[0]["lstm.weight_ih_l0"].shape[1] == 2
    numbered = LSTMRegressor(max_epochs=40, random_state=0, trajectory=0, direction=[1])
    np.testing.assert_array_equal(
        numbered.fit(X.to_numpy(), y).predict(X.to_numpy()), named.predict(X)
    )
    without = LSTMRegressor(max_epochs=40, random_state=0, direction=None).fit(X, y)
    assert without.weights_[0]["lstm.weight_ih_l0"].shape[1] == 1
    assert named.score(X, y) > max(0.9, without.score(X, y))
    with pytest.raises(ColumnError, match="dq2"):
        LSTMRegressor(direction=["dq2"]).fit(X, y)
    bagged = BLLRegressor(LSTMRegressor(max_epochs=1), n_estimators=1, random_state=0).fit(X, y)
    assert bagged.bagging_.estimators_[0].direction == [1]


@pytest.mark.slow
def test_the_linear_path_reaches_beyond_the_training_range():
    rng = np.random.default_rng(0)
    X = rng.normal(size=(600, 2))
    with_path, without = (
        LSTMRegressor(linear=linear, random_state=0).fit(X, X @ [2.0, -1.0])
        for linear in (True, False)
    )
    far = 3.0 * rng.normal(size=(200, 2))
    assert with_path.score(far, far @ [2.0, -1.0]) > max(0.9, without.score(far, far @ [2.0, -1.0]))


def test_one_network_per_joint_ignores_the_other_joints(log):
    X, y = log
    model = LSTMRegressor(**SMALL | {"max_epochs": 3}, per_joint=True)
    both = model.fit(X, y).predict(X)
    first = clone(model).fit(X, y * [1.0, -7.0]).predict(X)
    np.testing.assert_array_equal(both[:, 0], first[:, 0])
