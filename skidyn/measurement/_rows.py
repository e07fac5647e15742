# SPDX-License-Identifier: BSD-3-Clause
"""Averaged rows of a measurement."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array, Signals
from skidyn.evidence import REST, smooth_motion
from skidyn.measurement._fits import SAMPLES, Fits, Recorded
from skidyn.measurement._robust import FEWEST
from skidyn.robots import Robot

#: Width of a row in s; most rows used, over all intervals of the log.
WIDTH, MOST_ROWS = 0.125, 1200


def smoothed(signals: Signals) -> Signals:
    """Smoothed motion of a recording, computed once for all checks."""
    motion: Signals = signals.once("smooth motion", lambda: smooth_motion(signals))
    return motion


def make_fits(signals: Signals, torque: Array, robot: Robot) -> Fits | None:
    """Rows of a measurement; None if no interval of it is long enough.

    Parameters
    ----------
    signals : Signals
        Recorded motion.
    torque : ndarray of shape (n_samples, n_joints), N m or N
        Recorded torque.
    robot : Robot
        As described.
    """
    motion = smoothed(signals)
    every = max(1, round(motion.rate * WIDTH / SAMPLES))
    mean = running_mean(torque, every | 1)  # an even number would be half a sample late
    parts = []
    for rows in signals.segments:
        edge = max(2, motion.half_width // 2) + every
        picked = np.arange(rows.start + edge, rows.stop - edge, every)
        parts.append(picked[: len(picked) // SAMPLES * SAMPLES].reshape(-1, SAMPLES))
    blocks = np.concatenate(parts) if parts else np.zeros((0, SAMPLES), dtype=int)
    if len(blocks) < FEWEST:
        return None
    if len(blocks) > MOST_ROWS:  # intervals of rows from all parts of the log
        blocks = blocks[_stretches(len(blocks))]
    rows_used = blocks.ravel()
    taken = motion.take(rows_used).with_(robot=None)
    slow = REST * taken.unit
    moving = np.abs(taken.dq).reshape(-1, SAMPLES, robot.n_joints).mean(axis=1) > slow
    recorded = Recorded(signals.clock, mean, signals.segments, rows_used)
    return Fits(robot, taken, mean[rows_used], moving, recorded)


def _stretches(n: int) -> NDArray[np.int64]:
    """Rows of 24 stretches evenly over a log."""
    length = MOST_ROWS // 24
    starts = np.linspace(0, n - length, 24).astype(int)
    return np.unique(starts[:, None] + np.arange(length))


def running_mean(values: Array, width: int) -> Array:
    """Mean around every sample; ends are not used."""
    if width < 2:
        return values
    total = np.cumsum(np.vstack([np.zeros(values.shape[1]), values]), axis=0)
    n = len(values)
    low = np.clip(np.arange(n) - width // 2, 0, n)
    high = np.clip(low + width, 0, n)
    return np.asarray((total[high] - total[low]) / np.maximum(high - low, 1)[:, None])
