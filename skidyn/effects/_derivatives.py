# SPDX-License-Identifier: BSD-3-Clause
"""Time derivatives of torques that were computed from measured motion."""

from __future__ import annotations

import numpy as np

from skidyn._local_polynomial import local_polynomial
from skidyn._signals import Array, Signals

#: Width over which a signal is smoothed before it is differentiated, in s.
_SMOOTHING = 0.08


def smooth_derivatives(
    values: Array, signals: Signals, order: int = 4
) -> tuple[Array, Array, Array]:
    """A signal smoothed by local polynomials, with its first two time derivatives.

    Parameters
    ----------
    values : ndarray of shape (n_samples,) or (n_samples, n_columns)
        The signal; zeros are returned for a segment that is too short to smooth.
    signals : Signals
        Motion, for its segments and time.
    order : int, default=4
        Order of the polynomial. A low order smooths more.

    Returns
    -------
    smoothed, first, second : ndarray of the same shape
        Derivatives per s and per s^2.
    """
    result = tuple(np.zeros_like(values) for _ in range(3))
    for rows, step in zip(signals.segments, signals.steps, strict=True):
        y = values[rows]
        if len(y) < 7:
            continue
        half = max(3, int(_SMOOTHING / 2 / step))
        width = min(2 * half + 1, (len(y) - 1) // 2 * 2 + 1)
        parts = local_polynomial(y, width, min(order, width - 1), step)
        for out, part in zip(result, parts, strict=True):
            out[rows] = part
    return result  # type: ignore[return-value]
