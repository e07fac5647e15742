# SPDX-License-Identifier: BSD-3-Clause
"""Rows of the regression: torque and every column averaged over the same short windows.

Each row is a Hann-weighted sum over a window of time, scaled to unit noise gain. The same weights
act on the torque and on every regressor column (parallel filtering: Gautier 1997, ICRA), so the
linear model still holds exactly. Only valid samples are used: sticking and reversals, which do not
define sliding friction, are left out and do not affect their neighbours. With windows half
overlapping the rows are nearly independent, and there are few of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy
from numpy.typing import NDArray

from skidyn._signals import Array, Signals

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

#: Width of a window in s; wider if the log is slow, to hold a few samples.
WINDOW = 1 / 8
FEWEST_SAMPLES = 6
#: A window counts if at least this share of its weight falls on valid samples.
LEAST_WEIGHT = 0.35
#: Columns of a log that is faster than this, in Hz, are computed at one of every few samples: as
#: many per window as for a slow log, and at least one in this time, in s. Motion is smoothed to 27
#: Hz, so more samples would give no more information.
FAST, LONGEST_STEP = 600.0, 0.01
#: Below this velocity (in units of ``Signals.unit`` per s) a joint counts as resting.
REST = 0.01


@dataclass(frozen=True)
class Rows:
    """Averaging windows of every joint.

    Attributes
    ----------
    weights : list of csr_matrix of shape (n_rows_j, n_samples)
        Per joint, the weights of every row.
    trajectory : list of ndarray of shape (n_rows_j,)
        Trajectory of every row.
    time : list of ndarray of shape (n_rows_j,)
        Middle of every window in s.
    quarter : list of ndarray of shape (n_rows_j,)
        0 to 3: interleaved eighths of each segment, for folds within trajectories.
    sliding : ndarray of shape (n_samples, n_joints) of bool
        Samples that are used.
    step : int, default=1
        Columns are computed at one of this many samples, and interpolated between them.
    """

    weights: list[csr_matrix]
    trajectory: list[NDArray[np.int64]]
    time: list[Array]
    quarter: list[NDArray[np.int64]]
    sliding: NDArray[np.bool_]
    step: int = 1

    @property
    def n_joints(self) -> int:
        """Number of joints."""
        return len(self.weights)

    @property
    def counts(self) -> NDArray[np.int64]:
        """Number of rows of every joint."""
        return np.array([w.shape[0] for w in self.weights])

    @cached_property
    def recordings(self) -> NDArray[np.int64]:
        """Numbers of the trajectories of the rows of all joints, ascending."""
        return np.unique(np.concatenate(self.trajectory))

    @cached_property
    def spans(self) -> tuple[NDArray[np.intp], Array, Array]:
        """Positions of the rows of all joints, one joint after another, in their trajectories.

        Returns
        -------
        place : ndarray of shape (n_rows,)
            Index of the row's trajectory among the sorted trajectories.
        length : ndarray of shape (n_trajectories,), s
            Time from the first to the last row of any joint.
        share : ndarray of shape (n_rows,)
            Share of this time that has passed at a row.
        """
        trajectory, time = np.concatenate(self.trajectory), np.concatenate(self.time)
        names, place = np.unique(trajectory, return_inverse=True)
        start = np.full(len(names), np.inf)
        end = np.full(len(names), -np.inf)
        np.minimum.at(start, place, time)
        np.maximum.at(end, place, time)
        length = np.maximum(end - start, 1e-9)
        return place, length, (time - start[place]) / length[place]

    @cached_property
    def hop(self) -> float:
        """Usual time from one row to the next, in s."""
        steps = np.concatenate([np.diff(t) for t in self.time if len(t) > 1] or [np.ones(1)])
        return float(np.median(steps[steps > 0])) if (steps > 0).any() else 1.0

    def in_time(self, joint: int) -> NDArray[np.intp]:
        """Rows of a joint by trajectory and time."""
        if joint not in self._sorted:
            self._sorted[joint] = np.lexsort((self.time[joint], self.trajectory[joint]))
        return self._sorted[joint]

    def earlier(self, joint: int, lag: int) -> NDArray[np.intp]:
        """Places in :meth:`in_time` of which that ``lag`` later is in the same trajectory."""
        if (joint, lag) not in self._earlier:
            name = self.trajectory[joint][self.in_time(joint)]
            self._earlier[joint, lag] = np.flatnonzero(name[:-lag] == name[lag:])
        return self._earlier[joint, lag]

    @cached_property
    def _sorted(self) -> dict[int, NDArray[np.intp]]:
        return {}

    @cached_property
    def _earlier(self) -> dict[tuple[int, int], NDArray[np.intp]]:
        return {}

    def split(self, values: NDArray[Any]) -> list[NDArray[Any]]:
        """Values of the rows of all joints, one joint after another, by joint."""
        return np.split(values, np.cumsum(self.counts)[:-1])

    def average(self, values: Array, joint: int) -> Array:
        """Rows of a joint from values at every sample, shape (n_samples,) or (n_samples, k)."""
        return averaged(self.weights[joint], values)

    def thinned(self, between: csr_matrix) -> list[csr_matrix]:
        """Weights of the samples at which columns are computed, by joint.

        Parameters
        ----------
        between : csr_matrix of shape (n_samples, n)
            Matrix that interpolates values at every sample from those at some, of
            :func:`interpolation`.

        Returns
        -------
        list of csr_matrix of shape (n_rows_j, n)
        """
        return [scipy.sparse.csr_matrix(w @ between).sorted_indices() for w in self.weights]

    def weighted(self, weight: Array) -> Rows:
        """The same rows, each multiplied by the root of the mean weight of its samples.

        Parameters
        ----------
        weight : ndarray of shape (n_samples,)
            Weight of every sample, 0 or more; only ratios count.

        Returns
        -------
        Rows
            Without rows of weight 0.
        """
        shares = [abs(w) for w in self.weights]
        mean = [np.asarray((s @ weight) / (s @ np.ones_like(weight))) for s in shares]
        counted = np.concatenate(mean)[np.concatenate(mean) > 0]
        unit = float(counted.mean()) if len(counted) else 1.0
        keep = [np.flatnonzero(m > 0) for m in mean]
        scaled = [_scaled(w, np.sqrt(m / unit)) for w, m in zip(self.weights, mean, strict=True)]
        return replace(self, weights=scaled).taken(keep)

    def taken(self, index: Sequence[NDArray[np.intp]]) -> Rows:
        """Some of the rows of every joint, in the order of their index."""
        return replace(
            self,
            weights=[w[k] for w, k in zip(self.weights, index, strict=True)],
            trajectory=[x[k] for x, k in zip(self.trajectory, index, strict=True)],
            time=[x[k] for x, k in zip(self.time, index, strict=True)],
            quarter=[x[k] for x, k in zip(self.quarter, index, strict=True)],
        )


@dataclass(frozen=True)
class RowsInTime:
    """Weights of a joint's rows in the order of time, so that those of an interval are adjacent.

    Attributes
    ----------
    order : ndarray of shape (n_rows,) of int, or None
        The rows in the order of their first samples; None if they are in this order already.
    first, last : ndarray of shape (n_rows,) of int
        First and last sample of each row.
    weights : csr_matrix of shape (n_rows, n_samples)
        Sorted alike.
    """

    order: NDArray[np.int64] | None
    first: NDArray[np.int64]
    last: NDArray[np.int64]
    weights: csr_matrix

    @classmethod
    def of(cls, weights: csr_matrix) -> RowsInTime:
        """Sort rows whose samples are sorted."""
        first = weights.indices[weights.indptr[:-1]]
        last = weights.indices[weights.indptr[1:] - 1]
        if np.all(first[1:] >= first[:-1]):
            return cls(None, first, last, weights)
        order = np.argsort(first, kind="stable")
        return cls(order, first[order], last[order], weights[order])

    def within(self, samples: slice) -> tuple[NDArray[np.int64] | slice, csr_matrix]:
        """Rows with samples in an interval, and their weights on these."""
        rows, weights = slice(None), self.weights
        if samples.stop - samples.start < weights.shape[1]:
            start = int(np.searchsorted(self.last, samples.start))
            rows = slice(start, int(np.searchsorted(self.first, samples.stop)))
            weights = weights[rows, samples]
        return rows if self.order is None else self.order[rows], weights


def _scaled(weights: csr_matrix, factor: Array) -> csr_matrix:
    """Weights whose rows are multiplied by a factor each."""
    data = weights.data * np.repeat(factor, np.diff(weights.indptr))
    return scipy.sparse.csr_matrix((data, weights.indices, weights.indptr), shape=weights.shape)


def averaged(weights: csr_matrix, values: Array) -> Array:
    """Rows from values at every sample, shape (n_samples,) or (n_samples, k)."""
    if values.ndim == 2 and values.shape[1] == 1:  # products with one vector are faster
        return np.asarray(weights @ values[:, 0])[:, None]
    return np.asarray(weights @ values)


def every_sample(signals: Signals) -> Rows:
    """One row per sample, for data without a clock.

    Parameters
    ----------
    signals : Signals
        Motion.
    """
    n, joints = signals.n_samples, range(signals.n_joints)
    order = np.arange(n)
    return Rows(
        [scipy.sparse.csr_matrix((np.ones(n), (order, order)), shape=(n, n)) for _ in joints],
        [signals.trajectory.astype(np.int64) for _ in joints],
        [order.astype(float) for _ in joints],
        [order * 8 // max(1, n) % 4 for _ in joints],
        np.ones((n, signals.n_joints), dtype=bool),
    )


def sliding_samples(
    signals: Signals, valid: NDArray[np.bool_], margin: int | NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Samples at which a joint slides, neither at rest nor near a reversal.

    Parameters
    ----------
    signals : Signals
        Smoothed motion.
    valid : ndarray of shape (n_samples, n_joints) of bool
        Samples where motion and torque can be trusted.
    margin : int or ndarray of int of shape (n_segments, n_joints)
        Samples left out on each side, such as the reach of the smoother.

    Returns
    -------
    ndarray of shape (n_samples, n_joints) of bool
    """
    margins = np.broadcast_to(margin, (len(signals.segments), signals.n_joints))
    sliding = valid.copy()
    for rows, reaches in zip(signals.segments, margins, strict=True):
        velocity = signals.dq[rows]
        still = np.abs(velocity) <= REST * signals.unit
        turns = np.diff(np.sign(velocity), axis=0) != 0
        still[:-1] |= turns
        still[1:] |= turns
        for reach in set(reaches.tolist()):
            own = np.flatnonzero(reaches == reach)
            sliding[rows, own] &= ~widened(still[:, own], reach)
    return sliding


def column_step(signals: Signals, window: float, margin: int) -> int:
    """Samples of which one is enough where columns are computed; odd.

    Parameters
    ----------
    signals : Signals
        Motion with time; with several rates, the slowest recording counts.
    window : float, s
        Width of the averaging windows.
    margin : int
        Number of samples left out next to a reversal; columns are not interpolated across one.

    Returns
    -------
    int
    """
    pairs = zip(signals.segments, signals.steps, strict=True)
    steps = [step for rows, step in pairs if rows.stop - rows.start > FEWEST_SAMPLES]
    rate = 1.0 / max(steps, default=1.0)
    if rate < FAST:
        return 1
    step = int(rate * min(window / FEWEST_SAMPLES, LONGEST_STEP) * (1 + 1e-6))
    step = min(step, margin // 2)
    return max(1, step - 1 + step % 2)


def interpolation(segments: Sequence[slice], few: Sequence[slice], step: int) -> csr_matrix:
    """Cubic interpolation (Lagrange) from the middle one of every few samples to all of them.

    Parameters
    ----------
    segments : sequence of slice
        Of all samples.
    few : sequence of slice
        Of the samples that are kept, for each of these segments that keeps some.
    step : int
        Number of samples per kept sample.

    Returns
    -------
    csr_matrix of shape (n_samples, n)
        Each sample is interpolated from the four nearest kept ones of its segment, or equal to the
        nearest one if the segment keeps fewer.
    """
    kept = [rows for rows in segments if rows.stop - rows.start > step // 2]
    values, columns, n_samples = [], [], segments[-1].stop if segments else 0
    counts = np.zeros(n_samples, dtype=np.int64)
    for rows, own in zip(kept, few, strict=True):
        place = (np.arange(rows.stop - rows.start) - step // 2) / step
        count = own.stop - own.start
        if count < 4:
            nearest = np.clip(np.round(place), 0, count - 1).astype(np.int64)
            columns.append(own.start + nearest)
            values.append(np.ones(len(place)))
            counts[rows] = 1
            continue
        first = np.clip(np.floor(place).astype(np.int64) - 1, 0, count - 4)
        x = place - first
        a, b, c = x - 1, x - 2, x - 3
        weights = [-a * b * c / 6, x * b * c / 2, -x * a * c / 2, x * a * b / 6]
        columns.append((own.start + first[:, None] + np.arange(4)).ravel())
        values.append(np.column_stack(weights).ravel())
        counts[rows] = 4
    starts = np.concatenate([[0], np.cumsum(counts)])
    found = np.concatenate([np.zeros(0), *values]), np.concatenate([np.zeros(0, int), *columns])
    n = few[-1].stop if few else 0
    return scipy.sparse.csr_matrix((*found, starts), shape=(n_samples, n))


def widened(mask: NDArray[np.bool_], reach: int) -> NDArray[np.bool_]:
    """A mask extended along its first axis by some samples on each side."""
    wide = np.zeros((len(mask) + 2 * reach, *mask.shape[1:]), dtype=bool)
    wide[reach : reach + len(mask)] = mask
    width, whole = 1, 2 * reach + 1
    while width < whole:  # every sample shows those from it on, twice as many each time
        step = min(width, whole - width)
        wide[:-step] |= wide[step:]
        width += step
    return wide[: len(mask)]


def window_rows(
    signals: Signals, use: NDArray[np.bool_], window: float | Array = WINDOW, step: int = 1
) -> Rows:
    """Averaging windows over the samples that may be used.

    Parameters
    ----------
    signals : Signals
        Motion.
    use : ndarray of shape (n_samples, n_joints) of bool
        Samples that may be used.
    window : float or ndarray of shape (n_segments,), s, default=1/8
        Width of the windows; widened to hold six samples of each trajectory.
    step : int, default=1
        As in :class:`Rows`.
    """
    widths = np.broadcast_to(window, len(signals.segments)).tolist()
    spans = [
        _windows(signals.clock[rows], rows.start, width)
        for rows, width in zip(signals.segments, widths, strict=True)
    ]
    counts = [len(span.middle) for span in spans]
    middle = np.concatenate([span.middle for span in spans])
    name = np.repeat(signals.trajectory[[rows.start for rows in signals.segments]], counts)
    eighth = np.concatenate([np.arange(n) * 8 // max(1, n) % 4 for n in counts])
    weights, trajectory, time, quarter = [], [], [], []
    for joint in range(signals.n_joints):
        own = np.ascontiguousarray(use[:, joint])
        parts = [_weigh(span, own) for span in spans]
        weights.append(_stack([part[0] for part in parts], signals.n_samples))
        keep = np.concatenate([part[1] for part in parts])
        trajectory.append(name[keep])
        time.append(middle[keep])
        quarter.append(eighth[keep])
    return Rows(weights, trajectory, time, quarter, use, step)


@dataclass(frozen=True)
class _Windows:
    """All windows of one segment before samples are left out (flat, one entry per weight)."""

    middle: Array
    row: NDArray[np.int64]
    sample: NDArray[np.int32]  # the type of indices that SciPy chooses, so that it copies none
    weight: Array
    full: Array  # weight of every window, (n_windows,)


def _windows(time: Array, offset: int, window: float) -> _Windows:
    steps = np.diff(time)
    width = window
    if FEWEST_SAMPLES * steps.max(initial=0.0) > window:
        width = max(window, FEWEST_SAMPLES * np.median(steps[steps > 0]))
    middle = np.arange(time[0] + width / 2, time[-1] - width / 2 + 1e-9, width / 2)
    first = np.searchsorted(time, middle - width / 2)
    last = np.searchsorted(time, middle + width / 2)
    length = last - first
    row = np.repeat(np.arange(len(middle)), length)
    within = np.arange(len(row)) - np.repeat(np.cumsum(length) - length, length)
    sample = np.repeat(first, length) + within
    weight = np.cos(np.pi * (time[sample] - middle[row]) / width) ** 2
    full: Array = np.bincount(row, weight, minlength=len(middle)).astype(float)
    return _Windows(middle, row, (sample + offset).astype(np.int32), weight, full)


#: Number of samples of every kept window, and the samples and weights of one window after another.
Entries = tuple[NDArray[np.int64], NDArray[np.int32], Array]


def _weigh(span: _Windows, use: NDArray[np.bool_]) -> tuple[Entries, NDArray[np.bool_]]:
    """Weights of the samples in use, scaled to unit noise gain, and a mask of the kept windows."""
    n = len(span.middle)
    used = use.take(span.sample)
    weight = span.weight * used
    total = np.bincount(span.row, weight, n)
    keep = (total > 0) & (total >= LEAST_WEIGHT * span.full)
    gain = np.sqrt(np.bincount(span.row, weight**2, n))
    inside = np.flatnonzero(used & keep[span.row])
    row = span.row[inside]
    length = np.bincount(row, minlength=n)[keep]
    return (length, span.sample[inside], weight[inside] / gain[row]), keep


def _stack(parts: list[Entries], n_samples: int) -> csr_matrix:
    """Rows of all segments; entries are sorted by row and by sample already."""
    lengths, samples, values = zip(*parts, strict=True)
    start = np.concatenate([[0], *lengths]).cumsum(dtype=np.int32)
    found = np.concatenate(values), np.concatenate(samples), start
    return scipy.sparse.csr_matrix(found, shape=(len(start) - 1, n_samples))
