# SPDX-License-Identifier: BSD-3-Clause
"""Parquet files of simulated motion: sums of sines with exact derivatives, and friction."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from skidyn.robots import Robot

RATE, DURATION, HARMONICS = 100.0, 10.0, 5


def motion(robot: Robot, rng: np.random.Generator) -> tuple[np.ndarray, ...]:
    """Time and exact positions, velocities and accelerations of one trajectory."""
    time = np.arange(int(RATE * DURATION)) / RATE
    frequency = rng.uniform(0.1, 1.0, (HARMONICS, robot.n_joints)) * 2 * np.pi
    phase = rng.uniform(0, 2 * np.pi, frequency.shape)
    size = rng.uniform(0.1, 0.5, frequency.shape)
    angle = frequency * time[:, None, None] + phase
    q = np.sum(size * np.sin(angle), axis=1)
    dq = np.sum(size * frequency * np.cos(angle), axis=1)
    ddq = np.sum(-size * frequency**2 * np.sin(angle), axis=1)
    return time, q, dq, ddq


def torque(
    robot: Robot,
    q: np.ndarray,
    dq: np.ndarray,
    ddq: np.ndarray,
    friction: np.ndarray,
    rng: np.random.Generator,
) -> np.ndarray:
    """Rigid body, viscous (row 0) and Coulomb friction (row 1), and noise of 0.1 N m."""
    exact = robot.inverse_dynamics(q, dq, ddq) + friction[0] * dq + friction[1] * np.sign(dq)
    return exact + 0.1 * rng.normal(size=q.shape)


def write_tile(path: Path, robot: Robot, rows: int = 100_000, seed: int = 0) -> None:
    """Write a file of ``rows`` rows, in trajectories of 1,000 rows each."""
    rng, tables = np.random.default_rng(seed), []
    friction = np.array([np.full(robot.n_joints, 2.0), np.full(robot.n_joints, 3.0)])
    for k in range(rows // int(RATE * DURATION)):
        time, q, dq, ddq = motion(robot, rng)
        columns = {"time": time, "trajectory": np.full(len(time), k)}
        blocks = {"q": q, "dq": dq, "tau": torque(robot, q, dq, ddq, friction, rng)}
        for name, block in blocks.items():
            columns |= {f"{name}{j + 1}": block[:, j] for j in range(robot.n_joints)}
        tables.append(pd.DataFrame(columns))
    pd.concat(tables, ignore_index=True).to_parquet(path)
