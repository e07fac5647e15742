# SPDX-License-Identifier: BSD-3-Clause
"""Physics that must hold for any motion and any size of robot."""

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from skidyn.datasets import load_panda, load_planar_arm, load_scara, load_srs_arm
from skidyn.rigid_body import find_base_parameters
from skidyn.robots import Robot

ROBOTS = {
    "panda": load_panda(),
    "scara": load_scara(),
    "planar": load_planar_arm(),
    "srs": load_srs_arm(),
}
seeds = st.integers(0, 2**31)
check = settings(max_examples=15, deadline=None)


def state(robot, seed, n=6):
    return np.random.default_rng(seed).uniform(-2, 2, (3, n, robot.n_joints))


@pytest.mark.parametrize("robot", ROBOTS.values(), ids=ROBOTS)
@check
@given(seed=seeds)
def test_mass_matrix_is_symmetric_and_positive_definite(robot, seed):
    m = robot.mass_matrix(state(robot, seed)[0])
    np.testing.assert_allclose(m, m.transpose(0, 2, 1), atol=1e-12 * np.abs(m).max())
    assert (np.linalg.eigvalsh(m) > 0).all()


@pytest.mark.parametrize("robot", ROBOTS.values(), ids=ROBOTS)
@check
@given(seed=seeds, factor=st.floats(-1e6, 1e6))
def test_torque_is_linear_in_the_parameters(robot, seed, factor):
    q, dq, ddq = state(robot, seed)
    one, two = np.random.default_rng(seed + 1).normal(size=(2, robot.n_bodies, 10))
    torque = [robot.inverse_dynamics(q, dq, ddq, parameters=p) for p in (one, two)]
    mixed = robot.inverse_dynamics(q, dq, ddq, parameters=one + factor * two)
    wanted = torque[0] + factor * torque[1]
    np.testing.assert_allclose(mixed, wanted, atol=1e-11 * (1 + np.abs(wanted).max()))


@pytest.mark.parametrize("robot", ROBOTS.values(), ids=ROBOTS)
@check
@given(seed=seeds)
def test_power_is_the_change_of_energy(robot, seed):
    """Without gravity, dq . tau = d/dt (dq' M dq / 2), by central differences along the motion."""
    q, dq, ddq = state(robot, seed)
    no_gravity = robot.inverse_dynamics(q, dq, ddq, gravity=(0, 0, 0))
    h = 1e-5

    def energy(t):
        v = dq + ddq * t
        m = robot.mass_matrix(q + dq * t + ddq * t**2 / 2)
        return 0.5 * np.einsum("ni,nij,nj->n", v, m, v)

    rate = (energy(h) - energy(-h)) / (2 * h)
    power = np.sum(dq * no_gravity, axis=1)
    np.testing.assert_allclose(power, rate, rtol=1e-6, atol=1e-5 * (1 + np.abs(power).max()))


@check
@given(seed=seeds)
def test_turning_base_and_gravity_together_changes_nothing(seed):
    """A fixed joint that tilts the base, with gravity tilted alike, gives the same torque."""
    angle = np.random.default_rng(seed).uniform(-np.pi, np.pi)
    text = """<robot name="r"><link name="world"/><link name="b"/><link name="a"><inertial>
      <origin xyz="0.1 0.2 0.3"/><mass value="2"/>
      <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <joint name="base" type="fixed"><parent link="world"/><child link="b"/>
      <origin rpy="ANGLE 0 0"/></joint><joint name="j" type="continuous"><parent link="b"/>
      <child link="a"/><axis xyz="0 1 0"/></joint></robot>"""
    q, dq, ddq = np.random.default_rng(seed).uniform(-2, 2, (3, 5, 1))
    g = 9.81
    turned = (0.0, g * np.sin(angle), -g * np.cos(angle))
    upright = Robot.from_urdf(text.replace("ANGLE", "0")).inverse_dynamics(q, dq, ddq)
    tilted = Robot.from_urdf(text.replace("ANGLE", repr(angle)), gravity=turned)
    np.testing.assert_allclose(tilted.inverse_dynamics(q, dq, ddq), upright, atol=1e-12 * 30)


@pytest.mark.parametrize("factor", [1e-6, 1e-3, 1e3, 1e6])
def test_mass_scales_torque_and_nothing_else(factor):
    """Robots from milligrams to thousands of tonnes: same base parameters, torque to scale."""
    robot = ROBOTS["planar"]
    text = re.sub(
        r'(mass value|i[xyz]{2})="([^"]+)"',
        lambda m: f'{m[1]}="{float(m[2]) * factor!r}"',
        _planar_text(),
    )
    scaled = Robot.from_urdf(text)
    q, dq, ddq = state(robot, 0)
    np.testing.assert_allclose(
        scaled.inverse_dynamics(q, dq, ddq), factor * robot.inverse_dynamics(q, dq, ddq), rtol=1e-9
    )
    np.testing.assert_array_equal(
        find_base_parameters(scaled).index, find_base_parameters(robot).index
    )


def _planar_text():
    from importlib.resources import files

    return (files("skidyn.datasets") / "robots" / "planar_arm.urdf").read_text()
