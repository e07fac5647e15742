# SPDX-License-Identifier: BSD-3-Clause
"""Position, velocity and acceleration from logged positions, smoothed equally, without delay."""

from __future__ import annotations

import numpy as np

from skidyn._local_polynomial import local_polynomial
from skidyn._signals import Array, Signals

#: Order of the local polynomial. Of accelerations of 6 Hz sampled at 100 Hz, a quartic of the same
#: noise loses 0.7 %, which looks like an elastic joint if the torque is precise; this order loses
#: 0.1 %.
ORDER = 6
#: Highest cut-off in Hz, and the largest share of the sampling rate.
HIGHEST_CUTOFF, CUTOFF_SHARE = 27.0, 0.24
#: Relative spread of time steps above which positions are interpolated to an even grid first.
EVEN_STEPS = 1e-3


def smooth_motion(signals: Signals, cutoff: float | None = None) -> Signals:
    """Replace q, dq and ddq by a zero-phase local polynomial fit to the positions.

    Parameters
    ----------
    signals : Signals
        Logged motion; dq and ddq are not used.
    cutoff : float, Hz, optional
        Cut-off; by default 24 % of the sampling rate, at most 27 Hz.

    Returns
    -------
    Signals
        Samples near the ends of a segment are not valid.
    """
    rate = signals.rate
    half, used = _half_width(rate, cutoff)
    q, dq, ddq = (np.array(x, dtype=float) for x in (signals.q, signals.dq, signals.ddq))
    valid = np.ones(signals.q.shape, dtype=bool)
    for rows in signals.segments:
        own = signals.take(rows).rate if len(signals.segments) > 1 else rate
        own = own if abs(own - rate) > EVEN_STEPS * rate else rate  # recordings of several rates
        width, _ = _half_width(own, cutoff)
        # Irregular samples are too many for their median step, or too few for the time they span.
        steps = round(float(np.ptp(signals.clock[rows])) * own)
        if min(rows.stop - rows.start, steps + 1) <= 2 * width + 1:
            valid[rows] = False  # too short to smooth; kept as logged, and not used
            continue
        q[rows], dq[rows], ddq[rows] = _local_polynomial(
            signals.clock[rows], signals.q[rows], own, width
        )
        edge = max(2, width // 2)
        valid[rows.start : rows.start + edge] = False
        valid[rows.stop - edge : rows.stop] = False
    return signals.with_(q=q, dq=dq, ddq=ddq, valid=valid, half_width=half, cutoff=used)


def _half_width(rate: float, cutoff: float | None) -> tuple[int, float]:
    """Half width of the smoother in samples, and its cut-off in Hz."""
    cutoff = min(HIGHEST_CUTOFF, CUTOFF_SHARE * rate) if cutoff is None else cutoff
    # Cut-off of a Savitzky-Golay filter of this order and half width (Schafer 2011, IEEE SPM 28).
    half = ((ORDER + 1) / (2 * cutoff / rate) + 4.6) / 3.2
    return int(np.clip(round(half), 4, 60)), cutoff


def _local_polynomial(time: Array, q: Array, rate: float, half: int) -> list[Array]:
    """Smoothed position and its two derivatives at the given times."""
    step = 1.0 / rate
    # Times that are equal or decrease cannot be interpolated; data checks report them.
    even = np.ptp(np.diff(time)) < EVEN_STEPS * step or np.any(np.diff(time) <= 0)
    grid = time if even else np.arange(time[0], time[-1] + step / 2, step)
    if even:
        return list(local_polynomial(q, 2 * half + 1, ORDER, step))
    from scipy.interpolate import CubicSpline

    smoothed = local_polynomial(CubicSpline(time, q)(grid), 2 * half + 1, ORDER, step)
    inside = np.clip(time, grid[0], grid[-1])
    return [CubicSpline(grid, x)(inside) for x in smoothed]
