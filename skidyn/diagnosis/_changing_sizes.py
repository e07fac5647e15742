# SPDX-License-Identifier: BSD-3-Clause
"""A function of a signal whose size, or sign, differs from one recording to the next."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array
from skidyn.diagnosis._profile import QUARTERS
from skidyn.diagnosis._signal_products import Product, predictable, simple_functions, values_of

#: Most recordings: each has a coefficient of its own.
MOST_RECORDINGS = 24
#: Least number of rows in each quarter of a recording.
FEWEST_ROWS = 4
#: A function that varies within a part by a smaller share of its squares counts as constant.
CONSTANT = 1e-9


def changing_size(
    signals: dict[str, Array], y: Array, recording: NDArray[np.int64], quarter: NDArray[np.int64]
) -> Product | None:
    """The function of a signal that, with a size of its own in each recording, predicts most.

    The size is found from three quarters of a recording and judged on the fourth, beside a constant
    of each recording. It must predict more than the same function with a size common to all.

    Parameters
    ----------
    signals : dict of str to ndarray of shape (n_rows,)
        By name.
    y : ndarray of shape (n_rows,)
        Residual, N m or N.
    recording : ndarray of shape (n_rows,)
        Trajectory of every row.
    quarter : ndarray of shape (n_rows,)
        Its part of the recording, 0 to 3.

    Returns
    -------
    tuple or None
        The function, and the number of those among which it was chosen.
    """
    names, number = np.unique(recording, return_inverse=True)
    cell = number * QUARTERS + quarter
    counts = np.bincount(cell, minlength=len(names) * QUARTERS)
    if not 1 < len(names) <= MOST_RECORDINGS or counts.min() < FEWEST_ROWS:
        return None
    functions = [f for name, x in signals.items() for f in simple_functions(name, x)]
    values = values_of(functions, signals)
    order = np.argsort(cell, kind="stable")
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]])

    def sums(x: Array) -> Array:
        """Sums of columns, (recordings, quarters, k)."""
        total = np.add.reduceat(x[order], starts, axis=0)
        return np.asarray(total.reshape(len(names), QUARTERS, -1))

    n = sums(np.ones((len(y), 1)))
    own, square, along = sums(values), sums(values**2), sums(values * y[:, None])
    level, energy = sums(y[:, None]), sums(y[:, None] ** 2)

    def others(x: Array) -> Array:
        """Sums over the other quarters of the same recording."""
        return np.asarray(x.sum(axis=1, keepdims=True) - x)

    rest = others(n)
    mean, average = others(own) / rest, others(level) / rest
    squares = others(square)
    spread = np.maximum(squares - rest * mean**2, 0.0)
    slope = others(along) - rest * mean * average
    apart = _sizes(slope, spread, squares)
    common = _sizes(*(x.sum(axis=0, keepdims=True) for x in (slope, spread, squares)))

    def left(size: Array) -> Array:
        """Squared error of each held-out quarter, (recordings * quarters, k)."""
        base = average - size * mean
        error = energy - 2 * size * along + size**2 * square
        error = error - 2 * base * level + 2 * base * size * own + n * base**2
        return np.asarray(error.reshape(len(counts), -1))

    before, after = left(common), left(apart)
    best = int(np.argmin(after.sum(axis=0)))
    if not predictable(before[:, best], after[:, best]):
        return None
    return (functions[best],), len(functions)


def _sizes(slope: Array, spread: Array, square: Array) -> Array:
    """Coefficients of functions, 0 for those whose spread is only the rounding of their squares."""
    varies = spread > CONSTANT * np.maximum(square, 1e-300)
    return np.where(varies, slope / np.where(varies, spread, 1.0), 0.0)
