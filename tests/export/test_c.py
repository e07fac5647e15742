# SPDX-License-Identifier: BSD-3-Clause
"""The exported C function, compiled and called."""

import ctypes
import subprocess

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm
from skidyn.export import c_source, write_c
from skidyn.robots import Robot

STRICT = ("-O2", "-std=c99", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC")


@pytest.fixture
def called(c_compiler, tmp_path):
    """Torque of a motion by a source that is compiled without a warning."""

    def call(text, motion, name="skidyn_inverse_dynamics"):
        (tmp_path / "model.c").write_text(text)
        built = ["-o", "model.so", "model.c", "-lm"]
        subprocess.run([c_compiler, *STRICT, *built], cwd=tmp_path, check=True)
        function = getattr(ctypes.CDLL(str(tmp_path / "model.so")), name)
        function.restype = None
        torque = np.empty_like(motion[0])
        for k in range(len(torque)):
            arrays = [np.ascontiguousarray(signal[k]) for signal in motion]
            function(*(ctypes.c_void_p(a.ctypes.data) for a in (*arrays, torque[k])))
        return torque

    return call


@pytest.mark.parametrize("name", ["tree", "scara"])
def test_every_static_effect_equals_predict(models, name, states, called):
    model = models[name]
    motion = states(model.robot_)
    expected = model.predict(np.hstack(motion))
    np.testing.assert_allclose(called(c_source(model), motion), expected, rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("name", ["ur5", "panda", "planar_arm"])
def test_consistent_models_equal_predict(consistent, name, states, called):
    model = consistent[name]
    motion = states(model.robot_)
    torque = called(c_source(model, name="torque"), motion, "torque")
    np.testing.assert_allclose(torque, model.predict(np.hstack(motion)), rtol=1e-10, atol=1e-10)


def test_a_robot_alone_gives_its_rigid_bodies(tmp_path, states, called):
    robot = load_planar_arm()
    motion = states(robot)
    assert write_c(robot, tmp_path / "arm.c") == ()
    torque = called((tmp_path / "arm.c").read_text(), motion)
    np.testing.assert_allclose(torque, robot.inverse_dynamics(*motion), atol=1e-12)


def test_joint_names_cannot_break_out_of_the_text(states, called):
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
