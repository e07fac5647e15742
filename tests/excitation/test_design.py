# SPDX-License-Identifier: BSD-3-Clause
"""Designed motions keep every limit and tell more than random ones."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

from skidyn.datasets import load_planar_arm, load_scara, load_ur5, make_hidden_effect_log
from skidyn.exceptions import SkidynError
from skidyn.excitation import MotionLimits, design_excitation
from skidyn.identification import RBDRegressor

FAST = {"duration": 6.0, "iterations": 4}


@pytest.mark.parametrize("motion", ["fourier", "quintic"])
@pytest.mark.parametrize(
    "load", [load_planar_arm, load_scara, pytest.param(load_ur5, marks=pytest.mark.slow)]
)
def test_every_limit_holds_and_the_motion_starts_and_ends_at_rest(load, motion):
    robot = load()
    given = MotionLimits(acceleration=np.full(robot.n_joints, 3.0))

    excitation = design_excitation(robot, motion=motion, limits=given, **FAST)

    limits = given.resolved(robot)
    time, q, dq, ddq = excitation.sample(1000.0)
    for value, slope in ((q, dq), (dq, ddq)):
        gone = cumulative_trapezoid(slope, time, axis=0, initial=0.0)
        np.testing.assert_allclose(gone, value - value[0], atol=1e-4)
    assert np.all((q > limits.position[:, 0]) & (q < limits.position[:, 1]))
    assert np.all(np.abs(dq) <= limits.velocity)
    assert np.all(np.abs(ddq) <= 3.0)
    assert np.all(np.abs(robot.inverse_dynamics(q, dq, ddq)) <= limits.torque)
    for state in (dq, ddq):
        assert np.abs(state[[0, -1]]).max() < 1e-9
    np.testing.assert_allclose(q[[0, -1]], np.tile(excitation.middle, (2, 1)), atol=1e-12)


@pytest.mark.parametrize(("duration", "blend"), [(60.0, 0.5), (20.0, 0.1), (5.003, 0.5)])
def test_limits_and_rest_hold_for_long_motions_short_blends_and_odd_times(duration, blend):
    robot = load_planar_arm()

    excitation = design_excitation(robot, duration=duration, blend=blend, iterations=0)

    time, _, dq, ddq = excitation.sample(1000.0)
    limits = MotionLimits().resolved(robot)
    assert time[-1] == duration
    assert np.all(np.abs(dq).max(0) <= 1.001 * limits.velocity)
    assert np.all(np.abs(ddq).max(0) <= 1.001 * limits.acceleration)
    assert np.abs(ddq[-1]).max() < 1e-9


@pytest.mark.slow
def test_a_workspace_moves_the_motion_and_does_not_only_shrink_it():
    robot = load_planar_arm()
    box = np.array([[-0.1, 0.3], [-1.0, 1.0], [-0.3, 0.3]])
    asked = {"duration": 6.0, "iterations": 15}

    kept = design_excitation(robot, limits=MotionLimits(workspace=box), **asked)

    position, _ = robot.forward_kinematics(kept.sample(500.0)[1])
    assert np.all((position >= box[:, 0]) & (position <= box[:, 1]))
    assert np.ptp(position[:, 0]) > 0.2  # of the 0.4 m there are
    called = MotionLimits(workspace=lambda p: np.minimum(p - box[:, 0], box[:, 1] - p).min(axis=1))
    same = design_excitation(robot, limits=called, **asked)
    np.testing.assert_allclose(same.weights, kept.weights, atol=1e-3)


def test_torque_limits_hold_for_the_robot_or_for_the_fitted_model_with_its_friction():
    robot = load_planar_arm()
    limits = MotionLimits(torque=[9.0, 2.0])
    log = make_hidden_effect_log(robot, None, n_trajectories=3, duration=4.0)
    truth = robot.inverse_dynamics(*(log.X[[f"{s}1", f"{s}2"]] for s in ("q", "dq", "ddq")))
    sliding = np.sign(log.X[["dq1", "dq2"]].to_numpy())
    model = RBDRegressor(robot).fit(log.X, truth + 2.0 * sliding * [1.0, 0.2])

    rigid = design_excitation(robot, limits=limits, **FAST).to_frame(500.0)
    whole = design_excitation(model, limits=limits, **FAST).to_frame(500.0)

    def largest(frame):
        return np.abs(model.predict(frame.assign(trajectory=0)[list(log.X)])).max(0)

    assert np.any(largest(rigid) > limits.torque)
    assert np.all(largest(whole) <= limits.torque)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("criterion", "motion"), [("determinant", "fourier"), ("condition", "quintic")]
)
def test_the_descent_tells_more_than_the_best_of_random_motions(criterion, motion):
    robot = load_ur5()

    random, designed = (
        design_excitation(robot, duration=8.0, motion=motion, criterion=criterion, iterations=k)
        for k in (0, 5)
    )

    if criterion == "determinant":
        assert designed.log_determinant > random.log_determinant + 5
    else:
        assert designed.condition_number < 0.9 * random.condition_number


def test_parameters_are_identified_from_the_motion():
    robot = load_planar_arm()
    excitation = design_excitation(robot, duration=10.0, iterations=4)
    frame = excitation.to_frame(200.0).assign(trajectory=0)
    states = excitation.sample(200.0)[1:]
    truth = robot.inertial_parameters * 1.2
    torque = robot.inverse_dynamics(*states, parameters=truth)
    torque += 0.05 * np.random.default_rng(0).normal(size=torque.shape)

    model = RBDRegressor(robot).fit(frame, torque)

    left = robot.inverse_dynamics(*states, parameters=model.inertial_parameters_) - torque
    assert np.sqrt(np.mean(left**2)) < 0.06


def test_what_cannot_be_designed_is_refused():
    robot = load_planar_arm()
    with pytest.raises(SkidynError, match="no motion was found within the limits of torque"):
        design_excitation(robot, limits=MotionLimits(torque=[1e-9, 1e-9]), **FAST)
    with pytest.raises(SkidynError, match="criterion='trace'"):
        design_excitation(robot, criterion="trace", **FAST)
    with pytest.raises(SkidynError, match="motion='spline'"):
        design_excitation(robot, motion="spline", **FAST)
    with pytest.raises(SkidynError, match="is too short"):
        design_excitation(robot, duration=1.0)
