# SPDX-License-Identifier: BSD-3-Clause
"""Descriptions that are unusual, wrong or hostile."""

import warnings

import numpy as np
import pytest

from skidyn.exceptions import RobotDescriptionError, RobotDescriptionWarning
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
    "floating": (robot(TWO, joint("j", "a", "b", "floating")), "joint 'j' is of type 'floating'"),
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


@pytest.mark.parametrize("gravity", [(0, 0), (0, 0, np.nan)])
def test_wrong_gravity_is_refused(gravity):
    with pytest.raises(ValueError, match="gravity"):
        Robot.from_urdf(robot(TWO, joint("j", "a", "b")), gravity=gravity)


def test_missing_file(tmp_path):
    with pytest.raises(FileNotFoundError):
        Robot.from_urdf(tmp_path / "absent.urdf")


def test_path_text_and_bytes_are_read_alike(tmp_path):
    text = '<?xml version="1.0" encoding="utf-8"?>' + robot(TWO, joint("jé", "a", "b"))
    path = tmp_path / "robot.urdf"
    path.write_text(text, encoding="utf-8")
    for source in (path, str(path), text, text.encode(), "\ufeff" + text):
        assert Robot.from_urdf(source).joint_names == ("jé",)


def test_standard_defaults():
    """No axis is x, no inertial is no mass, a continuous joint has no limits, no origin is zero."""
    arm = Robot.from_urdf(
        robot(TWO, link("c"), joint("i", "a", "b", "continuous", ""), joint("j", "b", "c"))
    )
    assert arm.tree.axes.tolist() == [[1, 0, 0], [1, 0, 0]]
    assert arm.inertial_parameters[1].tolist() == [0] * 10
    assert arm.position_limits.tolist() == [[-np.inf, np.inf], [-1, 1]]
    assert arm.joint_types == ("continuous", "revolute")


def test_pictures_and_drivers_are_ignored():
    extra = (
        '<material name="m"/><transmission name="t"/><gazebo><plugin/></gazebo>'
        '<ros2_control name="x"/>'
    )
    body = (
        '<link name="b"><visual><geometry><nothing/></geometry></visual><collision/><inertial>'
        f'<mass value="1"/>{GOOD_INERTIA}</inertial></link>'
    )
    text = robot(extra, link("a"), body, joint("j", "a", "b", inside=LIMIT + "<calibration/>"))
    assert Robot.from_urdf(text).inertial_parameters[0, 0] == 1.0


def test_point_mass_is_accepted_and_impossible_inertia_warned_about():
    point = link("b", 1, GOOD_INERTIA.replace('"1"', '"0"'))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        Robot.from_urdf(robot(link("a"), point, joint("j", "a", "b")))
    odd = link("b", 1, GOOD_INERTIA.replace('izz="1"', 'izz="3"'))
    with pytest.warns(UserWarning, match="link 'b' break the triangle inequality"):
        Robot.from_urdf(robot(link("a"), odd, joint("j", "a", "b")))


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


def test_huge_tree_needs_no_recursion():
    n = 10_000
    parts = [link("l0")]
    for i in range(n):
        parts += [link(f"l{i + 1}", 1), joint(f"j{i}", f"l{i}", f"l{i + 1}", "continuous", "")]
    assert Robot.from_urdf(robot(*parts)).n_joints == n


@pytest.mark.parametrize("size", ["1e200", "1e308", "1e-200", "1e-310"])
def test_an_axis_of_any_length_is_a_direction(size):
    text = robot(TWO, joint("j", "a", "b", inside=f'{LIMIT}<axis xyz="{size} 0 {size}"/>'))
    np.testing.assert_allclose(Robot.from_urdf(text).tree.axes, [[0.5**0.5, 0, 0.5**0.5]])


def test_attributes_that_nobody_knows_are_passed_over_in_silence(capfd):
    more = " ".join(f'x{k}="{k}"' for k in range(500))
    text = robot(TWO, joint("j", "a", "b")).replace("<robot ", f"<robot {more} ", 1)
    assert Robot.from_urdf(text).chain.n_joints == 1
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("mass", ["1e300", "1.7e308"])
def test_a_body_whose_inertia_is_no_number_is_named(mass):
    far = f'<inertial><origin xyz="1e10 0 0"/><mass value="{mass}"/>{GOOD_INERTIA}</inertial>'
    text = robot(link("a"), f'<link name="b">{far}</link>', joint("j", "a", "b"))
    with pytest.raises(RobotDescriptionError, match="inertia of link 'b' is too large"):
        Robot.from_urdf(text)


def test_faulty_inertia_of_a_part_that_is_fixed_is_a_warning():
    """As in published descriptions: an antenna with a slightly negative moment on a heavy base."""
    inertia = GOOD_INERTIA.replace('ixy="0"', 'ixy="5"')
    antenna = link("antenna", 1e-3, inertia), joint("k", "a", "antenna", "fixed")
    text = robot(TWO, *antenna, joint("j", "a", "b"))
    with pytest.warns(RobotDescriptionWarning, match="link 'antenna' is not positive definite"):
        assert Robot.from_urdf(text).n_joints == 1
