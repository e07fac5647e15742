# SPDX-License-Identifier: BSD-3-Clause
"""Motions keep the limits, and velocities belong to positions."""

import numpy as np

from skidyn.datasets import load_panda, load_planar_arm, load_scara, make_hidden_effect_log

PLANAR, SCARA = load_planar_arm(), load_scara()
SHORT = {"n_trajectories": 4, "duration": 4.0}


def test_motion_keeps_the_limits():
    robot = load_panda()
    log = make_hidden_effect_log(robot, None, **SHORT)
    q = log.frame[[f"q{k}" for k in range(1, 8)]].to_numpy()
    low, high = robot.position_limits.T
    assert np.all(q > low - 1e-3) and np.all(q < high + 1e-3)
    dq = log.frame[[f"dq{k}" for k in range(1, 8)]].to_numpy()
    assert np.all(np.abs(dq).max(axis=0) < robot.velocity_limits)


def test_velocity_belongs_to_position():
    frame = make_hidden_effect_log(PLANAR, None, noise=0.0, **SHORT).frame
    one = frame[frame["trajectory"] == 1]
    derived = np.gradient(one["q1"], one["time"])
    np.testing.assert_allclose(derived[5:-5], one["dq1"][5:-5], atol=0.02)
