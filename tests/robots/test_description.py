# SPDX-License-Identifier: BSD-3-Clause
"""Inertias and axes that a description may state."""

import warnings

import numpy as np
import pytest

from skidyn.datasets import load_panda
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


def test_point_mass_is_accepted_and_impossible_inertia_warned_about():
    point = link("b", 1, GOOD_INERTIA.replace('"1"', '"0"'))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        Robot.from_urdf(robot(link("a"), point, joint("j", "a", "b")))
    odd = link("b", 1, GOOD_INERTIA.replace('izz="1"', 'izz="3"'))
    with pytest.warns(UserWarning, match="link 'b' violate the triangle inequality"):
        Robot.from_urdf(robot(link("a"), odd, joint("j", "a", "b")))


@pytest.mark.parametrize("size", ["1e200", "1e308", "1e-200", "1e-310"])
def test_an_axis_of_any_length_is_a_direction(size):
    text = robot(TWO, joint("j", "a", "b", inside=f'{LIMIT}<axis xyz="{size} 0 {size}"/>'))
    np.testing.assert_allclose(Robot.from_urdf(text).tree.axes, [[0.5**0.5, 0, 0.5**0.5]])


@pytest.mark.parametrize("mass", ["1e300", "1.7e308"])
def test_a_body_whose_inertia_is_no_number_is_named(mass):
    far = f'<inertial><origin xyz="1e10 0 0"/><mass value="{mass}"/>{GOOD_INERTIA}</inertial>'
    text = robot(link("a"), f'<link name="b">{far}</link>', joint("j", "a", "b"))
    with pytest.raises(RobotDescriptionError, match="inertia of link 'b' is too large"):
        Robot.from_urdf(text)


def test_right_angles_are_not_snapped():
    """An angle written with few digits is taken as written (1.57079632679 is 5e-12 rad off)."""
    assert set(np.unique(load_panda().tree.rotations[1])) == {-1.0, 0.0, 1.0}  # nearest to pi / 2
    turned = joint("turned", "base", "tip", inside='<origin rpy="1.57079632679 0 0"/>' + LIMIT)
    rotation = Robot.from_urdf(robot(link("base"), link("tip", 1.0), turned)).tree.rotations[0]
    assert rotation[1, 1] == np.cos(1.57079632679) != 0
