# SPDX-License-Identifier: BSD-3-Clause
"""Physics that must hold for any motion and any size of robot."""

import re
from importlib.resources import files
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation

from skidyn.datasets import load_panda, load_planar_arm, load_scara, load_srs_arm
from skidyn.robots import Robot, find_base_parameters

ROBOTS = {
    "panda": load_panda(),
    "scara": load_scara(),
    "planar": load_planar_arm(),
    "srs": load_srs_arm(),
}
FILES = {"panda": "panda", "scara": "scara", "planar": "planar_arm", "srs": "srs_arm"}
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


@pytest.mark.parametrize("name", FILES)
@check
@given(seed=seeds)
def test_the_choice_of_the_base_frame_changes_nothing(name, seed):
    """A base turned and shifted anyhow, with gravity turned alike, gives the same torque."""
    rng = np.random.default_rng(seed)
    angles, place = rng.uniform(-np.pi, np.pi, 3), rng.uniform(-2, 2, 3)
    root = ElementTree.fromstring(_text(FILES[name]))
    children = {joint.find("child").get("link") for joint in root.iter("joint")}
    base = next(link.get("name") for link in root.iter("link") if link.get("name") not in children)
    ElementTree.SubElement(root, "link", name="elsewhere")
    joint = ElementTree.SubElement(root, "joint", name="turned", type="fixed")
    ElementTree.SubElement(joint, "parent", link="elsewhere")
    ElementTree.SubElement(joint, "child", link=base)
    origin = {"rpy": angles, "xyz": place}
    ElementTree.SubElement(
        joint, "origin", {key: " ".join(map(repr, value.tolist())) for key, value in origin.items()}
    )
    gravity = Rotation.from_euler("xyz", angles).apply([0.0, 0.0, -9.81])
    turned = Robot.from_urdf(ElementTree.tostring(root, "unicode"), gravity=tuple(gravity))
    q, dq, ddq = state(turned, seed)
    torque = ROBOTS[name].inverse_dynamics(q, dq, ddq)
    np.testing.assert_allclose(
        turned.inverse_dynamics(q, dq, ddq), torque, atol=1e-12 * (1 + np.abs(torque).max())
    )
    n_base = [len(find_base_parameters(robot).index) for robot in (turned, ROBOTS[name])]
    assert n_base[0] == n_base[1]  # which of several equal choices is taken is up to rounding


@pytest.mark.parametrize("factor", [1e-6, 1e-3, 1e3, 1e6])
def test_mass_scales_torque_and_nothing_else(factor):
    """Robots from milligrams to thousands of tonnes: same base parameters, torque to scale."""
    robot = ROBOTS["planar"]
    text = re.sub(
        r'(mass value|i[xyz]{2})="([^"]+)"',
        lambda m: f'{m[1]}="{float(m[2]) * factor!r}"',
        _text("planar_arm"),
    )
    scaled = Robot.from_urdf(text)
    q, dq, ddq = state(robot, 0)
    np.testing.assert_allclose(
        scaled.inverse_dynamics(q, dq, ddq), factor * robot.inverse_dynamics(q, dq, ddq), rtol=1e-9
    )
    np.testing.assert_array_equal(
        find_base_parameters(scaled).index, find_base_parameters(robot).index
    )


def _text(name):
    return (files("skidyn.datasets") / "robots" / f"{name}.urdf").read_text()


def test_a_thousand_joints_move_exactly(chain):
    """All about one axis: every joint carries the inertia of what follows it."""
    n = 1000
    ddq = np.full((1, n), 0.1)
    torque = Robot.from_urdf(chain([f"j{k}" for k in range(n)])).inverse_dynamics(ddq, ddq, ddq)
    speed_up = 0.1 * np.arange(1, n + 1)  # of each link, its inertia is 1
    np.testing.assert_allclose(torque[0], speed_up[::-1].cumsum()[::-1], rtol=1e-10)


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**31))
def test_rigid_bodies_know_no_direction_of_time(seed):
    """Forces of inertia are even in the velocity; those of gravity have a potential."""
    robot = load_scara()
    q, dq, ddq = np.random.default_rng(seed).uniform(-2, 2, (3, 6, robot.n_joints))
    np.testing.assert_allclose(
        robot.inverse_dynamics(q, -dq, ddq), robot.inverse_dynamics(q, dq, ddq), atol=1e-10
    )
    # A torque field with a potential has a symmetric derivative.
    step, zero = 1e-6, np.zeros_like(q)
    slopes = np.stack(
        [
            robot.inverse_dynamics(q + step * e, zero, zero)
            - robot.inverse_dynamics(q - step * e, zero, zero)
            for e in np.eye(robot.n_joints)
        ],
        axis=-1,
    ) / (2 * step)
    np.testing.assert_allclose(slopes, slopes.transpose(0, 2, 1), atol=1e-5)
