# SPDX-License-Identifier: BSD-3-Clause
"""Identified numbers in the user's own files: executed by MuJoCo, nothing else touched."""

import re

import numpy as np
import pytest

from skidyn.datasets import make_hidden_effect_log
from skidyn.exceptions import SkidynError
from skidyn.export import merge_mjcf, merge_urdf
from skidyn.identification import RBDRegressor
from skidyn.robots import Robot

URDF = """<?xml version="1.0"?>
<!-- an arm with a hand that nobody may touch -->
<robot name="arm">
  <link name="base"/>
  <link name="upper">
    <inertial><origin xyz="0.2 0 0" rpy="0 0 0.3"/><mass value="2"/>
      <inertia ixx="0.02" ixy="0" ixz="0" iyy="0.05" iyz="0" izz="0.05"/></inertial>
    <visual><geometry><mesh filename="package://arm/upper.stl"/></geometry></visual>
  </link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
    <axis xyz="0 1 0"/><limit effort="50" velocity="3" lower="-3" upper="3"/>
    <dynamics damping="0.1" friction='0.2'/></joint>
  <link name="lower"><visual><geometry><sphere radius="0.1"/></geometry></visual>
    <inertial><origin xyz="0.1 0 0.02"/><mass value="1"/>
      <inertia ixx="0.01" ixy="0.001" ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial></link>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/>
    <origin xyz="0.4 0 0" rpy="0.2 0 0"/><axis xyz="0 1 0"/>
    <limit effort="50" velocity="3" lower="-3" upper="3"/></joint>
  <link name="hand"><inertial><origin xyz="0 0 0.05"/><mass value="0.3"/>
    <inertia ixx="0.001" ixy="0" ixz="0" iyy="0.001" iyz="0" izz="0.001"/></inertial></link>
  <joint name="mount" type="fixed"><parent link="lower"/><child link="hand"/>
    <origin xyz="0.3 0 0" rpy="0 0.5 0"/></joint>
</robot>
"""
#: The same mechanism in other frames, in degrees, with a hand, actuators and sensors of its own.
MJCF = """<mujoco model="own">
  <compiler angle="degree"/>   <!-- do not touch -->
  <option gravity="0 0 -9.81"/>
  <default><joint damping="7"/></default>
  <worldbody>
    <body name="stand" pos="0 0 1">
      <geom type="box" size=".1 .1 .1"/>
      <body name="A" euler="0 0 0">
        <joint name="shoulder" axis="0 1 0" range="-170 170"/>
        <geom type="capsule" size=".05" fromto="0 0 0 .4 0 0"/>
        <body name="B" pos=".4 0 0" euler="11.4591559026165 0 90">
          <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
          <joint name="elbow" axis="1 0 0" armature='0.5' />
          <body name="hand" pos="0 -.3 0"><geom type="sphere" size=".02" mass="0.3"/></body>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator><motor joint="elbow" gear="50"/></actuator>
  <sensor><jointpos joint="shoulder"/></sensor>
</mujoco>
"""
EFFECTS = ("viscous", "coulomb", "rotor_inertia", ("spring", [2]))


@pytest.fixture(scope="module")
def robot():
    return Robot.from_urdf(URDF)


@pytest.fixture(scope="module")
def model(robot):
    log = make_hidden_effect_log(robot, None, n_trajectories=4, random_state=1)
    q = log.X[["q1", "q2"]].to_numpy()
    y = log.y + 3.0 * (q - 0.4) * [0, 1]
    return RBDRegressor(robot, EFFECTS, consistent=True).fit(log.X, y)


@pytest.fixture
def own(tmp_path):
    (tmp_path / "own.urdf").write_text(URDF, encoding="utf-8")
    (tmp_path / "own.xml").write_text(MJCF, encoding="utf-8")
    return tmp_path


def torques(mujoco, path, q, dq, ddq, joints):
    """MuJoCo's inverse dynamics of a file, friction included."""
    world = mujoco.MjModel.from_xml_path(str(path))
    world.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    world.jnt_limited[:] = 0
    data, result = mujoco.MjData(world), []
    at = [world.joint(name).dofadr[0] for name in joints]
    for row in zip(q, dq, ddq, strict=True):
        data.qpos[at], data.qvel[at], data.qacc[at] = row
        mujoco.mj_inverse(world, data)
        result.append(data.qfrc_inverse[at].copy())
    return np.array(result)


def fast_motion(n=30):
    """Away from rest, where MuJoCo's frictionloss creeps."""
    rng = np.random.default_rng(0)
    q, dq, ddq = rng.uniform(-1, 1, (3, n, 2))
    return q, np.sign(dq) * (1 + np.abs(dq)), ddq


def model_torque(model, q, dq, ddq):
    from skidyn.effects import Signals

    signals = Signals(q, dq, ddq, np.zeros(len(q), dtype=int), robot=model.robot_)
    return model._torque(signals)


def test_mujoco_computes_the_torque_of_the_model_from_the_merged_file(model, own):
    mujoco = pytest.importorskip("mujoco")
    assert merge_mjcf(model, own / "own.xml", own / "new.xml") == ()
    motion = fast_motion()
    expected = model_torque(model, *motion)
    found = torques(mujoco, own / "new.xml", *motion, model.robot_.joint_names)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6 * np.abs(expected).max())


def test_every_other_byte_of_the_mjcf_stays(model, own):
    pytest.importorskip("mujoco")
    merge_mjcf(model, own / "own.xml", own / "new.xml")
    text = (own / "new.xml").read_text("utf-8")
    text = re.sub(r"\n *<inertial[^>]*/>(?=\n *<joint name=.shoulder)", "", text)
    text = re.sub(r"<inertial[^>]*/>", '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>', text)
    text = re.sub(r'(axis="1 0 0" armature=)"[^"]*"', r"\1'0.5'", text)
    text = re.sub(r' (damping|frictionloss|armature|stiffness|springref)="(?!7")[^"]*"', "", text)
    assert text == MJCF


def test_merged_twice_changes_nothing_more(model, own):
    pytest.importorskip("mujoco")
    merge_mjcf(model, own / "own.xml", own / "new.xml")
    merge_mjcf(model, own / "new.xml", own / "again.xml")
    read = [
        torques(pytest.importorskip("mujoco"), own / name, *fast_motion(), ("shoulder", "elbow"))
        for name in ("new.xml", "again.xml")
    ]
    np.testing.assert_allclose(*read, atol=1e-9)


def test_merged_urdf_gives_the_torque_and_keeps_pictures_and_comments(model, own):
    left = merge_urdf(model, own / "own.urdf", own / "new.urdf")
    assert any("spring" in name for name in left)
    assert (own / "new.urdf.skidyn.json").exists()
    read = Robot.from_urdf(own / "new.urdf")
    motion = fast_motion()
    np.testing.assert_allclose(
        read.inverse_dynamics(*motion), model.rigid_body_torque(*motion), rtol=1e-6, atol=1e-6
    )
    sizes = {t.kind: t for t in model.effect_terms_ if t.joints == (1,)}
    np.testing.assert_allclose(
        read.joint_dynamics["damping"][0], model.effect_coefficients_[sizes["viscous"]]
    )
    text = (own / "new.urdf").read_text("utf-8")
    for kept in ("<!-- an arm", "package://arm/upper.stl", '<sphere radius="0.1"/>', '"mount"'):
        assert kept in text
    hand = re.search(r'<link name="hand">.*?</link>', URDF, re.DOTALL).group()
    assert hand in text


def test_wrong_files_are_refused(model, own, tmp_path):
    pytest.importorskip("mujoco")
    cases = {
        "joint": (MJCF.replace('name="elbow" axis', 'name="knee" axis'), "no joint 'elbow'"),
        "axis": (MJCF.replace('"elbow" axis="1 0 0"', '"elbow" axis="0 1 0"'), "does not move"),
        "geom": (MJCF.replace('angle="degree"', 'inertiafromgeom="true"'), "inertiafromgeom"),
        "doctype": ("<!DOCTYPE mujoco>" + MJCF, "document type"),
        "broken": (MJCF.replace("</mujoco>", ""), "not XML"),
    }
    for name, (text, message) in cases.items():
        path = tmp_path / f"{name}.xml"
        text = text.replace('joint="elbow"', 'joint="shoulder"') if name == "joint" else text
        path.write_text(text, encoding="utf-8")
        with pytest.raises(SkidynError, match=message):
            merge_mjcf(model, path, tmp_path / "new.xml")
    assert not (tmp_path / "new.xml").exists()
    (tmp_path / "other.urdf").write_text(URDF.replace('mass value="2"', 'mass value="3"'))
    with pytest.raises(SkidynError, match="not the URDF"):
        merge_urdf(model, tmp_path / "other.urdf", tmp_path / "new.urdf")
