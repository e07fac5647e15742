# SPDX-License-Identifier: BSD-3-Clause
"""Evidence straight from arrays: the same least squares as with the whole regressor."""

from __future__ import annotations

from importlib import resources

import numpy as np
import pytest

from skidyn.datasets import load_panda, load_planar_arm, load_scara
from skidyn.evidence import evidence_from_motion, sample_blocks
from skidyn.exceptions import SkidynError
from skidyn.identification import RBDRegressor, is_consistent, regressor_from_evidence
from skidyn.robots import find_base_parameters

FRICTION = ("viscous", "coulomb")


def motion(robot, n_samples=600, seed=0):
    """States and the torque of other bodies than the URDF's, with friction and noise."""
    rng = np.random.default_rng(seed)
    q, dq, ddq = rng.uniform(-2, 2, (3, n_samples, robot.n_joints))
    truth = robot.inertial_parameters * rng.uniform(0.7, 1.3, (robot.n_bodies, 1))
    torque = robot.inverse_dynamics(q, dq, ddq, parameters=truth)
    return q, dq, ddq, torque + 0.3 * dq + rng.normal(0, 0.1, torque.shape)


def plain_least_squares(robot, q, dq, ddq, torque):
    """Corrections of the base parameters and viscous friction, from the whole regressor."""
    index = find_base_parameters(robot).index
    rigid = robot.torque_regressor(q, dq, ddq)[:, :, index]
    columns = np.concatenate([rigid, dq[:, :, None] * np.eye(robot.n_joints)], axis=2)
    change = torque - robot.inverse_dynamics(q, dq, ddq)
    return np.linalg.lstsq(columns.reshape(-1, columns.shape[2]), change.ravel())[0]


@pytest.mark.parametrize("method", ["gram", "qr"])
@pytest.mark.parametrize("load", [load_panda, load_scara])
def test_same_as_least_squares_on_the_whole_regressor(load, method):
    robot = load()
    data = motion(robot)
    found = evidence_from_motion(robot, *data, ("viscous",), method=method).solve()
    np.testing.assert_allclose(found, plain_least_squares(robot, *data), rtol=1e-8, atol=1e-9)


@pytest.mark.parametrize("name", ["panda", "ur10e"])
def test_same_as_pinocchio(name):
    pin = pytest.importorskip("pinocchio")
    from skidyn import datasets

    robot = getattr(datasets, f"load_{name}")()
    text = resources.files("skidyn.datasets").joinpath("robots", f"{name}.urdf").read_text()
    oracle = pin.buildModelFromXML(text)
    order = [oracle.joints[oracle.getJointId(joint)].idx_v for joint in robot.joint_names]
    data = oracle.createData()
    q, dq, ddq, torque = motion(robot, 800)
    base = find_base_parameters(robot)
    # pinocchio keeps Ixx, Ixy, Iyy, Ixz, Iyz, Izz
    places = np.array([0, 1, 2, 3, 4, 5, 7, 6, 8, 9])
    columns = np.concatenate([10 * i + places for i in order])[base.index]
    blocks = []
    for state in zip(q, dq, ddq, strict=True):
        given = np.zeros((3, oracle.nv))
        given[:, order] = state
        whole = pin.computeJointTorqueRegressor(oracle, data, *given)
        blocks.append(np.hstack([whole[order][:, columns], np.diag(state[1])]))
    expected = np.linalg.lstsq(np.vstack(blocks), torque.ravel())[0]
    found = evidence_from_motion(robot, q, dq, ddq, torque, ("viscous",)).solve()
    found[: len(base.index)] += base.values(robot.inertial_parameters)
    assert np.abs(found - expected).max() <= 1e-8 * np.abs(expected).max()


def test_nearly_dependent_columns_take_the_exact_path():
    robot = load_panda()
    q, dq, ddq, torque = motion(robot)
    small = 0.005 * q, 0.005 * dq, 0.005 * ddq  # every column is nearly constant
    for states, is_exact in (((q, dq, ddq), False), (small, True)):
        fast, exact = (
            evidence_from_motion(robot, *states, torque, ("viscous",), method=method).solve()
            for method in ("auto", "qr")
        )
        assert np.array_equal(fast, exact) == is_exact  # to the last bit


def test_trajectories_in_any_order_add_up():
    robot = load_planar_arm()
    q, dq, ddq, torque = motion(robot, 900)
    number = np.arange(900) % 3
    parts = evidence_from_motion(robot, q, dq, ddq, torque, FRICTION, trajectory=number)
    assert parts.trajectories == [0, 1, 2] and set(parts.counts.values()) == {300}
    whole = evidence_from_motion(robot, q, dq, ddq, torque, FRICTION)
    np.testing.assert_allclose(parts.solve(), whole.solve(), rtol=1e-9, atol=1e-10)
    one = number == 1
    alone = evidence_from_motion(robot, q[one], dq[one], ddq[one], torque[one], FRICTION)
    np.testing.assert_allclose(parts.only([1]).solve(), alone.solve(), rtol=1e-9, atol=1e-10)


@pytest.mark.parametrize("seed", range(5))
def test_consistent_bodies_also_from_noise(seed):
    robot = load_panda()
    rng = np.random.default_rng(seed)
    q, dq, ddq = 0.2 * rng.normal(size=(3, 40, 7))
    evidence = evidence_from_motion(robot, q, dq, ddq, rng.normal(0, 20, (40, 7)), FRICTION)
    model = regressor_from_evidence(robot, evidence, FRICTION, consistent=True)
    assert is_consistent(model.inertial_parameters_)
    assert all(np.all(c >= 0) for c in model.effect_coefficients_.values())


def test_consistency_costs_nothing_where_the_data_is_good():
    robot = load_panda()
    data = motion(robot, 4000)
    evidence = evidence_from_motion(robot, *data, ("viscous",))
    free, bound = (
        regressor_from_evidence(robot, evidence, ("viscous",), consistent=c) for c in (False, True)
    )
    errors = [
        np.sqrt(np.mean((m.rigid_body_torque(*data[:3]) + 0.3 * data[1] - data[3]) ** 2))
        for m in (free, bound)
    ]
    assert errors[1] == pytest.approx(errors[0], rel=1e-3)


def test_errors_name_what_is_wrong():
    robot = load_planar_arm()
    q, dq, ddq, torque = motion(robot, 20)
    with pytest.raises(SkidynError, match=r"ddq has shape \(20, 1\)"):
        evidence_from_motion(robot, q, dq, ddq[:, :1], torque)
    torque[7, 1] = np.nan
    with pytest.raises(SkidynError, match="torque of joint 2 is not finite in row 7"):
        evidence_from_motion(robot, q, dq, ddq, torque)
    with pytest.raises(SkidynError, match="one whole number"):
        evidence_from_motion(robot, q, dq, ddq, ddq, trajectory=[0.5] * 20)
    with pytest.raises(SkidynError, match="method is 'svd'"):
        evidence_from_motion(robot, q, dq, ddq, ddq, method="svd")


def test_blocks_of_samples():
    block, owner, fold = sample_blocks(np.repeat([7, 3], 100))
    assert np.bincount(block).tolist() == [25] * 8
    assert owner.tolist() == [3] * 4 + [7] * 4
    assert fold.tolist() == list(range(8))
    block, owner, fold = sample_blocks(np.repeat(np.arange(50), 3))
    np.testing.assert_array_equal(block, np.repeat(np.arange(50), 3))
    assert fold.max() == 19 and np.all(np.diff(fold) >= 0)


def test_regressor_without_a_clock_takes_this_path():
    robot = load_panda()
    q, dq, ddq, torque = motion(robot, 3000)
    X = np.column_stack([np.arange(3000) // 300, q, dq, ddq])
    model = RBDRegressor(robot, ("viscous",), trajectory=0).fit(X, torque)
    expected = regressor_from_evidence(
        robot,
        evidence_from_motion(robot, q, dq, ddq, torque, ("viscous",), trajectory=X[:, 0]),
        ("viscous",),
    )
    np.testing.assert_allclose(model.coef_, expected.coef_, rtol=1e-6, atol=1e-8)
    np.testing.assert_allclose(model.coef_std_, expected.coef_std_, rtol=1e-3)
    assert model.evidence_.trajectories == list(range(10))
    low, high = model.predict_interval(X)
    assert np.mean((low <= torque) & (torque <= high)) == pytest.approx(0.95, abs=0.02)
