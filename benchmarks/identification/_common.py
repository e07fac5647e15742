# SPDX-License-Identifier: BSD-3-Clause
"""Robots in skidyn and pinocchio, motions and interleaved timing, for these scripts."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "engine"))

import numpy as np
import pinocchio as pin
import torch
from _timing import branched_text, embedded_text, interleaved, models
from threadpoolctl import threadpool_limits

from skidyn.robots import Robot

# One thread, whatever was imported first.
threadpool_limits(1)
torch.set_num_threads(1)

__all__ = [
    "ROBOTS",
    "Oracle",
    "interleaved",
    "noisy_torque",
    "random_motion",
]

#: URDF text of each robot of the tables.
ROBOTS = {
    "panda": lambda: embedded_text("panda"),
    "srs_arm": lambda: embedded_text("srs_arm"),
    "ur10e": lambda: embedded_text("ur10e"),
    "branched, slider": branched_text,
}
#: Place of (m, mc, Ixx, Ixy, Ixz, Iyy, Iyz, Izz) among pinocchio's (.. Ixx, Ixy, Iyy, Ixz ..).
_PLACES = np.array([0, 1, 2, 3, 4, 5, 7, 6, 8, 9])


class Oracle:
    """A robot in pinocchio, with the columns and rows in the order of skidyn."""

    def __init__(self, text: str) -> None:
        self.robot, self.model, self.order = models(text)
        self.data = self.model.createData()
        self.columns = np.concatenate([10 * i + _PLACES for i in self.order])

    def in_order(self, *signals: np.ndarray) -> np.ndarray:
        """Signals with the joints in pinocchio's order."""
        given = np.zeros((len(signals), len(signals[0]), self.model.nv))
        given[:, :, self.order] = signals
        return given

    def regressor(self, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray) -> np.ndarray:
        """The loop over samples that pinocchio's Python interface offers, joints in its order."""
        out = np.empty((len(q), self.model.nv, 10 * self.model.nv))
        for k in range(len(q)):
            out[k] = pin.computeJointTorqueRegressor(self.model, self.data, q[k], dq[k], ddq[k])
        return out


def random_motion(robot: Robot, n_samples: int, seed: int = 0) -> np.ndarray:
    """Positions, velocities and accelerations, shape (3, n_samples, n_joints)."""
    return np.random.default_rng(seed).uniform(-2, 2, (3, n_samples, robot.n_joints))


def noisy_torque(robot: Robot, motion: np.ndarray, noise: float = 0.1, seed: int = 1) -> np.ndarray:
    """Torque of bodies up to 30 % off those of the URDF, with white noise in N m."""
    rng = np.random.default_rng(seed)
    truth = robot.inertial_parameters * rng.uniform(0.7, 1.3, (robot.n_bodies, 1))
    torque = robot.inverse_dynamics(*motion, parameters=truth)
    return torque + rng.normal(0, noise, torque.shape)
