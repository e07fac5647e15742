# SPDX-License-Identifier: BSD-3-Clause
"""Position, velocity and acceleration from logged positions, smoothed equally, without delay."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidyn._local_polynomial import local_polynomial
from skidyn._repeated import stale_rows
from skidyn._signals import Array, Signals
from skidyn.evidence._cutoff import (
    HIGHEST_CUTOFF,
    ORDER,
    half_width,
    lowered_cutoff,
    usual_cutoff,
)

#: Relative spread of time steps above which positions are interpolated to an even grid first.
EVEN_STEPS = 1e-3


def smooth_motion(signals: Signals, cutoff: float | None = None) -> Signals:
    """Replace q, dq and ddq by a zero-phase local polynomial fit to the positions.

    Parameters
    ----------
    signals : Signals
        Logged motion; dq and ddq are not used. Smoothed motion is smoothed again as it was.
    cutoff : float, Hz, optional
        Cut-off; by default 24 % of the sampling rate, at most 27 Hz, and less in trajectories with
        coarse positions (``_cutoff.py``).

    Returns
    -------
    Signals
        Samples near the ends of a segment are not valid, nor are rows that repeat the previous one;
        their positions are interpolated between the others.
    """
    rate, stale = signals.rate, stale_rows(signals)
    parts = [_Part(signals, rows, ~stale[rows], rate) for rows in signals.segments]
    q, dq, ddq = (np.array(x, dtype=float) for x in (signals.q, signals.dq, signals.ddq))
    valid = np.repeat(~stale[:, None], signals.n_joints, axis=1)
    if cutoff is not None:
        cutoffs = np.full(signals.n_samples, cutoff)
    elif signals.cutoff is not None:
        cutoffs = signals.cutoff
    else:
        cutoffs = _chosen(signals, parts, rate)
    for part in parts:
        rows, width = part.rows, half_width(part.rate, cutoffs[part.rows.start])
        if part.enough <= 2 * width + 1:
            valid[rows] = False  # too short to smooth; kept as logged, and not used
            continue
        q[rows], dq[rows], ddq[rows] = part.smoothed(width)
        edge = max(2, width // 2)
        valid[rows.start : rows.start + edge] = False
        valid[rows.stop - edge : rows.stop] = False
    half = half_width(rate, cutoffs.min(initial=HIGHEST_CUTOFF))
    return signals.with_(q=q, dq=dq, ddq=ddq, valid=valid, half_width=half, cutoff=cutoffs)


def _chosen(signals: Signals, parts: Sequence[_Part], rate: float) -> Array:
    """Cut-off of every sample, Hz, chosen for each trajectory."""
    cutoffs = np.full(signals.n_samples, usual_cutoff(rate))
    of: dict[Any, list[_Part]] = {}
    for part in parts:
        of.setdefault(signals.trajectory[part.rows.start], []).append(part)
    for own in of.values():
        even = [part.even for part in own if part.rate == rate]
        lowered = lowered_cutoff(even, rate, signals.unit)
        for part in own:
            cutoffs[part.rows] = lowered
    return cutoffs


class _Part:
    """Positions of a segment at even steps.

    Attributes
    ----------
    rows : slice
        The segment.
    rate : float, Hz
        Rate of the log, or that of the segment if it differs.
    enough : int
        Number of samples that the smoother can use.
    even : ndarray of shape (n, n_joints), rad or m
        Positions, interpolated where samples were uneven or repeat the previous one.
    """

    def __init__(
        self, signals: Signals, rows: slice, fresh: NDArray[np.bool_], rate: float
    ) -> None:
        self.rows = rows
        self._time, q = signals.clock[rows], signals.q[rows]
        own = signals.take(rows).rate if len(signals.segments) > 1 else rate
        self.rate = own if abs(own - rate) > EVEN_STEPS * rate else rate
        # Irregular samples are too many for their median step, or too few for the time they span.
        steps = round(float(np.ptp(self._time)) * self.rate)
        self.enough = min(int(fresh.sum()), steps + 1)
        changes = np.diff(self._time)
        even = len(changes) == 0 or (np.ptp(changes) < EVEN_STEPS / self.rate and fresh.all())
        # Times that are equal or decrease cannot be interpolated; data checks report them.
        self._grid: Array | None = None
        self.even = q
        if not even and not np.any(changes <= 0) and fresh.sum() > 1:
            from scipy.interpolate import CubicSpline

            self._grid = np.arange(self._time[0], self._time[-1] + 0.5 / self.rate, 1 / self.rate)
            self.even = CubicSpline(self._time[fresh], q[fresh])(self._grid)

    def smoothed(self, half: int) -> list[Array]:
        """Smoothed position and its two derivatives at the times of the samples."""
        smoothed = local_polynomial(self.even, 2 * half + 1, ORDER, 1 / self.rate)
        if self._grid is None:
            return list(smoothed)
        from scipy.interpolate import CubicSpline

        inside = np.clip(self._time, self._grid[0], self._grid[-1])
        return [CubicSpline(self._grid, x)(inside) for x in smoothed]
