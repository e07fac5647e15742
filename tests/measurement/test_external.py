# SPDX-License-Identifier: BSD-3-Clause
"""Torque from which that of a model was subtracted."""

import numpy as np
import pytest

from skidyn.datasets import load_ur5, make_hidden_effect_log
from skidyn.logs import check_log

ROBOT = load_ur5()
LOG = make_hidden_effect_log(ROBOT, None, n_trajectories=4, duration=6.0, random_state=2).frame
Q, DQ, TAU = (LOG[[f"{name}{k + 1}" for k in range(6)]].to_numpy() for name in ("q", "dq", "tau"))


def checked(torque):
    frame = LOG.assign(**{f"tau{k + 1}": torque[:, k] for k in range(6)})
    return {s.check: s for s in check_log(frame, ROBOT).checks if s.certainty != "noted"}


def model_torque():
    ddq = np.gradient(DQ, np.median(np.diff(LOG["time"])), axis=0)
    return ROBOT.inverse_dynamics(Q, DQ, ddq)


@pytest.mark.parametrize("share", [0.0, 0.02])
def test_torque_without_that_of_a_model(share):
    rest = 2.0 * np.sign(DQ) + 3.0 * DQ + np.random.default_rng(0).normal(0, 0.2, DQ.shape)
    told = checked(share * model_torque() + rest)["external_torque"]
    assert "no gravity and no inertia" in told.suspicion and told.certainty == "suspected"


def test_a_subtracted_model_is_told_if_the_robot_differs_from_it():
    told = checked(TAU - model_torque())
    assert any("model was subtracted" in s.suspicion for s in told.values())


@pytest.mark.parametrize("factor", [1.0, 0.02])
def test_other_torques_contain_bodies(factor):
    assert "external_torque" not in checked(factor * TAU)


def test_torque_without_gravity_alone():
    assert "external_torque" not in checked(TAU - ROBOT.gravity_torque(Q))
