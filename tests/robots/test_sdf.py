# SPDX-License-Identifier: BSD-3-Clause
"""SDF models against the same robot as URDF, and what is refused."""

import numpy as np
import pytest

from skidyn.exceptions import RobotDescriptionError
from skidyn.robots import Robot

INERTIA = (
    "<mass>{m}</mass><inertia><ixx>0.2</ixx><ixy>0.01</ixy><ixz>0</ixz><iyy>0.3</iyy><iyz>0</iyz>"
    "<izz>0.25</izz></inertia>"
)
LIMIT = "<limit><lower>-1</lower><upper>2</upper><effort>9</effort><velocity>-1</velocity></limit>"
ARM = f"""
<sdf version="1.9"><model name="arm">
 <frame name="shelf"><pose>0 0 0.5 0 0 0.3</pose></frame>
 <link name="base"><pose>0 0 0.1 0 0 0</pose><inertial>{INERTIA.format(m=1)}</inertial></link>
 <link name="upper"><pose relative_to="shelf">0.1 0 0 0.2 0 0</pose>
  <inertial><pose>0.1 0 0.2 0 0.4 0</pose>{INERTIA.format(m=2)}</inertial></link>
 <link name="rod"><pose relative_to="slide"/>
  <inertial><pose>0 0.1 0 0 0 0</pose>{INERTIA.format(m=3)}</inertial></link>
 <joint name="foot" type="fixed"><parent>world</parent><child>base</child></joint>
 <joint name="turn" type="revolute"><pose>0 0.05 0 0 0 0.7</pose><parent>base</parent>
  <child>upper</child><axis><xyz>0 1 1</xyz>{LIMIT}
  <dynamics><damping>0.3</damping><friction>0.1</friction></dynamics></axis></joint>
 <joint name="slide" type="prismatic"><pose relative_to="upper">0.3 0 0 0 0 1</pose>
  <parent>upper</parent><child>rod</child>
  <axis><xyz expressed_in="__model__">0 0 2</xyz></axis></joint>
</model></sdf>
"""


def rotation(roll, pitch, yaw):
    (sr, sp, sy), (cr, cp, cy) = np.sin([roll, pitch, yaw]), np.cos([roll, pitch, yaw])
    about_x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    about_y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    about_z = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    return about_z @ about_y @ about_x


def test_links_stand_where_their_poses_say():
    robot = Robot.from_sdf(ARM)
    position, orientation = robot.forward_kinematics(np.zeros((1, 2)), "upper")
    shelf = rotation(0, 0, 0.3)
    np.testing.assert_allclose(position[0], [0, 0, 0.5] + shelf @ [0.1, 0, 0], atol=1e-12)
    np.testing.assert_allclose(orientation[0], shelf @ rotation(0.2, 0, 0), atol=1e-12)
    rod, turned = robot.forward_kinematics(np.zeros((1, 2)), "rod")
    np.testing.assert_allclose(rod[0], position[0] + orientation[0] @ [0.3, 0, 0], atol=1e-12)
    np.testing.assert_allclose(turned[0], orientation[0] @ rotation(0, 0, 1), atol=1e-12)


def test_joints_move_about_their_own_frames():
    robot = Robot.from_sdf(ARM)
    still, rest = robot.forward_kinematics(np.zeros((1, 2)), "upper")
    moved, turned = robot.forward_kinematics([[0.8, 0.0]], "upper")
    anchor = still[0] + rest[0] @ [0, 0.05, 0]
    axis = rest[0] @ rotation(0, 0, 0.7) @ np.array([0, 1, 1]) / np.sqrt(2)
    about = turned[0] @ rest[0].T
    np.testing.assert_allclose(about @ axis, axis, atol=1e-12)
    assert np.trace(about) == pytest.approx(1 + 2 * np.cos(0.8))
    np.testing.assert_allclose(moved[0], anchor + about @ (still[0] - anchor), atol=1e-12)
    slid, _ = robot.forward_kinematics([[0.0, 0.4]], "rod")
    begin, _ = robot.forward_kinematics([[0.0, 0.0]], "rod")
    np.testing.assert_allclose(slid[0] - begin[0], [0, 0, 0.4], atol=1e-12)


def test_limits_and_inertials():
    robot = Robot.from_sdf(ARM)
    assert robot.joint_names == ("turn", "slide")
    assert robot.joint_types == ("revolute", "prismatic")
    assert robot.position_limits.tolist() == [[-1, 2], [-np.inf, np.inf]]
    assert robot.effort_limits.tolist() == [9, np.inf]
    assert robot.velocity_limits.tolist() == [np.inf, np.inf]
    assert robot.joint_dynamics["damping"].tolist() == [0.3, 0]
    # Standing still, the slide along the model's z carries the weight of the rod.
    assert robot.gravity_torque(np.zeros((1, 2)))[0, 1] == pytest.approx(3 * 9.81)


def test_a_link_without_inertial_is_named():
    text = ARM.replace(f"<inertial>{INERTIA.format(m=1)}</inertial>", "")
    with pytest.warns(UserWarning, match="link 'base' has no <inertial>"):
        Robot.from_sdf(text)


def test_a_model_of_a_world_is_chosen_by_name():
    two = ARM.replace("<model", "<world name='w'><model").replace("</model>", "</model></world>")
    assert Robot.from_sdf(two).joint_names == Robot.from_sdf(two, model="arm").joint_names


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('type="prismatic"', 'type="screw"', "joint 'slide' is of type 'screw'"),
        ("0.1 0 0 0.2 0 0", "0.1 0 0 0.2", "pose of link 'upper'.*expected 6"),
        ('relative_to="shelf"', 'relative_to="shelv"', "relative to 'shelv'"),
        ('relative_to="upper"', 'relative_to="rod"', "relative to itself"),
        ("<xyz>0 1 1</xyz>", "<xyz>0 0 0</xyz>", "axis of joint 'turn' is zero"),
        ("<mass>3</mass>", "<mass>-3</mass>", "mass of link 'rod'"),
        ("</model>", "<include/></model>", "<include>"),
        ('<sdf version="1.9">', "<sdf><model name='b'><joint/></model>", "2 models"),
    ],
)
def test_wrong_models_are_refused(old, new, message):
    with pytest.raises(ValueError, match=message):
        Robot.from_sdf(ARM.replace(old, new))


def test_frames_upon_frames_need_no_recursion():
    frames = "".join(f'<frame name="f{k}" attached_to="f{k + 1}"/>' for k in range(3000))
    text = ARM.replace('relative_to="shelf"', 'relative_to="f0"')
    text = text.replace("<frame ", frames + '<frame name="f3000" attached_to="shelf"/><frame ', 1)
    np.testing.assert_allclose(
        Robot.from_sdf(text).inertial_parameters, Robot.from_sdf(ARM).inertial_parameters
    )


@pytest.mark.parametrize("version", ["", "1.x", "1." + "9" * 5000, "1....9"])
def test_a_version_that_is_none_is_named(version):
    with pytest.raises(RobotDescriptionError, match="The version of the SDF is"):
        Robot.from_sdf(ARM.replace('version="1.9"', f'version="{version}"'))


def test_a_file_says_its_format_itself():
    text = "<?xml version='1.0'?><!-- <robot> of a hall -->" + ARM.strip()
    assert Robot.from_file(text).joint_names == Robot.from_sdf(ARM).joint_names
