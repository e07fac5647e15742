# SPDX-License-Identifier: BSD-3-Clause
"""Simulated motion obeys the model, whatever effects it has, and agrees with MuJoCo."""

import numpy as np
import pandas as pd
import pytest

from skidyn.datasets import load_planar_arm, load_ur5, make_hidden_effect_log
from skidyn.effects import Term
from skidyn.exceptions import SkidynError
from skidyn.identification import RBDRegressor
from skidyn.robots import Robot
from skidyn.simulation import Controller, simulate

SLIDER = """<robot name="slider"><link name="base"/><link name="cart"><inertial><mass value="2"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="slide" type="prismatic"><axis xyz="1 0 0"/><parent link="base"/><child link="cart"/>
<limit effort="9" velocity="9" lower="-9" upper="9"/></joint></robot>"""


def fitted(robot, effects, coefficients=None, seed=0):
    """A model of the robot of the URDF with effects of known size."""
    n, time = robot.n_joints, np.arange(0, 20, 0.01)
    speed, phase = np.random.default_rng(seed).uniform(1, 4, (2, n))
    angle = speed * time[:, None] + phase
    q, dq, ddq = np.sin(angle), speed * np.cos(angle), -(speed**2) * np.sin(angle)
    names = [f"{s}{j + 1}" for s in ("q", "dq", "ddq") for j in range(n)]
    X = pd.DataFrame(np.hstack([q, dq, ddq]), columns=names).assign(time=time)
    model = RBDRegressor(robot, effects, "nominal", smooth=False)
    model.fit(X, robot.inverse_dynamics(q, dq, ddq) + 0.1 * dq)
    for term in model.effect_terms_:
        model.effect_coefficients_[term] = np.asarray((coefficients or {})[term.kind], dtype=float)
    return model


def log_of(robot, start_q, start_dq, torque, time):
    """A log whose first sample is the state to start from; torque is a function of time."""
    n = robot.n_joints
    table = {f"q{j + 1}": start_q[j] + 0 * time for j in range(n)}
    table |= {f"dq{j + 1}": start_dq[j] + 0 * time for j in range(n)}
    table |= {f"ddq{j + 1}": 0 * time for j in range(n)}
    return pd.DataFrame(table | {"time": time}), np.column_stack(
        [torque(time, j) for j in range(n)]
    )


def moved(model, X, y=None, **options):
    """Simulated positions and velocities."""
    out = simulate(model, X, y, **options)
    n = model.robot_.n_joints
    return (out[[f"{s}{j + 1}" for j in range(n)]].to_numpy() for s in ("q", "dq"))


def slider(effects, coefficients):
    return fitted(Robot.from_urdf(SLIDER), effects, coefficients)


@pytest.mark.parametrize("arm", [load_planar_arm, load_ur5], ids=["planar", "ur5"])
def test_agrees_with_mujoco(arm):
    pytest.importorskip("mujoco")
    robot = arm()
    n = robot.n_joints
    sizes = {"viscous": [1.5], "rotor_inertia": [0.3], "spring": [4.0, 1.0], "coulomb": [0.0]}
    model = fitted(robot, list(sizes), sizes)
    time = np.linspace(0, 1, 101)
    start = 0.3 * np.ones(n)
    hold = robot.gravity_torque(start[None])[0]
    X, y = log_of(robot, start, 0.2 * start, lambda t, j: hold[j] + 2 * np.sin(5 * t + j), time)
    own, _ = moved(model, X, y, step=5e-4)
    other, _ = moved(model, X, y, engine="mujoco", step=5e-4)
    assert np.abs(own[-1] - own[0]).max() > 0.05
    np.testing.assert_allclose(own, other, atol=1e-6)


def test_agrees_with_mujoco_while_it_slides():
    """Sliding, MuJoCo's frictionloss is dry friction; only at rest it creeps."""
    pytest.importorskip("mujoco")
    sizes = {"viscous": [0.4], "coulomb": [1.0]}
    model = slider(list(sizes), sizes)
    time = np.linspace(0, 1, 101)
    X, y = log_of(model.robot_, [0.0], [0.5], lambda t, j: 1.5 + 0.5 * np.sin(8 * t), time)
    own, _ = moved(model, X, y, step=5e-4)
    other, _ = moved(model, X, y, engine="mujoco", step=5e-4)
    np.testing.assert_allclose(own, other, atol=1e-6)


def test_dry_friction_stops_and_holds_exactly():
    model = slider(["coulomb"], {"coulomb": [3.0]})
    time = np.linspace(0, 4, 41)  # 10 Hz
    X, y = log_of(model.robot_, [0.0], [2.0], lambda t, j: 2.5 * (t > 2), time)
    q, dq = moved(model, X, y)
    # v = 2 - 1.5 t until 4/3 s, at 4/3 m; 2.5 N do not overcome 3 N
    assert np.all(dq[14:] == 0.0)
    np.testing.assert_allclose(q[14:, 0], 4 / 3, atol=2e-3)
    np.testing.assert_allclose(np.ptp(q[14:]), 0.0, atol=1e-12)


def test_joint_breaks_loose_when_the_torque_exceeds_friction():
    model = slider(["coulomb"], {"coulomb": [3.0]})
    time = np.linspace(0, 2, 201)
    X, y = log_of(model.robot_, [0.0], [0.0], lambda t, j: 3 * t, time)
    q, _ = moved(model, X, y)
    assert np.abs(q[:101]).max() < 1e-9
    np.testing.assert_allclose(q[-1, 0], 1.5 / 6, atol=1e-3)  # ddq = 1.5 (t - 1)


def test_stiff_controller_is_stable_at_the_rate_of_a_slow_log():
    model = slider(["viscous", "coulomb"], {"viscous": [5.0], "coulomb": [0.5]})
    time = np.linspace(0, 2, 41)  # 20 Hz, time constants of a hundredth of a step
    X, _ = log_of(model.robot_, [0.0], [0.0], lambda t, j: 0 * t, time)
    X["q_ref1"] = np.sin(time)
    controller = Controller(stiffness=1e6, damping=1e4, follows_velocity=False)
    q, _ = moved(model, X, controller=controller, step=1.0)
    assert np.abs(q[:, 0] - np.sin(time)).max() < 0.03


def test_presliding_springs_back():
    """Dahl friction lets go what it held: a push within the presliding range leaves no trace."""
    sizes = {"dahl": [3.0], "viscous": [100.0]}
    model = slider([Term("dahl", (1,), {"presliding": 0.01}), "viscous"], sizes)
    time = np.linspace(0, 3, 301)
    X, y = log_of(model.robot_, [0.0], [0.0], lambda t, j: 0.3 * (t < 1.5), time)
    q, _ = moved(model, X, y)
    np.testing.assert_allclose(q[145, 0], -0.01 * np.log(0.9), rtol=0.02)
    assert abs(q[-1, 0]) < 0.15 * q[145, 0]


def test_elastic_link_swings_at_its_resonance():
    """Motor held by a stiff controller: the link of 2 kg swings at sqrt(k / m)."""
    term = Term("joint_elasticity", (1,), {"resonance": 5.0, "damping": 0.01})
    stiffness = 2.0 * (2 * np.pi * 5.0) ** 2
    sizes = {"joint_elasticity": [1 / stiffness], "rotor_inertia": [1.0]}
    model = slider([term, "rotor_inertia"], sizes)
    time = np.linspace(0, 1, 1001)
    X, y = log_of(model.robot_, [0.0], [0.0], lambda t, j: 10.0 * (t < 0.01), time)
    q, dq = moved(model, X, y)
    # two masses: omega^2 = k (1/1 + 1/2)
    free = dq[:, 0] - 0.095 / 3.0  # the momentum of the push, which ends within a sample
    crossings = np.flatnonzero((free[:-1] < 0) & (free[1:] >= 0))
    period = np.diff(time[crossings[crossings > 20]]).mean()
    np.testing.assert_allclose(1 / period, 5.0 * np.sqrt(3.0), rtol=0.02)


@pytest.mark.parametrize("kind", ["dahl", "load_dependent_friction", "time_delay", "backlash"])
def test_effect_that_is_there_improves_the_motion(kind):
    log = make_hidden_effect_log(load_planar_arm(), kind, joints=[1], n_trajectories=4)
    train = log.frame["trajectory"] <= 3
    plain = RBDRegressor(log.robot).fit(log.X[train], log.y[train])
    whole = plain.with_effects([(kind, [1])]).fit(log.X[train], log.y[train])
    errors = [
        np.sqrt(np.nanmean((out["q1"] - log.X["q1"][~train]) ** 2))
        for out in (simulate(m, log.X[~train], log.y[~train], horizon=1.0) for m in (plain, whole))
    ]
    assert errors[1] < 0.8 * errors[0]


def test_bad_input_is_told():
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=1, duration=2.0)
    model = RBDRegressor(log.robot).fit(log.X, log.y)
    with pytest.raises(SkidynError, match="torque y or a controller"):
        simulate(model, log.X)
    with pytest.raises(SkidynError, match="q_ref1"):
        simulate(model, log.X, controller=Controller(1.0))
    with pytest.raises(SkidynError, match="stiffness"):
        simulate(model, log.X.assign(q_ref1=0.0, q_ref2=0.0), controller=Controller(-1.0))
    with pytest.raises(SkidynError, match="horizon"):
        simulate(model, log.X, log.y, horizon=0)
    with pytest.raises(SkidynError, match="row 7"):
        simulate(model, log.X, np.where(np.arange(len(log.y))[:, None] == 7, np.nan, log.y))
    with pytest.raises(SkidynError, match="engine"):
        simulate(model, log.X, log.y, engine="bullet")


def test_mujoco_says_what_it_cannot_hold():
    pytest.importorskip("mujoco")
    log = make_hidden_effect_log(load_planar_arm(), "dahl", joints=[1], n_trajectories=2)
    model = RBDRegressor(log.robot, ["viscous", ("dahl", [1])]).fit(log.X, log.y)
    with pytest.raises(SkidynError, match="dahl of joint1"):
        simulate(model, log.X, log.y, engine="mujoco")
