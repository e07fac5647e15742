# SPDX-License-Identifier: BSD-3-Clause
"""Which of nearly equal explanations is named."""

import numpy as np
import pytest

from skidyn.datasets import make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor
from skidyn.robots import Robot

#: A link, its mass in kg, and the slide that moves it.
SLIDE = """<link name="l{n}"><inertial><mass value="{mass}"/>
<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="joint{n}" type="prismatic"><parent link="l{before}"/><child link="l{n}"/>
<axis xyz="{axis}"/><limit lower="-1" upper="1" effort="1000" velocity="3"/></joint>"""


@pytest.mark.parametrize("kind", ["rotor_inertia", "offset"])
def test_of_explanations_that_a_mass_makes_equal_the_one_with_bodies_as_described_is_named(kind):
    """On a vertical slide a rotor and a counterweight are the same beside the mass that is fit."""
    links = (
        SLIDE.format(n=n, before=n - 1, mass=mass, axis=axis)
        for n, mass, axis in ((1, 20.0, "1 0 0"), (2, 8.0, "0 0 1"))
    )
    robot = Robot.from_urdf('<robot name="slides"><link name="l0"/>' + "".join(links) + "</robot>")
    X = make_hidden_effect_log(robot, None, noise="low", n_trajectories=6, duration=5.0).X
    q, dq, ddq = (X[[f"{s}1", f"{s}2"]].to_numpy() for s in ("q", "dq", "ddq"))
    torque = robot.inverse_dynamics(q, dq, ddq)
    torque += np.random.default_rng(0).normal(0.0, 0.1, torque.shape)
    torque[:, 1] += 2.0 * ddq[:, 1] if kind == "rotor_inertia" else 12.0

    (finding,) = diagnose(RBDRegressor(robot), X, torque, checks=()).findings

    assert (finding.kind, finding.joints) == (kind, (2,))


@pytest.mark.slow
def test_plain_friction_that_the_model_lacks_is_found_before_a_power_of_the_velocity(
    without_friction,
):
    """Together, viscous and Coulomb friction resemble a small power of the velocity."""
    arm = without_friction
    torque = arm.torque + 0.1 * arm.size * (np.sign(arm.dq) + arm.dq)

    findings = diagnose(RBDRegressor(arm.robot, ()), arm.X, torque, checks=()).findings

    found = {(f.kind, j) for f in findings for j in f.joints}
    assert found == {("coulomb", 1), ("coulomb", 2), ("viscous", 1), ("viscous", 2)}


def test_an_offset_over_a_logged_temperature_is_no_offset_that_grows(without_friction):
    arm = without_friction
    since = arm.X["time"].to_numpy() - arm.X["time"].to_numpy().min()
    warm = -10.0 * np.expm1(-since / 500.0)
    torque = arm.torque.copy()
    torque[:, 0] += 0.01 * arm.size[0] * warm
    X = arm.X.assign(temp1=30.0 + warm, temp2=30.0 + warm)

    (finding,) = diagnose(RBDRegressor(arm.robot, ()), X, torque, checks=()).findings

    assert (finding.kind, finding.joints) == ("temperature_offset", (1,))
    assert set(finding.parameters) == {"dtau_dT", "tau0"}
