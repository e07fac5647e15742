# SPDX-License-Identifier: BSD-3-Clause
"""Recordings that were merged by a clock which restarts for each of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array

#: Steps of the clock, as a share of its range, up to which two rows have one time.
SAME_TIME = 1e-9
#: Fewest rows with one time, and most rows that are searched for the one that continues a row.
FEWEST, MOST = 1.5, 60
#: Usual step from row to row, as a share of the spread of the positions, and over that to the
#: nearest of the rows at the next times, of recordings that were merged.
LEAPS, FARTHER = 0.05, 5.0


@dataclass(frozen=True)
class Interleaved:
    """How rows of several recordings follow each other.

    Attributes
    ----------
    rows : float
        Mean number of rows with one time.
    leap : float
        Usual step of the positions from row to row, as a share of their spread.
    """

    rows: float
    leap: float


def find_interleaved(time: Array, q: Array, trajectory: NDArray[np.int64]) -> Interleaved | None:
    """Whether rows with one time belong to different recordings.

    Samples with coarse stamps share a time as well, but a row is as near to the next one as to any
    other. Rows of different recordings are far apart, and each continues some row at the next time.

    Parameters
    ----------
    time : ndarray of shape (n_samples,), s
        Recorded clock.
    q : ndarray of shape (n_samples, n_joints), rad or m
        Recorded positions.
    trajectory : ndarray of shape (n_samples,)
        Trajectory of every row.

    Returns
    -------
    Interleaved or None
        None for samples of one recording after the other.

    Examples
    --------
    >>> import numpy as np
    >>> from skidyn.measurement import find_interleaved
    >>> t = np.arange(0, 5, 0.01)
    >>> q = np.sin(np.concatenate([t, t + 2, t + 4]))[:, None]
    >>> order = np.argsort(np.tile(t, 3), kind="stable")
    >>> find_interleaved(np.repeat(t, 3), q[order], np.zeros(1500, int)).rows
    3.0
    """
    spread = q.std(axis=0)
    if len(time) < 2 or not (spread > 0).any():
        return None
    within = trajectory[1:] == trajectory[:-1]
    new = np.abs(np.diff(time)) > SAME_TIME * float(np.ptp(time))
    rows = len(time) / (1 + int(np.sum(new | ~within)))
    if rows < FEWEST:
        return None
    places = q[:, spread > 0] / spread[spread > 0]
    leap = np.linalg.norm(np.diff(places, axis=0), axis=1) / np.sqrt(places.shape[1])
    reach = int(min(2 * np.ceil(rows), MOST))
    nearest = np.full(len(places) - reach, np.inf)
    for ahead in range(1, reach + 1):
        apart = places[ahead : ahead + len(nearest)] - places[: len(nearest)]
        nearest = np.minimum(nearest, np.linalg.norm(apart, axis=1) / np.sqrt(places.shape[1]))
    usual = float(np.median(leap))
    if usual > LEAPS and len(nearest) and usual > FARTHER * float(np.median(nearest)):
        return Interleaved(rows, usual)
    return None
