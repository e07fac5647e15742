# SPDX-License-Identifier: BSD-3-Clause
"""A model in a control loop obeys its own equations, and makes instruments."""

import numpy as np
import pandas as pd
import polars
import pytest
from scipy.signal import butter, filtfilt

from skidyn.datasets import load_planar_arm
from skidyn.effects import Signals
from skidyn.exceptions import ColumnError, SkidynError
from skidyn.identification import RBDRegressor
from skidyn.simulation import Controller, simulate, simulate_closed_loop

ROBOT = load_planar_arm()
MOTION = [f"{s}{j}" for s in ("q", "dq", "ddq") for j in (1, 2)]
STIFFNESS, DAMPING = np.array([300.0, 200.0]), 30.0


def make_reference(duration=10.0, rate=500.0, seed=1):
    """A multi-sine with its exact derivative."""
    rng, time = np.random.default_rng(seed), np.arange(0, duration, 1 / rate)
    table = {"time": time}
    for j in (1, 2):
        a, b = rng.normal(0, 0.5, (2, 5)) / np.arange(1, 6)
        angle = 2 * np.pi * 0.2 * np.arange(1, 6) * time[:, None]
        table[f"q{j}"] = np.sin(angle) @ a + np.cos(angle) @ b
        speed = 2 * np.pi * 0.2 * np.arange(1, 6)
        table[f"dq{j}"] = np.cos(angle) @ (a * speed) - np.sin(angle) @ (b * speed)
    return pd.DataFrame(table)


def torque(table, viscous=0.5):
    q, dq, ddq = table[MOTION].to_numpy().reshape(-1, 3, 2).transpose(1, 0, 2)
    return (
        ROBOT.inverse_dynamics(q, dq, ddq)
        + viscous * dq
        + Signals(q, dq, ddq, np.zeros(len(q)), robot=ROBOT).sign
    )


def fit_truth(viscous=0.5):
    X = pd.DataFrame(np.random.default_rng(0).uniform(-2, 2, (400, 6)), columns=MOTION)
    return RBDRegressor(ROBOT, ("viscous", "coulomb")).fit(X, torque(X, viscous))


@pytest.fixture(scope="module")
def truth():
    return fit_truth()


@pytest.mark.parametrize("compensated", [True, False])
def test_motion_is_that_of_the_controlled_model(truth, compensated):
    reference = make_reference(4.0)
    motion = simulate_closed_loop(
        truth, reference, STIFFNESS, DAMPING, gravity_compensation=compensated
    )
    q, dq = motion[["q1", "q2"]].to_numpy(), motion[["dq1", "dq2"]].to_numpy()
    drive = STIFFNESS * (reference[["q1", "q2"]] - q).to_numpy()
    drive += DAMPING * (reference[["dq1", "dq2"]] - dq).to_numpy()
    if compensated:
        drive += ROBOT.gravity_torque(q)
    np.testing.assert_allclose(torque(motion), drive, atol=1e-9)
    # and it is one motion: velocities are what positions change by
    moved = np.cumsum((dq[1:] + dq[:-1]) / 2 * 0.002, axis=0)
    np.testing.assert_allclose(q[1:] - q[0], moved, atol=1e-3)
    assert list(motion.columns) == [*reference.columns, "ddq1", "ddq2"]


@pytest.mark.slow
def test_both_integrators_agree_without_dry_friction():
    X = pd.DataFrame(np.random.default_rng(0).uniform(-2, 2, (400, 6)), columns=MOTION)
    y = ROBOT.inverse_dynamics(*X.to_numpy().reshape(-1, 3, 2).transpose(1, 0, 2))
    smooth = RBDRegressor(ROBOT, ("viscous",)).fit(X, y + 0.5 * X[["dq1", "dq2"]].to_numpy())
    reference = make_reference(2.0)
    one = simulate_closed_loop(smooth, reference, STIFFNESS, DAMPING, gravity_compensation=False)
    wanted = reference.assign(ddq1=0.0, ddq2=0.0, q_ref1=reference["q1"], q_ref2=reference["q2"])
    other = simulate(smooth, wanted, controller=Controller(STIFFNESS, DAMPING))
    np.testing.assert_allclose(one[["q1", "q2"]], other[["q1", "q2"]], atol=2e-4)


@pytest.mark.slow
def test_it_makes_the_instruments_that_undo_the_bias_of_noise(truth):
    reference, rng = make_reference(30.0), np.random.default_rng(3)
    measured = simulate_closed_loop(truth, reference, STIFFNESS, DAMPING)
    y = torque(measured) + rng.normal(0, 0.3, (len(measured), 2))
    q = measured[["q1", "q2"]].to_numpy()
    low_pass = butter(4, 60, fs=500)
    q = filtfilt(*low_pass, q + rng.normal(0, 3e-3, q.shape), axis=0)
    dq = np.gradient(q, 0.002, axis=0)
    noisy = measured.copy()
    noisy[MOTION] = np.hstack([q, dq, np.gradient(dq, 0.002, axis=0)])

    effects = ("viscous", "coulomb")
    # Least squares by the data alone: the default draws what is weak to the URDF, and with it some
    # of the bias away.
    plain = RBDRegressor(ROBOT, effects, estimator="ridge", prior_std=1e3).fit(noisy, y)
    model = RBDRegressor(ROBOT, effects, consistent=True).fit(noisy, y)
    for _ in range(2):
        instruments = simulate_closed_loop(model, reference, STIFFNESS, DAMPING)
        model = RBDRegressor(ROBOT, effects, estimator="instrumental")
        model.fit(noisy, y, instruments=instruments[list(noisy.columns)])

    def error(m):
        return np.linalg.norm(m.predict(measured) - torque(measured))

    assert error(model) < error(plain) / 2


def test_trajectories_start_anew_and_tables_stay_what_they_are():
    one = make_reference(1.0, 200.0)
    both = pd.concat([one.assign(trajectory=k) for k in (4, 7)], ignore_index=True)
    twice = simulate_closed_loop(ROBOT, both, 200.0, 20.0)
    once = simulate_closed_loop(ROBOT, one, 200.0, 20.0)
    np.testing.assert_array_equal(twice[MOTION].iloc[len(one) :], once[MOTION])
    same = simulate_closed_loop(ROBOT, polars.from_pandas(one), 200.0, 20.0)
    np.testing.assert_array_equal(same["ddq2"].to_numpy(), once["ddq2"])


def test_what_cannot_be_simulated_is_refused(truth):
    reference = make_reference(1.0)
    with pytest.raises(ColumnError, match="'time'"):
        simulate_closed_loop(truth, reference.drop(columns="time"), 200.0, 20.0)
    with pytest.raises(SkidynError, match="stiffness is .* each of the 2 joints"):
        simulate_closed_loop(truth, reference, [1.0, 2.0, 3.0], 20.0)
    with pytest.raises(SkidynError, match="damping"):
        simulate_closed_loop(truth, reference, 200.0, -1.0)
    broken = reference.copy()
    broken.loc[7, "q2"] = np.nan
    with pytest.raises(SkidynError, match="positions .* row 7"):
        simulate_closed_loop(truth, broken, 200.0, 20.0)
    X = reference.assign(ddq1=0.0, ddq2=0.0)
    hysteresis = RBDRegressor(ROBOT, ("dahl",)).fit(X, np.zeros((len(X), 2)))
    with pytest.raises(SkidynError, match="dahl of joint1, dahl of joint2: depends"):
        simulate_closed_loop(hysteresis, reference, 200.0, 20.0)


def test_models_that_run_away_are_told():
    reference = make_reference(4.0)
    with pytest.raises(SkidynError, match="left its reference|solver failed"):
        simulate_closed_loop(fit_truth(viscous=-50.0), reference, 200.0, 20.0)
    X = pd.DataFrame(np.random.default_rng(0).uniform(-2, 2, (400, 6)), columns=MOTION)
    upside_down = RBDRegressor(ROBOT).fit(X, -torque(X))
    with pytest.raises(SkidynError, match="eigenvalue .* consistent=True"):
        simulate_closed_loop(upside_down, reference, 200.0, 20.0)
