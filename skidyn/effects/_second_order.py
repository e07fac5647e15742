# SPDX-License-Identifier: BSD-3-Clause
"""Digital filters of oscillating systems: springs with masses, liquids in tanks."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from skidyn._signals import Array


def second_order_filter(
    top: Sequence[float], omega: float, damping: float, rate: float
) -> tuple[Array, Array]:
    r"""Filter of :math:`(b_2 s^2 + b_1 s + b_0) / (s^2 + 2\zeta\omega s + \omega^2)` for samples.

    By Tustin's substitution of :math:`s`, as :func:`scipy.signal.bilinear` does for any order, in a
    hundredth of its time; it is needed for every shape and every segment of a log.

    Parameters
    ----------
    top : sequence of 3 floats
        ``b_2``, ``b_1`` and ``b_0``.
    omega : float, rad/s
        Angular frequency of the undamped oscillation.
    damping : float
        Damping ratio.
    rate : float, Hz
        Sampling rate.

    Returns
    -------
    b, a : ndarray of shape (3,)
        Arguments of :func:`scipy.signal.lfilter`.
    """
    k = 2 * rate

    def substituted(second: float, first: float, constant: float) -> Array:
        square, linear = second * k * k, first * k
        return np.array(
            [square + linear + constant, 2 * (constant - square), square - linear + constant]
        )

    a = substituted(1.0, 2 * damping * omega, omega**2)
    return substituted(*top) / a[0], a / a[0]
