# SPDX-License-Identifier: BSD-3-Clause
"""Logs of commands and positions: gain and delay are found, and models from motion alone move."""

import warnings

import numpy as np
import pandas as pd
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.effects import Term
from skidyn.exceptions import LogWarning, SkidynError
from skidyn.identification import RBDRegressor
from skidyn.simulation import Controller, fit_servo, servo_torque, simulate, simulation_errors

GAIN, DELAY = 60.0, 0.02
EFFECTS = ("viscous", "coulomb")


@pytest.fixture(scope="module")
def servo_log():
    """A planar arm behind position servos, at 50 Hz, with friction and a delay of the command."""
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=3, duration=10.0)
    truth = RBDRegressor(log.robot, EFFECTS, "nominal").fit(log.X, log.y)
    for term in truth.effect_terms_:
        size = {"viscous": 4.0, "coulomb": 1.5}[term.kind] * (1.0, 0.1)[term.places[0]]
        truth.effect_coefficients_[term] = np.array([size])
    wanted = log.X.iloc[::2].reset_index(drop=True)
    wanted = wanted.assign(q_ref1=wanted["q1"], q_ref2=wanted["q2"])
    servo = Controller(stiffness=GAIN, delay=DELAY, follows_velocity=False)
    moved = simulate(truth, wanted, controller=servo, step=5e-3)
    for j in (1, 2):
        moved[f"dq{j}"] = np.gradient(moved[f"q{j}"], moved["time"])
    return log.robot, moved


def test_gain_and_delay_show_by_the_weight(servo_log):
    robot, log = servo_log
    servo = fit_servo(robot, log)
    np.testing.assert_allclose(servo.stiffness, GAIN, rtol=0.1)
    assert servo.delay == pytest.approx(DELAY, abs=0.011)
    shared = fit_servo(robot, log, shared=True)
    np.testing.assert_allclose(shared.stiffness, GAIN, rtol=0.1)


def test_recordings_with_other_gains_are_told(servo_log):
    robot, log = servo_log
    with warnings.catch_warnings():
        warnings.simplefilter("error", LogWarning)
        fit_servo(robot, log)
    other = log.copy()
    last = other["trajectory"] == 3
    for j in (1, 2):  # half the gain needs twice the error
        late = other.loc[last, f"q_ref{j}"].shift(
            1, fill_value=other.loc[last, f"q_ref{j}"].iloc[0]
        )
        other.loc[last, f"q_ref{j}"] += late - other.loc[last, f"q{j}"]
    with pytest.warns(LogWarning, match="differs between recordings: .* in recording 3,"):
        fit_servo(robot, other, shared=True)


def test_friction_from_motion_alone_improves_the_motion_of_a_new_log(servo_log):
    robot, log = servo_log
    train = log["trajectory"] <= 2
    servo = fit_servo(robot, log[train])
    torque = servo_torque(servo, log)
    X = log[["time", "trajectory", "q1", "q2", "dq1", "dq2"]]
    plain = RBDRegressor(robot, (), "nominal").fit(X[train], torque[train])
    whole = RBDRegressor(robot, EFFECTS, "nominal").fit(X[train], torque[train])
    sizes = {t: float(c[0]) for t, c in whole.effect_coefficients_.items()}
    assert sizes[Term("viscous", (1,))] == pytest.approx(4.0, rel=0.2)
    assert sizes[Term("coulomb", (1,))] == pytest.approx(1.5, rel=0.3)
    before, after = (
        simulation_errors(m, log[~train], controller=servo, step=1e-2).position
        for m in (plain, whole)
    )
    assert np.all(after < 0.5 * before)


def test_gain_that_does_not_show_is_refused(servo_log):
    robot, log = servo_log
    blind = log.assign(q_ref2=log["q2"] + np.random.default_rng(0).normal(0, 0.01, len(log)))
    with pytest.raises(SkidynError, match="servo gain of joint2"):
        fit_servo(robot, blind)
    with pytest.raises(SkidynError, match="q_ref1"):
        fit_servo(robot, log.drop(columns="q_ref1"))


def test_torque_of_a_servo_is_limited():
    log = pd.DataFrame({"time": [0.0, 0.1], "q1": 0.0, "dq1": 0.0, "q_ref1": [1.0, 3.0]})
    torque = servo_torque(Controller(2.0, limit=5.0), log)
    np.testing.assert_allclose(torque[:, 0], [2.0, 5.0])
