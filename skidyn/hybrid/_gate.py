# SPDX-License-Identifier: BSD-3-Clause
"""Weight of a learned part, from recordings that it has not seen."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from skidyn.evidence import jackknife

Array = NDArray[np.float64]

#: Added to divisors, to keep ratios finite.
TINY = np.finfo(np.float64).tiny


def learned_weights(
    residual: Array, learned: Array, unit: NDArray[Any], alpha: float
) -> tuple[Array, Array, Array]:
    """Weight of the learned part for each joint; zero if its gain is not significant.

    The least-squares factor of the cross-fitted learned part has a standard error over units
    (recordings), from the jackknife. The weight is the factor minus one standard error, between 0
    and 1: a learned part of little benefit has a small weight. The weight is zero unless residual
    and learned part agree significantly, by a one-sided t-test over units of their products: of
    their mean correlation over all joints, which detects small gains on many joints, or of a joint
    alone after Holm's correction. The smaller of the two p-values counts, doubled. For noise the
    mean of the products is zero, so the level is kept.

    Parameters
    ----------
    residual, learned : ndarray of shape (n_samples, n_joints), N m
        Cross-fitted residual of the physics, and the learner's cross-fitted prediction of it.
    unit : ndarray of shape (n_samples,)
        Number of the independent unit of every row; at least three.
    alpha : float
        Level of the tests, over all joints together.

    Returns
    -------
    weight, gain, p_value : ndarray of shape (n_joints,)
        The gain is the relative reduction of the RMSE on units, with the weight found from the
        other units. The p-value is 1 if the weight would be zero.

    References
    ----------
    .. [1] L. Breiman, "Stacked regressions", Machine Learning 24, 1996.
    .. [2] B. Efron, "The Jackknife, the Bootstrap and Other Resampling Plans", SIAM, 1982.
    .. [3] S. Holm, "A simple sequentially rejective multiple test procedure", Scandinavian
       Journal of Statistics 6, 1979.
    """
    labels, number = np.unique(unit, return_inverse=True)

    def per_unit(values: Array) -> Array:
        return np.stack([np.bincount(number, column) for column in values.T], axis=1)

    rr, rl, ll = (per_unit(v) for v in (residual**2, residual * learned, learned**2))
    n_joints = rr.shape[1]
    if len(labels) < 3:
        return np.zeros(n_joints), np.zeros(n_joints), np.ones(n_joints)
    each = range(len(labels))
    others = np.stack([_cautious_factor(np.delete(rl, k, 0), np.delete(ll, k, 0)) for k in each])
    after = rr - 2 * others * rl + others**2 * ll
    gain = 1.0 - np.sqrt(after.sum(axis=0) / np.maximum(rr.sum(axis=0), TINY))
    correlation = rl / np.maximum(np.sqrt(rr.sum(axis=0) * ll.sum(axis=0)), TINY)
    common = _p_value(correlation.mean(axis=1, keepdims=True))
    p_value = np.minimum(2 * np.minimum(_holm(_p_value(correlation)), common), 1.0)
    weight = np.where(gain > 0, _cautious_factor(rl, ll), 0.0)
    p_value[weight == 0] = 1.0
    return np.where((p_value < alpha) | (alpha == 1), weight, 0.0), gain, p_value


def _cautious_factor(products: Array, squares: Array) -> Array:
    """Least-squares factor from the sums of each unit minus its standard error, in 0 to 1."""
    without = (products.sum(axis=0) - products) / np.maximum(squares.sum(axis=0) - squares, TINY)
    error = jackknife(without)
    factor = products.sum(axis=0) / np.maximum(squares.sum(axis=0), TINY)
    cautious: Array = np.clip(factor - error, 0.0, 1.0)
    return cautious


def _p_value(values: Array) -> Array:
    """One-sided t-test over units (rows) that the mean is positive."""
    spread = values.std(axis=0, ddof=1) / np.sqrt(len(values))
    statistic = values.mean(axis=0) / np.maximum(spread, TINY)
    p_value: Array = stats.t.sf(statistic, len(values) - 1)
    return p_value


def _holm(p_values: Array) -> Array:
    """Corrected p-values: the chance of any false finding among all of them."""
    order = np.argsort(p_values, kind="stable")
    factors = len(p_values) - np.arange(len(p_values))
    corrected = np.empty_like(p_values)
    corrected[order] = np.minimum(np.maximum.accumulate(factors * p_values[order]), 1.0)
    return corrected
