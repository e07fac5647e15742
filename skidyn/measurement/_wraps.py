# SPDX-License-Identifier: BSD-3-Clause
"""Positions that jump back by the range of their counter, and the size of their jumps."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array

#: A full turn, rad, and how near to it a measured jump is that is one.
TURN, NEARLY = 2 * np.pi, 2e-3
#: Fewest jumps of which the size is measured, and how nearly equal they must be, as a share of it.
FEWEST, EQUAL = 3, 1e-3
#: Least size of a jump, as a share of the range of the position, most range over a jump, and
#: largest step beside a jump over it.
HALF, RANGE, BESIDE = 0.5, 1.1, 0.1


def wrap_period(position: Array, trajectory: NDArray[np.int64]) -> float | None:
    """Range after which a position begins anew, by the size of its jumps.

    A counter that overflows jumps against the motion, always by its range, and the position moves
    on as before; a value that was not read jumps away and back.

    Parameters
    ----------
    position : ndarray of shape (n_samples,), rad or m
        Of one joint.
    trajectory : ndarray of shape (n_samples,)
        Trajectory of every row.

    Returns
    -------
    float or None
        A full turn where jumps are as large as one, to what can be measured; None if there are too
        few jumps, or they differ.

    Examples
    --------
    >>> import numpy as np
    >>> from skidyn.measurement import wrap_period
    >>> position = 8 * np.sin(np.arange(0, 20, 0.01))
    >>> counted = (position + 3.2768) % 6.5536 - 3.2768
    >>> round(wrap_period(counted, np.zeros(2000, int)), 3)
    6.554
    """
    span = float(np.ptp(position)) if len(position) else 0.0
    if span == 0:
        return None
    step = np.diff(position)
    step[trajectory[1:] != trajectory[:-1]] = 0.0
    rows = np.flatnonzero(np.abs(step) > HALF * span)
    rows = rows[(rows > 0) & (rows < len(step) - 1)]
    if len(rows) < FEWEST:
        return None
    usual = (step[rows - 1] + step[rows + 1]) / 2
    size = np.abs(step[rows] - usual)
    period = float(np.median(size))
    beside = np.maximum(np.abs(step[rows - 1]), np.abs(step[rows + 1]))
    alone = beside < BESIDE * period
    # where the joint turns, the motion is too slow to tell its direction
    against = (step[rows] * usual <= 0) | (np.abs(usual) < EQUAL * period)
    if span > RANGE * period or not alone.all() or not against.all():
        return None
    if np.abs(size - period).max() > EQUAL * period:
        return None
    return TURN if abs(period / TURN - 1) < NEARLY else period
