# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import pandas as pd
import pytest

from skidyn.datasets import load_planar_arm

N_JOINTS = 2


@pytest.fixture(scope="session", autouse=True)
def with_fresh_processes(fresh_processes):
    """All tests of networks."""


def make_hysteretic_log(n_trajectories=8, n_rows=120, seed=0, joint_scale=(1.0, 1.0)):
    """Torque of two joints with friction that remembers the motion, so that history is needed."""
    rng = np.random.default_rng(seed)
    tables, torques = [], []
    t = np.arange(n_rows) * 0.02
    for k in range(n_trajectories):
        phase, speed = rng.uniform(0, 6, N_JOINTS), 2 * np.pi * rng.uniform(0.5, 1.5, N_JOINTS)
        amplitude = rng.uniform(0.5, 1, N_JOINTS)
        angle = speed * t[:, None] + phase
        q, dq = amplitude * np.sin(angle), amplitude * speed * np.cos(angle)
        ddq = -amplitude * speed**2 * np.sin(angle)
        state, friction = np.zeros(N_JOINTS), []
        for velocity in dq:
            state = state + 0.02 * (velocity - 4 * np.abs(velocity) * state)
            friction.append(state)
        torque = 0.05 * ddq + 2 * np.cos(q) + 3 * np.array(friction)
        torques.append((torque + 0.05 * rng.normal(size=torque.shape)) * joint_scale)
        tables.append(np.c_[np.full(n_rows, k), t, q, dq, ddq])
    names = ["trajectory", "time"] + [f"{s}{j + 1}" for s in ("q", "dq", "ddq") for j in range(2)]
    return pd.DataFrame(np.concatenate(tables), columns=names), np.concatenate(torques)


@pytest.fixture(scope="session")
def log():
    return make_hysteretic_log()


@pytest.fixture(scope="session")
def make_log():
    return make_hysteretic_log


@pytest.fixture(scope="module")
def arm_log():
    """The arm has other inertial parameters than its description, and friction."""
    robot = load_planar_arm()
    rng = np.random.default_rng(0)
    t = np.arange(150) * 0.02
    frames, torques = [], []
    for k in range(8):
        speed, phase = rng.uniform(1, 4, 2), rng.uniform(0, 6, 2)
        angle = speed * t[:, None] + phase
        q, dq, ddq = np.sin(angle), speed * np.cos(angle), -(speed**2) * np.sin(angle)
        torque = robot.inverse_dynamics(q, dq, ddq, parameters=1.3 * robot.inertial_parameters)
        torques.append(torque + 0.5 * np.tanh(dq / 0.1))
        names = [f"{s}{j}" for s in ("q", "dq", "ddq") for j in (1, 2)]
        frames.append(pd.DataFrame(np.c_[q, dq, ddq], columns=names).assign(trajectory=k))
    return robot, pd.concat(frames, ignore_index=True), np.concatenate(torques)
