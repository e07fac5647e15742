# SPDX-License-Identifier: BSD-3-Clause
"""Output error: what noisy motion does to least squares, a simulation does not feel."""

import numpy as np
import pandas as pd
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.exceptions import ColumnError, SkidynError
from skidyn.identification import RBDRegressor, is_consistent
from skidyn.simulation import Controller, servo_torque, simulate, simulation_errors


@pytest.fixture(scope="module")
def clean():
    return make_hidden_effect_log(
        load_planar_arm(), None, n_trajectories=4, duration=8.0, random_state=0
    )


@pytest.mark.slow
def test_simulates_better_than_least_squares_of_a_slow_log(clean):
    """At 12.5 Hz accelerations are smoothed away, which biases least squares."""
    train = (clean.frame["trajectory"] <= 3).to_numpy()
    few = np.flatnonzero(train)[::8]
    X, y = clean.X.iloc[few], clean.y[few]
    models = [
        RBDRegressor(clean.robot, estimator=e).fit(X, y) for e in ("weighted", "output_error")
    ]
    scores = [simulation_errors(m, clean.X[~train], clean.y[~train]).score for m in models]
    assert scores[1] < 0.95 * scores[0]
    assert np.all(np.isfinite(models[1].coef_std_)) and np.all(models[1].coef_std_ > 0)
    low, high = models[1].predict_interval(clean.X[~train])
    assert np.all(low < high)


@pytest.mark.slow
def test_exact_data_keep_the_exact_model(clean):
    """What least squares has right already, a simulation does not spoil."""
    frame = clean.X[clean.frame["trajectory"] == 1].reset_index(drop=True)
    model = RBDRegressor(clean.robot).fit(clean.X, clean.y)
    wanted = frame.assign(q_ref1=frame["q1"], q_ref2=frame["q2"])
    controller = Controller(stiffness=300.0, damping=20.0)
    motion = simulate(model, wanted, controller=controller)
    torque = controller.checked(2).torque(
        motion[["q1", "q2"]].to_numpy(),
        motion[["dq1", "dq2"]].to_numpy(),
        frame[["q1", "q2"]].to_numpy(),
        np.gradient(frame[["q1", "q2"]].to_numpy(), frame["time"], axis=0),
    )
    X = motion[["time", "q1", "q2", "dq1", "dq2"]]
    plain = simulation_errors(RBDRegressor(clean.robot).fit(X, torque), X, torque)
    refined = RBDRegressor(clean.robot, estimator="output_error").fit(X, torque)
    again = simulation_errors(refined, X, torque)
    assert again.score < 1.05 * plain.score < 0.05


@pytest.fixture(scope="module")
def servo_log(clean):
    """An arm with friction in a position servo, logged without noise, and what drives it."""
    arm = RBDRegressor(clean.robot, ("viscous", "coulomb"), "nominal").fit(clean.X, clean.y)
    frame = clean.X[clean.frame["trajectory"] <= 2].reset_index(drop=True)
    wanted = frame.assign(cmd1=frame["q1"], cmd2=frame["q2"])
    servo = Controller(stiffness=60.0, follows_velocity=False)
    motion = simulate(arm, wanted, controller=servo, horizon=None)
    log = wanted[["time", "cmd1", "cmd2"]]
    log = log.assign(trajectory=np.arange(len(log)) // 200)  # short ones are simulated together
    return arm, servo, log.assign(**{c: motion[c].to_numpy() for c in ("q1", "q2", "dq1", "dq2")})


@pytest.mark.slow
def test_commands_drive_the_model_through_a_controller(servo_log):
    """A torque whose constant is wrong is where the fit starts, and not where it ends."""
    arm, servo, log = servo_log
    torque = 0.8 * servo_torque(servo, log)
    model = RBDRegressor(arm.robot, arm.effects, "nominal", estimator="output_error", horizon=None)
    start = RBDRegressor(arm.robot, arm.effects, "nominal").fit(log, torque)
    found = model.fit(log, torque, controller=servo)
    coulomb = [m.effect_coefficients_[m.effect_terms_[2]][0] for m in (arm, start, found)]
    assert abs(coulomb[1] / coulomb[0] - 1) > 0.15
    assert abs(coulomb[2] / coulomb[0] - 1) < 0.03
    errors = [simulation_errors(m, log, controller=servo).position for m in (start, found)]
    assert np.all(errors[1] < 0.9 * errors[0]) and errors[1][0] < 0.1 * errors[0][0]


@pytest.mark.slow
def test_a_controller_needs_commands_and_the_estimator_that_simulates(servo_log):
    arm, servo, log = servo_log
    torque, model = servo_torque(servo, log), RBDRegressor(arm.robot, arm.effects, "nominal")
    with pytest.raises(
        ValueError, match="'weighted' does not accept a controller; 'output_error' does"
    ):
        model.fit(log, torque, controller=servo)
    model.set_params(estimator="output_error")
    with pytest.raises(ValueError, match=r"expected a skidyn\.simulation\.Controller"):
        model.fit(log, torque, controller=60.0)
    with pytest.raises(ColumnError, match="cmd"):
        model.fit(log.drop(columns=["cmd1", "cmd2"]), torque, controller=servo)


def test_consistent_on_request(clean):
    train = clean.frame["trajectory"] <= 2
    model = RBDRegressor(clean.robot, estimator="output_error", consistent=True)
    model.fit(clean.X[train], clean.y[train])
    assert np.all(is_consistent(model.inertial_parameters_))


def test_consistent_starts_from_bodies_that_can_move(clean):
    """Where least squares ends with a negative inertia, nothing could be simulated."""
    X = clean.X[clean.frame["trajectory"] == 1]
    bodies = clean.robot.inertial_parameters.copy()
    bodies[-1, 4:] *= -3.0
    q, dq = (X[[f"{k}1", f"{k}2"]].to_numpy() for k in ("q", "dq"))
    ddq = np.gradient(dq, X["time"], axis=0)
    torque = clean.robot.inverse_dynamics(q, dq, ddq, parameters=bodies)
    words = {"estimator": "output_error", "horizon": 0.25}
    with pytest.raises(SkidynError, match="such bodies cannot be simulated"):
        RBDRegressor(clean.robot, **words).fit(X, torque)
    model = RBDRegressor(clean.robot, consistent=True, **words).fit(X, torque)
    assert np.all(is_consistent(model.inertial_parameters_))


def test_needs_time_and_whole_rows(clean):
    X = pd.DataFrame(np.random.default_rng(0).normal(size=(200, 6)))
    X.columns = [f"{s}{j}" for s in ("q", "dq", "ddq") for j in (1, 2)]
    model = RBDRegressor(clean.robot, estimator="output_error")
    with pytest.raises(SkidynError, match="time"):
        model.fit(X, np.zeros((200, 2)))
    with pytest.raises(AttributeError, match="partial_fit"):
        model.partial_fit(clean.X, clean.y)
