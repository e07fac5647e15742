# SPDX-License-Identifier: BSD-3-Clause
"""What could still hide in a log is stated in numbers and words that a user can rely on."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, load_ur5, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor


def limits_of(log, X=None, effects=None):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        diagnosis = diagnose(
            RBDRegressor(log.robot), log.X if X is None else X, log.y, effects=effects, checks=()
        )
    return {(limit.kind, limit.joint): limit for limit in diagnosis.limits}


@pytest.fixture(scope="module")
def log():
    return make_hidden_effect_log(
        load_planar_arm(), None, noise="high", n_trajectories=6, duration=6.0, random_state=3
    )


@pytest.fixture(scope="module")
def limits(log):
    return limits_of(log)


def test_no_limit_is_larger_than_the_torque_itself(log, limits):
    size = np.abs(np.asarray(log.y)).max(0)

    for (kind, joint), limit in limits.items():
        if limit.unit == "N m" and limit.largest_hidden is not None and kind != "saturation":
            assert limit.largest_hidden < size[joint - 1], limit.sentence


@pytest.mark.slow
def test_an_effect_of_twice_the_limit_is_found_and_one_of_a_quarter_is_not(log, limits):
    limit = limits["spring", 2]
    found = []
    for factor in (0.25, 2.0):
        torque = np.array(log.y)
        torque[:, 1] += factor * limit.largest_hidden * log.X["q2"].to_numpy()
        diagnosis = diagnose(RBDRegressor(log.robot), log.X, torque, checks=())
        found.append([(f.kind, f.joints) for f in diagnosis.findings])

    assert found == [[], [("spring", (2,))]]


def test_the_sentence_holds_name_size_and_unit(limits):
    limit = limits["spring", 1]

    assert f"{limit.largest_hidden:.3g} N m/rad" in limit.sentence
    assert "not detected; k above" in limit.sentence


def test_a_temperature_that_is_not_logged_shows_nothing(log):
    X = log.X.drop(columns=[c for c in log.X if c.startswith("temp")])

    limit = limits_of(log, X, ["temperature_friction"])["temperature_friction", 1]

    assert limit.largest_hidden is None
    assert "no temperature is logged" in limit.sentence


def test_motion_at_one_speed_cannot_tell_the_shape_of_friction():
    robot = load_planar_arm()
    rng = np.random.default_rng(0)
    log = make_hidden_effect_log(robot, None, noise="high", random_state=2)
    X = log.X.copy()
    for name in np.unique(X["trajectory"]):  # joint 2 sweeps back and forth at 1 rad/s
        rows = X["trajectory"] == name
        t = X.loc[rows, "time"].to_numpy() - X.loc[rows, "time"].min()
        X.loc[rows, "q2"] = np.abs((t + name / 7) % 4 - 2) - 1
        X.loc[rows, "dq2"] = np.sign((t + name / 7) % 4 - 2)
    q = X[["q1", "q2"]].to_numpy()
    dq = X[["dq1", "dq2"]].to_numpy()
    torque = robot.inverse_dynamics(q, dq, np.zeros_like(q)) + 0.3 * np.sign(dq)
    torque += 0.2 * rng.normal(size=q.shape)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        diagnosis = diagnose(RBDRegressor(robot), X, torque, effects=["stribeck"], checks=())

    (limit,) = [x for x in diagnosis.limits if (x.kind, x.joint) == ("stribeck", 2)]
    assert limit.largest_hidden is None
    assert "constant-speed sweeps" in limit.sentence


def test_a_joint_that_moves_once_has_limits_of_its_few_blocks(complete_log):
    X, robot = complete_log.X.copy(), complete_log.robot
    run = X["trajectory"] == X["trajectory"].iloc[0]
    time = (X["time"] - X["time"].iloc[0]).to_numpy()
    moves = run.to_numpy() & (time > 1.0) & (time < 4.0)
    phase, rate = np.where(moves, time - 1.0, 0.0), 2 * np.pi / 3.0
    X["q2"] = 0.3 + 0.4 * (1.0 - np.cos(rate * phase))
    X["dq2"] = 0.4 * rate * np.sin(rate * phase)
    X["ddq2"] = np.where(moves, 0.4 * rate**2 * np.cos(rate * phase), 0.0)
    motion = [X[[f"{s}{j}" for j in (1, 2)]].to_numpy() for s in ("q", "dq", "ddq")]
    y = robot.inverse_dynamics(*motion) + 0.3 * np.sign(motion[1]) + 0.5 * motion[1]
    y += np.random.default_rng(0).normal(0.0, 0.02, y.shape)

    diagnosis = diagnose(RBDRegressor(robot, ("viscous", "coulomb")), X, y, checks=())

    limits = [x.largest_hidden for x in diagnosis.limits if x.largest_hidden is not None]
    assert limits and np.isfinite(limits).all()


def test_a_ratio_to_a_load_of_rounding_error_is_no_limit():
    # the first axis is vertical: its load at constant speed is zero but for rounding
    log = make_hidden_effect_log(load_ur5(), None, n_trajectories=4, duration=5.0, random_state=5)
    for (_, joint), limit in limits_of(log, effects=["load_dependent_friction"]).items():
        assert limit.largest_hidden is None or limit.largest_hidden < 1e3, joint
