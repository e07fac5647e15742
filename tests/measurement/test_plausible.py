# SPDX-License-Identifier: BSD-3-Clause
"""Which descriptions are possible, and which links are in another unit."""

from dataclasses import replace
from importlib import resources

import numpy as np
import pandas as pd
import pytest

from skidyn.logs import check_log
from skidyn.robots import Robot

FOLDER = resources.files("skidyn.datasets") / "robots"


@pytest.fixture(scope="module")
def told():
    """Joints by what is suspected of the units of a description, with a torque of noise."""

    def asked(robot):
        t, rates = np.arange(0.0, 2.0, 0.01)[:, None], 1 + 0.3 * np.arange(robot.n_joints)
        noise = np.random.default_rng(0).normal(size=(len(t), robot.n_joints))
        blocks = {"q": np.sin(rates * t), "dq": rates * np.cos(rates * t), "tau": noise}
        columns = {f"{x}{k + 1}": v[:, k] for x, v in blocks.items() for k in range(len(rates))}
        checks = check_log(pd.DataFrame({"time": t[:, 0], **columns}), robot).checks
        found = [s for s in checks if s.check == "description_units"]
        return {s.suspicion: s.joints for s in found}

    return asked


def with_factors(robot, bodies, mass=1.0, center=1.0, inertia=1.0):
    """A robot some bodies of which have other masses, centers of mass and inertias about these."""
    parameters = np.array(robot.inertial_parameters, dtype=float)
    for body in bodies:
        m, *first = parameters[body, :4]
        x, y, z = np.array(first) / m
        about = m * np.array([y * y + z * z, -x * y, -x * z, x * x + z * z, -y * z, x * x + y * y])
        about_origin = mass * center**2 * about
        parameters[body, 4:] = about_origin + inertia * (parameters[body, 4:] - about)
        parameters[body, :4] *= mass * np.array([1, center, center, center])
    return replace(robot, inertial_parameters=parameters)


@pytest.mark.parametrize(
    "name", sorted(file.name for file in FOLDER.iterdir() if file.name.endswith(".urdf"))
)
def test_bundled_robots_and_their_mistakes(name, told):
    robot = Robot.from_urdf((FOLDER / name).read_text())
    assert told(robot) == {}
    for factors, quantity in [
        ({"inertia": 1e9}, "inertia"),
        ({"inertia": 1e6}, "inertia"),
        ({"center": 1e3}, "center of mass"),
        ({"mass": 1e3}, "mass"),
    ]:
        other = with_factors(robot, range(robot.n_bodies), **factors)
        ((words, joints),) = told(other).items()
        assert words.startswith(f"the {quantity} of ")
        changed = np.any(other.inertial_parameters != robot.inertial_parameters, axis=1)
        assert joints == tuple(np.flatnonzero(changed) + 1)


@pytest.mark.parametrize("body", [1, 5])
def test_single_links(body, told):
    robot = Robot.from_urdf((FOLDER / "ur10e.urdf").read_text())
    for factors in ({"inertia": 1e9}, {"inertia": 1e6}, {"center": 1e3}, {"mass": 1e3}):
        (joints,) = told(with_factors(robot, [body], **factors)).values()
        assert joints == (body + 1,)


def test_an_inertia_without_a_mass(told):
    robot = Robot.from_urdf((FOLDER / "ur5.urdf").read_text())
    parameters = np.array(robot.inertial_parameters, dtype=float)
    parameters[5] = [0, 0, 0, 0, 1e4, 0, 0, 1e4, 0, 1e4]
    words = "the description states an inertia, but no mass, of link 'wrist_3_link'"
    assert told(replace(robot, inertial_parameters=parameters)) == {words: (6,)}


@pytest.mark.parametrize("inertia", [1e-3, 1e-6])
@pytest.mark.parametrize("mass", [0.0, 1e-3])
def test_placeholders_are_in_no_other_unit(mass, inertia, told):
    robot = Robot.from_urdf((FOLDER / "ur5.urdf").read_text())
    parameters = np.array(robot.inertial_parameters, dtype=float)
    parameters[3] = [mass, 0, 0, 0, inertia, 0, 0, inertia, 0, inertia]
    assert told(replace(robot, inertial_parameters=parameters)) == {}
    assert told(replace(robot, inertial_parameters=np.zeros_like(parameters))) == {}
