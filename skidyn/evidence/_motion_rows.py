# SPDX-License-Identifier: BSD-3-Clause
"""Averaging windows of a motion and the folds into which they fall."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array, Signals, blocks_held_out
from skidyn.evidence._broken import without_broken
from skidyn.evidence._cutoff import half_width, usual_cutoff
from skidyn.evidence._kinematics import smooth_motion
from skidyn.evidence._rows import (
    FEWEST_SAMPLES,
    WINDOW,
    Rows,
    column_step,
    every_sample,
    sliding_samples,
    window_rows,
)

#: Most folds: of more trajectories, several are held out together.
MOST_FOLDS = 20
#: Share of the smoother's half width that is left out around rest and reversals, and number of
#: samples left out where a model of hysteresis describes the motion between the two.
MARGIN, SHORT_MARGIN = 0.75, 1
#: Rows whose middle is nearer than this, or half a window, to the border between two blocks are
#: dropped, in s.
WINDOW_GUARD = 1 / 16
#: Rows of a joint at least: fewer are fitted by its own friction and inertia, whatever else acts.
FEWEST_ROWS = 12

#: Rows, the fold of every row by joint, the number of folds, and whether they are whole
#: trajectories.
RowsAndFolds = tuple[Rows, list[NDArray[np.int64]], int, bool]


def read_motion(signals: Signals, smooth: bool, torque: Array) -> Signals:
    """Motion as used by the rows, smoothed or as logged, without broken samples."""
    if signals.time is None:
        return signals
    smoothed = signals.once("smooth motion", lambda: smooth_motion(signals))  # by checks, too
    motion = without_broken(smoothed, signals, torque)
    return motion if smooth else motion.with_(q=signals.q, dq=signals.dq, ddq=signals.ddq)


def usual_windows(signals: Signals) -> Array:
    """Width of the windows of every segment in s.

    Where the cut-off of the smoother is lowered, it is at least the first zero of their spectrum:
    what it removes from the motion would else be left in the rows of the torque.
    """
    widths = np.full(len(signals.segments), WINDOW)
    if signals.cutoff is None:
        return widths
    cutoffs = signals.cutoff[[rows.start for rows in signals.segments]]
    lowered = cutoffs < usual_cutoff(signals.rate)
    return np.where(lowered, np.maximum(WINDOW, 2 / cutoffs), widths)


def _margins(signals: Signals, reversals: Sequence[int]) -> NDArray[np.int64]:
    """Samples left out beside a reversal, (n_segments, n_joints)."""
    margins = np.ones((len(signals.segments), signals.n_joints), dtype=np.int64)
    if signals.cutoff is not None:
        reach = [half_width(signals.rate, signals.cutoff[r.start]) for r in signals.segments]
        margins *= np.array([max(1, round(MARGIN * half)) for half in reach])[:, None]
    margins[:, list(reversals)] = SHORT_MARGIN
    return margins


def motion_rows(signals: Signals, reversals: Sequence[int], window: float | None = None) -> Rows:
    """Averaging windows over the samples that count, of the usual width unless it is given."""
    if signals.time is None:
        return every_sample(signals)
    windows = usual_windows(signals)
    if window is not None:
        windows = np.full_like(windows, window)
    margins = _margins(signals, reversals)
    use = sliding_samples(signals, signals.usable, margins)
    step = column_step(signals, float(windows.min()), int(margins.min()))
    rows = window_rows(signals, use, windows, step)
    few = rows.counts < FEWEST_ROWS
    if not (few & (rows.counts > 0)).any():
        return rows
    use = use & ~few  # a joint that slides for a moment only is treated as one at rest
    return window_rows(signals, use, windows, step)


def rows_and_folds(
    signals: Signals,
    reversals: Sequence[int],
    weight: Array | None = None,
    window: float | None = None,
) -> RowsAndFolds:
    """Averaging windows and the folds they fall into."""
    # A slow log has wider windows, which extend further over a border; single samples do not.
    clock = signals.time is not None
    widest = float(usual_windows(signals).max(initial=0.0))
    guard = max(WINDOW_GUARD, widest / 2, _half_window(signals.rate)) if clock else 0.0
    rows = motion_rows(signals, reversals, window)
    return _folds(rows if weight is None else rows.weighted(weight), guard)


def _half_window(rate: float) -> float:
    return FEWEST_SAMPLES / rate / 2


def _folds(rows: Rows, guard: float) -> tuple[Rows, list[NDArray[np.int64]], int, bool]:
    """Assign rows to folds and sort them; blocks of few trajectories lose the rows at borders."""
    names = np.unique(np.concatenate(rows.trajectory))
    blocks = blocks_held_out(len(names))
    whole = blocks == 1
    ends = {}
    for name in names:
        times = np.concatenate(
            [t[k == name] for t, k in zip(rows.time, rows.trajectory, strict=True)]
        )
        ends[name] = np.linspace(times.min(), times.max() + 1e-9, blocks + 1)
    n_folds = min(len(names) * blocks, MOST_FOLDS) if whole else len(names) * blocks
    fold, order = [], []
    for time, trajectory in zip(rows.time, rows.trajectory, strict=True):
        label = np.searchsorted(names, trajectory) * blocks
        keep = np.ones(len(time), dtype=bool)
        for name in names:
            inside = np.flatnonzero(trajectory == name)
            edges = ends[name][1:-1]
            label[inside] += np.searchsorted(edges, time[inside], side="right")
            for edge in edges:
                near = np.abs(time[inside] - edge) < guard
                keep[inside[near]] = False
        label = label * n_folds // (len(names) * blocks)
        index = np.flatnonzero(keep)
        index = index[np.argsort(label[index], kind="stable")]
        fold.append(label[index])
        order.append(index)
    return rows.taken(order), fold, n_folds, whole
