# SPDX-License-Identifier: BSD-3-Clause
"""Position servos simulated as BAM does, and identified from commands and positions."""

import numpy as np
import pandas as pd
import pytest

from skidyn.datasets import load_planar_arm
from skidyn.exceptions import SkidynError
from skidyn.export import BamModel
from skidyn.robots import Robot
from skidyn.simulation import fit_bam_servo, simulate_bam_servo

URDF = """<robot name="pendulum"><link name="stand"/>
  <link name="arm"><inertial><origin xyz="0 0 -0.1"/><mass value="0.5"/>
    <inertia ixx="1e-9" iyy="1e-9" izz="1e-9" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="servo" type="continuous"><parent link="stand"/><child link="arm"/>
    <axis xyz="0 1 0"/></joint></robot>"""
TRUE = {
    "kt": 0.45,
    "R": 3.0,
    "armature": 0.002,
    "q_offset": 0.02,
    "friction_base": 0.015,
    "friction_viscous": 0.006,
    "load_friction_base": 0.06,
}
VOLTS, STEP = 7.4, 0.005


@pytest.fixture(scope="module")
def robot():
    return Robot.from_urdf(URDF)


@pytest.fixture(scope="module")
def servo():
    return BamModel("m3", "xl330", TRUE)


@pytest.fixture(scope="module")
def log(robot, servo):
    """Commands at two gains, the motor off at the end, and what the servo makes of them."""
    parts = []
    for number, (gain, pace) in enumerate([(0.4, 1.3), (1.1, 2.1), (0.4, 3.0)]):
        time = np.arange(0, 3.0, STEP)
        goal = 1.2 * np.sin(pace * time) + 0.3 * np.sin(3.1 * pace * time)
        on = (time < 2.6).astype(float)
        parts.append(
            pd.DataFrame(
                {"time": time, "trajectory": number, "q1": 0.0, "dq1": 0.0, "q_ref1": goal}
            ).assign(enabled=on, gain=gain)
        )
    frame = pd.concat(parts, ignore_index=True)
    return simulate_bam_servo(servo, robot, frame, gain=frame["gain"], volts=VOLTS)


def by_hand(goal, on, gain):
    """The same servo, one step after the other, as BAM's documentation has it."""
    q, dq, path = 0.0, 0.0, []
    inertia = 0.5 * 0.1**2 + 1e-9 + TRUE["armature"]
    for wanted, powered in zip(goal, on, strict=True):
        path.append(q)
        volts = VOLTS * np.clip(gain * (wanted - q), -1, 1)
        motor = powered * TRUE["kt"] * (volts - TRUE["kt"] * dq) / TRUE["R"]
        outside = -0.5 * 9.81 * 0.1 * np.sin(q + TRUE["q_offset"])
        most = TRUE["friction_base"] + TRUE["friction_viscous"] * abs(dq)
        most += TRUE["load_friction_base"] * abs(motor - outside)
        stopping = -(inertia * dq / STEP + motor + outside)
        rate = (motor + outside + np.clip(stopping, -most, most)) / inertia
        dq += STEP * rate
        q += STEP * dq + 0.5 * STEP**2 * rate
    return np.array(path)


def test_the_servo_moves_as_by_hand(log):
    for number in (0, 1, 2):
        own = log[log["trajectory"] == number]
        gain = own["gain"].iloc[0]
        path = by_hand(own["q_ref1"], own["enabled"], gain)
        np.testing.assert_allclose(own["q1"][:-1], path[:-1], atol=1e-9)


@pytest.mark.parametrize("name", ["m1", "m6"])
def test_bam_itself_moves_the_same(name, robot):
    bam = pytest.importorskip("bam.model", reason="better-actuator-models is not installed")
    simulate = pytest.importorskip("bam.simulate")
    values = {**TRUE, "friction_stribeck": 0.02, "dtheta_stribeck": 0.5, "alpha": 1.5}
    values |= {"load_friction_motor": 0.1, "load_friction_external": 0.03}
    values |= {"load_friction_motor_stribeck": 0.02, "load_friction_external_stribeck": 0.05}
    values |= {"load_friction_motor_quad": 0.005, "load_friction_external_quad": 0.003}
    servo = BamModel(name, "xl330", values)
    other = bam.load_model_from_dict({**values, "model": name, "actuator": "xl330"})
    time = np.arange(0, 2.0, STEP)
    goal = np.sin(3 * time)
    entries = [
        {"position": 0.0, "speed": 0.0, "goal_position": g, "torque_enable": True} for g in goal
    ]
    log = {"mass": 0.5, "arm_mass": 0.0, "length": 0.1, "kp": 300, "vin": VOLTS}
    path, _, _ = simulate.Simulator(other).rollout_log(
        {**log, "dt": STEP, "entries": entries}, simulate_control=True
    )
    gain = 300 * (4096 / (2 * np.pi)) / (256 * 885)
    table = pd.DataFrame({"time": time, "q1": 0.0, "dq1": 0.0, "q_ref1": goal})
    own = simulate_bam_servo(servo, robot, table, gain=gain, volts=VOLTS)
    # BAM has its own value of gravity, 9.80665
    np.testing.assert_allclose(own["q1"][:-1], path[:-1], atol=2e-3)


def test_a_servo_is_known_again_from_its_motion(robot, servo, log):
    rng = np.random.default_rng(0)
    noisy = log.assign(q1=log["q1"] + 1e-3 * rng.normal(size=len(log)))
    noisy["dq1"] = 0.0
    found = fit_bam_servo(robot, noisy, gain=log["gain"], volts=VOLTS, name="m3", actuator="xl330")
    assert found.name == "m3" and found.actuator == "xl330"
    for key in ("kt", "R", "friction_viscous", "load_friction_base"):
        assert found.parameters[key] == pytest.approx(TRUE[key], rel=0.1), key
    motion = simulate_bam_servo(found, robot, log, gain=log["gain"], volts=VOLTS)
    assert np.abs(motion["q1"] - log["q1"]).max() < 5e-3


def test_wrong_input_is_refused_by_name(robot, servo, log):
    words = {"gain": 1.0, "volts": VOLTS}
    with pytest.raises(SkidynError, match="lacks the column.*q_ref1"):
        simulate_bam_servo(servo, robot, log.drop(columns="q_ref1"), **words)
    with pytest.raises(SkidynError, match="one revolute joint"):
        simulate_bam_servo(servo, load_planar_arm(), log, **words)
    with pytest.raises(SkidynError, match="gain is to be"):
        simulate_bam_servo(servo, robot, log, gain=[1.0, 2.0], volts=VOLTS)
    with pytest.raises(SkidynError, match="'q1' has entries"):
        simulate_bam_servo(servo, robot, log.assign(q1=np.nan), **words)
    friction = {"friction_base": 0.1, "friction_viscous": 0.1}
    with pytest.raises(SkidynError, match="lacks kt, R, armature"):
        simulate_bam_servo(BamModel("m1", "x", friction), robot, log, **words)
    with pytest.raises(SkidynError, match="models m1"):
        fit_bam_servo(robot, log, name="m9", actuator="x", **words)
