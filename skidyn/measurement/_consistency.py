# SPDX-License-Identifier: BSD-3-Clause
"""Consistency of a velocity with the change of its position."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

#: Windows over which velocity is compared with differentiated position, s.
WINDOW = 0.05
#: Correlation from which velocity is proportional to the rate of the position, the share of the
#: windows that may be left out for it, and in how many rounds these are found.
PROPORTIONAL, FEW, TRIMS = 0.98, 0.02, 3


def velocity_consistency(
    time: np.ndarray, position: np.ndarray, velocity: np.ndarray, segments: Sequence[slice]
) -> tuple[float, float]:
    """Slope and correlation of integrated velocity against change of position.

    Both are taken over windows of 50 ms (in samples of the median step), which averages noise and
    quantisation out. NaN where the joint does not move. A few windows are left out if all others
    are proportional: a lost sample that is near the others is no outlier of the position.
    """
    x, y, _ = way_and_area(time, position, velocity, segments)
    if x @ x < 1e-20 or y @ y < 1e-20:
        return np.nan, np.nan
    slope, likeness = _proportion(x, y)
    trimmed = slope, likeness
    for _ in range(TRIMS if likeness < PROPORTIONAL else 0):
        left = np.abs(y - trimmed[0] * x)
        kept = left <= np.quantile(left, 1 - FEW)
        trimmed = _proportion(x[kept], y[kept])
    return trimmed if trimmed[1] > PROPORTIONAL else (slope, likeness)


def _proportion(x: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """Slope of y on x through zero, and their correlation."""
    xx, yy = float(x @ x) + 1e-300, float(y @ y) + 1e-300
    return float(x @ y) / xx, float(x @ y) / np.sqrt(xx * yy)


def way_and_area(
    time: np.ndarray, position: np.ndarray, velocity: np.ndarray, segments: Sequence[slice]
) -> tuple[np.ndarray, np.ndarray, float]:
    """Change of position and integral of velocity over windows, and the median window in s.

    Empty where there are no windows.
    """
    nothing = np.zeros(0)
    steps = np.concatenate([np.diff(time[rows]) for rows in segments])
    if len(steps) == 0:
        return nothing, nothing, 0.0
    window = int(np.clip(np.round(WINDOW / np.median(steps)), 1, 50))
    change, integral = [], []
    for rows in segments:
        t, q, dq = time[rows], position[rows], velocity[rows]
        if len(t) <= window:
            continue
        area = np.r_[0.0, np.cumsum((dq[1:] + dq[:-1]) / 2 * np.diff(t))]
        change.append(q[window:] - q[:-window])
        integral.append(area[window:] - area[:-window])
    if not change:
        return nothing, nothing, 0.0
    return np.concatenate(change), np.concatenate(integral), window * float(np.median(steps))
