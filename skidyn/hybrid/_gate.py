# SPDX-License-Identifier: BSD-3-Clause
"""How much of a learned part to keep, judged on recordings that it has not seen."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

Array = NDArray[np.float64]

#: One-sided p-value of a gain of one standard error.
ONE_STANDARD_ERROR = 0.16
#: Keeps ratios finite.
TINY = np.finfo(np.float64).tiny


def learned_weights(
    residual: Array, learned: Array, unit: NDArray[Any], alpha: float
) -> tuple[Array, Array, Array]:
    """Weight of the learned part for each joint; zero where its gain may be chance.

    The least-squares factor of the cross-fitted learned part, between 0 and 1, is taken from all
    units (recordings, or blocks of the only one) but one, and its gain is measured on that one.
    Two one-sided paired t-tests over units are made at level `alpha`; noise passes much more
    rarely, since its held-out gain is negative in the mean. If the mean gain over all joints
    passes, every joint is kept whose own gain is more than its standard error (small gains on many
    joints are seen together); otherwise the joints that pass alone, after Holm's correction. A
    joint's weight is the smallest of its factors: what no single unit can talk it into.

    Parameters
    ----------
    residual, learned : ndarray of shape (n_samples, n_joints), N m
        Cross-fitted residual of the physics, and the learner's cross-fitted prediction of it.
    unit : ndarray of shape (n_samples,)
        Number of the independent unit of every row.
    alpha : float
        Level of the tests, over all joints together.

    Returns
    -------
    weight, gain, p_value : ndarray of shape (n_joints,)
        The gain is the relative fall of the held-out RMSE. The p-value is the smaller of the
        joint's own and the common one, corrected.

    References
    ----------
    .. [1] S. Holm, "A simple sequentially rejective multiple test procedure", Scandinavian
       Journal of Statistics 6, 1979.
    """
    labels, number = np.unique(unit, return_inverse=True)

    def per_unit(values: Array) -> Array:
        return np.stack([np.bincount(number, column) for column in values.T], axis=1)

    rr, rl, ll = (per_unit(v) for v in (residual**2, residual * learned, learned**2))
    n_joints = rr.shape[1]
    if len(labels) < 3:
        return np.zeros(n_joints), np.zeros(n_joints), np.ones(n_joints)
    others = np.clip((rl.sum(axis=0) - rl) / np.maximum(ll.sum(axis=0) - ll, TINY), 0.0, 1.0)
    after = rr - 2 * others * rl + others**2 * ll
    gain = 1.0 - np.sqrt(after.sum(axis=0) / np.maximum(rr.sum(axis=0), TINY))
    logs = np.log(np.maximum(after, TINY) / np.maximum(rr, TINY))
    tried = others.max(axis=0) > 0
    alone = np.where(tried, _p_value(logs), 1.0)
    p_value = _holm(alone)
    if tried.sum() > 1:
        common = _p_value(logs[:, tried].mean(axis=1, keepdims=True))[0]
        p_value = np.minimum(p_value, np.where(alone < ONE_STANDARD_ERROR, common, 1.0))
    # at alpha = 1 the user asks for whatever helps, and a corrected p-value may be exactly 1
    kept = ((p_value < alpha) | (alpha == 1)) & (gain > 0)
    return np.where(kept, others.min(axis=0), 0.0), gain, p_value


def _p_value(logs: Array) -> Array:
    """One-sided paired t-test over units (rows) that the logarithm of the error fell."""
    spread = logs.std(axis=0, ddof=1) / np.sqrt(len(logs))
    statistic = logs.mean(axis=0) / np.maximum(spread, TINY)
    p_value: Array = stats.t.cdf(statistic, len(logs) - 1)
    return p_value


def _holm(p_values: Array) -> Array:
    """Corrected p-values: the chance of any false finding among all of them."""
    order = np.argsort(p_values, kind="stable")
    factors = len(p_values) - np.arange(len(p_values))
    corrected = np.empty_like(p_values)
    corrected[order] = np.minimum(np.maximum.accumulate(factors * p_values[order]), 1.0)
    return corrected
