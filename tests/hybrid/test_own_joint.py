# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import pandas as pd
import pytest
from sklearn.ensemble import ExtraTreesRegressor
from sklearn.linear_model import Ridge
from sklearn.utils.estimator_checks import parametrize_with_checks

from skidyn.hybrid import OwnJointRegressor
from skidyn.hybrid._own_joint import _travel_since_reversal


class AnyColumns(OwnJointRegressor):
    """For the common tests, whose tables are of any width: every joint sees every column."""

    def _resolve(self, n_joints):
        self._n_joints = n_joints
        return None

    def _features(self, X):
        return [X] * self._n_joints


@parametrize_with_checks([AnyColumns(Ridge())])
def test_scikit_learn_contract(estimator, check):
    check(estimator)


@pytest.fixture
def data():
    X = pd.DataFrame(
        np.random.default_rng(0).normal(size=(300, 6)),
        columns=[f"{s}_{joint}" for s in ("q", "dq", "ddq") for joint in ("base", "tip")],
    )
    return X, np.stack([np.sign(X["dq_base"]), X["q_tip"] ** 2], axis=1)


def test_joints_see_only_themselves(data):
    X, y = data
    model = OwnJointRegressor(ExtraTreesRegressor(5), joint_names=["base", "tip"]).fit(X, y)
    expected = model.predict(X)
    X = X.assign(q_tip=0.0, dq_tip=0.0, ddq_tip=0.0)
    changed = model.predict(X)
    np.testing.assert_array_equal(changed[:, 0], expected[:, 0])
    assert (changed[:, 1] != expected[:, 1]).any()


def test_missing_columns_are_named(data):
    X, y = data
    with pytest.raises(ValueError, match="ddq_tip"):
        OwnJointRegressor(joint_names=["base", "tip"]).fit(X.drop(columns="ddq_tip"), y)
    with pytest.raises(ValueError, match="needs 6 by position"):
        OwnJointRegressor().fit(X.to_numpy()[:, :5], y)


def test_travel_restarts_at_reversals_and_segments():
    q = np.array([0.0, 1.0, 3.0, 2.0, 1.0, 5.0, 6.0])
    dq = np.array([1.0, 1.0, 1.0, -1.0, -1.0, 1.0, 1.0])
    travel = _travel_since_reversal(q, dq, [slice(0, 5), slice(5, 7)])
    np.testing.assert_array_equal(travel, [0, 1, 3, 0, -1, 0, 1])
