# SPDX-License-Identifier: BSD-3-Clause
"""Maximum of a likelihood of one number, by parabolas or by halved steps."""

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
        apart = vertex(left, middle, right)
        step = near * (np.sign(right - left) if apart is None else apart)
        step = float(np.clip(step, -2 * near, 2 * near))
        if abs(step) < CLOSE * near:
            return value + step
        if at(value + step) < middle:  # beyond the maximum, which may be a cusp
            near /= 2
        else:
            value += step
    return value


def vertex(left: float, middle: float, right: float) -> float | None:
    """Place of the maximum of a parabola through three values, at -1, 0 and 1.

    Returns
    -------
    float or None
        None if they do not bend downwards.
    """
    bend = 2 * middle - left - right
    return float(0.5 * (right - left) / bend) if bend > 0 else None


def climb(
    likelihood: Callable[[float], float],
    start: float,
    step: float,
    least: float,
    reach: float = np.inf,
) -> tuple[float, float]:
    """Number at which a likelihood has a maximum, and the maximum, where a parabola is too narrow.

    Parameters
    ----------
    likelihood : callable
    start : float
        First guess.
    step : float
        First step, which is halved where neither neighbour is likelier.
    least : float
        Steps end before this one.
    reach : float, default=inf
        Distance from the first guess beyond which the search ends.

    Returns
    -------
    number, likelihood : float
    """
    at, value = cache(likelihood), start
    best = at(value)
    while step > least and abs(value - start) <= reach:
        near, other = max((at(x), x) for x in (value - step, value + step))
        if near > best:
            best, value = near, other
        else:
            step /= 2
    return value, best
