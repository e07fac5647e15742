# SPDX-License-Identifier: BSD-3-Clause
"""Friction of a fitted model as BAM's."""

import numpy as np
import pandas as pd
import pytest

from skidyn.effects import Term
from skidyn.export import BamModel, fit_bam, read_bam, write_bam
from skidyn.robots import Robot

#: Numbers of no servo, all different.
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
    "load_friction_motor_quad": 0.009,
    "load_friction_external_quad": 0.004,
    "dtheta_stribeck": 0.8,
    "alpha": 1.4,
}
MOTOR = {"kt": 0.37, "R": 2.8, "armature": 0.002, "q_offset": 0.01}
MODELS = ("m1", "m2", "m3", "m4", "m5", "m6")
PENDULUM = """<robot name="pendulum"><link name="stand"/>
  <link name="arm"><inertial><origin xyz="0 0 -0.1"/><mass value="0.49"/>
    <inertia ixx="1e-9" iyy="1e-9" izz="1e-9" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="servo" type="continuous"><parent link="stand"/><child link="arm"/>
    <axis xyz="0 1 0"/></joint></robot>"""


def servo(name):
    return BamModel(name, "xl330", {**FRICTION, **MOTOR})


def test_a_fitted_model_is_written_as_the_simplest_that_holds_it(fit, load, tmp_path):
    effects = ["viscous", "coulomb", "rotor_inertia", "offset"]
    model = fit(load("scara"), effects, consistent=True)
    left = write_bam(
        model, tmp_path / "m1.json", joint="joint2", actuator="mx64", motor={"kt": 1.6}
    )
    assert left == ("offset of joint2",)
    found = read_bam(tmp_path / "m1.json")
    own = {t.kind: c[0] for t, c in model.effect_coefficients_.items() if t.joints == (2,)}
    assert found.name == "m1" and found.actuator == "mx64"
    assert found.parameters == {
        "armature": own["rotor_inertia"],
        "friction_base": own["coulomb"],
        "friction_viscous": own["viscous"],
        "kt": 1.6,
    }
    stribeck = Term("stribeck", (2,), {"vs": 0.1, "delta": 2.0})
    model = fit(load("scara"), ["coulomb", stribeck], consistent=True)
    model.effect_coefficients_[stribeck] = np.array([0.3])
    assert write_bam(model, tmp_path / "m2.json", joint=2, actuator="mx64") == ()
    found = read_bam(tmp_path / "m2.json")
    assert found.name == "m2" and found.parameters["friction_stribeck"] == 0.3
    q, dq, ddq = np.zeros((3, 9, model.robot_.n_joints))
    dq[:, 1] = np.linspace(0.02, 0.4, 9)
    moved = model.predict(np.hstack([q, dq, ddq])) - model.rigid_body_torque(q, dq, ddq)
    np.testing.assert_allclose(found.friction(0.0, 0.0, dq[:, 1]), moved[:, 1], rtol=1e-4)


@pytest.mark.parametrize("name", MODELS)
def test_a_generated_log_shows_the_friction_it_was_made_with(name):
    robot, own = Robot.from_urdf(PENDULUM), servo(name)
    time = np.arange(0, 40, 0.005)
    q = 1.2 * np.sin(1.1 * time) + 0.5 * np.sin(3.3 * time + 1) + 0.15 * np.sin(9.1 * time)
    dq = np.gradient(q, time)
    ddq = np.gradient(dq, time)
    motion = [x[:, None] for x in (q, dq, ddq)]
    need = robot.inverse_dynamics(*motion)[:, 0] + MOTOR["armature"] * ddq
    outside = -robot.inverse_dynamics(motion[0], motion[1], 0 * motion[2])[:, 0]
    motor = need.copy()
    for _ in range(200):  # friction depends on the torque that it is part of
        motor = need + own.friction(motor, outside, dq)
    rng = np.random.default_rng(1)
    X = pd.DataFrame({"time": time, "q1": q, "dq1": dq, "ddq1": ddq})
    found = fit_bam(robot, X, motor + 0.002 * rng.normal(size=len(q)), name=name, actuator="xl330")
    moves = np.abs(dq) > 0.1
    truth = own.friction(motor, outside, dq)[moves]
    wrong = found.friction(motor, outside, dq)[moves] - truth
    assert np.std(wrong) < 0.02 * np.std(truth)
    assert found.parameters["armature"] == pytest.approx(MOTOR["armature"], rel=0.1)
    assert set(found.parameters) >= {"friction_base", "friction_viscous"}
