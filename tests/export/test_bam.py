# SPDX-License-Identifier: BSD-3-Clause
"""Friction of servos in BAM's format: written, read again, and what BAM itself makes of it."""

import json

import numpy as np
import pandas as pd
import pytest

from skidyn.exceptions import SkidynError
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


def states(n=400):
    rng = np.random.default_rng(0)
    motor, outside = rng.uniform(-2, 2, (2, n))
    return motor, outside, rng.normal(size=n)


@pytest.mark.parametrize("name", MODELS)
def test_a_written_file_reads_back_to_the_same(name, tmp_path):
    assert write_bam(servo(name), tmp_path / "own.json") == ()
    assert read_bam(tmp_path / "own.json") == servo(name)
    written = json.loads((tmp_path / "own.json").read_text())
    assert written["model"] == name and written["actuator"] == "xl330"


@pytest.mark.parametrize("name", MODELS)
def test_bam_itself_reads_the_file_and_has_the_same_friction(name, tmp_path):
    bam = pytest.importorskip("bam.model", reason="better-actuator-models is not installed")
    write_bam(servo(name), tmp_path / "own.json")
    other = bam.load_model(str(tmp_path / "own.json"))
    motor, outside, speed = states()
    loss, damping = other.compute_frictions(motor, outside, speed)
    np.testing.assert_allclose(
        servo(name).friction(motor, outside, speed),
        np.sign(speed) * (loss + damping * np.abs(speed)),
        rtol=1e-12,
    )
    assert other.kt.value == MOTOR["kt"] and other.armature.value == MOTOR["armature"]


#: Keys of the files of better-actuator-models 1.0.2 (bam/params/xl330), for installations without
#: that package, which requires Python 3.12.
ALWAYS = {"model", "actuator", "friction_base", "friction_viscous", *MOTOR}
STRIBECK = {"friction_stribeck", "dtheta_stribeck", "alpha"}
EITHER = {"load_friction_motor", "load_friction_external"}
PUBLISHED = {
    "m1": set(),
    "m2": STRIBECK,
    "m3": {"load_friction_base"},
    "m4": {"load_friction_base", "load_friction_stribeck", *STRIBECK},
    "m5": {*EITHER, *(f"{key}_stribeck" for key in EITHER), *STRIBECK},
    "m6": {*EITHER, *(f"{key}_{law}" for key in EITHER for law in ("stribeck", "quad")), *STRIBECK},
}


@pytest.mark.parametrize("name", MODELS)
def test_files_have_the_keys_of_the_published_ones(name, tmp_path):
    keys = ALWAYS | PUBLISHED[name]
    numbers = {k: v for k, v in {**FRICTION, **MOTOR}.items() if k in keys}
    published = {**numbers, "model": name, "actuator": "xl330"}
    assert set(published) == keys
    (tmp_path / "published.json").write_text(json.dumps(published))
    servo = read_bam(tmp_path / "published.json")
    assert (servo.name, servo.actuator, servo.parameters) == (name, "xl330", numbers)
    write_bam(servo, tmp_path / "own.json")
    assert json.loads((tmp_path / "own.json").read_text()) == published


def test_friction_of_every_model_by_hand():
    p, motor, outside, speed = FRICTION, 0.6, -0.4, -0.5
    fade = np.exp(-((0.5 / 0.8) ** 1.4))
    m1 = 0.02 + 0.01 * 0.5
    m3 = m1 + 0.08 * 1.0
    m5 = m1 + abs(-0.4 * 0.04 - 0.6 * 0.15) + fade * (0.03 + abs(-0.4 * 0.07 - 0.6 * 0.02))
    expected = {
        "m1": m1,
        "m2": m1 + fade * 0.03,
        "m3": m3,
        "m4": m3 + fade * (0.03 + 0.05 * 1.0),
        "m5": m5,
        "m6": m5 + fade * p["load_friction_external_quad"] * 0.4**2,
    }
    for name, size in expected.items():
        assert servo(name).friction(motor, outside, speed) == pytest.approx(-size), name
    driven = m5 + fade * p["load_friction_motor_quad"] * 0.1**2
    driven += abs(-0.4 * 0.04 - 0.1 * 0.15) - abs(-0.4 * 0.04 - 0.6 * 0.15)
    driven += fade * (abs(-0.4 * 0.07 - 0.1 * 0.02) - abs(-0.4 * 0.07 - 0.6 * 0.02))
    assert servo("m6").friction(0.1, outside, speed) == pytest.approx(-driven)
    assert servo("m6").friction(0.6, -0.4, 0.0) == 0.0


def test_wrong_files_and_arguments_are_refused_by_name(fit, load, tmp_path):
    def refused(text, message):
        (tmp_path / "bad.json").write_text(text)
        with pytest.raises(SkidynError, match=message):
            read_bam(tmp_path / "bad.json")

    refused("{", "not JSON")
    refused('{"kt": 1}', "lacks 'model'")
    refused('{"model": "m7", "actuator": "x"}', "models m1, m2")
    refused('{"model": "m1", "actuator": "x", "friction_base": 1}', "'friction_viscous'")
    refused('{"model": "m1", "actuator": "x", "friction_base": "a"}', "expected a number")
    with pytest.raises(SkidynError, match="friction is not negative"):
        BamModel("m1", "x", {"friction_base": -1.0, "friction_viscous": 0.0})
    model = fit(load("scara"), ["viscous"], consistent=True)
    cases = {
        "expected one of": {"joint": "elbow", "actuator": "x"},
        "number from 1": {"joint": 0, "actuator": "x"},
        "actuator is missing": {"joint": 1},
        "joint3 is prismatic": {"joint": "joint3", "actuator": "x"},
    }
    for message, words in cases.items():
        with pytest.raises(SkidynError, match=message):
            write_bam(model, tmp_path / "x.json", **words)
    still = pd.DataFrame({"time": np.arange(300.0), "q1": 0.0, "dq1": 0.0, "ddq1": 0.0})
    with pytest.raises(SkidynError, match="0 samples of servo move"):
        fit_bam(Robot.from_urdf(PENDULUM), still, np.zeros(300), actuator="x")
