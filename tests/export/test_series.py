# SPDX-License-Identifier: BSD-3-Clause
"""Elastic gears and gears with play in the user's MJCF: executed by MuJoCo."""

import re

import numpy as np
import pytest

from skidyn.effects import Signals, Term, get_effect
from skidyn.exceptions import SkidynError
from skidyn.export import merge_mjcf, write_mjcf
from skidyn.identification import RBDRegressor
from skidyn.robots import Robot
from skidyn.simulation import simulate

mujoco = pytest.importorskip("mujoco")

INERTIA = '<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.05" iyz="0" izz="0.05"/>'
URDF = f"""<robot name="arm"><link name="base"/>
  <link name="upper"><inertial><origin xyz="0.2 0 0"/><mass value="2"/>{INERTIA}</inertial></link>
  <link name="lower"><inertial><origin xyz="0.1 0 0"/><mass value="1"/>{INERTIA}</inertial></link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
    <axis xyz="0 1 0"/><limit effort="50" velocity="9" lower="-3" upper="3"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/>
    <origin xyz="0.4 0 0"/><axis xyz="0 1 0"/>
    <limit effort="50" velocity="9" lower="-3" upper="3"/></joint>
</robot>"""
#: Another frame of the elbow, degrees, and defaults that a passive joint must not inherit.
MJCF = """<mujoco>
  <compiler angle="degree"/>
  <default><joint damping="7" armature="2" frictionloss="1" margin="0.1"/>
    <default class="own"><joint axis="0 0 1" range="-100 100"/></default></default>
  <worldbody>
    <body name="A">
      <joint name="shoulder" axis="0 1 0"/>
      <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
      <body name="B" pos=".4 0 0" euler="-90 0 0">
        <joint name="elbow" class="own"/>  <!-- the gear -->
        <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor joint="elbow"/></actuator>
</mujoco>
"""
ELASTIC = Term("joint_elasticity", (2,), {"resonance": 12.0, "damping": 0.1})
STIFFENING = Term("joint_elasticity", (2,), {"resonance": 12.0, "stiffening": 1.0})
LOOSE = Term("backlash", (2,), {"gap": 0.04})


@pytest.fixture(scope="module")
def robot():
    # the zero of the elbow is the same in both files: x along the link, y up or down
    return Robot.from_urdf(URDF)


def model_of(robot, *terms, effects=("viscous", "coulomb", "rotor_inertia"), size=None):
    """A model with given effects of a known size."""
    q, dq, ddq = np.random.default_rng(0).normal(size=(3, 300, 2))
    torque = robot.inverse_dynamics(q, dq, ddq) + 0.3 * dq + 0.2 * np.tanh(dq / 3e-3) + 0.1 * ddq
    model = RBDRegressor(robot, effects, consistent=True).fit(np.hstack([q, dq, ddq]), torque)
    model.effect_terms_ = type(model.effect_terms_)([*model.effect_terms_, *terms])
    for term in terms:
        default = 1.0 if term.kind == "backlash" else 1 / 400.0
        model.effect_coefficients_[term] = np.array([default if size is None else size])
    return model


@pytest.fixture
def merged(tmp_path):
    """Merge a model into a file, and load the result."""

    def merge(model, text=MJCF):
        (tmp_path / "own.xml").write_text(text, encoding="utf-8")
        left = merge_mjcf(model, tmp_path / "own.xml", tmp_path / "new.xml")
        world = mujoco.MjModel.from_xml_path(str(tmp_path / "new.xml"))
        world.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
        return world, left, (tmp_path / "new.xml").read_text("utf-8")

    return merge


def motor_and_link(model, motor, link):
    """Torque of the motors: effects of their own motion, bodies of that of the links."""
    rigid = [t for t in model.effect_terms_ if t not in (ELASTIC, LOOSE)]
    signals = Signals(*motor, np.zeros(len(motor[0]), dtype=int), robot=model.robot_)
    torque = model.rigid_body_torque(*link)
    for term in rigid:
        for j, block in term.torque_columns(signals).items():
            torque[:, j] += block @ model.effect_coefficients_[term]
    return torque


def inverse(world, motor, twist, passive):
    """MuJoCo's torques: of the two motors, and of the passive joint, which has no motor."""
    data, result = mujoco.MjData(world), []
    names = ("shoulder", "elbow", passive)
    at = [world.joint(name).dofadr[0] for name in names]
    for k in range(len(motor[0])):
        for values, own, extra in zip((data.qpos, data.qvel, data.qacc), motor, twist, strict=True):
            values[at] = [*own[k], extra[k]]
        mujoco.mj_inverse(world, data)
        result.append(data.qfrc_inverse[at].copy())
    return np.array(result)


def test_torques_of_an_elastic_gear_are_those_of_the_model(robot, merged):
    model = model_of(robot, ELASTIC)
    world, left, _ = merged(model)
    assert left == ()
    stiffness, damping = 400.0, 0.2 * 400.0 / (2 * np.pi * 12.0)
    rng = np.random.default_rng(1)
    q, dq, ddq = rng.uniform(-1, 1, (3, 40, 2))
    dq = np.sign(dq) * (1 + np.abs(dq))  # away from rest, where frictionloss creeps
    x, dx = rng.uniform(-0.02, 0.02, 40), rng.uniform(-0.1, 0.1, 40)
    elbow = np.array([0.0, 1.0])

    def link(ddx):
        return q + x[:, None] * elbow, dq + dx[:, None] * elbow, ddq + ddx[:, None] * elbow

    # the spring supplies what the link takes: solved for the acceleration of the link
    start = model.rigid_body_torque(*link(np.zeros(40)))[:, 1]
    slope = model.rigid_body_torque(*link(np.ones(40)))[:, 1] - start
    ddx = -(start + stiffness * x + damping * dx) / slope
    expected = motor_and_link(model, (q, dq, ddq), link(ddx))
    found = inverse(world, (q, dq, ddq), (x, dx, ddx), "elbow_elasticity")
    scale = np.abs(expected).max()
    np.testing.assert_allclose(found[:, :2], expected, rtol=0, atol=1e-6 * scale)
    np.testing.assert_allclose(found[:, 2], 0.0, atol=1e-6 * scale)


def test_the_effect_of_first_order_agrees_within_a_hundredth(robot, merged):
    """The effect changes the torque by its derivative along the wind-up, MuJoCo by all of it."""
    smooth = ("viscous", "rotor_inertia")
    model = model_of(robot, ELASTIC, effects=smooth)
    world, _, _ = merged(model)
    time = np.arange(0, 4, 1e-3)
    phase = np.array([0.3, 1.1]) + np.outer(time, [2.1, 3.7])
    rate = np.array([2.1, 3.7])
    motor = np.sin(phase), rate * np.cos(phase), -(rate**2) * np.sin(phase)
    signals = Signals(
        *motor, np.zeros(len(time), dtype=int), time=time, robot=robot,
        load=model.rigid_body_torque(*motor), inertial_parameters=model.inertial_parameters_,
    )  # fmt: skip
    moves = get_effect("joint_elasticity").moves(signals, 1, **ELASTIC.shape)
    twist = [-move / 400.0 for move in moves]
    found = inverse(world, motor, twist, "elbow_elasticity")
    expected = model._torque(signals)
    error = np.abs(found[:, :2] - expected).max(axis=0)
    assert np.all(error < 0.01 * np.abs(expected).max(axis=0))
    rigid = model_of(robot, effects=smooth)._torque(signals)
    assert np.all(np.abs(rigid - expected).max(axis=0) > 2 * error)


@pytest.mark.slow
def test_both_engines_move_alike(robot, merged):
    model = model_of(robot, ELASTIC, effects=("viscous", "rotor_inertia"))
    world, _, _ = merged(model)
    time = np.arange(0, 1.0, 1e-3)
    torque = np.column_stack([8 * np.cos(5 * time), 3 * np.sin(9 * time)])
    X = np.column_stack([np.zeros((len(time), 6)), time])
    import pandas as pd

    names = ["q1", "q2", "dq1", "dq2", "ddq1", "ddq2", "time"]
    own = simulate(model, pd.DataFrame(X, columns=names), torque, horizon=None, step=2.5e-4)
    data = mujoco.MjData(world)
    start = model.rigid_body_torque(*np.zeros((3, 1, 2)))[0, 1]
    data.qpos[world.joint("elbow_elasticity").qposadr[0]] = -start / 400.0
    world.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
    world.opt.timestep = 5e-4
    at = [world.joint(name).dofadr[0] for name in ("shoulder", "elbow")]
    path = [data.qpos[at].copy()]
    for k in range(len(time) - 1):
        for part in (0.25, 0.75):
            data.qfrc_applied[at] = torque[k] + part * (torque[k + 1] - torque[k])
            mujoco.mj_step(world, data)
        path.append(data.qpos[at].copy())
    np.testing.assert_allclose(own[["q1", "q2"]], path, atol=1e-6)


def test_a_link_with_play_stays_until_the_motor_has_crossed_the_gap(robot, merged):
    model = model_of(robot, LOOSE, effects=("rotor_inertia",))
    world, left, text = merged(model)
    assert left == ()
    half = np.rad2deg(0.02)
    low, high = re.search(r'name="elbow_backlash"[^>]* range="(\S+) (\S+)"', text).groups()
    np.testing.assert_allclose([float(low), float(high)], [-half, half])
    world.opt.gravity[:] = 0.0
    world.opt.timestep = 1e-4
    data = mujoco.MjData(world)
    elbow, gap = (world.joint(n).dofadr[0] for n in ("elbow", "elbow_backlash"))
    moved, driven = [], []
    while data.qpos[elbow] < 0.1:
        data.qfrc_applied[elbow] = 0.5
        mujoco.mj_step(world, data)
        driven.append(data.qpos[elbow])
        moved.append(data.qpos[elbow] + data.qpos[gap])
    driven, moved = np.array(driven), np.array(moved)
    inside = driven < 0.019
    assert np.abs(moved[inside]).max() < 1e-4 and inside.sum() > 100
    assert moved[-1] > 0.05  # pushed or thrown by the flank
    # the torque in the gap is that of the motor alone
    motor = np.random.default_rng(0).normal(size=(3, 20, 2))
    motor[1] = motor[2] = 0.0
    motor[2, :, 1] = 3.0
    still = [np.zeros(20), np.zeros(20), -motor[2, :, 1]]
    found = inverse(world, motor, still, "elbow_backlash")
    inertia = model.effect_coefficients_[model.effect_terms_[1]][0]
    np.testing.assert_allclose(found[:, 1], 3.0 * inertia, rtol=1e-6)


@pytest.mark.parametrize("term", [ELASTIC, LOOSE])
def test_nothing_else_of_the_file_is_touched(robot, merged, tmp_path, term):
    plain = merged(model_of(robot))[2]
    _, _, text = merged(model_of(robot, term))
    added = re.findall(r"\n *<joint [^>]*name=.elbow_[a-z]+.[^>]*/>", text)
    assert len(added) == 1
    assert text.replace(added[0], "") == plain
    assert "/>  <!-- the gear -->" in text
    again = merged(model_of(robot, term), text)[2]
    assert again == text


def test_effects_without_a_joint_are_left_with_a_reason(robot, merged, tmp_path):
    keyed = MJCF.replace("</mujoco>", '<keyframe><key name="home" qpos="0 0"/></keyframe></mujoco>')
    cases = [
        (model_of(robot, ELASTIC, effects=("viscous",)), MJCF, "rotor inertia"),
        (model_of(robot, ELASTIC, size=-1e-3), MJCF, "not positive"),
        (model_of(robot, LOOSE, ELASTIC), MJCF, "has its backlash already"),
        (model_of(robot, ELASTIC), keyed, "keyframe 'home'"),
        (model_of(robot, STIFFENING), MJCF, "changes with the load"),
    ]
    for model, text, reason in cases:
        _, left, _ = merged(model, text)
        assert len(left) == 1 and left[0].startswith("joint_elasticity of elbow (")
        assert reason in left[0]
        assert reason in (tmp_path / "new.xml.skidyn.json").read_text("utf-8")


def test_names_that_are_taken_are_refused(robot, merged):
    elastic = model_of(robot, ELASTIC)
    taken = '<joint name="elbow_elasticity" axis="0 0 1"/>'
    other = MJCF.replace('<body name="A">', '<body name="A">' + taken)
    with pytest.raises(SkidynError, match="'elbow_elasticity' of the passive joint"):
        merged(elastic, other)
    loose = merged(model_of(robot, LOOSE))[2]
    with pytest.raises(SkidynError, match="has the passive joint 'elbow_backlash'"):
        merged(elastic, loose)


def test_a_new_file_has_the_joint_too(robot, merged, tmp_path):
    model = model_of(robot, ELASTIC)
    assert write_mjcf(model, tmp_path / "robot.xml") == ()
    world = mujoco.MjModel.from_xml_path(str(tmp_path / "robot.xml"))
    motion = np.random.default_rng(3).uniform(0.5, 1.5, (3, 10, 2))
    twist = np.random.default_rng(4).uniform(-0.02, 0.02, (3, 10))
    found = inverse(world, motion, twist, "elbow_elasticity")
    expected = inverse(merged(model)[0], motion, twist, "elbow_elasticity")
    np.testing.assert_allclose(found, expected, atol=1e-6 * np.abs(expected).max())
