# SPDX-License-Identifier: BSD-3-Clause
"""Another direction of gravity."""

import numpy as np
import pytest

from skidyn.datasets import make_hidden_effect_log
from skidyn.diagnosis import diagnose
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


def three_links(lever):
    """An arm whose second axis passes the first one at a distance, m."""
    joints = [("0 0 0.2", "0 0 1"), (f"0 {lever} 0.1", "0 1 0"), ("0.4 0 0", "0 1 0")]
    links = (
        LINK.format(n=n, before=n - 1, mass=4 - n, place=place, axis=axis)
        for n, (place, axis) in enumerate(joints, 1)
    )
    return Robot.from_urdf('<robot name="arm"><link name="l0"/>' + "".join(links) + "</robot>")


@pytest.mark.parametrize("lever", [0.0, 1e-4, 1.6e-3])
def test_a_mass_that_no_motion_shows_does_not_change_a_tilt(lever):
    """The mass of a link whose axis nearly meets the first one may be tons in a fit."""
    arm = three_links(lever)
    log = make_hidden_effect_log(arm, "base_tilt", n_trajectories=8, duration=5.0)
    model = RBDRegressor(arm, effects=("viscous", "coulomb", "base_tilt")).fit(log.X, log.y)
    (found,) = (c for t, c in model.effect_coefficients_.items() if t.kind == "base_tilt")

    true = log.truth[0]["parameters"]
    np.testing.assert_allclose(found[:2], [true["gx"], true["gy"]], atol=0.02)
    error = np.sqrt(np.mean((log.y - model.predict(log.X)) ** 2, axis=0))
    assert (error < 0.2).all()


@pytest.mark.slow
def test_a_base_that_leans_from_one_recording_on():
    arm = three_links(0.0)
    log = make_hidden_effect_log(arm, None, n_trajectories=8, duration=5.0)
    q, dq, ddq = (log.X[[f"{s}{j}" for j in (1, 2, 3)]].to_numpy() for s in ("q", "dq", "ddq"))
    later = log.X["trajectory"].isin([4, 5, 6, 7]).to_numpy()[:, None]
    leaning = arm.inverse_dynamics(q, dq, ddq, gravity=np.asarray(arm.gravity) + [0.5, -0.3, 0.0])
    torque = np.where(later, leaning, arm.inverse_dynamics(q, dq, ddq))
    torque += np.random.default_rng(0).normal(0.0, 0.02, torque.shape)

    (finding,) = diagnose(RBDRegressor(arm), log.X, torque, checks=()).findings

    assert (finding.kind, finding.trajectories) == ("base_tilt", (4, 5, 6, 7))
