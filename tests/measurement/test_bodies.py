# SPDX-License-Identifier: BSD-3-Clause
"""Torque against what a robot with bodies and friction can have."""

from dataclasses import replace

import numpy as np
import pytest

from skidyn.datasets import (
    load_planar_arm,
    load_scara,
    load_ur5,
    make_hidden_effect_log,
)
from skidyn.logs import check_log
from skidyn.measurement import Measurement, check_measurement


def test_torque_in_newton_millimetres(signals, torque, found, only):
    only(found(signals, 1e3 * torque), "torque_scale", "certain", "--units tau=Nmm")


def test_currents(signals, torque, found):
    told = [s for s in found(signals, torque * 0.05) if s.check == "torque_scale"]
    assert told and "motor currents" in told[0].suspicion


def test_torque_of_something_else(recorded, told_of):
    wave = np.random.default_rng(4).normal(size=len(recorded.frame))
    wave = np.convolve(wave, np.hanning(80), "same")
    other = recorded.frame.assign(tau2=recorded.frame["tau2"].std() * wave / wave.std())
    assert told_of(other)["unexplained"].joints == (2,)


def test_stated_bodies_concern_only_those_who_keep_them(arm, signals, torque):
    torque = torque.copy()
    torque[:, 1] += 9 * np.cos(signals.q.sum(1))  # a weight that the description lacks

    def certainty(identified):
        names = ("shoulder", "elbow")
        told = check_measurement(Measurement(signals, torque, arm, names, identified))
        return next((s.certainty for s in told if s.check == "bodies"), None)

    assert certainty(False) == "suspected"
    assert certainty(None) == "noted"
    assert certainty(True) is None


@pytest.mark.parametrize("factor", [0.25, 4.0])
def test_the_torque_of_one_joint_at_another_scale(factor, recorded, told_of):
    told = told_of(recorded.frame.assign(tau2=factor * recorded.frame["tau2"]))["torque_scale"]
    name, _, size = told.remedy.option.partition("=")
    assert told.joints == (2,) and name == "--gain tau2"
    assert float(size) == pytest.approx(1 / factor, rel=0.1)


def test_a_torque_far_beyond_the_effort_limit(arm, recorded, told_of):
    robot = replace(arm, effort_limits=2 * recorded.frame[["tau1", "tau2"]].abs().max().to_numpy())
    assert "torque_scale" not in told_of(recorded.frame, robot)
    told = told_of(recorded.frame.assign(tau2=1e3 * recorded.frame["tau2"]), robot)["torque_scale"]
    assert told.joints == (2,) and told.remedy.option == "--gain tau2=0.001"


def test_an_effort_limit_that_the_weight_of_the_links_exceeds_is_what_is_wrong(
    arm, recorded, told_of
):
    largest = recorded.frame[["tau1", "tau2"]].abs().max().to_numpy()
    robot = replace(arm, effort_limits=largest * [0.02, 2])
    assert "torque_scale" not in told_of(recorded.frame, robot)


@pytest.mark.parametrize("factor", [0.5, 4.0])
def test_a_rate_that_is_wrong_in_clock_and_velocities(factor, told_of):
    robot = load_ur5()
    frame = make_hidden_effect_log(
        robot, None, n_trajectories=4, duration=4.0, random_state=3
    ).frame
    velocities = {f"dq{k}": frame[f"dq{k}"] / factor for k in range(1, 7)}
    told = told_of(frame.assign(time=factor * frame["time"], **velocities), robot)["torque_scale"]
    assert told.suspicion.startswith("the clock runs at a different rate")
    words = dict(pair.split("=") for pair in told.remedy.option.split(" ")[1].split(","))
    assert float(words["time"]) == pytest.approx(1 / factor, rel=0.1)
    assert float(words["dq"]) == pytest.approx(factor, rel=0.1)


def test_a_unit_beside_an_effect_as_large_as_the_torque_of_the_bodies():
    robot = load_scara()
    log = make_hidden_effect_log(
        robot, "torque_ripple", n_trajectories=5, duration=6.0, magnitude=4.0, random_state=2
    )
    torque = {f"tau{k + 1}": 1e3 * log.frame[f"tau{k + 1}"] for k in range(4)}
    told = {s.check: s for s in check_log(log.frame.assign(**torque), robot).checks}
    assert told["torque_scale"].remedy.option == "--units tau=Nmm"
    assert "torque_scale" not in {s.check for s in check_log(log.frame, robot).checks}


@pytest.fixture(scope="module")
def wrist():
    robot = load_ur5()
    return robot, make_hidden_effect_log(
        robot, "stribeck", n_trajectories=5, duration=5.0, random_state=7
    ).frame


def test_a_last_joint_with_friction_alone_is_in_the_unit_of_the_one_before(wrist):
    robot, frame = wrist
    both = frame.assign(**{n: 1e3 * frame[n] for n in ("tau5", "tau6")})
    (told,) = [s for s in check_log(both, robot).checks if s.certainty != "noted"]
    assert told.joints == (5, 6) and told.remedy.option == "--gain tau5=0.001,tau6=0.001"
    alone = check_log(frame.assign(tau6=1e3 * frame["tau6"]), robot).checks
    (told,) = [s for s in alone if s.check == "torque_scale"]
    assert told.certainty == "noted" and told.joints == (6,)


@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_a_rate_that_leaves_the_scale_of_every_torque(factor):
    robot = load_planar_arm()
    frame = make_hidden_effect_log(
        robot, None, n_trajectories=5, duration=6.0, random_state=7319358
    ).frame
    speeds = {n: frame[n] / factor for n in ("dq1", "dq2")}
    frame = frame.assign(time=frame["time"] * factor, **speeds)
    (told,) = [s for s in check_log(frame, robot).checks if s.certainty != "noted"]
    assert told.remedy.option == f"--gain time={1 / factor:g},dq={factor:g}"


def test_slow_noise_that_a_function_of_the_position_could_follow(recorded, told_of):
    rng = np.random.default_rng(6)
    frame = recorded.frame.copy()
    for _, own in frame.groupby("trajectory"):
        wave = np.convolve(rng.normal(size=len(own) + 400), np.hanning(200), "same")[200:-200]
        frame.loc[own.index, "tau2"] = wave * frame["tau2"].std() / wave.std()
    assert told_of(frame)["unexplained"].joints == (2,)


@pytest.mark.parametrize("factor", [1e-3, 1e3])
def test_a_robot_of_any_weight_is_checked_alike(arm, recorded, factor):
    other = replace(arm, inertial_parameters=factor * arm.inertial_parameters)
    names = [f"tau{k + 1}" for k in range(arm.n_joints)]
    frame = recorded.frame.assign(q1=recorded.frame["q1"] + 0.5)
    heavy = frame.assign(**{name: factor * frame[name] for name in names})
    told, same = check_log(frame, arm).checks, check_log(heavy, other).checks
    assert [(c.check, c.joints, c.certainty) for c in same] == [
        (c.check, c.joints, c.certainty) for c in told
    ]


def test_bodies_that_predict_no_other_recording_are_said(arm, told_of):
    log = make_hidden_effect_log(arm, None, n_trajectories=6, duration=6.0, random_state=8)
    frame = log.frame.copy()
    rng = np.random.default_rng(2)
    # each recording holds the torque of joint 1 of another time of another recording
    parts = [own for _, own in frame.groupby("trajectory")["tau1"]]
    mixed = [parts[k].to_numpy()[::-1] for k in rng.permutation(len(parts))]
    told = told_of(frame.assign(tau1=np.concatenate(mixed)))
    assert told["unexplained"].joints == (1,)
    assert "identified on the other parts of the log" in told["unexplained"].evidence
