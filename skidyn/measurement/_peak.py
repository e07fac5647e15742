# SPDX-License-Identifier: BSD-3-Clause
"""Maximum of a likelihood of one number, by parabolas."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np

#: Most parabolas, and the last step, as a share of the distance of their points.
STEPS, CLOSE = 6, 1 / 20


def peak(likelihood: Callable[[float], float], start: float, near: float) -> float:
    """Number at which a likelihood has its maximum, close to a first guess.

    Parameters
    ----------
    likelihood : callable
    start : float
        First guess.
    near : float
        Distance of the points of a parabola; the likelihood should have one within a few of them.

    Returns
    -------
    float
    """
    at, value = cache(likelihood), start
    for _ in range(STEPS):
        left, middle, right = (at(value + step) for step in (-near, 0.0, near))
        bend = 2 * middle - left - right
        step = near * (0.5 * (right - left) / bend if bend > 0 else np.sign(right - left))
        step = float(np.clip(step, -2 * near, 2 * near))
        if abs(step) < CLOSE * near:
            return value + step
        if at(value + step) < middle:  # beyond the maximum, which may be a cusp
            near /= 2
        else:
            value += step
    return value
