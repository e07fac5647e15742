# SPDX-License-Identifier: BSD-3-Clause
"""The motion of a model with friction, springs and memory."""

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, load_ur5
from skidyn.effects import Term


@pytest.mark.parametrize(
    "arm",
    [
        pytest.param(load_planar_arm, id="planar"),
        pytest.param(load_ur5, id="ur5", marks=pytest.mark.slow),
    ],
)
def test_agrees_with_mujoco(arm, fitted, log_of, moved):
    pytest.importorskip("mujoco")
    robot = arm()
    n = robot.n_joints
    sizes = {"viscous": [1.5], "rotor_inertia": [0.3], "spring": [4.0, 1.0], "coulomb": [0.0]}
    model = fitted(robot, list(sizes), sizes)
    time = np.linspace(0, 1, 101)
    start = 0.3 * np.ones(n)
    hold = robot.gravity_torque(start[None])[0]
    X, y = log_of(robot, start, 0.2 * start, lambda t, j: hold[j] + 2 * np.sin(5 * t + j), time)
    own, _ = moved(model, X, y, step=5e-4)
    other, _ = moved(model, X, y, engine="mujoco", step=5e-4)
    assert np.abs(own[-1] - own[0]).max() > 0.05
    np.testing.assert_allclose(own, other, atol=1e-6)


def test_presliding_springs_back(slider, log_of, moved):
    """Dahl friction lets go what it held: a push within the presliding range leaves no trace."""
    sizes = {"dahl": [3.0], "viscous": [100.0]}
    model = slider([Term("dahl", (1,), {"presliding": 0.01}), "viscous"], sizes)
    time = np.linspace(0, 3, 301)
    X, y = log_of(model.robot_, [0.0], [0.0], lambda t, j: 0.3 * (t < 1.5), time)
    q, _ = moved(model, X, y)
    np.testing.assert_allclose(q[145, 0], -0.01 * np.log(0.9), rtol=0.02)
    assert abs(q[-1, 0]) < 0.15 * q[145, 0]


def test_elastic_link_swings_at_its_resonance(slider, log_of, moved):
    """Motor held by a stiff controller: the link of 2 kg swings at sqrt(k / m)."""
    term = Term("joint_elasticity", (1,), {"resonance": 5.0, "damping": 0.01})
    stiffness = 2.0 * (2 * np.pi * 5.0) ** 2
    sizes = {"joint_elasticity": [1 / stiffness], "rotor_inertia": [1.0]}
    model = slider([term, "rotor_inertia"], sizes)
    time = np.linspace(0, 1, 1001)
    X, y = log_of(model.robot_, [0.0], [0.0], lambda t, j: 10.0 * (t < 0.01), time)
    q, dq = moved(model, X, y)
    # two masses: omega^2 = k (1/1 + 1/2)
    free = dq[:, 0] - 0.095 / 3.0  # the momentum of the push, which ends within a sample
    crossings = np.flatnonzero((free[:-1] < 0) & (free[1:] >= 0))
    period = np.diff(time[crossings[crossings > 20]]).mean()
    np.testing.assert_allclose(1 / period, 5.0 * np.sqrt(3.0), rtol=0.02)


def test_a_gear_that_becomes_stiffer_gives_way_less(slider, log_of, moved):
    """A force of 10 N on a motor of 1 kg, whose link of 2 kg lags behind by the wind-up."""
    stiffness, stiffening = 2.0 * (2 * np.pi * 5.0) ** 2, 2.0
    term = Term("joint_elasticity", (1,), {"resonance": 5.0, "stiffening": stiffening})
    sizes = {"joint_elasticity": [1 / stiffness], "rotor_inertia": [1.0]}
    model = slider([term, "rotor_inertia"], sizes)
    time = np.linspace(0, 2, 2001)
    X, y = log_of(model.robot_, [0.0], [0.0], lambda t, j: 10.0 + 0 * t, time)
    q, _ = moved(model, X, y)
    center = 0.5 * (10.0 / 3.0) * time**2
    wound_up = stiffening / stiffness * np.arcsinh(10.0 * 2 / 3 / stiffening)
    np.testing.assert_allclose(q[-200:, 0] - center[-200:], 2 / 3 * wound_up, rtol=0.1)
