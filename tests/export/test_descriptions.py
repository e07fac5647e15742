# SPDX-License-Identifier: BSD-3-Clause
"""Exported URDF and MJCF files read back to the same dynamics."""

import json

import numpy as np
import pytest

from skidyn.datasets import load_panda, load_scara, load_srs_arm, load_ur5, load_ur10e
from skidyn.export import write_mjcf, write_urdf
from skidyn.robots import Robot

ROBOTS = [load_scara, load_srs_arm, load_ur5, load_ur10e]

FOLLOWING = """
<robot name="gripper"><link name="base"/>
  <link name="left"><inertial><origin xyz="0.1 0 0"/><mass value="1"/>
    <inertia ixx="0.1" iyy="0.2" izz="0.2" ixy="0.01" ixz="0" iyz="0"/></inertial></link>
  <link name="right"><inertial><origin xyz="0 0.1 0"/><mass value="2"/>
    <inertia ixx="0.1" iyy="0.2" izz="0.2" ixy="0.01" ixz="0" iyz="0"/></inertial></link>
  <link name="pad"><inertial><origin xyz="0 0.1 0"/><mass value="0.3"/>
    <inertia ixx="0.1" iyy="0.2" izz="0.2" ixy="0.01" ixz="0" iyz="0"/></inertial></link>
  <joint name="lead" type="prismatic"><parent link="base"/><child link="left"/>
    <origin xyz="1 2 3" rpy="0.1 1.5707963267948966 0.3"/><axis xyz="1 1 0"/>
    <limit lower="-1" upper="1" velocity="1" effort="1"/></joint>
  <joint name="follow" type="continuous"><parent link="left"/><child link="right"/>
    <origin rpy="0.4 -0.2 0.3"/><axis xyz="0 1 1"/>
    <mimic joint="lead" multiplier="-2" offset="0.3"/></joint>
  <joint name="glue" type="fixed"><parent link="right"/><child link="pad"/>
    <origin xyz="0 0 1" rpy="1 2 3"/></joint>
</robot>
"""


def consistent_parameters(robot):
    """Other parameters of real bodies: heavier, with a mass added off center."""
    added = np.array([0.5, 0.05, -0.02, 0.03, 0.02, 0.001, -0.002, 0.02, 0.003, 0.02])
    return 1.3 * robot.inertial_parameters + added


def states(robot):
    return np.random.default_rng(0).normal(size=(3, 20, robot.n_joints))


@pytest.mark.parametrize("load", [*ROBOTS, load_panda, lambda: Robot.from_urdf(FOLLOWING)])
def test_urdf_reads_back_to_the_same_robot(load, tmp_path):
    robot = load()
    parameters = consistent_parameters(robot)
    friction = np.arange(1.0, robot.n_joints + 1)
    path = tmp_path / "robot.urdf"
    assert (
        write_urdf(robot, path, parameters=parameters, viscous=friction, coulomb=2 * friction) == ()
    )
    again = Robot.from_urdf(path)
    expected = robot.inverse_dynamics(*states(robot), parameters=parameters)
    np.testing.assert_allclose(again.inverse_dynamics(*states(robot)), expected, atol=1e-10)
    assert again.joint_names == robot.joint_names and again.joint_types == robot.joint_types
    np.testing.assert_array_equal(again.position_limits, robot.position_limits)
    np.testing.assert_array_equal(again.joint_dynamics["damping"], friction)
    np.testing.assert_array_equal(again.joint_dynamics["friction"], 2 * friction)
    q = states(robot)[0]
    for link in robot.links:
        for a, b in zip(
            again.forward_kinematics(q, link), robot.forward_kinematics(q, link), strict=True
        ):
            np.testing.assert_allclose(a, b, atol=1e-12)


@pytest.mark.parametrize("load", ROBOTS)
def test_mjcf_has_the_same_inverse_dynamics_in_mujoco(load, tmp_path):
    mujoco = pytest.importorskip("mujoco")
    robot = load()
    parameters = consistent_parameters(robot)
    viscous, rotor = np.random.default_rng(1).uniform(0.1, 2.0, size=(2, robot.n_joints))
    path = tmp_path / "robot.xml"
    left_out = write_mjcf(
        robot, path, parameters=parameters, viscous=viscous, rotor_inertia=rotor,
        coulomb=np.zeros(robot.n_joints),
    )  # fmt: skip
    assert left_out == ()
    model = mujoco.MjModel.from_xml_path(str(path))
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    data = mujoco.MjData(model)
    q, dq, ddq = states(robot)
    expected = robot.inverse_dynamics(q, dq, ddq, parameters=parameters)
    expected = expected + viscous * dq + rotor * ddq
    for k in range(len(q)):
        data.qpos[:], data.qvel[:], data.qacc[:] = q[k], dq[k], ddq[k]
        mujoco.mj_inverse(model, data)
        np.testing.assert_allclose(data.qfrc_inverse, expected[k], atol=1e-8)


def test_mjcf_ties_joints_that_follow(tmp_path):
    mujoco = pytest.importorskip("mujoco")
    robot = Robot.from_urdf(FOLLOWING)
    write_mjcf(robot, tmp_path / "gripper.xml")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "gripper.xml"))
    assert model.neq == 1 and model.nv == 2 and model.nsite == 2


def test_what_a_format_cannot_hold_goes_to_the_side_car(tmp_path):
    robot = load_scara()
    ripple = {"amplitude": np.array([0.1, 0.2]), "harmonic": 3}
    options = {"rotor_inertia": [1, 2, 3, 4], "effects": {"torque_ripple": ripple}}
    for write, suffix, expected in (
        (write_urdf, "urdf", ("torque_ripple", "rotor_inertia")),
        (write_mjcf, "xml", ("torque_ripple",)),
    ):
        left_out = write(robot, tmp_path / f"robot.{suffix}", **options)
        assert left_out == expected
    for suffix, expected in (
        ("urdf", ("torque_ripple", "rotor_inertia")),
        ("xml", ("torque_ripple",)),
    ):
        sidecar = json.loads((tmp_path / f"robot.{suffix}.skidyn.json").read_text())
        assert sidecar["joints"] == list(robot.joint_names)
        assert tuple(sidecar["not_held"]) == expected
        assert sidecar["not_held"]["torque_ripple"] == {"amplitude": [0.1, 0.2], "harmonic": 3}


@pytest.mark.parametrize("write", [write_urdf, write_mjcf])
def test_impossible_bodies_are_refused_by_name(write, tmp_path):
    robot = load_scara()
    negative, indefinite = robot.inertial_parameters.copy(), robot.inertial_parameters.copy()
    negative[1, 0] = -1.0
    indefinite[2, 4] = -1.0
    with pytest.raises(ValueError, match="'link2' has a mass of -1"):
        write(robot, tmp_path / "x", parameters=negative)
    with pytest.raises(ValueError, match="'quill' has the principal moments"):
        write(robot, tmp_path / "x", parameters=indefinite)
    with pytest.raises(ValueError, match="viscous has shape"):
        write(robot, tmp_path / "x", viscous=[1.0])
    assert not (tmp_path / "x").exists()
