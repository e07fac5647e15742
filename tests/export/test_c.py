# SPDX-License-Identifier: BSD-3-Clause
"""The exported C function, compiled and called."""

import ctypes

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm
from skidyn.dynamics._compiled import compile_library, find_compiler
from skidyn.export import c_source, write_c
from skidyn.robots import Robot

STRICT = ("-O2", "-std=c99", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC")


def called(text, motion, name="skidyn_inverse_dynamics"):
    if find_compiler() is None:
        pytest.skip("no C compiler")
    function = getattr(compile_library(text, STRICT), name)
    function.restype = None
    torque = np.empty_like(motion[0])
    for k in range(len(torque)):
        arrays = [np.ascontiguousarray(signal[k]) for signal in motion]
        function(*(ctypes.c_void_p(a.ctypes.data) for a in (*arrays, torque[k])))
    return torque


@pytest.mark.parametrize("name", ["tree", "scara"])
def test_every_static_effect_equals_predict(models, name, states):
    model = models[name]
    motion = states(model.robot_)
    expected = model.predict(np.hstack(motion))
    np.testing.assert_allclose(called(c_source(model), motion), expected, rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("name", ["ur5", "panda", "planar_arm"])
def test_consistent_models_equal_predict(consistent, name, states):
    model = consistent[name]
    motion = states(model.robot_)
    torque = called(c_source(model, name="torque"), motion, "torque")
    np.testing.assert_allclose(torque, model.predict(np.hstack(motion)), rtol=1e-10, atol=1e-10)


def test_a_robot_alone_gives_its_rigid_bodies(tmp_path, states):
    robot = load_planar_arm()
    motion = states(robot)
    assert write_c(robot, tmp_path / "arm.c") == ()
    torque = called((tmp_path / "arm.c").read_text(), motion)
    np.testing.assert_allclose(torque, robot.inverse_dynamics(*motion), atol=1e-12)


def test_joint_names_cannot_break_out_of_the_text(states):
    evil = '*/ int x; /* """ + '
    robot = Robot.from_urdf(
        '<robot name="*/ r"><link name="a"/><link name="b"><inertial><mass value="1"/></inertial>'
        f"</link><joint name='{evil}' type='continuous'><parent link='a'/><child link='b'/></joint>"
        "</robot>"
    )
    assert c_source(robot).count("*/") == 1
    called(c_source(robot), states(robot, 1))


@pytest.mark.parametrize("name", ["", "1st", "a b", "a;b"])
def test_names_are_checked(name):
    with pytest.raises(ValueError, match="name is"):
        c_source(load_planar_arm(), name=name)
