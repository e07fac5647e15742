# SPDX-License-Identifier: BSD-3-Clause
"""Steps of a coarse sensor."""

from __future__ import annotations

import numpy as np


def position_step(position: np.ndarray) -> float:
    """Step of a position sensor, or NaN where positions are not visibly quantised.

    Gaps between neighbouring distinct values are whole multiples of the step of the sensor.
    """
    return step_of_values(np.unique(position))


def step_of_values(position: np.ndarray) -> float:
    """The same from distinct values in ascending order."""
    gaps = np.diff(position)
    gaps = gaps[gaps > 1e-12]
    if len(gaps) < 20:
        return np.nan
    count = max(len(gaps) // 50, 5)
    smallest = np.sort(np.partition(gaps, count - 1)[:count])
    step = float(np.median(smallest))
    if step < 0.8 * smallest[-1] or smallest[0] < 0.8 * step:
        return np.nan
    largest = float(np.abs(position).max())
    if step < 8 * np.finfo(np.float32).eps * largest and np.all(position == np.float32(position)):
        return np.nan  # the step of the numbers in the file, not of the sensor
    multiples = gaps[gaps < 20 * step] / step
    whole = np.abs(multiples - np.round(multiples)) < 0.1
    return step if whole.mean() > 0.9 else np.nan
