# SPDX-License-Identifier: BSD-3-Clause
"""What is accepted of bounded and small explanations."""

import warnings

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, load_scara, load_ur5, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor


@pytest.mark.slow
def test_friction_whose_presliding_is_too_short_to_be_seen_is_coulomb_friction(arm_log, found_in):
    kinds = found_in(load_planar_arm(), arm_log.X, arm_log.y, effects=["viscous"])

    assert kinds == {"coulomb": {1, 2}}


@pytest.mark.slow
def test_offsets_beside_friction_that_differs_between_directions_are_offsets(arm_log, found_in):
    speed = np.abs(arm_log.X["dq1"].to_numpy())
    torque = np.array(arm_log.y)
    size = np.std(torque, axis=0)
    torque[:, 0] += 0.3 * size[0] * speed**0.8
    torque[:, 1] -= 0.3 * size[1]

    found = found_in(load_planar_arm(), arm_log.X, torque)

    assert found == {"asymmetric_friction": {1}, "offset": {2}}


@pytest.mark.slow
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


@pytest.mark.slow
def test_stops_of_two_joints_are_stops_where_one_recording_alone_reaches_one_of_them(found_in):
    robot = load_scara()
    log = make_hidden_effect_log(robot, "end_stop", joints=(1, 4), noise="high", random_state=0)

    assert found_in(robot, log.X, log.y) == {"end_stop": {1, 4}}


@pytest.mark.slow
def test_a_coupling_that_bodies_make_the_same_on_another_pair_of_joints_names_both_pairs():
    robot = load_scara()
    log = make_hidden_effect_log(
        robot, "coupled_inertia", joints=(1, 4), noise="low", random_state=3
    )
    model = RBDRegressor(robot, effects=["viscous", "coulomb", "rotor_inertia"])

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        (finding,) = diagnose(model, log.X, log.y, checks=()).findings

    assert {finding.joints, *finding.elsewhere} == {(1, 4), (2, 4)}
    assert finding.confidence < 0.5
    assert "equally well on joints 2 and 4" in finding.sentence


def test_what_depends_on_another_joint_without_a_reaction_is_no_coupling():
    log = make_hidden_effect_log(
        load_ur5(), None, noise="low", n_trajectories=8, duration=5.0, random_state=2
    )
    X, torque = log.X, log.y.copy()
    change = X["ddq2"] / X["ddq2"].std()
    torque[:, 4] += 0.5 * torque[:, 4].std() * change

    diagnosis = diagnose(RBDRegressor(log.robot), X, torque, effects=["coupled_inertia"], checks=())

    assert not [f for f in diagnosis.findings if f.kind == "coupled_inertia"]
    assert diagnosis.verdict == "unknown"


@pytest.mark.slow
def test_friction_without_a_reaction_does_not_hide_that_of_a_coupling():
    log = make_hidden_effect_log(
        load_ur5(), "coupled_friction", joints=(2, 3), noise="low", n_trajectories=8, random_state=2
    )
    X, torque = log.X, log.y.copy()
    torque[:, 4] += 0.3 * torque[:, 4].std() * np.sign(X["dq2"] + 1.1 * X["dq5"])
    model = RBDRegressor(log.robot, effects=["viscous", "coulomb"])

    diagnosis = diagnose(model, X, torque, effects=["coupled_friction"], checks=())

    found = {(f.kind, f.joints) for f in diagnosis.findings}
    assert found == {("coupled_friction", (2, 3)), ("unknown", (5,))}


@pytest.mark.slow
def test_a_floor_that_explains_all_that_a_larger_force_leaves_is_no_error_of_the_force(found_in):
    """Nor is the force withdrawn because it increases the error until the floor is found."""
    robot = load_ur5()
    log = make_hidden_effect_log(robot, "environment_contact", n_trajectories=8, duration=6.0)
    q = log.X[[f"q{j + 1}" for j in range(robot.n_joints)]].to_numpy()
    pulled = np.isin(log.X["trajectory"], (1, 4, 6))
    torque = np.array(log.y)
    force = np.array([28.0, 38.0, 14.0, 0.0, 0.0, 0.0])
    torque[pulled] += np.einsum("nij,i->nj", robot.jacobian(q[pulled]), force)

    found = set(found_in(robot, log.X, torque))

    assert found == {"external_wrench", "environment_contact"}


def test_a_gain_may_be_that_of_the_other_joint_where_masses_are_identified():
    log = make_hidden_effect_log(
        load_planar_arm(), None, noise="low", n_trajectories=6, duration=5.0, random_state=4
    )

    (finding,) = diagnose(RBDRegressor(log.robot), log.X, log.y * [1.2, 1.0], checks=()).findings

    assert (finding.kind, finding.joints) == ("torque_gain", (1,))
    assert finding.elsewhere == ((2,),)
    assert finding.confidence < 0.5
    assert "It would explain the data equally well on joint 2." in finding.sentence
