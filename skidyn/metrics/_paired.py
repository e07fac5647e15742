# SPDX-License-Identifier: BSD-3-Clause
"""Comparison of two models over whole recordings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats

from skidyn.metrics._errors import _pair

Array = NDArray[np.float64]


def trajectory_errors(
    y_true: ArrayLike, y_pred: ArrayLike, trajectory: ArrayLike
) -> tuple[NDArray[Any], Array]:
    """Mean squared error of every trajectory and joint.

    Parameters
    ----------
    y_true, y_pred : array-like of shape (n_samples,) or (n_samples, n_joints), N m (N if prismatic)
        Measured and modelled torque.
    trajectory : array-like of shape (n_samples,)
        Trajectory number of every row.

    Returns
    -------
    labels : ndarray of shape (n_trajectories,)
        Sorted trajectory numbers.
    errors : ndarray of shape (n_trajectories, n_joints), (N m)^2
        Mean squared errors.

    Examples
    --------
    >>> trajectory_errors([0.0, 0.0, 0.0], [1.0, 1.0, 2.0], [0, 0, 1])[1].ravel().tolist()
    [1.0, 4.0]
    """
    true, pred = _pair(y_true, y_pred)
    labels, number = np.unique(np.asarray(trajectory), return_inverse=True)
    if len(number) != len(true):
        raise ValueError(f"trajectory has {len(number)} rows, y_true has {len(true)}.")
    squares = np.stack([np.bincount(number, column) for column in ((true - pred) ** 2).T], axis=1)
    return labels, squares / np.bincount(number)[:, None]


@dataclass(frozen=True)
class PairedComparison:
    """Ratio of two models' errors over the same recordings.

    Parameters
    ----------
    ratio : float
        RMSE of the second model over that of the first, geometric mean over recordings and joints;
        below 1 the second is better.
    low, high : float
        Confidence interval of the ratio, with recordings as independent observations.
    p_value : float
        One-sided: probability of a ratio this low if the second model were no better.
    n_recordings : int
        Number of recordings.

    Examples
    --------
    >>> from skidyn.metrics import paired_comparison
    >>> result = paired_comparison([1.0, 1.1, 0.9], [0.5, 0.6, 0.5])
    >>> result.ratio < 1
    True
    """

    ratio: float
    low: float
    high: float
    p_value: float
    n_recordings: int

    def __str__(self) -> str:
        return f"{self.ratio:.3f} [{self.low:.3f}, {self.high:.3f}] (n = {self.n_recordings})"


def paired_comparison(
    errors_first: ArrayLike, errors_second: ArrayLike, *, confidence: float = 0.95
) -> PairedComparison:
    """Compare two models by their errors on the same recordings.

    Rows of one recording are far from independent, so the recording is the unit: the interval is a
    paired t interval of the logarithm of the error ratio of each recording (mean over joints).

    Parameters
    ----------
    errors_first, errors_second : array-like of shape (n_recordings, n_joints), (N m)^2
        Mean squared errors, for example from :func:`trajectory_errors`.
    confidence : float, default=0.95
        Coverage of the interval.

    Returns
    -------
    PairedComparison
        Ratio with its interval, which is infinite with fewer than two recordings.

    Examples
    --------
    >>> comparison = paired_comparison([[4.0], [4.4], [3.8]], [[1.0], [1.0], [1.0]])
    >>> round(comparison.ratio, 2), comparison.high < 1
    (0.5, True)
    """
    first = np.atleast_2d(np.asarray(errors_first, dtype=float))
    second = np.atleast_2d(np.asarray(errors_second, dtype=float))
    if first.shape != second.shape:
        raise ValueError(f"errors have the shapes {first.shape} and {second.shape}.")
    if not (first > 0).all() or not (second > 0).all():
        raise ValueError("errors must be positive mean squared errors.")
    logs = 0.5 * (np.log(second) - np.log(first)).mean(axis=1)
    n, centre = len(logs), float(logs.mean())
    spread = float(logs.std(ddof=1) / np.sqrt(n)) if n > 1 else np.inf
    if not np.isfinite(spread):
        return PairedComparison(float(np.exp(centre)), 0.0, np.inf, 1.0, n)
    half = float(stats.t.ppf(0.5 + confidence / 2, n - 1)) * spread
    p = float(stats.t.cdf(centre / spread, n - 1)) if spread > 0 else float(centre >= 0)
    ratio, low, high = (float(np.exp(v)) for v in (centre, centre - half, centre + half))
    return PairedComparison(ratio, low, high, p, n)
