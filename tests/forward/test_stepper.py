# SPDX-License-Identifier: BSD-3-Clause
"""Steps with set-valued friction: it stops, holds and breaks loose exactly."""

import numpy as np
import pytest

from skidyn.simulation import Controller


def test_agrees_with_mujoco_while_it_slides(slider, log_of, moved):
    """Sliding, MuJoCo's frictionloss is dry friction; only at rest it creeps."""
    pytest.importorskip("mujoco")
    sizes = {"viscous": [0.4], "coulomb": [1.0]}
    model = slider(list(sizes), sizes)
    time = np.linspace(0, 1, 101)
    X, y = log_of(model.robot_, [0.0], [0.5], lambda t, j: 1.5 + 0.5 * np.sin(8 * t), time)
    own, _ = moved(model, X, y, step=5e-4)
    other, _ = moved(model, X, y, engine="mujoco", step=5e-4)
    np.testing.assert_allclose(own, other, atol=1e-6)


def test_dry_friction_stops_and_holds_exactly(slider, log_of, moved):
    model = slider(["coulomb"], {"coulomb": [3.0]})
    time = np.linspace(0, 4, 41)  # 10 Hz
    X, y = log_of(model.robot_, [0.0], [2.0], lambda t, j: 2.5 * (t > 2), time)
    q, dq = moved(model, X, y)
    # v = 2 - 1.5 t until 4/3 s, at 4/3 m; 2.5 N do not overcome 3 N
    assert np.all(dq[14:] == 0.0)
    np.testing.assert_allclose(q[14:, 0], 4 / 3, atol=2e-3)
    np.testing.assert_allclose(np.ptp(q[14:]), 0.0, atol=1e-12)


def test_joint_breaks_loose_when_the_torque_exceeds_friction(slider, log_of, moved):
    model = slider(["coulomb"], {"coulomb": [3.0]})
    time = np.linspace(0, 2, 201)
    X, y = log_of(model.robot_, [0.0], [0.0], lambda t, j: 3 * t, time)
    q, _ = moved(model, X, y)
    assert np.abs(q[:101]).max() < 1e-9
    np.testing.assert_allclose(q[-1, 0], 1.5 / 6, atol=1e-3)  # ddq = 1.5 (t - 1)


def test_stiff_controller_is_stable_at_the_rate_of_a_slow_log(slider, log_of, moved):
    model = slider(["viscous", "coulomb"], {"viscous": [5.0], "coulomb": [0.5]})
    time = np.linspace(0, 2, 41)  # 20 Hz, time constants of a hundredth of a step
    X, _ = log_of(model.robot_, [0.0], [0.0], lambda t, j: 0 * t, time)
    X["q_ref1"] = np.sin(time)
    controller = Controller(stiffness=1e6, damping=1e4, follows_velocity=False)
    q, _ = moved(model, X, controller=controller, step=1.0)
    assert np.abs(q[:, 0] - np.sin(time)).max() < 0.03
