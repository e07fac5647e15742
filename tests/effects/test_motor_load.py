# SPDX-License-Identifier: BSD-3-Clause
"""Friction by the torque of the motor: BAM's own formulas, fitted, predicted and written."""

import numpy as np
import pandas as pd
import pytest

from skidyn.diagnosis import diagnose
from skidyn.effects import Term, get_effect, searched_kinds
from skidyn.export import BamModel, python_source, read_bam, write_bam
from skidyn.identification import RBDRegressor
from skidyn.robots import Robot
from skidyn.simulation import simulation_errors

PENDULUM = """<robot name="pendulum"><link name="stand"/>
  <link name="arm"><inertial><origin xyz="0 0 -0.1"/><mass value="0.49"/>
    <inertia ixx="1e-3" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="servo" type="continuous"><parent link="stand"/><child link="arm"/>
    <axis xyz="0 1 0"/></joint></robot>"""
FRICTION = {
    "friction_base": 0.02,
    "friction_viscous": 0.01,
    "friction_stribeck": 0.03,
    "load_friction_base": 0.08,
    "load_friction_stribeck": 0.05,
    "load_friction_motor": 0.15,
    "load_friction_external": 0.04,
    "load_friction_motor_stribeck": 0.02,
    "load_friction_external_stribeck": 0.07,
    "load_friction_motor_quad": 0.09,
    "load_friction_external_quad": 0.04,
    "dtheta_stribeck": 0.8,
    "alpha": 1.4,
}
KINDS = {
    "m3": "motor_load_friction",
    "m4": "stribeck_load_friction",
    "m5": "directional_load_friction",
    "m6": "quadratic_load_friction",
}
#: Relative error of a parameter with an open shape. BAM's m6 jumps where both torques have the same
#: size; 0.2 % of the samples have no torque that satisfies it.
TOLERANCE = {"m3": 1e-6, "m4": 5e-3, "m5": 5e-3, "m6": 2e-2}


@pytest.fixture(scope="module")
def robot():
    return Robot.from_urdf(PENDULUM)


@pytest.fixture(scope="module")
def log(robot):
    """Motion, and torque of a motor by BAM's own formula, solved by iteration."""

    def make(name):
        rng, parts = np.random.default_rng(1), []
        time = np.arange(0, 12.0, 0.005)
        rates = 2 * np.pi * np.array([0.13, 0.31, 0.7, 1.3])
        for run in range(4):
            sizes = rng.uniform(0.4, 1.1, 4) / np.array([1, 1, 2, 5])
            phase = np.outer(time, rates) + rng.uniform(0, 6, 4)
            motion = np.sin(phase) @ sizes, np.cos(phase) @ (sizes * rates)
            ddq = -np.sin(phase) @ (sizes * rates**2)
            parts.append(np.column_stack([time, np.full(len(time), run), *motion, ddq]))
        X = pd.DataFrame(np.vstack(parts), columns=["time", "trajectory", "q1", "dq1", "ddq1"])
        q, dq, ddq = (X[[c]].to_numpy() for c in ("q1", "dq1", "ddq1"))
        bodies = robot.inverse_dynamics(q, dq, ddq)[:, 0] + 0.002 * ddq[:, 0]
        outside = -robot.inverse_dynamics(q, dq, 0 * ddq)[:, 0]
        servo, torque = BamModel(name, "xl330", FRICTION), bodies
        direction = np.tanh(dq[:, 0] / 0.003)
        for _ in range(100):
            torque = bodies + direction * np.abs(servo.friction(torque, outside, dq[:, 0]))
        return X, torque

    return make


def fitted(robot, name, X, y, **shape):
    effects = ["viscous", "coulomb", "rotor_inertia", Term(KINDS[name], (1,), shape)]
    return RBDRegressor(robot, effects, "nominal", smooth=False).fit(X, y)


@pytest.mark.parametrize("name", KINDS)
def test_parameters_of_bam_are_recovered_and_written(robot, log, name, tmp_path):
    X, y = log(name)
    model = fitted(robot, name, X, y)
    assert write_bam(model, tmp_path / "own.json", actuator="xl330") == ()
    written = read_bam(tmp_path / "own.json")
    assert written.name == name
    assert written.parameters["armature"] == pytest.approx(0.002, rel=TOLERANCE[name])
    for key, value in written.parameters.items():
        if key != "armature":
            assert value == pytest.approx(FRICTION[key], rel=TOLERANCE[name]), key
    moving = np.abs(X["dq1"].to_numpy()) > 0.05
    error = np.abs(model.predict(X) - y)[moving] / np.abs(y).max()
    assert np.quantile(error, 0.99) < 1e-4


@pytest.mark.parametrize("name", KINDS)
def test_with_a_known_shape_the_torque_is_exact(robot, log, name):
    X, y = log(name)
    shape = {"vs": 0.8, "alpha": 1.4, "outside": 0.04 / 0.19, "slow_outside": 0.07 / 0.09}
    wanted = {s.name for s in get_effect(KINDS[name]).shapes}
    model = fitted(robot, name, X, y, **{k: v for k, v in shape.items() if k in wanted})
    error = np.abs(model.predict(X) - y) / np.abs(y).max()
    assert np.quantile(error, 0.98) < (1e-9 if name != "m6" else 1e-4)
    namespace = {}
    exec(python_source(model), namespace)
    states = [X[[column]].to_numpy() for column in ("q1", "dq1", "ddq1")]
    written = namespace["inverse_dynamics"](*states)[:, 0]
    np.testing.assert_allclose(written, model.predict(X), atol=1e-9)


def test_the_simulated_motion_is_that_of_the_log(robot, log):
    X, y = log("m4")
    model = fitted(robot, "m4", X, y, vs=0.8, alpha=1.4)
    some = X["trajectory"] == 0
    errors = simulation_errors(model, X[some], y[some], horizon=0.5)
    assert errors.position[0] < 0.01 * errors.resting[0]


@pytest.mark.slow
def test_they_are_tried_only_if_they_are_asked_for(robot, log):
    assert not set(KINDS.values()) & set(searched_kinds())
    X, y = log("m4")
    few = (X["trajectory"] < 3) & (X["time"] < 6.0)
    X, y = X[few], y[few]
    base = RBDRegressor(robot, ("viscous", "coulomb", "rotor_inertia"), "nominal", smooth=False)
    automatic = diagnose(base, X, y, force=True)
    assert not set(KINDS.values()) & {f.kind for f in automatic.findings}
    asked = diagnose(base, X, y, effects=["stribeck_load_friction", "dahl"], force=True)
    assert [f.kind for f in asked.findings] == ["stribeck_load_friction"]


def test_a_second_friction_of_the_load_is_left_out_of_the_file(robot, log, tmp_path):
    X, y = log("m4")
    model = fitted(robot, "m4", X, y, vs=0.8, alpha=1.4)
    both = RBDRegressor(robot, [*model.effect_terms_, "load_dependent_friction"], "nominal")
    left = write_bam(both.fit(X, y), tmp_path / "own.json", actuator="xl330")
    assert left == ("load_dependent_friction of servo",)
