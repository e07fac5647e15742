# SPDX-License-Identifier: BSD-3-Clause
"""Findings judged together: a second effect beside the first, one in place of two."""

from __future__ import annotations

import warnings

import numpy as np
import pandas as pd
import pytest

from skidyn.datasets import load_planar_arm, load_ur5, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor

ROBOT = load_planar_arm()
RECORDINGS, HEAVY, NOISE = 10, (2, 5, 6, 9), np.array([0.05, 0.02])


def motion():
    """Sums of sines in separate recordings, with their exact derivatives."""
    rng = np.random.default_rng(4)
    time = np.arange(0.0, 6.0, 0.01)
    tables = []
    for k in range(1, RECORDINGS + 1):
        omega = 2 * np.pi * rng.uniform(0.15, 0.9, (3, 2))
        phase, size = rng.uniform(0, 2 * np.pi, (3, 2)), rng.uniform(0.2, 0.5, (3, 2))
        waves = time[:, None, None] * omega + phase
        q, dq = (size * np.sin(waves)).sum(1), (size * omega * np.cos(waves)).sum(1)
        ddq = -(size * omega**2 * np.sin(waves)).sum(1)
        columns = {f"{s}{j + 1}": x[:, j] for s, x in (("q", q), ("dq", dq)) for j in (0, 1)}
        tables.append((pd.DataFrame({"trajectory": k, "time": time + 10 * k} | columns), ddq))
    return pd.concat([t for t, _ in tables], ignore_index=True), np.vstack([a for _, a in tables])


@pytest.fixture(scope="module")
def plain():
    """Log, rigid-body torque with a heavier last link in some recordings, and the rest of it."""
    X, ddq = motion()
    q, dq = X[["q1", "q2"]].to_numpy(), X[["dq1", "dq2"]].to_numpy()
    bodies = ROBOT.inertial_parameters.copy()
    light = ROBOT.inverse_dynamics(q, dq, ddq, parameters=bodies)
    bodies[-1] += [3.0, 0.3, 0.0, 0.0, 0.01, 0.0, 0.0, 0.04, 0.0, 0.04]
    heavy = ROBOT.inverse_dynamics(q, dq, ddq, parameters=bodies)
    noise = NOISE * np.random.default_rng(5).normal(size=q.shape)
    rest = 0.8 * dq + 0.5 * np.sign(dq) + noise
    return X, light, heavy, rest


def diagnosed(X, torque):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return diagnose(RBDRegressor(ROBOT, ("viscous", "coulomb")), X, torque, checks=())


@pytest.mark.slow
def test_friction_that_grows_with_a_load_of_some_recordings(plain):
    X, light, heavy, rest = plain
    load = np.where(np.isin(X["trajectory"], HEAVY)[:, None], heavy, light)
    direction = np.sign(X[["dq1", "dq2"]].to_numpy())

    torque = load + rest + 0.08 * np.abs(load) * direction

    diagnosis = diagnosed(X, torque)

    kinds = {(f.kind, f.trajectories) for f in diagnosis.findings}
    assert kinds == {("payload", HEAVY), ("load_dependent_friction", None)}
    for finding in diagnosis.findings:
        if finding.kind == "load_dependent_friction":
            assert finding.parameters["mu"]["value"] == pytest.approx(0.08, rel=0.1)
    # the gears of the model carry the load too
    error = np.abs(diagnosis.model.predict(X) - torque)
    assert np.all(np.median(error, axis=0) < NOISE)


def test_friction_of_the_last_recording_is_no_drift(plain):
    X, light, _, rest = plain
    few = X["trajectory"].to_numpy() <= 6
    X, torque = X[few].reset_index(drop=True), (light + rest)[few]
    last = X["trajectory"].to_numpy() == 6
    torque[last, 1] += 0.4 * np.sign(X["dq2"].to_numpy()[last])

    findings = diagnosed(X, torque).findings

    said = [(f.kind, f.joints, f.trajectories) for f in findings]
    assert said == [("coulomb", (2,), (6,))]


@pytest.mark.slow
def test_a_tilted_base_is_found_beside_large_friction_that_is_missing(found_in):
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


@pytest.mark.slow
def test_friction_that_falls_while_a_gear_warms_up_is_one_drift(arm_log, found_in):
    time, dq = arm_log.X["time"].to_numpy(), arm_log.X["dq1"].to_numpy()
    since = time - time.min()
    warm = 1 - np.exp(-since / (0.3 * np.ptp(time)))
    torque = np.array(arm_log.y)
    torque[:, 0] -= 0.8 * warm * dq

    kinds = found_in(load_planar_arm(), arm_log.X, torque)

    assert kinds == {"friction_drift": {1}}


@pytest.mark.slow
def test_a_narrow_bump_is_one_function_and_not_a_spring_and_a_stop(arm_log, found_in):
    q = arm_log.X["q1"].to_numpy()
    middle, span = np.median(q), np.ptp(q)
    torque = np.array(arm_log.y)
    torque[:, 0] += np.std(torque[:, 0]) * np.exp(-(((q - middle) / (0.12 * span)) ** 2))

    assert found_in(load_planar_arm(), arm_log.X, torque) == {"unknown": {1}}


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "recordings"), [(8, 11), (9, 6)])
def test_two_effects_that_hide_each_other_are_both_named(seed, recordings):
    """Neither is significant alone; a function of their signals explains both, or nothing does."""
    log = make_hidden_effect_log(
        ROBOT, None, noise="low", n_trajectories=recordings, duration=6.0, random_state=seed
    )
    run, row = log.X["trajectory"].to_numpy(), np.arange(len(log.X))
    warmth = 6 * np.random.default_rng(seed).normal(size=40)[run] + 3 * np.sin(row / 700)
    X = log.X.assign(temp1=30.0, temp2=30 + warmth)
    q, dq = X["q2"].to_numpy(), X["dq2"].to_numpy()
    friction = -warmth * np.sign(dq) * (1 + np.abs(dq))
    spring = np.exp(3.6 * (q - (q.max() + q.min()) / 2) / np.ptp(q))
    torque, size = np.array(log.y), 0.6 * np.std(log.y[:, 1])
    torque[:, 1] += size * (friction / np.std(friction) + spring / np.std(spring))

    found = diagnosed(X, torque)

    assert found.verdict == "missing"
    assert {(f.kind, f.joints) for f in found.findings} == {
        ("nonlinear_spring", (2,)),
        ("temperature_friction", (2,)),
    }


@pytest.mark.slow
def test_friction_that_the_model_lacks_and_that_drifts_is_no_size_for_each_recording():
    log = make_hidden_effect_log(
        ROBOT, "friction_drift", joints=[1, 2], n_trajectories=8, duration=6.0, random_state=15
    )

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = diagnose(RBDRegressor(ROBOT, ()), log.X, log.y)

    everywhere = {(f.kind, f.joints) for f in found.findings if f.trajectories is None}
    assert everywhere >= {(k, (j,)) for k in ("viscous", "friction_drift") for j in (1, 2)}
    assert not [f for f in found.findings if f.kind == "viscous" and f.trajectories is not None]


@pytest.mark.slow
def test_the_second_of_two_kinds_of_friction_is_named_where_the_first_was_fitted_to_both():
    log = make_hidden_effect_log(ROBOT, None, noise="low", random_state=21)
    dq = log.X["dq1"].to_numpy()
    backwards = -np.sqrt(np.maximum(-dq, 0.0))
    stribeck = np.exp(-np.sqrt(np.abs(dq) / (0.05 * np.abs(dq).max()))) * np.sign(dq)
    torque, size = np.array(log.y), 0.3 * np.std(log.y[:, 0])
    torque[:, 0] += size * (backwards / np.std(backwards) + stribeck / np.std(stribeck))

    found = diagnosed(log.X, torque)

    assert {f.kind for f in found.findings} == {"asymmetric_friction", "stribeck"}
