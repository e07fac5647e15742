# SPDX-License-Identifier: BSD-3-Clause
"""Gaps of a clock that the motion does not have: stamps of arrival, and clocks that were set."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array, find_segments
from skidyn.measurement._check import Check
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._suspicion import Suspicion, remedy_of

#: Steps of motion beside a gap, in units of their usual scatter, from which a joint clearly moves.
CLEAR = 4.0
#: How many times as far as in a usual step joints may move in a gap that the motion does not have,
#: and how many times at least they would move in one that it has.
ONE_STEP, LONG = 2.0, 5.0
#: Gaps of a recording from which its stamps are those of batches; fewer are jumps of the clock.
BATCHES = 5


def rows_after_false_gaps(time: Array, q: Array, trajectory: NDArray[np.int64]) -> NDArray[np.intp]:
    """Rows before which the clock jumps, although joints move no further than in any other step.

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
    ndarray of int
        Sorted; all gaps of a recording in which joints clearly move at its gaps, or none of them.

    Examples
    --------
    >>> import numpy as np
    >>> t = np.arange(200) * 0.01
    >>> q, recording = np.sin(t)[:, None], np.zeros(200, int)
    >>> rows_after_false_gaps(t + 3 * (t > 1.0), q, recording).tolist()
    [101]
    >>> rows_after_false_gaps(t[(t < 1.0) | (t > 1.5)], q[(t < 1.0) | (t > 1.5)], recording[:150])
    array([], dtype=int64)
    """
    found: list[NDArray[np.intp]] = []
    recordings = find_segments(trajectory)
    if len(find_segments(trajectory, time)) == len(recordings) or len(q) < 3:
        return np.zeros(0, dtype=np.intp)  # no gaps, as in most logs
    moved = np.abs(np.diff(q, axis=0))
    scatter = np.median(np.abs(np.diff(q, 2, axis=0)), axis=0)
    for rows in recordings:
        steps = np.diff(time[rows])
        begins = [s.start for s in find_segments(trajectory[rows], time[rows])][1:]
        gaps = np.array(begins, dtype=np.intp) - 1
        gaps = gaps[(gaps > 0) & (gaps + 1 < len(steps))]
        if not len(gaps) or np.any(steps < 0):
            continue
        own = moved[rows.start : rows.stop - 1]
        beside = (own[gaps - 1] + own[gaps + 1]) / 2
        usual = (steps[gaps - 1] + steps[gaps + 1]) / 2
        clear = beside > np.maximum(CLEAR * scatter, 1e-12)
        if not clear.any():
            continue
        across, expected = own[gaps][clear].sum(), beside[clear].sum()
        full = (beside * (steps[gaps] / np.maximum(usual, 1e-300))[:, None])[clear].sum()
        if across < ONE_STEP * expected and full > LONG * ONE_STEP * expected:
            found.append(rows.start + 1 + gaps)
    return np.concatenate(found) if found else np.zeros(0, dtype=np.intp)


def without_false_gaps(time: Array, trajectory: NDArray[np.int64], rows: NDArray[np.intp]) -> Array:
    """The clock with gaps closed that the motion does not have.

    In a recording with many gaps, samples arrived in batches, and their number between the
    beginnings of batches gives the step. A few gaps are jumps of a clock that was set, and the
    usual step replaces them.

    Parameters
    ----------
    time : ndarray of shape (n_samples,), s
        Recorded clock.
    trajectory : ndarray of shape (n_samples,)
        Trajectory of every row.
    rows : ndarray of int
        Rows before which the clock jumps, from :func:`rows_after_false_gaps`.
    """
    mended = np.array(time, dtype=float)
    for own in find_segments(trajectory):
        gaps = rows[(rows > own.start) & (rows < own.stop)]
        if len(gaps) >= BATCHES:
            begins = np.r_[own.start, gaps[:-1]]  # the last batch may be short
            line = np.polyfit(begins - own.start, mended[begins], 1)
            mended[own] = np.polyval(line, np.arange(own.stop - own.start))
        elif len(gaps):
            steps = np.diff(mended[own])
            steps[gaps - own.start - 1] = np.median(steps)
            mended[own] = mended[own][0] + np.r_[0.0, np.cumsum(steps)]
    return mended


class FalseGaps(Check):
    """Gaps in time across which joints move no further than from row to row."""

    name = "false_gaps"
    suspects = (
        "gaps in time that the motion does not have: time stamps of arrival in batches, or a clock "
        "that was set"
    )

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        if not len(measurement.false_gaps):
            return
        number = measurement.recorded.trajectory[measurement.false_gaps]
        runs, counts = np.unique(number, return_counts=True)
        batches = bool(np.any(counts >= BATCHES))
        told = (
            "time stamps are those of arrival in batches"
            if batches
            else "the clock was set while joints moved"
        )
        shown = ", ".join(map(str, runs[:8].tolist())) + ", ..." * (len(runs) > 8)
        yield self.suspicion(
            told,
            f"at {counts.sum()} gap(s) in time (in trajectories {shown}) joints move about as far "
            "as from any row to the next",
            "certain" if counts.sum() > 1 else "suspected",
            remedy=remedy_of("clock", "regular"),
        )
