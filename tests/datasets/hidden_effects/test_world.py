# SPDX-License-Identifier: BSD-3-Clause
"""The simulated robot is near the nominal one, and physical."""

import numpy as np

from skidyn.datasets import load_panda, make_hidden_effect_log

SHORT = {"n_trajectories": 4, "duration": 4.0}


def test_robot_differs_from_the_nominal_one_and_stays_physical():
    robot = load_panda()
    log = make_hidden_effect_log(robot, None, base=(), noise=0.0, **SHORT)
    ratio = log.true_parameters[:, 0] / robot.inertial_parameters[:, 0]
    assert np.all((np.abs(ratio - 1) > 0.09) & (np.abs(ratio - 1) < 0.21))
    for m, hx, hy, hz, xx, xy, xz, yy, yz, zz in log.true_parameters:
        inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        h = np.array([[hx, hy, hz]])
        pseudo = np.block([[np.trace(inertia) / 2 * np.eye(3) - inertia, h.T], [h, m]])
        assert np.linalg.eigvalsh(pseudo)[0] > 0
    state = (log.X[[f"{s}{k}" for k in range(1, 8)]].to_numpy() for s in ("q", "dq"))
    q, dq = state
    moving = robot.inverse_dynamics(q, dq, np.zeros_like(q), parameters=log.true_parameters)
    slow = np.abs(log.X[[f"ddq{k}" for k in range(1, 8)]].to_numpy()).max(axis=1) < 0.02
    np.testing.assert_allclose(log.y[slow], moving[slow], atol=0.15)
