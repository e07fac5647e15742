# SPDX-License-Identifier: BSD-3-Clause
"""What is left and nothing that was logged predicts is told where it is slow, as noise is not."""

import numpy as np
import pandas as pd
import pytest
from scipy.signal import lfilter

from skidyn.datasets import (
    load_panda,
    load_planar_arm,
    load_scara,
    load_ur5,
    make_hidden_effect_log,
)
from skidyn.diagnosis import Settings, diagnose
from skidyn.identification import RBDRegressor


@pytest.fixture(scope="module")
def log():
    return make_hidden_effect_log(
        load_planar_arm(), None, noise="high", duration=6.0, random_state=4
    )


@pytest.fixture(scope="module")
def wandering(log):
    """A torque that wanders by chance, over about half a second."""
    steps = np.random.default_rng(1).normal(size=len(log.y))
    torque = lfilter([1.0], [1.0, -0.98], steps)
    return torque / torque.std()


def test_slow_remainder_below_twice_the_noise_is_told(log, wandering):
    clean = diagnose(RBDRegressor(log.robot), log.X, log.y, checks=())
    torque = log.y.copy()
    torque[:, 1] += 1.4 * clean.noise[1] * wandering

    found = diagnose(RBDRegressor(log.robot), log.X, torque)

    assert clean.verdict == "complete"
    assert found.rmse_after[1] < 2 * found.noise[1]
    assert found.verdict == "unknown"
    assert found.unexplained["joints"] == [2]
    assert found.unexplained["variables"] == []


def test_slow_remainder_of_a_thousandth_of_the_range_is_not_told(log, wandering):
    torque = log.y.copy()
    torque[:, 1] += 0.001 * np.ptp(log.y[:, 1]) * wandering

    found = diagnose(RBDRegressor(log.robot), log.X, torque, checks=())

    assert found.verdict == "complete"


def test_a_log_that_does_not_determine_the_model_has_no_remainder():
    log = make_hidden_effect_log(
        load_scara(), None, noise="high", n_trajectories=1, duration=3.0, random_state=707
    )
    found = diagnose(RBDRegressor(log.robot), log.X, log.y, checks=())
    assert found.rmse_after[2] > 2 * found.noise[2]
    assert found.verdict == "complete"
    assert any("is due to extrapolation" in note for note in found.warnings)


@pytest.mark.parametrize(
    ("load", "noise", "seed"), [(load_ur5, "low", 340021), (load_panda, "high", 342039)]
)
def test_nothing_is_left_in_a_short_log_at_a_high_rate(load, noise, seed):
    """Their noise is correlated over some samples, and averaged rows have more than its share."""
    log = make_hidden_effect_log(
        load(), None, noise=noise, rate=500.0, n_trajectories=1, duration=3.0, random_state=seed
    )
    assert diagnose(RBDRegressor(log.robot), log.X, log.y, checks=()).verdict == "complete"


@pytest.fixture(scope="module")
def with_coloured_noise():
    """A Panda with nothing hidden and noise that is correlated over some tenths of a second."""
    log = make_hidden_effect_log(
        load_panda(), None, noise="low", n_trajectories=6, duration=4.0, random_state=0
    )
    steps = np.random.default_rng(2).normal(size=log.y.shape)
    slow = lfilter([1.0], [1.0, -0.97], steps, axis=0)
    slow /= slow.std(0)
    nothing = Settings(max_findings=0)
    noise = diagnose(RBDRegressor(log.robot), log.X, log.y, checks=(), settings=nothing).noise
    return log, noise, slow


@pytest.mark.slow
def test_noise_that_is_correlated_on_all_joints_alike_is_no_effect(with_coloured_noise):
    log, noise, slow = with_coloured_noise

    # between what is not worth mentioning (below twice the noise) and what is too much for noise
    torque = log.y + 2.5 * noise * slow
    found = diagnose(RBDRegressor(log.robot), log.X, torque, checks=())

    assert found.noise_is_coloured
    assert found.verdict == "complete"
    assert found.to_dict()["noise_is_coloured"]
    assert "every joint" in found.story()["text"]


@pytest.mark.slow
def test_as_much_on_one_joint_is_told(with_coloured_noise):
    log, noise, slow = with_coloured_noise
    torque = log.y.copy()
    torque[:, 2] += 6 * noise[2] * slow[:, 2]

    found = diagnose(RBDRegressor(log.robot), log.X, torque, checks=())

    assert not found.noise_is_coloured
    assert found.verdict == "unknown"
    assert found.unexplained["joints"] == [3]


def test_noise_of_positions_is_felt_by_rotors():
    log = make_hidden_effect_log(
        load_scara(), None, noise="low", n_trajectories=4, duration=4.0, random_state=0
    )
    X, torque = log.X.copy(), log.y.copy()
    rng = np.random.default_rng(0)
    for j in range(log.robot.n_joints):
        X[f"q{j + 1}"] += 2e-5 * rng.normal(size=len(X))
    with_rotors = torque + 0.5 * X[[f"ddq{j + 1}" for j in range(4)]].to_numpy()
    model = RBDRegressor(log.robot, ("viscous", "coulomb", "rotor_inertia"))

    light, heavy = (diagnose(model, X, y, effects=(), checks=()) for y in (torque, with_rotors))

    assert np.all(heavy.parts.position_noise > light.parts.position_noise)


def test_a_joint_that_slides_in_few_recordings_is_extrapolated_where_one_is_left_out():
    arm, rng = load_planar_arm(), np.random.default_rng(0)
    t, tables = np.arange(0, 4, 0.01), []
    for run in range(9):
        slides = run in (0, 6)
        size = np.array([0.12 * slides, 0.9])
        phase, rate = np.column_stack([1.2 * t, 1.7 * t + run]), np.array([1.2, 1.7])
        q = size * np.sin(phase) + [0.5 * run * slides - 1.0, 0.0]
        dq, ddq = size * rate * np.cos(phase), -size * rate**2 * np.sin(phase)
        torque = arm.inverse_dynamics(q, dq, ddq) + 0.8 * dq + 1.5 * np.sign(dq)
        torque += rng.normal(0, 0.05, q.shape)
        tables.append(np.column_stack([t + 10 * run, np.full(len(t), run), q, dq, torque]))
    names = ["time", "trajectory", "q1", "q2", "dq1", "dq2", "tau1", "tau2"]
    log = pd.DataFrame(np.vstack(tables), columns=names)

    found = diagnose(RBDRegressor(arm), log, log[["tau1", "tau2"]])

    assert found.rmse_after[0] > 20 * found.noise[0]
    assert found.verdict == "complete" and found.findings == []
    (note,) = found.warnings
    assert "joint 1" in note and "extrapolation" in note
