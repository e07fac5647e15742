# SPDX-License-Identifier: BSD-3-Clause
"""Several effects at once, and effects that become each other."""

import warnings

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, load_scara, load_ur5, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor


def found_in(robot, X, y, effects=("viscous", "coulomb")):
    """Kinds and joints of what is named where the model has some effects."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        diagnosis = diagnose(RBDRegressor(robot, effects=list(effects)), X, y)
    together = {}
    for finding in diagnosis.findings:
        together.setdefault(finding.kind, set()).update(finding.joints)
    return together


@pytest.fixture(scope="module")
def arm_log():
    return make_hidden_effect_log(load_planar_arm(), None, noise="low", random_state=4)


def test_a_tilted_base_is_found_beside_large_friction_that_is_missing():
    robot = load_ur5()
    log = make_hidden_effect_log(
        robot, None, noise="low", n_trajectories=4, duration=4.0, random_state=6
    )
    q = log.X[[f"q{j}" for j in range(1, 7)]].to_numpy()
    still = np.zeros_like(q)
    tilted = (9.81 * np.sin(np.deg2rad(3)), 0.0, -9.81 * np.cos(np.deg2rad(3)))
    tilt = robot.inverse_dynamics(q, still, still, gravity=tilted)
    tilt -= robot.inverse_dynamics(q, still, still)

    kinds = found_in(robot, log.X, log.y + tilt, effects=["coulomb", ("viscous", [4, 5, 6])])

    assert kinds == {"viscous": {1, 2, 3}, "base_tilt": {1, 2, 3, 4, 5, 6}}


def test_friction_whose_presliding_is_too_short_to_be_seen_is_coulomb_friction(arm_log):
    kinds = found_in(load_planar_arm(), arm_log.X, arm_log.y, effects=["viscous"])

    assert kinds == {"coulomb": {1, 2}}


def test_fast_motion_under_a_precise_torque_makes_no_joint_elastic():
    log = make_hidden_effect_log(load_scara(), None, noise="low", random_state=1022)

    assert found_in(load_scara(), log.X, log.y) == {}


def test_a_limit_of_the_drive_is_read_although_the_friction_had_bent_toward_it(arm_log):
    torque = np.array(arm_log.y)
    limit = 0.55 * np.abs(torque[:, 1]).max()
    torque[:, 1] = np.clip(torque[:, 1], -limit, limit)

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        (finding,) = diagnose(RBDRegressor(load_planar_arm()), arm_log.X, torque).findings

    assert (finding.kind, finding.joints) == ("saturation", (2,))
    assert finding.parameters["limit"]["value"] == pytest.approx(limit, rel=0.02)
    assert finding.parameters["share"]["value"] == pytest.approx(1.0, abs=0.05)


def test_friction_that_falls_while_a_gear_warms_up_is_one_drift(arm_log):
    time, dq = arm_log.X["time"].to_numpy(), arm_log.X["dq1"].to_numpy()
    since = time - time.min()
    warm = 1 - np.exp(-since / (0.3 * np.ptp(time)))
    torque = np.array(arm_log.y)
    torque[:, 0] -= 0.8 * warm * dq

    kinds = found_in(load_planar_arm(), arm_log.X, torque)

    assert kinds == {"friction_drift": {1}}


def test_stops_of_two_joints_are_stops_where_one_recording_alone_reaches_one_of_them():
    robot = load_scara()
    log = make_hidden_effect_log(robot, "end_stop", joints=(1, 4), noise="high", random_state=0)

    assert found_in(robot, log.X, log.y) == {"end_stop": {1, 4}}


def test_a_coupling_that_bodies_make_the_same_on_another_pair_of_joints_names_both_pairs():
    robot = load_scara()
    log = make_hidden_effect_log(
        robot, "coupled_inertia", joints=(1, 4), noise="low", random_state=3
    )
    model = RBDRegressor(robot, effects=["viscous", "coulomb", "rotor_inertia"])

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        (finding,) = diagnose(model, log.X, log.y).findings

    assert {finding.joints, *finding.elsewhere} == {(1, 4), (2, 4)}
    assert finding.confidence < 0.5
    assert "equally well on joints 2 and 4" in finding.sentence


def test_a_narrow_bump_is_one_function_of_the_position_and_not_a_spring_and_a_stop(arm_log):
    q = arm_log.X["q1"].to_numpy()
    middle, span = np.median(q), np.ptp(q)
    torque = np.array(arm_log.y)
    torque[:, 0] += np.std(torque[:, 0]) * np.exp(-(((q - middle) / (0.12 * span)) ** 2))

    assert found_in(load_planar_arm(), arm_log.X, torque) == {"unknown": {1}}


def test_a_cable_that_only_pulls_between_two_joints(arm_log):
    q = arm_log.X[["q1", "q2"]].to_numpy()
    x = q[:, 0] - 0.8 * q[:, 1]
    torque = np.array(arm_log.y)
    pull = np.std(torque[:, 1]) * np.maximum(0.0, x - np.median(x))
    torque += pull[:, None] * [1.0, -0.8]

    assert found_in(load_planar_arm(), arm_log.X, torque) == {"coupling_spring": {1, 2}}


def test_what_passes_on_another_share_of_torque_than_of_way_is_no_spring(arm_log):
    q = arm_log.X[["q1", "q2"]].to_numpy()
    torque = np.array(arm_log.y)
    pull = 0.5 * np.std(torque[:, 1]) * np.cos(q[:, 0] - q[:, 1])
    torque += pull[:, None] * [1.0, -0.5]

    assert found_in(load_planar_arm(), arm_log.X, torque) == {"unknown": {1, 2}}
