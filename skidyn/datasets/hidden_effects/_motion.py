# SPDX-License-Identifier: BSD-3-Clause
"""Excitation of a robot: multi-sines at several speeds and point-to-point runs with dwells."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from skidyn._signals import Array

if TYPE_CHECKING:
    from skidyn.robots import Robot

#: Order of the kinds of trajectories, so that even few of them differ.
KINDS = ("medium", "fast", "slow", "point_to_point", "medium", "slow", "fast", "point_to_point")
#: Largest speed relative to :attr:`Ranges.speed`, and base frequency in Hz, of each multi-sine.
SINES = {"slow": (0.15, 0.06), "medium": (0.5, 0.1), "fast": (1.0, 0.16)}
N_HARMONICS = 5


@dataclass(frozen=True)
class Motion:
    """Positions (rad or m), velocities and accelerations on one time grid, exact.

    Their shape is (n_trajectories, n_steps, n_joints).
    """

    q: Array
    dq: Array
    ddq: Array

    def every(self, stride: int) -> Motion:
        """The motion at every ``stride``-th step."""
        return Motion(self.q[:, ::stride], self.dq[:, ::stride], self.ddq[:, ::stride])


@dataclass(frozen=True)
class Ranges:
    """Range of positions and speeds of each joint.

    ``centre`` is the middle of the motion and ``reach`` the largest distance from it, rad or m;
    ``speed`` is the largest velocity.
    """

    centre: Array
    reach: Array
    speed: Array


def motion_ranges(robot: Robot) -> Ranges:
    """Moderate ranges inside the limits of a robot.

    Joints without limits turn by up to 1.3 rad or slide by up to 0.1 m.
    """
    sliding = np.array([kind == "prismatic" for kind in robot.joint_types])
    low, high = np.asarray(robot.position_limits, dtype=float).T
    limited = np.isfinite(low) & np.isfinite(high) & (high > low)
    low, high = np.where(limited, low, -np.pi), np.where(limited, high, np.pi)
    reach = np.minimum(0.45 * (high - low), np.where(sliding, 0.1, 1.3))
    speed = np.asarray(robot.velocity_limits, dtype=float)
    speed = np.where(np.isfinite(speed) & (speed > 0), speed, np.inf)
    speed = np.minimum(0.8 * speed, np.where(sliding, 0.25, 1.8))
    return Ranges((low + high) / 2, reach, speed)


def plan_motion(
    robot: Robot, n_trajectories: int, step: float, n_steps: int, rng: np.random.Generator
) -> Motion:
    """Plan trajectories of alternating kinds, with ``n_steps`` rows that are ``step`` s apart."""
    ranges = motion_ranges(robot)
    time = step * np.arange(n_steps, dtype=np.float64)
    parts = []
    for k in range(n_trajectories):
        kind = KINDS[k % len(KINDS)]
        if kind == "point_to_point":
            parts.append(_point_to_point(ranges, time, rng))
        else:
            parts.append(_multi_sine(ranges, time, *SINES[kind], rng))
    return Motion(*(np.stack([part[d] for part in parts]) for d in range(3)))


def _multi_sine(
    ranges: Ranges, time: Array, speed: float, frequency: float, rng: np.random.Generator
) -> tuple[Array, Array, Array]:
    """Sum of harmonics per joint with the requested speed and within the range."""
    n = len(ranges.centre)
    harmonics = np.arange(1, N_HARMONICS + 1)
    omega = 2 * np.pi * frequency * rng.uniform(0.8, 1.25, (n, 1)) * harmonics
    phase = rng.uniform(0, 2 * np.pi, (n, N_HARMONICS))
    amplitude = rng.uniform(0.4, 1.0, (n, N_HARMONICS)) / harmonics
    angle = time[:, None, None] * omega + phase
    sine, cosine = np.sin(angle), np.cos(angle)
    q = np.einsum("tnh,nh->tn", sine, amplitude)
    dq = np.einsum("tnh,nh->tn", cosine, amplitude * omega)
    ddq = -np.einsum("tnh,nh->tn", sine, amplitude * omega**2)
    middle = (q.max(axis=0) + q.min(axis=0)) / 2
    span = (q.max(axis=0) - q.min(axis=0)) / 2
    scale = np.minimum(
        speed * ranges.speed / np.abs(dq).max(axis=0),
        rng.uniform(0.6, 1.0, n) * ranges.reach / span,
    )
    room = ranges.reach - scale * span
    centre = ranges.centre + rng.uniform(-1, 1, n) * room
    return centre + scale * (q - middle), scale * dq, scale * ddq


def _point_to_point(
    ranges: Ranges, time: Array, rng: np.random.Generator
) -> tuple[Array, Array, Array]:
    """Quintic moves between random points, with a rest at each point."""
    n = len(ranges.centre)
    q, dq, ddq = (np.zeros((len(time), n)) for _ in range(3))
    here = ranges.centre + rng.uniform(-0.8, 0.8, n) * ranges.reach
    begin = -rng.uniform(0.0, 0.3)
    while begin < time[-1]:
        target = ranges.centre + rng.uniform(-0.8, 0.8, n) * ranges.reach
        way = target - here
        # the peak speed of a quintic is 15/8 of its mean speed
        lasts = max(float(np.max(np.abs(way) / ranges.speed)) * 1.875 / rng.uniform(0.25, 0.9), 0.3)
        rest = rng.uniform(0.3, 0.8)
        rows = (time >= begin) & (time < begin + lasts + rest)
        u = np.clip((time[rows] - begin) / lasts, 0.0, 1.0)[:, None]
        q[rows] = here + way * (u**3 * (10 - 15 * u + 6 * u**2))
        dq[rows] = way / lasts * (30 * u**2 * (1 - u) ** 2)
        ddq[rows] = way / lasts**2 * (60 * u * (1 - u) * (1 - 2 * u))
        here, begin = target, begin + lasts + rest
    return q, dq, ddq
