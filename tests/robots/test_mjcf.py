# SPDX-License-Identifier: BSD-3-Clause
"""MJCF models against MuJoCo's own inverse dynamics."""

import numpy as np
import pytest

from skidyn.exceptions import RobotDescriptionError
from skidyn.robots import Robot

mujoco = pytest.importorskip("mujoco")

ARM = """
<mujoco model="arm"><option gravity="0 1 -9"/><compiler angle="radian"/>
 <worldbody><body name="base" pos="0 0 0.2" euler="0.1 0.2 0.3">
  <geom type="box" size="0.1 0.1 0.1" mass="1"/>
  <body name="upper" pos="0.1 0 0.3" euler="0.4 0 0">
   <joint name="yaw" axis="0 0 1" pos="0.02 0 0.01" ref="0.3" damping="0.4" frictionloss="0.2"/>
   <joint name="pitch" axis="0 1 1" range="-1 2"/>
   <geom type="capsule" fromto="0 0 0 0.3 0.1 0" size="0.04" mass="2"/>
   <body name="rod" pos="0.3 0.1 0">
    <joint name="slide" type="slide" axis="1 0 0.5" ref="0.1"/>
    <geom type="box" size="0.05 0.2 0.03" mass="1.5" pos="0 0.1 0"/>
    <site name="tip" pos="0 0.3 0"/>
   </body>
   <body name="finger" pos="0 0 0.2"><joint name="wrist" axis="1 0 0" pos="0 0 0.1"/>
    <geom type="box" size="0.02 0.05 0.1" mass="0.4"/></body>
  </body></body></worldbody>
</mujoco>
"""


def test_torques_and_frames_are_those_of_mujoco():
    robot, model = Robot.from_mjcf(ARM), mujoco.MjModel.from_xml_string(ARM)
    model.dof_damping[:] = model.dof_frictionloss[:] = 0.0
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_LIMIT
    data = mujoco.MjData(model)
    names = [model.joint(j).name for j in range(model.njnt)]
    order = [names.index(name) for name in robot.joint_names]
    q, dq, ddq = np.random.default_rng(0).uniform(-2, 2, (3, 20, 4))
    torque = robot.inverse_dynamics(q, dq, ddq)
    place, _ = robot.forward_kinematics(q, "tip")
    for k in range(20):
        data.qpos[order], data.qvel[order], data.qacc[order] = q[k], dq[k], ddq[k]
        mujoco.mj_inverse(model, data)
        np.testing.assert_allclose(torque[k], data.qfrc_inverse[order], atol=1e-9)
        np.testing.assert_allclose(place[k], data.site("tip").xpos, atol=1e-9)


def test_limits_friction_and_gravity_are_read():
    robot = Robot.from_mjcf(ARM)
    assert robot.joint_names == ("yaw", "pitch", "slide", "wrist")
    assert robot.joint_types == ("continuous", "revolute", "prismatic", "continuous")
    assert robot.position_limits[1].tolist() == [-1, 2]
    assert robot.joint_dynamics["damping"].tolist() == [0.4, 0, 0, 0]
    assert robot.joint_dynamics["friction"].tolist() == [0.2, 0, 0, 0]
    assert robot.gravity.tolist() == [0, 1, -9]
    assert Robot.from_mjcf(ARM, gravity=(0, 0, -1)).gravity.tolist() == [0, 0, -1]


def test_a_ratio_between_joints_is_a_mimic_joint():
    tied = ARM.replace(
        "</mujoco>",
        '<equality><joint joint1="wrist" joint2="pitch" polycoef="0.1 -2 0 0 0"/></equality>'
        "</mujoco>",
    )
    robot = Robot.from_mjcf(tied)
    assert robot.joint_names == ("yaw", "pitch", "slide")
    assert robot.tree.multipliers[-1] == -2 and robot.tree.offsets[-1] == pytest.approx(0.1)


def test_what_is_no_rigid_body_is_named():
    with pytest.warns(UserWarning, match="armature of joint 'slide'.*'rotor_inertia'"):
        Robot.from_mjcf(ARM.replace('name="slide"', 'name="slide" armature="0.1"'))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (ARM.replace('<joint name="wrist" axis="1 0 0" pos="0 0 0.1"/>', '<joint type="ball"/>'),
         "'joint3' is a ball or a free joint"),
        (ARM.replace('type="slide"', 'type="screw"'), "MuJoCo cannot compile"),
        ('<!DOCTYPE mujoco [<!ENTITY a "b">]><mujoco/>', "document type"),
    ],
)  # fmt: skip
def test_wrong_models_are_refused(text, message):
    with pytest.raises(ValueError, match=message):
        Robot.from_mjcf(text)


def test_a_file_is_read_by_its_path(tmp_path):
    path = tmp_path / "arm.xml"
    path.write_text(ARM)
    assert Robot.from_mjcf(path).joint_names == Robot.from_mjcf(ARM.encode()).joint_names
    assert Robot.from_file(path).joint_names == Robot.from_mjcf(path).joint_names


def test_a_body_of_infinite_size_is_named():
    text = """<mujoco><worldbody><body name="a"><joint name="j" axis="0 1 0"/>
    <geom size="inf" mass="1"/></body></worldbody></mujoco>"""
    with pytest.raises(RobotDescriptionError):
        Robot.from_mjcf(text)
