# SPDX-License-Identifier: BSD-3-Clause
"""Exported functions compute what the robot computes."""

import ctypes
import subprocess
import sys

import numpy as np
import pytest

from skidyn.datasets import load_panda, load_planar_arm, load_scara
from skidyn.export import c_source, python_source
from skidyn.rigid_body._compiled import compile_library, find_compiler
from skidyn.robots import Robot

ROBOTS = [load_panda, load_scara, load_planar_arm]


def case(load):
    robot = load()
    rng = np.random.default_rng(0)
    parameters = rng.normal(size=(robot.n_bodies, 10))
    states = rng.normal(size=(3, 20, robot.n_joints))
    return robot, parameters, states, robot.inverse_dynamics(*states, parameters=parameters)


@pytest.mark.skipif(find_compiler() is None, reason="no C compiler")
@pytest.mark.parametrize("load", ROBOTS)
def test_c_function_compiled_and_called(load):
    robot, parameters, states, expected = case(load)
    text = c_source(robot, parameters=parameters, name="torque")
    strict = ("-O2", "-std=c99", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC")
    function = compile_library(text, strict).torque
    function.restype = None
    for k, tau in enumerate(expected):
        arrays = [np.ascontiguousarray(signal[k]) for signal in states]
        out = np.empty(robot.n_joints)
        function(*(ctypes.c_void_p(a.ctypes.data) for a in (*arrays, out)))
        np.testing.assert_allclose(out, tau, atol=1e-11)


@pytest.mark.parametrize("load", ROBOTS)
def test_python_function_needs_numpy_only(load, tmp_path):
    robot, parameters, states, expected = case(load)
    (tmp_path / "model.py").write_text(python_source(robot, parameters=parameters))
    np.save(tmp_path / "states.npy", states)
    script = (
        "import sys, numpy as np, model\n"
        "np.save('tau.npy', model.inverse_dynamics(*np.load('states.npy')))\n"
        "assert 'skidyn' not in sys.modules and 'torch' not in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", script], cwd=tmp_path, check=True)
    np.testing.assert_allclose(np.load(tmp_path / "tau.npy"), expected, atol=1e-11)


@pytest.mark.skipif(find_compiler() is None, reason="no C compiler")
def test_friction_rotor_inertia_and_offset():
    robot, parameters, (q, dq, ddq), expected = case(load_scara)
    dq[:5] = 0.0  # at rest there is no Coulomb friction
    expected = robot.inverse_dynamics(q, dq, ddq, parameters=parameters)
    terms = dict(
        zip(
            ("viscous", "coulomb", "rotor_inertia", "offset"),
            np.random.default_rng(2).normal(size=(4, 4)),
            strict=True,
        )
    )
    expected = expected + terms["viscous"] * dq + terms["coulomb"] * np.sign(dq)
    expected = expected + terms["rotor_inertia"] * ddq + terms["offset"]
    namespace = {}
    exec(python_source(robot, parameters=parameters, **terms), namespace)
    np.testing.assert_allclose(namespace["inverse_dynamics"](q, dq, ddq), expected, atol=1e-11)
    text = c_source(robot, parameters=parameters, **terms)
    function = compile_library(text, ("-shared", "-fPIC")).skidyn_inverse_dynamics
    for k in range(len(q)):
        arrays = [np.ascontiguousarray(signal[k]) for signal in (q, dq, ddq)]
        out = np.empty(4)
        function(*(ctypes.c_void_p(a.ctypes.data) for a in (*arrays, out)))
        np.testing.assert_allclose(out, expected[k], atol=1e-11)
    with pytest.raises(ValueError, match="coulomb has shape"):
        c_source(robot, coulomb=[1.0])


@pytest.mark.parametrize("export", [c_source, python_source])
def test_names_are_checked(export):
    for name in ("", "1st", "a b", "a;b"):
        with pytest.raises(ValueError, match="name is"):
            export(load_planar_arm(), name=name)


@pytest.mark.skipif(find_compiler() is None, reason="no C compiler")
def test_joint_names_cannot_break_out_of_the_text():
    evil = '*/ int x; /* """ + '
    robot = Robot.from_urdf(
        '<robot name="*/ r"><link name="a"/><link name="b"><inertial><mass value="1"/></inertial>'
        f"</link><joint name='{evil}' type='continuous'><parent link='a'/><child link='b'/></joint>"
        "</robot>"
    )
    assert c_source(robot).count("*/") == 1
    compile_library(c_source(robot), ("-shared", "-fPIC"))
    namespace = {}
    exec(python_source(robot), namespace)
    assert namespace["JOINTS"] == robot.joint_names
