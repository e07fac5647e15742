# SPDX-License-Identifier: BSD-3-Clause
"""Descriptions are read as text, bytes or files, whatever else they hold."""

import json
import os

import pytest
from hypothesis import given, settings, strategies as st

from skidyn.exceptions import RobotDescriptionError, SkidynError
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


def test_missing_file(tmp_path):
    with pytest.raises(FileNotFoundError):
        Robot.from_urdf(tmp_path / "absent.urdf")


@pytest.mark.parametrize("read", [Robot.from_file, Robot.from_sdf, Robot.from_mjcf])
def test_a_git_lfs_pointer_is_recognised(tmp_path, read):
    path = tmp_path / "robot.urdf"
    path.write_text("version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 10\n")
    with pytest.raises(RobotDescriptionError, match="git lfs pull --include=robot.urdf"):
        read(path)


def test_path_text_and_bytes_are_read_alike(tmp_path):
    text = '<?xml version="1.0" encoding="utf-8"?>' + robot(TWO, joint("jé", "a", "b"))
    path = tmp_path / "robot.urdf"
    path.write_text(text, encoding="utf-8")
    for source in (path, str(path), text, text.encode(), "\ufeff" + text):
        assert Robot.from_urdf(source).joint_names == ("jé",)


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


def test_attributes_that_nobody_knows_are_passed_over_in_silence(capfd):
    more = " ".join(f'x{k}="{k}"' for k in range(500))
    text = robot(TWO, joint("j", "a", "b")).replace("<robot ", f"<robot {more} ", 1)
    assert Robot.from_urdf(text).chain.n_joints == 1
    assert capfd.readouterr() == ("", "")


def test_entities_are_never_expanded(chain):
    lol = '<!DOCTYPE robot [<!ENTITY a "lol"><!ENTITY b "&a;&a;&a;&a;">]>'
    other = '<!DOCTYPE robot [<!ENTITY f SYSTEM "file:///etc/passwd">]>'
    for declaration in (lol, other):
        with pytest.raises(SkidynError, match="document type or entities"):
            Robot.from_urdf(declaration + chain(["j"]))


@pytest.mark.parametrize("text", ["<robot><link></robot>", robot(link("a"), link("b", "heavy"))])
def test_errors_name_the_file(tmp_path, text):
    path = tmp_path / "arm.urdf"
    path.write_text(text, encoding="utf-8")
    for read in (Robot.from_file, Robot.from_urdf):
        with pytest.raises(RobotDescriptionError, match=r"arm\.urdf: "):
            read(path)
    with pytest.raises(RobotDescriptionError, match="^(?!.*arm.urdf)"):
        Robot.from_urdf(text)


def test_files_that_a_description_names_are_not_opened(secret, opened, chain):
    secret, names = secret
    assert str(secret) in opened(lambda: open(names[1]).close())
    for name in names:
        mesh = f'<geometry><mesh filename="{name}"/></geometry>'
        picture = (
            f'<visual>{mesh}<material name="m"><texture filename="{name}"/></material></visual>'
        )
        inside = f"</inertial>{picture}<collision>{mesh}</collision>"
        text = chain(["j"]).replace("</inertial>", inside)
        space = 'xmlns:xi="http://www.w3.org/2001/XInclude"'
        more = f'<include filename="{name}"/><xi:include {space} href="{name}"/></robot>'
        text = text.replace("</robot>", more)
        text = f'<?xml-stylesheet href="{name}"?>{text}'
        with open("robot.urdf", "w") as file:
            file.write(text)
        with open("robot.urdf.skidyn.json", "w") as file:
            file.write(json.dumps({"include": name}))
        heard = opened(lambda: Robot.from_urdf("robot.urdf"))
        assert os.path.realpath("robot.urdf") in heard
        assert str(secret) not in heard and os.path.realpath("robot.urdf.skidyn.json") not in heard


@settings(max_examples=40, deadline=None)
@given(st.text(max_size=40))
def test_any_joint_name_is_kept_or_refused(chain, name):
    from xml.sax.saxutils import quoteattr

    text = chain(["NAME"]).replace('"NAME"', quoteattr(name))
    try:
        assert Robot.from_urdf(text).n_joints == 1
    except SkidynError:
        pass


@pytest.mark.slow
def test_ten_thousand_joints_are_read(chain):
    robot = Robot.from_urdf(chain([f"j{k}" for k in range(10_000)]))
    assert robot.n_joints == 10_000
