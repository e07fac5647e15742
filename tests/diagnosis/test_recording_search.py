# SPDX-License-Identifier: BSD-3-Clause
"""Effects of all joints with another size in each recording."""

import numpy as np
import pandas as pd
import pytest

from skidyn.datasets import load_planar_arm
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor

#: Recordings two by two: the base is moved, or the logger started, after every second one.
GROUPS = [(1, 2), (3, 4), (5, 6)]
TIME = np.arange(0.0, 5.0, 0.01)


def motion(seed):
    """Positions, velocities and accelerations along sines."""
    rng = np.random.default_rng(seed)
    frequency, phase = rng.uniform(0.3, 1.2, (4, 2)), rng.uniform(0, 2 * np.pi, (4, 2))
    size = rng.uniform(0.2, 0.5, (4, 2))
    omega = 2 * np.pi * frequency
    angle = omega * TIME[:, None, None] + phase
    parts = size * np.sin(angle), size * omega * np.cos(angle), -size * omega**2 * np.sin(angle)
    return tuple(part.sum(axis=1) for part in parts)


def log_of(torque_of):
    """A log of six recordings, in which the group of a recording determines its torque."""
    frames, torques = [], []
    for name in range(1, 7):
        q, dq, ddq = motion(name)
        frame = pd.DataFrame({"time": TIME + 20 * name, "trajectory": name})
        frame[["q1", "q2", "dq1", "dq2"]] = np.hstack([q, dq])
        frames.append(frame)
        torques.append(torque_of((name - 1) // 2, q, dq, ddq))
    torque = np.vstack(torques)
    noise = np.random.default_rng(0).normal(size=torque.shape)
    return pd.concat(frames, ignore_index=True), torque + 0.01 * torque.std(axis=0) * noise


def friction(dq):
    return 0.2 * dq + 0.3 * np.sign(dq)


def found_in(robot, X, torque):
    model = RBDRegressor(robot, ("viscous", "coulomb"))
    findings = diagnose(model, X, torque, checks=()).findings
    return sorted(findings, key=lambda finding: finding.trajectories or ())


def test_a_base_that_is_moved_between_recordings_is_tilted_in_another_way_in_each():
    robot = load_planar_arm()
    down, side = np.array(robot.gravity, dtype=float), np.zeros(3)
    side[np.argmin(np.abs(down))] = 9.81
    angles = np.deg2rad([2.0, -3.0, 6.0])

    def torque(group, q, dq, ddq):
        gravity = np.cos(angles[group]) * down + np.sin(angles[group]) * side
        return robot.inverse_dynamics(q, dq, ddq, gravity=gravity) + friction(dq)

    findings = found_in(robot, *log_of(torque))

    assert {f.kind for f in findings} == {"base_tilt"}
    assert {f.trajectories for f in findings} <= set(GROUPS)
    tilt = {f.trajectories: f.parameters["gx"]["value"] for f in findings}
    differences = [tilt.get(group, 0.0) - tilt.get(GROUPS[0], 0.0) for group in GROUPS[1:]]
    assert differences == pytest.approx(9.81 * np.sin(angles[1:] - angles[0]), rel=0.05)


def test_a_logger_that_is_started_by_hand_is_late_by_another_time_in_each_recording():
    robot, delays = load_planar_arm(), [0.006, 0.014, 0.022]

    def torque(group, q, dq, ddq):
        exact = robot.inverse_dynamics(q, dq, ddq) + friction(dq)
        columns = [np.interp(TIME - delays[group], TIME, column) for column in exact.T]
        return np.column_stack(columns)

    findings = found_in(robot, *log_of(torque))

    assert [(f.kind, f.joints, f.trajectories) for f in findings] == [
        ("time_delay", (1, 2), group) for group in GROUPS
    ]
    found = [f.parameters["delay"]["value"] for f in findings]
    assert found == pytest.approx(delays, abs=0.002)


def test_a_longer_delay_of_one_joint_is_a_pure_one_and_no_load_that_swings():
    robot, delay = load_planar_arm(), 0.03

    def torque(group, q, dq, ddq):
        exact = robot.inverse_dynamics(q, dq, ddq) + friction(dq)
        exact[:, 0] = np.interp(TIME - delay, TIME, exact[:, 0])
        return exact

    (finding,) = found_in(robot, *log_of(torque))

    assert (finding.kind, finding.joints) == ("time_delay", (1,))
    assert finding.parameters["delay"]["value"] == pytest.approx(delay, abs=0.002)
