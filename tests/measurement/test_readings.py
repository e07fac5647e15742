# SPDX-License-Identifier: BSD-3-Clause
"""Signs, order and zeros of the columns, and gravity in them."""

import re
from dataclasses import replace

import numpy as np
import pytest

from skidyn.datasets import (
    load_panda,
    load_planar_arm,
    load_scara,
    load_ur5,
    make_hidden_effect_log,
)
from skidyn.logs import check_log


@pytest.mark.parametrize("joint", [0, 1])
def test_torque_with_the_other_sign(joint, signals, torque, found, only):
    sign = np.where(np.arange(2) == joint, -1, 1)
    only(found(signals, torque * sign), "reading", "certain", f"--flip tau{joint + 1}")


def test_exchanged_torques(recorded, told_of):
    frame = recorded.frame.assign(tau1=recorded.frame["tau2"], tau2=recorded.frame["tau1"])
    reading = told_of(frame)["reading"]
    assert reading.certainty == "certain" and reading.remedy.option == "--order tau=2,1"


def test_torque_without_gravity(arm, signals, torque, found, only):
    told = found(signals, torque - arm.gravity_torque(signals.q))
    only(told, "reading", told[0].certainty, "--gravity none")


def test_zero_of_a_joint(signals, torque, found):
    told = found(signals.with_(q=signals.q + [0.0, 1.0]), torque)
    assert [s.check for s in told] == ["reading"]
    value = float(re.search(r"--zero q2=(\S+)", told[0].evidence)[1])
    assert told[0].remedy is None and value == pytest.approx(1.0, abs=0.02)


def test_a_last_body_whose_weight_points_elsewhere_is_no_certain_zero(signals, torque, found):
    told = found(signals.with_(q=signals.q + [0.0, np.deg2rad(16)]), torque)
    (reading,) = [s for s in told if s.check == "reading"]
    assert (reading.certainty, reading.joints) == ("noted", (2,))
    assert "bodies that differ from the description" in reading.suspicion


def test_a_zero_of_some_degrees_is_suspected():
    log = make_hidden_effect_log(load_ur5(), None, n_trajectories=4, duration=6.0, random_state=2)
    shifted = log.frame.assign(q2=log.frame["q2"] + np.deg2rad(5))
    (told,) = [s for s in check_log(shifted, log.robot).checks if s.check == "reading"]
    assert told.certainty != "noted" and told.joints == (2,)
    name, _, angle = told.remedy.option.partition("=")
    assert name == "--zero q2" and np.rad2deg(float(angle)) == pytest.approx(5, abs=1.5)


def test_a_last_body_whose_weight_points_hardly_elsewhere_is_not_told(signals, torque, found):
    told = found(signals.with_(q=signals.q + [0.0, np.deg2rad(6)]), torque)
    assert "reading" not in {s.check for s in told}


def test_a_small_tilt_of_the_base_is_no_zero_of_an_upright_first_joint():
    """It is an effect, which a diagnosis finds, in all recordings and in single ones."""
    robot = load_ur5()
    log = make_hidden_effect_log(robot, None, n_trajectories=4, duration=6.0, random_state=2)
    tilt = np.deg2rad(12)
    leaning = replace(robot, gravity=9.81 * np.array([0.0, np.sin(tilt), -np.cos(tilt)]))
    told = {s.check for s in check_log(log.frame, leaning).checks if s.certainty != "noted"}
    assert not told & {"reading", "odd_recording", "divided_recordings"}


def test_a_joint_that_counts_the_other_way_from_another_zero(signals, torque, found):
    sign, zero = np.array([1, -1]), np.array([0, np.pi / 2])
    turned = signals.with_(q=zero + sign * signals.q, dq=sign * signals.dq, ddq=sign * signals.ddq)
    told = [s for s in found(turned, sign * torque) if s.certainty != "noted"]
    assert [s.remedy.option for s in told] == ["--flip q2,tau2", "--zero q2=-1.5708"]


@pytest.mark.slow
def test_a_torque_that_is_turned_round_twice_is_as_it_was():
    """The sign of all torques is found first, and then that of joint 1 again."""
    robot = load_ur5()
    log = make_hidden_effect_log(robot, None, n_trajectories=4, duration=6.0, random_state=2)
    others = {f"tau{k}": -log.frame[f"tau{k}"] for k in range(2, 7)}
    told = {s.check: s for s in check_log(log.frame.assign(**others), robot).checks}["reading"]
    assert told.joints == (2, 3, 4, 5, 6)
    assert told.remedy.option == "--flip tau2,tau3,tau4,tau5,tau6"


def test_upside_down_goes_before_a_first_joint_half_a_turn_off(arm, recorded, told_of):
    told = told_of(recorded.frame, replace(arm, gravity=-arm.gravity))["reading"]
    assert told.remedy.option == "--gravity=0,0,-9.81" and told.certainty == "suspected"
    assert "zero" in told.evidence


@pytest.mark.slow
def test_zeros_of_two_joints_are_refined_together():
    log = make_hidden_effect_log(
        load_panda(), None, n_trajectories=5, duration=6.0, random_state=9700101
    )
    frame = log.frame.assign(q5=log.frame["q5"] - 0.74, q6=log.frame["q6"] + 1.89)
    told = {s.check: s for s in check_log(frame, log.robot).checks}["reading"]
    values = dict(x.split("=") for x in told.remedy.option.removeprefix("--zero ").split(","))
    assert float(values["q5"]) == pytest.approx(-0.74, abs=0.01)
    assert float(values["q6"]) == pytest.approx(1.89, abs=0.01)


def test_a_zero_is_within_half_a_turn(signals, torque, found):
    told = found(signals.with_(q=signals.q + [0.0, 3.0]), torque)
    value = float(re.search(r"--zero q2=(\S+)", told[0].evidence)[1])
    assert value == pytest.approx(3.0, abs=0.02)


@pytest.mark.slow
def test_gravity_that_was_removed_with_bodies_that_are_not_those_of_the_robot():
    """The rest of it that is left looks like another scale of single torques."""
    robot = load_panda()
    log = make_hidden_effect_log(
        robot, "stribeck", n_trajectories=5, duration=6.0, random_state=9700202
    )
    names = [f"tau{k + 1}" for k in range(7)]
    pull = robot.gravity_torque(log.frame[[f"q{k + 1}" for k in range(7)]].to_numpy())
    changes = dict(zip(names, (log.frame[names].to_numpy() - pull).T, strict=True))
    told = {s.check: s for s in check_log(log.frame.assign(**changes), robot).checks}["reading"]
    assert told.remedy.option == "--restore-gravity"


def test_a_zero_of_a_last_joint_is_noted_beside_a_load():
    arm = load_planar_arm()
    options = {"n_trajectories": 5, "duration": 6.0, "random_state": 7319358}
    frame = make_hidden_effect_log(arm, None, **options).frame
    assert "reading" not in {s.check for s in check_log(frame, arm).checks}
    told = check_log(frame.assign(q2=frame["q2"] - 1.3), arm).checks
    (one,) = [s for s in told if s.check == "reading"]
    assert one.certainty == "noted" and one.suspicion.startswith("either the zero of joint 2")
    assert one.remedy is None and "--zero q2=-1." in one.evidence


def test_the_angle_of_a_first_joint_is_not_taken_for_gravity_along_an_axis():
    arm = load_planar_arm()
    options = {"n_trajectories": 5, "duration": 6.0, "random_state": 7319358}
    frame = make_hidden_effect_log(arm, None, **options).frame
    told = check_log(frame.assign(q1=frame["q1"] - 1.274), arm).checks
    (one,) = [s for s in told if s.check == "reading"]
    name, _, angle = one.remedy.option.partition("=")
    assert name == "--zero q1" and float(angle) == pytest.approx(-1.274, abs=0.02)


def test_the_weight_of_a_slider_shows_along_which_axis_gravity_is():
    robot = load_scara()
    log = make_hidden_effect_log(robot, None, n_trajectories=4, duration=5.0, random_state=2)
    on_the_wall = replace(robot, gravity=np.array([9.81, 0.0, 0.0]))
    (told,) = [s for s in check_log(log.frame, on_the_wall).checks if s.certainty != "noted"]
    assert told.check == "reading" and told.remedy.option == "--gravity=0,0,-9.81"


@pytest.mark.slow
def test_a_load_of_some_recordings_hides_no_sign():
    robot = load_scara()
    options = {"n_trajectories": 5, "duration": 6.0, "random_state": 5}
    frame = make_hidden_effect_log(robot, "payload", **options).frame
    assert not [s for s in check_log(frame, robot).checks if s.certainty != "noted"]
    changed = frame.assign(tau3=-frame["tau3"])
    (told,) = [s for s in check_log(changed, robot).checks if s.certainty != "noted"]
    assert told.check == "reading" and told.remedy.option == "--flip tau3"


@pytest.mark.slow
def test_a_load_of_some_recordings_does_not_hide_removed_gravity(loaded):
    assert not [s for s in loaded.checks if s.certainty != "noted"]
    changed = without_gravity(loaded.frame, loaded.robot)
    (told,) = [s for s in check_log(changed, loaded.robot).checks if s.certainty != "noted"]
    assert told.check == "reading" and told.remedy.option == "--restore-gravity"


def without_gravity(frame, robot):
    """The log without the gravity of the stated bodies."""
    n = robot.n_joints
    pull = robot.gravity_torque(frame[[f"q{k + 1}" for k in range(n)]].to_numpy())
    return frame.assign(**{f"tau{k + 1}": frame[f"tau{k + 1}"] - pull[:, k] for k in range(n)})


def test_a_base_that_is_tilted_in_some_recordings_is_no_zero():
    robot = load_panda().with_gravity((9.81, 0, 0))
    log = make_hidden_effect_log(robot, "coulomb", n_trajectories=6, duration=6.0, random_state=4)
    tilted = 9.81 * np.array([np.cos(np.radians(8)), np.sin(np.radians(8)), 0.0])
    rows = (log.frame["trajectory"] <= 4).to_numpy()
    torques, positions = ([f"{name}{k + 1}" for k in range(7)] for name in ("tau", "q"))
    q = log.frame[positions].to_numpy()
    pull = robot.gravity_torque(q, gravity=tilted) - robot.gravity_torque(q)
    log.frame.loc[rows, torques] += pull[rows]
    told = {told.check for told in check_log(log.frame, robot).checks if told.certainty != "noted"}
    assert "reading" not in told
