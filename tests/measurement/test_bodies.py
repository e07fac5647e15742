# SPDX-License-Identifier: BSD-3-Clause
"""Torque against what a robot with bodies and friction can have."""

from dataclasses import replace

import numpy as np
import pytest

from skidyn.datasets import load_ur5, make_hidden_effect_log
from skidyn.logs import check_log
from skidyn.measurement import Measurement, check_measurement


def test_torque_of_something_else(recorded, told_of):
    wave = np.random.default_rng(4).normal(size=len(recorded.frame))
    wave = np.convolve(wave, np.hanning(80), "same")
    other = recorded.frame.assign(tau2=recorded.frame["tau2"].std() * wave / wave.std())
    assert told_of(other)["unexplained"].joints == (2,)


@pytest.mark.slow
def test_a_heavy_payload_in_half_of_many_recordings_is_no_mistake():
    robot = load_ur5()
    names = {name: [f"{name}{j + 1}" for j in range(6)] for name in ("q", "dq", "tau")}
    options = {"n_trajectories": 10, "duration": 6.0, "random_state": 2}
    frame = make_hidden_effect_log(robot, None, **options).frame
    carried = frame["trajectory"].isin([1, 3, 4, 5, 8]).to_numpy()
    q, dq = (frame[names[name]].to_numpy() for name in ("q", "dq"))
    columns = robot.torque_regressor(q, dq, np.gradient(dq, 0.01, axis=0))[..., -10:]
    body = [3.5, -0.1, 0.1, 0.28, 0.03, 0.0, 0.0, 0.03, 0.0, 0.01]  # 3.5 kg, 8 cm from the flange
    frame.loc[carried, names["tau"]] += (columns @ body)[carried]
    told = check_log(frame, robot).checks
    assert not [s.suspicion for s in told if s.certainty != "noted"]


def test_stated_bodies_concern_only_those_who_keep_them(arm, signals, torque):
    torque = torque.copy()
    torque[:, 1] += 9 * np.cos(signals.q.sum(1))  # a weight that the description lacks

    def certainty(identified):
        names = ("shoulder", "elbow")
        told = check_measurement(Measurement(signals, torque, arm, names, identified))
        for s in told:
            if s.check == "bodies":
                assert "times on joint 2 (elbow)" in s.evidence and "-0" not in s.evidence
                return s.certainty
        return None

    assert certainty(False) == "suspected"
    assert certainty(None) == "noted"
    assert certainty(True) is None


def test_slow_noise_that_a_function_of_the_position_could_follow(recorded, told_of):
    rng = np.random.default_rng(6)
    frame = recorded.frame.copy()
    for _, own in frame.groupby("trajectory"):
        wave = np.convolve(rng.normal(size=len(own) + 400), np.hanning(200), "same")[200:-200]
        frame.loc[own.index, "tau2"] = wave * frame["tau2"].std() / wave.std()
    assert told_of(frame)["unexplained"].joints == (2,)


@pytest.mark.parametrize("factor", [1e-3, pytest.param(1e3, marks=pytest.mark.slow)])
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
