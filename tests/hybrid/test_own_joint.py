# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import pandas as pd
import pytest
from sklearn.ensemble import ExtraTreesRegressor
from sklearn.linear_model import Ridge
from sklearn.utils.estimator_checks import parametrize_with_checks

from skidyn.effects import dahl_state
from skidyn.hybrid import OwnJointRegressor

MEMORY = {
    "check_methods_sample_order_invariance": "pre-sliding friction remembers the path of the joint",
    "check_methods_subset_invariance": "pre-sliding friction remembers the path of the joint",
}


@parametrize_with_checks(
    [OwnJointRegressor(Ridge())], expected_failed_checks=lambda estimator: MEMORY
)
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
    with pytest.raises(ValueError, match="q_1.* need joint_names"):
        OwnJointRegressor().fit(X, y)
    with pytest.warns(UserWarning, match="the motion of 2 joint"):
        OwnJointRegressor().fit(X.to_numpy()[:, :5], y)


def test_a_learner_without_memory_sees_hysteresis():
    t = np.arange(0, 40, 0.01)
    q = np.sin(t) + 0.3 * np.sin(3.1 * t)
    X = np.stack([q, np.gradient(q, t), np.zeros_like(t)], axis=1)
    y = dahl_state(q, [slice(0, len(t))], 0.03)
    train, test = slice(0, 2000), slice(2000, 4000)
    trees = ExtraTreesRegressor(10, random_state=0)
    with_memory = OwnJointRegressor(trees).fit(X[train], y[train])
    without = OwnJointRegressor(trees, presliding=[]).fit(X[train], y[train])
    error = [
        np.abs(m.predict(X[test])[100:] - y[test][100:]).mean() for m in (with_memory, without)
    ]
    assert error[0] < 0.3 * error[1]


def test_rows_have_weights():
    X = np.random.default_rng(0).normal(size=(120, 6))
    y = X[:, 2:4].copy()
    y[:60] += 10.0
    weight = np.r_[np.zeros(60), np.ones(60)]
    model = OwnJointRegressor(Ridge(), presliding=()).fit(X, y, sample_weight=weight)
    np.testing.assert_allclose(model.predict(X)[60:], y[60:], atol=0.1)


def test_the_torque_of_one_joint_of_several_needs_its_name():
    rng = np.random.default_rng(0)
    X = pd.DataFrame(
        rng.normal(size=(50, 6)), columns=[f"{s}{k}" for s in ("q", "dq", "ddq") for k in (1, 2)]
    )
    with pytest.raises(ValueError, match="numbers do not tell whose it is"):
        OwnJointRegressor(Ridge()).fit(X, X["q2"])
    named = X.rename(columns=lambda name: name[:-1] + {"1": "_base", "2": "_tip"}[name[-1]])
    own = OwnJointRegressor(Ridge(), joint_names=["tip"]).fit(named, X["q2"])
    assert own.score(named, X["q2"]) > 0.99


@pytest.mark.parametrize("presliding", [(0,), (-1.0, 0.1), (np.nan,)])
def test_distances_that_are_none_are_refused(presliding):
    X = np.random.default_rng(0).normal(size=(50, 3))
    with pytest.raises(ValueError, match="expected distances above 0"):
        OwnJointRegressor(Ridge(), presliding=presliding).fit(X, X[:, 1])
