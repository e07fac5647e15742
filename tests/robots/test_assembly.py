# SPDX-License-Identifier: BSD-3-Clause
"""Links and joints become a tree of moving bodies."""

import numpy as np
import pytest

from skidyn.exceptions import RobotDescriptionWarning
from skidyn.robots import Robot

GOOD_INERTIA = '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>'
LIMIT = '<limit lower="-1" upper="1" velocity="2" effort="3"/>'


def link(name, mass=None, inertia=GOOD_INERTIA):
    if mass is None:
        return f'<link name="{name}"/>'
    return f'<link name="{name}"><inertial><mass value="{mass}"/>{inertia}</inertial></link>'


def joint(name, parent, child, kind="revolute", inside=LIMIT):
    ends = f'<parent link="{parent}"/><child link="{child}"/>'
    return f'<joint name="{name}" type="{kind}">{ends}{inside}</joint>'


def robot(*parts):
    return '<robot name="r">' + "".join(parts) + "</robot>"


TWO = link("a") + link("b", 1)


@pytest.mark.parametrize(
    ("joints", "message"),
    [
        (["k"], "names 'k'.*It has: 'j'"),
        ([], "joints is empty"),
        (["j", "j"], "twice"),
        ("j", "list of joint names"),
        (["bolt"], "is fixed"),
        (["f"], "mimics 'j'"),
    ],
)
def test_wrong_selection_is_refused(joints, message):
    text = robot(
        TWO, link("c"), link("d"), joint("j", "a", "b"), joint("bolt", "b", "c", "fixed", ""),
        joint("f", "c", "d", inside=LIMIT + '<mimic joint="j"/>'),
    )  # fmt: skip
    with pytest.raises(ValueError, match=message):
        Robot.from_urdf(text, joints=joints)


def test_mimic_joints_follow_and_hand_their_torque_to_the_leader():
    text = robot(
        TWO, link("c", 2), joint("j", "a", "b"),
        joint("f", "b", "c", inside=LIMIT + '<mimic joint="g" multiplier="3"/>'),
        link("d", 1),
        joint("g", "c", "d", inside=LIMIT + '<mimic joint="j" multiplier="-0.5" offset="0.2"/>'),
    )  # fmt: skip
    arm = Robot.from_urdf(text)
    assert arm.joint_names == ("j",) and arm.body_names == ("b", "c", "d")
    assert arm.tree.multipliers.tolist() == [1.0, -1.5, -0.5]
    assert arm.tree.offsets == pytest.approx([0.0, 0.6, 0.2])
    # All axes are x: the bodies turn by 1, -0.5 and -1 times the leader, with 1 kg m^2 each.
    assert arm.mass_matrix([[0.3]])[0, 0, 0] == pytest.approx(1.0 + 0.25 + 1.0)


def test_locked_leader_locks_its_followers_at_their_offset():
    inside = LIMIT + '<axis xyz="0 0 1"/>'
    text = robot(
        TWO, link("c", 2), link("d", 1), joint("j", "a", "b", inside=inside),
        joint("k", "b", "c", inside=inside),
        joint("f", "c", "d", inside=inside + '<mimic joint="k" offset="0.5"/>'),
    )  # fmt: skip
    arm = Robot.from_urdf(text, joints=["j"])
    assert arm.body_names == ("b",)
    _, rotation = arm.forward_kinematics([[0.0]], "d")
    np.testing.assert_allclose(rotation[0, 0, 0], np.cos(0.5))


@pytest.mark.slow
def test_huge_tree_needs_no_recursion():
    n = 10_000
    parts = [link("l0")]
    for i in range(n):
        parts += [link(f"l{i + 1}", 1), joint(f"j{i}", f"l{i}", f"l{i + 1}", "continuous", "")]
    assert Robot.from_urdf(robot(*parts)).n_joints == n


def test_faulty_inertia_of_a_part_that_is_fixed_is_a_warning():
    """As in published descriptions: an antenna with a slightly negative moment on a heavy base."""
    inertia = GOOD_INERTIA.replace('ixy="0"', 'ixy="5"')
    antenna = link("antenna", 1e-3, inertia), joint("k", "a", "antenna", "fixed")
    text = robot(TWO, *antenna, joint("j", "a", "b"))
    with pytest.warns(RobotDescriptionWarning, match="link 'antenna' is not positive definite"):
        assert Robot.from_urdf(text).n_joints == 1
