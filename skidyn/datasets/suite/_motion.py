# SPDX-License-Identifier: BSD-3-Clause
"""Typical motions of the commissioning of a robot."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from skidyn._signals import Array
from skidyn.datasets.suite._robots import Drives

#: Time in s of shape (n,) to position, velocity and acceleration of shape (n, n_joints).
Motion = Callable[[Array], tuple[Array, Array, Array]]

#: Lowest and highest harmonic, and share of the top speed, of a multi-sine.
PACES = {
    "slow": ((1, 4), (0.10, 0.22)),
    "medium": ((1, 6), (0.4, 0.65)),
    "fast": ((2, 11), (0.8, 1.0)),
}
#: Seconds before the log starts, in which the controller settles.
SETTLE = 0.4


def plan(pace: str, drives: Drives, duration: float, rng: np.random.Generator) -> Motion:
    """A motion of the pace: slow, medium or fast multi-sine, or ``points`` with rests between."""
    if pace == "points":
        return _points(drives, duration, rng)
    return _multi_sine(pace, drives, duration, rng)


def _multi_sine(pace: str, drives: Drives, duration: float, rng: np.random.Generator) -> Motion:
    (low, high), shares = PACES[pace]
    omega = 2 * np.pi / max(duration, 4.0)
    orders = np.arange(low if duration >= 4 else max(1, low), high + 1)
    n = drives.n_joints
    a, b = (rng.normal(size=(n, len(orders))) / np.sqrt(orders) for _ in range(2))
    w = orders * omega

    def series(t: Array) -> tuple[Array, Array, Array]:
        sine, cosine = np.sin(np.outer(t, w)), np.cos(np.outer(t, w))
        return (
            sine @ a.T + cosine @ b.T,
            (cosine * w) @ a.T - (sine * w) @ b.T,
            -(sine * w**2) @ a.T - (cosine * w**2) @ b.T,
        )

    q, v, acc = series(np.linspace(-SETTLE, duration, 800))
    stroke, centre = np.array(drives.stroke), np.array(drives.centre, float)
    reach = stroke * rng.uniform(0.6, 1.0, n)
    speed = np.array(drives.speed) * rng.uniform(*shares, n)
    scale = np.minimum(reach / (np.ptp(q, axis=0) / 2), speed / np.abs(v).max(axis=0))
    scale = np.minimum(scale, np.array(drives.acceleration) / np.abs(acc).max(axis=0))
    room = np.maximum(stroke - scale * np.ptp(q, axis=0) / 2, 0.0)
    middle = centre + room * rng.uniform(-1, 1, n) - scale * (q.max(axis=0) + q.min(axis=0)) / 2

    def motion(t: Array) -> tuple[Array, Array, Array]:
        q, v, acc = series(np.asarray(t, float))
        return middle + scale * q, scale * v, scale * acc

    return motion


def _points(drives: Drives, duration: float, rng: np.random.Generator) -> Motion:
    """Quintic moves between random points."""
    centre, stroke = np.array(drives.centre, float), np.array(drives.stroke)
    speed, acceleration = np.array(drives.speed), np.array(drives.acceleration)
    here = centre + stroke * rng.uniform(-0.7, 0.7, len(centre))
    start, moves = here, []
    clock = -SETTLE - 0.01
    while clock < duration + 1:
        goal = centre + stroke * rng.uniform(-0.85, 0.85, len(centre))
        way = np.abs(goal - here)
        # a quintic's peaks are 1.875 times the mean speed and 5.77 distance/time^2
        took = max(0.3, (2.4 * way / speed).max(), np.sqrt(5.8 * way / acceleration).max())
        moves.append((clock, took, here, goal))
        clock += took + rng.uniform(0.15, 0.5)
        here = goal

    def motion(t: Array) -> tuple[Array, Array, Array]:
        t = np.asarray(t, float)
        q = np.tile(start, (len(t), 1))
        v, acc = np.zeros_like(q), np.zeros_like(q)
        for begin, took, a, b in moves:
            now = t >= begin
            u = np.clip((t[now] - begin) / took, 0, 1)[:, None]
            q[now] = a + (b - a) * (10 * u**3 - 15 * u**4 + 6 * u**5)
            v[now] = (b - a) * (30 * u**2 - 60 * u**3 + 30 * u**4) / took
            acc[now] = (b - a) * (60 * u - 180 * u**2 + 120 * u**3) / took**2
        return q, v, acc

    return motion
