# SPDX-License-Identifier: BSD-3-Clause
"""What a log hardly shows stays as in the URDF; what it shows is as least squares says."""

import numpy as np
import pandas as pd
import pytest

from skidyn.datasets import load_panda, load_planar_arm, load_ur5, make_hidden_effect_log
from skidyn.identification import RBDRegressor
from skidyn.robots import find_base_parameters

NOISE = 0.5


def recorded(robot, *, together, hidden=0.0, seed=0):
    """A log of a robot whose bodies differ from the URDF; each joint moves alone or all do."""
    rng = np.random.default_rng(seed)
    n, time = robot.n_joints, np.arange(0, 6, 0.01)
    pose, truth = rng.uniform(-0.8, 0.8, n), 1 + 0.2 * rng.standard_normal((robot.n_bodies, 1))
    frames, torques = [], []
    for k in range(n):
        q = np.tile(pose, (len(time), 1))
        dq, ddq = np.zeros_like(q), np.zeros_like(q)
        for j in range(n) if together else [k]:
            for frequency in (0.1, 0.25, 0.5):
                a, phase, w = rng.uniform(0.2, 0.5), rng.uniform(0, 6.28), 2 * np.pi * frequency
                q[:, j] += a * np.sin(w * time + phase)
                dq[:, j] += a * w * np.cos(w * time + phase)
                ddq[:, j] -= a * w**2 * np.sin(w * time + phase)
        tau = robot.inverse_dynamics(q, dq, ddq, parameters=truth * robot.inertial_parameters)
        tau += 2 * dq + 1.5 * np.tanh(dq / 0.003) + hidden * np.sin(3 * q)
        torques.append(tau + NOISE * rng.standard_normal(q.shape))
        q = q + 2e-5 * rng.standard_normal(q.shape)
        columns = {"time": time, "trajectory": k}
        columns |= {f"q{j + 1}": q[:, j] for j in range(n)}
        frames.append(pd.DataFrame(columns | {f"dq{j + 1}": dq[:, j] for j in range(n)}))
    return pd.concat(frames, ignore_index=True), np.vstack(torques)


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


@pytest.mark.parametrize("load", [load_ur5, load_panda])
def test_a_beginners_log_gives_a_model_to_be_trusted(load):
    """Each joint moved alone: least squares would be off by tens to thousands of N m."""
    robot = load()
    X, y = recorded(robot, together=False)
    new, wanted = recorded(robot, together=True)
    model = RBDRegressor(robot).fit(X, y)
    assert rms(model.predict(X) - y) < 1.5 * NOISE
    assert rms(model.predict(new) - wanted) < 1.5 * NOISE
    _, std = model.predict(new, return_std=True)
    assert rms(std) > rms(model.predict(new) - wanted) / 1.1


def test_an_effect_that_is_missing_does_not_loosen_what_the_log_does_not_show():
    robot = load_panda()
    X, y = recorded(robot, together=False, hidden=3.0)
    new, wanted = recorded(robot, together=True, hidden=3.0)
    model = RBDRegressor(robot).fit(X, y)
    assert rms(model.predict(new) - wanted) < 1.3 * 3.0


def test_what_is_known_well_is_as_least_squares_says():
    robot = load_planar_arm()
    X = np.random.default_rng(0).uniform(-2, 2, (3000, 6))
    y = robot.inverse_dynamics(
        X[:, :2], X[:, 2:4], X[:, 4:], parameters=1.3 * np.asarray(robot.inertial_parameters)
    )
    y += 0.3 * X[:, 2:4] + np.random.default_rng(1).normal(0, 0.01, y.shape)
    model = RBDRegressor(robot, ("viscous",), estimator="ordinary").fit(X, y)
    base = find_base_parameters(robot)
    regressor = np.asarray(robot.torque_regressor(X[:, :2], X[:, 2:4], X[:, 4:]))[..., base.index]
    viscous = np.einsum("sj,jk->sjk", X[:, 2:4], np.eye(2))
    columns = np.concatenate([regressor, viscous], axis=2).reshape(-1, len(base.index) + 2)
    exact = np.linalg.lstsq(columns, y.ravel())[0]
    np.testing.assert_allclose(model.coef_, exact, rtol=1e-6, atol=1e-9)


def test_what_never_shows_is_the_urdf_and_said_to_be_open():
    robot = load_planar_arm()
    X = np.random.default_rng(0).uniform(-2, 2, (500, 6))
    X[:, [0, 2, 4]] = 0.0  # the first joint never moves
    y = 1.3 * robot.inverse_dynamics(X[:, :2], X[:, 2:4], X[:, 4:])
    y += np.random.default_rng(1).normal(0, 0.1, y.shape)
    model = RBDRegressor(robot).fit(X, y)
    table = {row["name"]: row for row in model.parameter_table()}
    assert len(table) == len(model.coef_) == 6 + 4
    new = np.random.default_rng(2).uniform(-2, 2, (300, 6))
    state = new[:, :2], new[:, 2:4], new[:, 4:]
    nominal, truth = robot.inverse_dynamics(*state), 1.3 * robot.inverse_dynamics(*state)
    assert rms(model.rigid_body_torque(*state) - truth) < rms(nominal - truth)
    known, open_ = (model.predict(motion, return_std=True)[1].mean(0) for motion in (X, new))
    assert open_[0] > 1.5 * known[0]
    assert table["Izz_link1 + 0.0676*m_link2"]["std"] > 0.01


def test_without_trust_in_the_urdf_it_is_least_squares():
    robot = load_ur5()
    rng = np.random.default_rng(0)
    X = rng.uniform(-0.3, 0.3, (400, 18))  # the inertias hardly show
    q, dq, ddq = np.split(X, 3, axis=1)
    y = robot.inverse_dynamics(q, dq, ddq) + 2 * dq + rng.normal(0, NOISE, q.shape)
    columns = np.concatenate(
        [robot.torque_regressor(q, dq, ddq), np.einsum("si,ij->sij", dq, np.eye(6))], axis=2
    )
    columns = columns.reshape(y.size, -1)
    expected = columns @ np.linalg.lstsq(columns, y.ravel(), rcond=1e-9)[0]
    given = {"effects": ("viscous",), "estimator": "ordinary", "time": None}
    plain = RBDRegressor(robot, prior_std=np.inf, **given).fit(X, y).predict(X)
    np.testing.assert_allclose(plain.ravel(), expected, atol=1e-6)
    held = RBDRegressor(robot, **given).fit(X, y).predict(X)
    truth = robot.inverse_dynamics(q, dq, ddq) + 2 * dq
    assert rms(held - truth) < rms(plain - truth)
    with pytest.raises(ValueError, match="prior_std=inf leaves estimator='entropic' without"):
        RBDRegressor(robot, estimator="entropic", prior_std=np.inf).fit(X, y)


@pytest.mark.parametrize("hidden", [lambda q: 60.0 * q, lambda q: 40.0 * np.sin(2.0 * q)])
def test_a_strong_spring_does_not_hold_the_model_to_the_description(hidden):
    """Clear data of some directions is used, however far the spring moves others from the URDF."""
    log, new = (
        make_hidden_effect_log(load_ur5(), None, n_trajectories=7, random_state=seed)
        for seed in (3, 4)
    )
    y, wanted = (
        some.y + np.eye(6)[1] * hidden(some.X["q2"].to_numpy())[:, None] for some in (log, new)
    )
    trusting, free = (
        RBDRegressor(log.robot, prior_std=prior).fit(log.X, y).predict(new.X) - wanted
        for prior in (None, np.inf)
    )
    assert rms(trusting[:, 1]) < 1.1 * rms(free[:, 1])
