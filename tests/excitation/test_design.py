# SPDX-License-Identifier: BSD-3-Clause
"""Designed motions keep every limit and tell more than random ones."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from skidyn._exceptions import SkidynError
from skidyn.datasets import load_planar_arm, load_scara, load_ur5
from skidyn.excitation import MotionLimits, design_excitation
from skidyn.rigid_body import RBDRegressor

FAST = {"duration": 6.0, "iterations": 4}


@pytest.mark.parametrize("load", [load_planar_arm, load_scara, load_ur5])
def test_every_limit_holds_and_the_motion_starts_and_ends_at_rest(load):
    robot = load()
    given = MotionLimits(acceleration=np.full(robot.n_joints, 3.0))

    excitation = design_excitation(robot, limits=given, **FAST)

    limits = given.resolved(robot)
    _, q, dq, ddq = excitation.sample(1000.0)
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


def test_torque_and_workspace_limits_shrink_the_motion():
    robot = load_planar_arm()
    free = design_excitation(robot, **FAST)
    position, _ = robot.forward_kinematics(free.sample(500.0)[1])
    box = np.column_stack([position.min(0) - 1e-6, position.max(0) + 1e-6])
    box[np.argmax(np.ptp(position, axis=0)), 1] = np.mean(box[np.argmax(np.ptp(position, axis=0))])

    bound = MotionLimits(workspace=box)
    kept = design_excitation(robot, limits=bound, **FAST)

    position, _ = robot.forward_kinematics(kept.sample(500.0)[1])
    assert np.all((position >= box[:, 0]) & (position <= box[:, 1]))
    called = MotionLimits(workspace=lambda p: np.all((p >= box[:, 0]) & (p <= box[:, 1]), axis=1))
    same = design_excitation(robot, limits=called, **FAST)
    np.testing.assert_array_equal(same.weights, kept.weights)


@pytest.mark.parametrize("criterion", ["determinant", "condition"])
def test_the_descent_tells_more_than_the_best_of_random_motions(criterion):
    robot = load_ur5()

    random, designed = (
        design_excitation(robot, duration=8.0, criterion=criterion, iterations=k) for k in (0, 4)
    )

    if criterion == "determinant":
        assert designed.log_determinant > random.log_determinant + 5
    else:
        assert designed.condition_number < random.condition_number


def test_what_was_recorded_already_is_not_told_again():
    robot = load_planar_arm()
    t = np.linspace(0, 6, 300)
    wave = np.column_stack([np.sin(3 * t), 0 * t])
    only_first = (wave, 3 * np.column_stack([np.cos(3 * t), 0 * t]), -9 * wave)

    alone = design_excitation(robot, **FAST)
    together = design_excitation(robot, recorded=[only_first], **FAST)

    assert together.log_determinant > alone.log_determinant


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


def test_csv_holds_the_motion(tmp_path):
    excitation = design_excitation(load_planar_arm(), duration=2.0, iterations=0)

    excitation.to_csv(tmp_path / "motion.csv", rate=50.0)

    table = pd.read_csv(tmp_path / "motion.csv")
    np.testing.assert_allclose(table["ddq2"], excitation.sample(50.0)[3][:, 1])


def test_limits_that_leave_no_room_are_refused_by_joint():
    robot = load_planar_arm()
    with pytest.raises(SkidynError, match=r"joint 2 \(joint2\) leave no room"):
        design_excitation(robot, limits=MotionLimits(position=[[-1, 1], [1, -1]]), **FAST)
    with pytest.raises(SkidynError, match=r"velocity limits have shape \(3,\); \(2,\)"):
        design_excitation(robot, limits=MotionLimits(velocity=[1, 1, 1]), **FAST)
    with pytest.raises(SkidynError, match="no motion .* keeps the torque"):
        design_excitation(robot, limits=MotionLimits(torque=[1e-9, 1e-9]), **FAST)
    with pytest.raises(SkidynError, match="criterion='trace'"):
        design_excitation(robot, criterion="trace", **FAST)
