# SPDX-License-Identifier: BSD-3-Clause
"""Local polynomials on an even grid (Savitzky, Golay 1964) with the first two derivatives.

``scipy.signal.savgol_filter`` computes the polynomial and both edges again at every call and for
every derivative. Here they are weights, computed once for a width and an order.
"""

from __future__ import annotations

from functools import lru_cache
from math import perm

import numpy as np

from skidyn._signals import Array

#: Value, first and second derivative.
ORDERS = (0, 1, 2)


def local_polynomial(values: Array, width: int, order: int, step: float) -> tuple[Array, ...]:
    """Smoothed values and their first two derivatives (per s, per s^2) along the first axis.

    Values are ``step`` s apart. ``width`` is the odd number of samples of a window, which the
    values have at least; ``order`` is below it. At the edges the polynomial of the outermost window
    is used up to the end, as ``savgol_filter(mode="interp")`` does.
    """
    inside, start, end = _weights(width, order)
    table = values.reshape(len(values), -1)
    half = width // 2
    results = []
    for k in ORDERS:
        out = np.empty_like(table, dtype=np.float64)
        for column in range(table.shape[1]):
            out[half : len(out) - half, column] = np.correlate(table[:, column], inside[k], "valid")
        out[:half] = start[k] @ table[:width]
        out[len(out) - half :] = end[k] @ table[len(table) - width :]
        results.append((out / step**k if k else out).reshape(values.shape))
    return tuple(results)


def middle_weights(width: int, order: int) -> Array:
    """Weights of a window for the value and two derivatives in its middle, (3, width)."""
    return _weights(width, order)[0]


@lru_cache(maxsize=64)
def _weights(width: int, order: int) -> tuple[Array, Array, Array]:
    """Weights of the middle of a window, and of the places before and after it, for unit steps.

    Shapes are (3, width), and (3, width // 2, width) at either end.
    """
    half = width // 2
    place = np.arange(-half, half + 1) / half
    powers = np.arange(order + 1)
    fit = np.linalg.pinv(place[:, None] ** powers)
    whole = np.zeros((len(ORDERS), width, width))
    for k in ORDERS:
        slope = np.zeros((width, order + 1))
        for power in range(k, order + 1):
            slope[:, power] = perm(power, k) * place ** (power - k) / half**k
        whole[k] = slope @ fit
    return whole[:, half], whole[:, :half], whole[:, half + 1 :]
