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

    The least-squares factor of the cross-fitted learned part, between 0 and 1, is taken from all
    units (recordings, or blocks of the only one) but one, and its gain is measured on that one. A
    joint is kept if a one-sided paired t-test over units passes `alpha` after Holm's correction
    over the joints, so `alpha` bounds the chance that any joint is kept in vain. Its weight is the
    smallest of those factors: what no single unit can talk it into.

    Parameters
    ----------
    residual, learned : ndarray of shape (n_samples, n_joints), N m
        Cross-fitted residual of the physics, and the learner's cross-fitted prediction of it.
    unit : ndarray of shape (n_samples,)
        Number of the independent unit of every row.
    alpha : float
        Level of the test, over all joints together.

    Returns
    -------
    weight, gain, p_value : ndarray of shape (n_joints,)
        The gain is the relative fall of the held-out RMSE; the p-value is corrected.

    References
    ----------
    .. [1] S. Holm, "A simple sequentially rejective multiple test procedure", Scandinavian
       Journal of Statistics 6, 1979.
    """
    labels, number = np.unique(unit, return_inverse=True)

    def per_unit(values: Array) -> Array:
        return np.stack([np.bincount(number, column) for column in values.T], axis=1)

    rr, rl, ll = (per_unit(v) for v in (residual**2, residual * learned, learned**2))
    tiny = np.finfo(np.float64).tiny
    n_joints = rr.shape[1]
    if len(labels) < 3:
        return np.zeros(n_joints), np.zeros(n_joints), np.ones(n_joints)
    others = np.clip((rl.sum(axis=0) - rl) / np.maximum(ll.sum(axis=0) - ll, tiny), 0.0, 1.0)
    after = rr - 2 * others * rl + others**2 * ll
    gain = 1.0 - np.sqrt(after.sum(axis=0) / np.maximum(rr.sum(axis=0), tiny))
    logs = np.log(np.maximum(after, tiny) / np.maximum(rr, tiny))
    spread = logs.std(axis=0, ddof=1) / np.sqrt(len(labels))
    t = logs.mean(axis=0) / np.maximum(spread, tiny)
    p_value = _holm(np.where(others.max(axis=0) > 0, stats.t.cdf(t, len(labels) - 1), 1.0))
    # at alpha = 1 the user asks for whatever helps, and a corrected p-value may be exactly 1
    kept = ((p_value < alpha) | (alpha == 1)) & (gain > 0)
    return np.where(kept, others.min(axis=0), 0.0), gain, p_value


def _holm(p_values: Array) -> Array:
    """Corrected p-values: the chance of any false finding among all of them."""
    order = np.argsort(p_values, kind="stable")
    factors = len(p_values) - np.arange(len(p_values))
    corrected = np.empty_like(p_values)
    corrected[order] = np.minimum(np.maximum.accumulate(factors * p_values[order]), 1.0)
    return corrected
