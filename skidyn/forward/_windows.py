# SPDX-License-Identifier: BSD-3-Clause
"""Pieces of a log that are simulated side by side, each from its own measured state."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from skidyn._exceptions import SkidynError
from skidyn._signals import Array, Signals

#: Share of a horizon that the last piece of a recording needs to count.
LEAST_SHARE = 0.5


@dataclass(frozen=True)
class Windows:
    """Rows of a log in pieces of equal length; shorter ones repeat their last sample.

    Attributes
    ----------
    rows : ndarray of shape (n_windows, n_samples) of int
        Rows of the log.
    valid : ndarray of shape (n_windows, n_samples) of bool
        Whether a row belongs to the piece, and is not a repetition.
    time : ndarray of shape (n_windows, n_samples), s
        Their time; it continues after the end of a piece.
    """

    rows: NDArray[np.int64]
    valid: NDArray[np.bool_]
    time: Array

    @property
    def steps(self) -> Array:
        """Time steps, shape (n_windows, n_samples - 1)."""
        return np.diff(self.time, axis=1)


def make_windows(signals: Signals, horizon: float | None) -> Windows:
    """Cut a log into pieces of ``horizon`` s that overlap by one sample.

    None means the whole of every continuous stretch. A remainder shorter than half of a piece is
    left out if its stretch has a whole piece. A SkidynError is raised if no time is logged, the
    horizon is not positive, or no stretch holds two samples.
    """
    if signals.time is None:
        raise SkidynError("the log has no column 'time' (s); a simulation needs it")
    if horizon is not None and not horizon > 0:
        raise SkidynError(f"horizon={horizon!r}; expected seconds above 0, or None")
    pieces: list[tuple[int, int]] = []
    for rows in signals.segments:
        time = signals.time[rows]
        if len(time) < 2:
            continue
        if horizon is None:
            pieces.append((rows.start, rows.stop))
            continue
        start, last = 0, len(time) - 1
        first = True
        while start < last:
            end = int(np.searchsorted(time, time[start] + horizon * (1 - 1e-9)))
            whole = end <= last
            end = min(end, last)
            if first or whole or time[end] - time[start] >= LEAST_SHARE * horizon:
                pieces.append((rows.start + start, rows.start + end + 1))
            start, first = end, False
    if not pieces:
        raise SkidynError("no part of the log has two samples of one trajectory")
    longest = max(b - a for a, b in pieces)
    index = np.empty((len(pieces), longest), dtype=np.int64)
    valid = np.zeros((len(pieces), longest), dtype=bool)
    times = np.empty((len(pieces), longest))
    for k, (a, b) in enumerate(pieces):
        own = np.arange(a, b)
        index[k] = np.r_[own, np.full(longest - len(own), b - 1)]
        valid[k, : len(own)] = True
        step = float(np.median(np.diff(signals.time[own])))
        more = signals.time[b - 1] + step * np.arange(1, longest - len(own) + 1)
        times[k] = np.r_[signals.time[own], more]
    if np.any(np.diff(times, axis=1) <= 0):
        k, i = np.argwhere(np.diff(times, axis=1) <= 0)[0]
        raise SkidynError(
            f"time does not increase in row {index[k, i + 1]} of the log; remove repeated rows"
        )
    return Windows(index, valid, times)
