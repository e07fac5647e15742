# SPDX-License-Identifier: BSD-3-Clause
"""How much of a learned part to keep, judged on recordings that it has not seen."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

Array = NDArray[np.float64]


def learned_weights(
    residual: Array, learned: Array, unit: NDArray[Any], alpha: float
) -> tuple[Array, Array, Array]:
    """Weight of the learned part for each joint; zero where its gain may be chance.

    The weight is the least-squares factor of the cross-fitted learned part, between 0 and 1. Its
    gain is measured on each unit (recording, or block of the only one) with the factor of all
    other units, and is kept if a one-sided paired t-test over units finds it below `alpha`.

    Parameters
    ----------
    residual, learned : ndarray of shape (n_samples, n_joints), N m
        Cross-fitted residual of the physics, and the learner's cross-fitted prediction of it.
    unit : ndarray of shape (n_samples,)
        Number of the independent unit of every row.
    alpha : float
        Level of the test.

    Returns
    -------
    weight, gain, p_value : ndarray of shape (n_joints,)
        The gain is the relative fall of the held-out RMSE.
    """
    labels, number = np.unique(unit, return_inverse=True)

    def per_unit(values: Array) -> Array:
        return np.stack([np.bincount(number, column) for column in values.T], axis=1)

    rr, rl, ll = (per_unit(v) for v in (residual**2, residual * learned, learned**2))
    tiny = np.finfo(np.float64).tiny
    weight = np.clip(rl.sum(axis=0) / np.maximum(ll.sum(axis=0), tiny), 0.0, 1.0)
    if len(labels) < 3:
        return np.zeros_like(weight), np.zeros_like(weight), np.ones_like(weight)
    others = np.clip((rl.sum(axis=0) - rl) / np.maximum(ll.sum(axis=0) - ll, tiny), 0.0, 1.0)
    after = rr - 2 * others * rl + others**2 * ll
    gain = 1.0 - np.sqrt(after.sum(axis=0) / np.maximum(rr.sum(axis=0), tiny))
    logs = np.log(np.maximum(after, tiny) / np.maximum(rr, tiny))
    spread = logs.std(axis=0, ddof=1) / np.sqrt(len(labels))
    t = logs.mean(axis=0) / np.maximum(spread, tiny)
    p_value = np.where(others.max(axis=0) > 0, stats.t.cdf(t, len(labels) - 1), 1.0)
    kept = (p_value < alpha) & (gain > 0)
    return np.where(kept, weight, 0.0), gain, p_value
