# SPDX-License-Identifier: BSD-3-Clause
"""Descriptions that are unusual, wrong or hostile."""

import numpy as np
import pytest

from skidyn.exceptions import RobotDescriptionError
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

WRONG = {
    "floating": (
        robot(TWO, joint("j", "a", "b", "floating")),
        "type 'floating'.*Set type=\"fixed\"",
    ),
    "planar": (robot(TWO, joint("j", "a", "b", "planar")), "joint 'j' is of type 'planar'"),
    "unknown type": (robot(TWO, joint("j", "a", "b", "screw")), "(?s)j.*screw"),
    "cycle": (
        robot(TWO, link("c"), joint("i", "b", "c"), joint("j", "c", "b")),
        "closed loop",
    ),
    "no root": (robot(TWO, joint("i", "a", "b"), joint("j", "b", "a")), "closed loop"),
    "several roots": (robot(TWO, link("c"), joint("j", "a", "b")), "2 roots, 'a', 'c'"),
    "two parents": (
        robot(TWO, link("c"), joint("i", "a", "b"), joint("j", "c", "b")),
        "child of two joints, 'i' and 'j'",
    ),
    "no joint": (robot(link("a")), "no moving joint"),
    "no link": (robot(), "no links"),
    "only fixed": (robot(TWO, joint("j", "a", "b", "fixed")), "no moving joint"),
    "negative mass": (robot(link("a"), link("b", -1), joint("j", "a", "b")), "mass of link 'b'"),
    "indefinite inertia": (
        robot(
            link("a"),
            link("b", 1, GOOD_INERTIA.replace('ixy="0"', 'ixy="5"')),
            joint("j", "a", "b"),
        ),
        "inertia of link 'b' is not positive definite",
    ),
    "nan mass": (robot(link("a"), link("b", "nan"), joint("j", "a", "b")), "mass of link 'b'"),
    "inf origin": (
        robot(TWO, joint("j", "a", "b", inside=LIMIT + '<origin xyz="0 inf 0"/>')),
        "origin of joint 'j'",
    ),
    "zero axis": (
        robot(TWO, joint("j", "a", "b", inside=LIMIT + '<axis xyz="0 0 0"/>')),
        "axis of joint 'j' is zero",
    ),
    "short axis": (
        robot(TWO, joint("j", "a", "b", inside=LIMIT + '<axis xyz="0 1"/>')),
        "axis of joint 'j'",
    ),
    "text number": (robot(link("a"), link("b", "heavy"), joint("j", "a", "b")), "b.*heavy"),
    "missing mass": (
        robot(link("a"), link("b", 1).replace('<mass value="1"/>', ""), joint("j", "a", "b")),
        "link 'b' has no <mass>",
    ),
    "missing inertia entry": (
        robot(link("a"), link("b", 1, '<inertia ixx="1"/>'), joint("j", "a", "b")),
        "inertia of link 'b' has no ixy",
    ),
    "two axes": (
        robot(TWO, joint("j", "a", "b", inside=LIMIT + "<axis/><axis/>")),
        "joint 'j' has 2 <axis> elements",
    ),
    "no parent": (
        robot(TWO, f'<joint name="j" type="revolute"><child link="b"/>{LIMIT}</joint>'),
        "joint 'j' has no <parent>",
    ),
    "missing limit": (robot(TWO, joint("j", "a", "b", inside="")), "joint 'j' has no <limit>"),
    "crossed limits": (
        robot(TWO, joint("j", "a", "b", inside=LIMIT.replace("-1", "5"))),
        "joint 'j' has its lower limit",
    ),
    "dangling mimic": (
        robot(TWO, joint("j", "a", "b", inside=LIMIT + '<mimic joint="k"/>')),
        "'j' mimics 'k', which is not described",
    ),
    "mimic of itself": (
        robot(TWO, joint("j", "a", "b", inside=LIMIT + '<mimic joint="j"/>')),
        "'j' mimics itself",
    ),
    "unknown link": (robot(TWO, joint("j", "a", "bb")), "child link 'bb' of joint 'j'.*mean 'b'"),
    "link twice": (robot(TWO, link("a"), joint("j", "a", "b")), "link 'a' is described twice"),
    "joint twice": (
        robot(TWO, link("c"), joint("j", "a", "b"), joint("j", "b", "c")),
        "joint 'j' is described twice",
    ),
    "nameless link": (robot("<link/>", TWO, joint("j", "a", "b")), "<link> has no name"),
    "malformed": ("<robot><link name='a'>", "not well-formed"),
    "no XML": (b"\x00\x01\x02", "not well-formed"),
    "empty": (b"  ", "empty"),
    "MJCF": ("<mujoco/>", "root element is <mujoco>"),
    "xacro": (
        '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:macro name="m"/></robot>',
        "xacro",
    ),
    "billion laughs": (
        '<!DOCTYPE robot [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]>'
        "<robot name='&b;'/>",
        "document type or entities",
    ),
    "external entity": (
        '<!DOCTYPE robot [<!ENTITY x SYSTEM "file:///etc/passwd">]><robot name="&x;"/>',
        "document type or entities",
    ),
    "external subset": (
        '<!DOCTYPE robot SYSTEM "http://example.invalid/robot.dtd"><robot name="r"/>',
        "document type or entities",
    ),
    "unknown encoding": (
        b'<?xml version="1.0" encoding="nonsense"?><robot/>',
        "well-formed",
    ),
}


@pytest.mark.parametrize(("text", "message"), WRONG.values(), ids=WRONG.keys())
def test_wrong_description_is_refused_by_name(text, message):
    with pytest.raises(ValueError, match=message):
        Robot.from_urdf(text)


@pytest.mark.parametrize("gravity", [(0, 0), (0, 0, np.nan)])
def test_wrong_gravity_is_refused(gravity):
    with pytest.raises(ValueError, match="gravity"):
        Robot.from_urdf(robot(TWO, joint("j", "a", "b")), gravity=gravity)


def test_standard_defaults():
    """No axis is x, no inertial is no mass, a continuous joint has no limits, no origin is zero."""
    arm = Robot.from_urdf(
        robot(TWO, link("c"), joint("i", "a", "b", "continuous", ""), joint("j", "b", "c"))
    )
    assert arm.tree.axes.tolist() == [[1, 0, 0], [1, 0, 0]]
    assert arm.inertial_parameters[1].tolist() == [0] * 10
    assert arm.position_limits.tolist() == [[-np.inf, np.inf], [-1, 1]]
    assert arm.joint_types == ("continuous", "revolute")


def test_xacro_is_expanded_by_a_command_that_can_be_copied(tmp_path):
    path = tmp_path / "arm.urdf.xacro"
    path.write_text('<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:m/></robot>')
    with pytest.raises(RobotDescriptionError, match=r"xacro \S+arm\.urdf\.xacro > arm\.urdf "):
        Robot.from_urdf(path)
