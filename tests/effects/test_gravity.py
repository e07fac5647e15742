# SPDX-License-Identifier: BSD-3-Clause
"""Another direction of gravity."""

import numpy as np
import pytest

from skidyn.datasets import make_hidden_effect_log
from skidyn.effects import get_effect
from skidyn.identification import RBDRegressor
from skidyn.robots import Robot


def test_tilt_is_a_change_of_gravity(signals, robot):
    tilted = np.asarray(robot.gravity) + [0.3, -0.2, 0.0]
    rest = np.zeros_like(signals.q)
    change = robot.inverse_dynamics(signals.q, rest, rest, gravity=tilted)
    change = change - robot.inverse_dynamics(signals.q, rest, rest)
    blocks = get_effect("base_tilt").torque_columns(signals, (0, 1))
    for j in range(2):
        np.testing.assert_allclose(blocks[j][:, :2] @ [0.3, -0.2], change[:, j], atol=1e-10)


#: A link, its place, and the joint that turns it.
LINK = """<link name="l{n}"><inertial><origin xyz="0.15 0.01 0.02"/><mass value="{mass}"/>
<inertia ixx="0.01" iyy="0.03" izz="0.03" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j{n}" type="revolute"><parent link="l{before}"/><child link="l{n}"/>
<origin xyz="{place}"/><axis xyz="{axis}"/>
<limit lower="-2.5" upper="2.5" effort="100" velocity="2"/></joint>"""


@pytest.mark.parametrize("lever", [0.0, 1e-4, 1.6e-3])
def test_a_mass_that_no_motion_shows_does_not_change_a_tilt(lever):
    """The mass of a link whose axis nearly meets the first one may be tons in a fit."""
    joints = [("0 0 0.2", "0 0 1"), (f"0 {lever} 0.1", "0 1 0"), ("0.4 0 0", "0 1 0")]
    links = (
        LINK.format(n=n, before=n - 1, mass=4 - n, place=place, axis=axis)
        for n, (place, axis) in enumerate(joints, 1)
    )
    arm = Robot.from_urdf('<robot name="arm"><link name="l0"/>' + "".join(links) + "</robot>")
    log = make_hidden_effect_log(arm, "base_tilt", n_trajectories=8, duration=5.0)
    model = RBDRegressor(arm, effects=("viscous", "coulomb", "base_tilt")).fit(log.X, log.y)
    (found,) = (c for t, c in model.effect_coefficients_.items() if t.kind == "base_tilt")

    true = log.truth[0]["parameters"]
    np.testing.assert_allclose(found[:2], [true["gx"], true["gy"]], atol=0.02)
    error = np.sqrt(np.mean((log.y - model.predict(log.X)) ** 2, axis=0))
    assert (error < 0.2).all()
