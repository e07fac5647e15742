# SPDX-License-Identifier: BSD-3-Clause
"""Comparison of every recording with all others, to find changed drive gains."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array
from skidyn.evidence import jackknife
from skidyn.payload._runs import Runs

#: Number of blocks of time of a recording, left out in turn for the standard error of its share.
BLOCKS = 10
#: Least difference of a recording to be reported: in standard errors, and as a share.
DIFFERS, LEAST = 4.0, 0.01
#: Standard error, as a share, beyond which a recording has no information about a joint.
LARGEST_ERROR = 0.1


@dataclass(frozen=True)
class Shares:
    """Measured values of every recording relative to those expected from all others.

    ``values`` and their standard errors ``std`` are of shape (n_recordings, n_joints), and NaN for
    the only recording of its kind and for joints that it does not move.
    """

    names: tuple[str, ...]
    values: Array
    std: Array

    def to_dict(self) -> dict[str, Any]:
        """As plain numbers, for JSON."""
        return {
            "recordings": list(self.names),
            "values": self.values.tolist(),
            "std": self.std.tolist(),
        }


def compare_recordings(
    runs: Runs, predict: Callable[[NDArray[np.int64]], Sequence[Array]]
) -> Shares:
    """Measured torque or current of every recording as a share of the expected, by joint.

    ``predict`` is a function of the left-out folds that returns the values of all rows expected
    from the others, per joint. The standard error of a share includes the spread over the blocks of
    its recording and, because the expectation comes from the others, half the usual distance
    between recordings.
    """
    rows, n = runs.problem.rows, len(runs.target)
    numbers = np.unique(runs.problem.signals.trajectory)
    loaded = np.array([runs.carries[runs.problem.signals.trajectory == k].any() for k in numbers])
    values, std = np.full((2, len(numbers), n), np.nan)
    for r, number in enumerate(numbers):
        if np.sum(loaded == loaded[r]) < 2:
            continue
        mine = [trajectory == number for trajectory in rows.trajectory]
        folds = [fold[own] for fold, own in zip(runs.fold, mine, strict=True)]
        expected = predict(np.unique(np.concatenate(folds)))
        for j, own in enumerate(mine):
            order = np.argsort(rows.time[j][own])
            x, y = expected[j][own][order], runs.target[j][own][order]
            blocks = np.array_split(np.arange(len(x)), BLOCKS)
            both = np.array([x[b] @ y[b] for b in blocks])
            size = np.array([x[b] @ x[b] for b in blocks])
            if len(x) < BLOCKS or not np.all(size.sum() - size > 0):
                continue
            values[r, j] = both.sum() / size.sum()
            without = (both.sum() - both) / (size.sum() - size)
            std[r, j] = float(jackknife(without))
    known = np.isfinite(values)
    for some, shares, errors in zip(known.T, values.T, std.T, strict=True):
        if some.sum() > 2:
            usual = np.median(np.abs(shares[some] - np.median(shares[some])))
            errors[some] = np.hypot(errors[some], usual / 2)
    return Shares(_names(loaded), values, std)


def differing(shares: Shares, joint_names: Sequence[str]) -> list[str]:
    """A note if a recording differs from the value expected from the others."""
    away = np.abs(shares.values - 1.0)
    told = (shares.std < LARGEST_ERROR) & (away > LEAST) & (away > DIFFERS * shares.std)
    if not told.any():
        return []
    r, j = divmod(int(np.argmax(np.where(told, away / shares.std, 0.0))), told.shape[1])
    return [
        f"In {shares.names[r]}, {joint_names[j]} measures {100 * shares.values[r, j]:.1f} ± "
        f"{100 * shares.std[r, j]:.1f} % of the torque expected from the other recordings: its "
        "drive gain or its friction was different there."
    ]


def _names(loaded: NDArray[np.bool_]) -> tuple[str, ...]:
    place = np.where(loaded, np.cumsum(loaded), np.cumsum(~loaded))
    return tuple(
        f"{'loaded' if is_loaded else 'unloaded'} {k}"
        for is_loaded, k in zip(loaded, place, strict=True)
    )
