# SPDX-License-Identifier: BSD-3-Clause
import pickle
from copy import copy
from dataclasses import replace

import numpy as np
import pytest
from sklearn.base import clone
from sklearn.model_selection import GroupKFold
from sklearn.utils.estimator_checks import parametrize_with_checks
from skorch.callbacks import Checkpoint, EarlyStopping

from skidyn.identification import RBDRegressor
from skidyn.model_selection import LeakageWarning
from skidyn.neural_network import SDLRegressor
from skidyn.robots import Robot

PENDULUM = """
<robot name="pendulum"><link name="base"/>
  <link name="rod"><inertial><origin xyz="0 0 -0.5"/><mass value="2"/>
    <inertia ixx="0.1" iyy="0.1" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="swing" type="continuous"><parent link="base"/><child link="rod"/></joint>
</robot>"""


class AnyWidth(SDLRegressor):
    """For the common tests, whose tables are of any width: one joint, columns taken in turn."""

    def _keys(self):
        return replace(super()._keys(), features=tuple(range(self.n_features_in_)))

    def _resolve(self):
        usual = copy(self)
        usual.n_features_in_ = 3
        q, dq, ddq = np.resize(np.arange(self.n_features_in_), 3)
        return replace(super(AnyWidth, usual)._resolve(), q=(q,), dq=(dq,), ddq=(ddq,))

    def __sklearn_tags__(self):
        tags = super().__sklearn_tags__()
        tags.target_tags.multi_output = False
        tags.regressor_tags.poor_score = True  # their data are no pendulum's
        return tags


EXPECTED = {
    "check_supervised_y_2d": "the torque of one joint may be given as a column",
    "check_sample_weight_equivalence_on_dense_data": (
        "a removed row is missing from the history of its successors, a row of weight 0 is not"
    ),
}
# On the data of the checks a network that is held out adds nothing, and its physics has no memory.
ORDER = {
    "check_methods_sample_order_invariance": "the order of rows is time, so it matters",
    "check_methods_subset_invariance": "a row is predicted from the rows before it as well",
}


@parametrize_with_checks(
    [
        AnyWidth(
            Robot.from_urdf(PENDULUM),
            cv=cv,
            window=3,
            hidden_size=8,
            max_epochs=5,
            random_state=0,
        )
        for cv in (None, 3)
    ],
    expected_failed_checks=lambda estimator: EXPECTED | (ORDER if estimator.cv is None else {}),
)
def test_scikit_learn_contract(estimator, check):
    check(estimator)


def fitted(arm_log, physics=None, **parameters):
    robot, X, y = arm_log
    settings = {"window": 8, "hidden_size": 12, "max_epochs": 10, "random_state": 0} | parameters
    return SDLRegressor(physics or robot, **settings).fit(X, y)


@pytest.mark.slow
def test_rigid_body_and_network_are_optimised_together(arm_log):
    robot, X, y = arm_log
    joint = fitted(arm_log, max_epochs=30)
    frozen = fitted(arm_log, max_epochs=30, rigid_body="frozen")
    start = frozen.inertial_parameters_
    np.testing.assert_array_equal(start, frozen.initial_inertial_parameters_)
    np.testing.assert_array_equal(joint.initial_inertial_parameters_, start)
    assert np.abs(joint.inertial_parameters_ - start).max() > 1e-4
    for model in (joint, frozen):
        assert model.score(X, y) > 0.97
    # identified parameters, not the description's, although friction disturbs them
    nominal = robot.inverse_dynamics(*(X[[f"{s}1", f"{s}2"]] for s in ("q", "dq", "ddq")))
    assert np.abs(frozen.rigid_body_torque(X) - y).mean() < 0.6 * np.abs(nominal - y).mean()


def least_squares_torque(robot, X, y):
    """Rigid body alone, fitted."""
    regressor = robot.torque_regressor(*(X[[f"{s}1", f"{s}2"]] for s in ("q", "dq", "ddq")))
    flat = regressor.reshape(-1, regressor.shape[-1])
    return (flat @ np.linalg.lstsq(flat, y.ravel(), rcond=1e-9)[0]).reshape(y.shape)


@pytest.mark.parametrize("residual", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_falls_back_on_the_rigid_body_far_from_the_data(arm_log, residual):
    robot, X, y = arm_log
    # at this rate the torque that the network reads without residual=True is soon none
    model = fitted(arm_log, residual=residual, learning_rate=0.1)
    errors = [
        np.abs(torque - y).mean()
        for torque in (model.rigid_body_torque(X), least_squares_torque(robot, X, y))
    ]
    assert errors[0] < 1.2 * errors[1]
    assert model.outside_range(X).mean() < 0.05
    far = X.copy()
    far[["dq1", "dq2"]] *= 10.0
    far[["ddq1", "ddq2"]] *= 100.0
    far["q1"] += 3.0
    outside = model.outside_range(far)
    assert outside.mean() > 0.9
    gone = np.abs(model.predict(far) - model.rigid_body_torque(far)).max(axis=1) < 1e-9
    assert gone.mean() > 0.8
    inside = np.abs(model.predict(X) - model.rigid_body_torque(X)).max(axis=1)
    assert np.median(inside) > 0.05


def test_contract_of_columns_and_storage(arm_log):
    robot, X, y = arm_log
    stop = EarlyStopping(patience=1)
    model = fitted(arm_log, max_epochs=3, callbacks=[stop], resample="trajectory")
    expected = model.predict(X)
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(model)).predict(X), expected)
    shuffled = X[X.columns[::-1]]
    np.testing.assert_array_equal(clone(model).fit(shuffled, y).predict(shuffled), expected)
    with pytest.raises(ValueError, match="y has 1 columns; the robot has 2 joints"):
        clone(model).fit(X, y[:, 0])
    with pytest.raises(ValueError, match="lacks the column"):
        clone(model).fit(X.drop(columns="ddq2"), y)
    array = X.to_numpy()
    by_position = clone(model).set_params(trajectory=6).fit(array, y)
    np.testing.assert_array_equal(by_position.predict(array), expected)


@pytest.mark.slow
def test_not_worse_than_its_physics_on_new_trajectories(arm_log):
    """Noise alone is left: an ungated network adds some of it, a gated one next to nothing."""
    robot, X, y = arm_log
    state = (X[[f"{s}1", f"{s}2"]].to_numpy() for s in ("q", "dq", "ddq"))
    y = robot.inverse_dynamics(*state) + np.random.default_rng(0).normal(0, 0.3, y.shape)
    last = (X["trajectory"] == X["trajectory"].max()).to_numpy()
    physics = RBDRegressor(robot, ("viscous",), trajectory="trajectory")
    log = robot, X[~last], y[~last]
    settings = {"max_epochs": 40, "hidden_size": 32}
    gated, free = (fitted(log, physics, cv=cv, **settings) for cv in (3, None))
    alone = physics.fit(X[~last], y[~last])
    clean = robot.inverse_dynamics(*(X.loc[last, [f"{s}1", f"{s}2"]] for s in ("q", "dq", "ddq")))
    errors = [
        np.sqrt(np.mean(np.square(m.predict(X[last]) - y[last]))) for m in (alone, gated, free)
    ]
    assert errors[1] < 1.01 * errors[0]
    assert np.all(gated.learned_weight_ < 0.5)
    assert np.square(gated.predict(X[last]) - clean).mean() <= (
        np.square(free.predict(X[last]) - clean).mean()
    )


def test_groups_and_lists_of_splits(arm_log):
    robot, X, y = arm_log
    groups, cv = X["trajectory"].to_numpy() // 2, GroupKFold(2)
    model = SDLRegressor(robot, cv=cv, max_epochs=1, random_state=0).fit(X, y, groups=groups)
    given = clone(model).set_params(cv=list(cv.split(X, y, groups))).fit(X, y)
    np.testing.assert_array_equal(given.predict(X), model.predict(X))


def test_net_and_callbacks_of_skorch(arm_log, tmp_path):
    robot, X, y = arm_log
    stop = EarlyStopping(patience=1, threshold=0.5, threshold_mode="rel")
    best = Checkpoint(dirname=tmp_path, load_best=True)
    model = fitted(arm_log, max_epochs=50, callbacks=[stop, best], module__dropout=0.0)
    assert model.n_iter_ < 50 and len(model.net_.history) <= model.n_iter_
    assert len(model.learned_weight_) == 2  # held-out copies write no checkpoints of their own
    stored = (tmp_path / "history.json").read_text()
    assert stored.count("valid_loss_best") == len(model.net_.history)
    assert model.net_.module_.core.dropout.share == 0.0


def test_shuffled_rows_are_sorted_with_a_warning(arm_log):
    robot, X, y = arm_log
    X = X.assign(time=np.tile(np.arange(150) * 0.02, 8))
    model = SDLRegressor(robot, max_epochs=1, hidden_size=4, random_state=0)
    expected = model.fit(X, y).predict(X)
    order = np.random.default_rng(0).permutation(len(X))
    with pytest.warns(LeakageWarning, match="SDLRegressor predicts a row from the rows before it"):
        shuffled = clone(model).fit(X.iloc[order], y[order])
    np.testing.assert_allclose(shuffled.predict(X.iloc[order]), expected[order], atol=1e-9)
