# SPDX-License-Identifier: BSD-3-Clause
"""Small-sample laws: p-values of scores whose variance comes from few blocks of time."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.special import fdtrc
from scipy.stats import t as student

from skidyn._signals import Array
from skidyn.diagnosis._rule import FEWEST_BLOCKS, IN_FEW_BLOCKS, LIKE_ELSEWHERE
from skidyn.evidence import RIDGE


def tail(statistic: float, k: float, free: float) -> float:
    """Probability that a value of the F distribution is larger.

    As ``scipy.stats.f.sf``, which spends most of its time on checking the arguments.
    """
    return 1.0 if statistic <= 0 else float(fdtrc(k, free, statistic))


def chance_of_score(score: Array, sums: Array) -> float:
    """P-value of a score with independent sums over blocks (Hotelling's T-squared).

    Parameters
    ----------
    score : ndarray of shape (n_coefficients,)
        Score of the model without the candidate, over all blocks.
    sums : ndarray of shape (n_blocks, n_coefficients)
        Score of every block, with the residual with the candidate.
    """
    count, k = sums.shape
    if count < k + FEWEST_BLOCKS:
        return 1.0
    free = count - 1
    return hotelling(score, sums.T @ sums * count / free, free)


def hotelling(score: Array, variance: Array, free: float) -> float:
    """P-value of a score whose variance is an estimate with some degrees of freedom."""
    k = len(score)
    variance = variance + 1e-12 * np.trace(variance) * np.eye(k)
    wald, rest = float(score @ np.linalg.solve(variance, score)), free - k + 1
    return tail(wald * rest / (k * free), k, rest) if rest > 0 else 1.0


def degrees_of_freedom(share: Array) -> float:
    """Degrees of freedom of the variance from blocks with some shares of the information.

    Twice the squared expectation of the sum of squares of :func:`unbiased_scores` over its
    variance, for independent rows. Several coefficients have one number: that for their mean share.

    Parameters
    ----------
    share : ndarray of shape (n_blocks, n_coefficients, n_coefficients)
        Of every block, for orthonormal columns.

    Returns
    -------
    float
        The number of blocks less one if all have equal shares, fewer if some have more.
    """
    h = np.trace(share, axis1=1, axis2=2) / share.shape[1]
    between = np.sort(h**2 / np.maximum(1.0 - h, RIDGE))
    # Products of different blocks, smallest first: one block may hold nearly everything.
    pairs = 2.0 * float(between[1:] @ np.cumsum(between)[:-1])
    return 1.0 / (float(h @ h) + pairs)


@lru_cache(maxsize=4096)
def least_significant(level: float, free: float) -> float:
    """Size of one coefficient, in standard errors, from which blocks find it significant.

    Parameters
    ----------
    level : float
        Largest p-value.
    free : float
        Degrees of freedom of the blocks in which it acts.

    Returns
    -------
    float
    """
    many = student.isf((1.0 - IN_FEW_BLOCKS) * level / 2, free)
    few = student.isf(IN_FEW_BLOCKS * level / 2, free + LIKE_ELSEWHERE)
    return float(min(many, few))


def unbiased_scores(score: Array, sums: Array, grams: Array) -> tuple[Array, Array, Array]:
    """Scores of blocks whose sum of squares is the variance of the score also for few blocks.

    A block with much of the information about a coefficient draws it towards its own torque, and
    therefore has a small residual (Bell, McCaffrey 2002; [1]_, equation 2.2).

    Parameters
    ----------
    score : ndarray of shape (n_coefficients,)
        Over all blocks.
    sums : ndarray of shape (n_blocks, n_coefficients)
        Scores of blocks with the remaining residual.
    grams : ndarray of shape (n_blocks, n_coefficients, n_coefficients)
        Products of the columns of every block.

    Returns
    -------
    score : ndarray of shape (n_coefficients,)
        For columns that are orthonormal.
    sums : ndarray of shape (n_blocks, n_coefficients)
        Of blocks for the same columns.
    share : ndarray of shape (n_blocks, n_coefficients, n_coefficients)
        Of every block of the information about the same coefficients.

    References
    ----------
    .. [1] G. W. Imbens, M. Kolesar (2016), Robust standard errors in small samples: some practical
       advice, Review of Economics and Statistics 98(4).
    """
    k = len(score)
    value, vector = np.linalg.eigh(grams.sum(0) + RIDGE * np.eye(k))
    root = vector / np.sqrt(np.maximum(value, RIDGE))
    share = root.T @ grams @ root
    value, vector = np.linalg.eigh(np.eye(k) - share)
    own = np.einsum("bji,bj->bi", vector, sums @ root) / np.sqrt(np.maximum(value, RIDGE))
    return score @ root, np.einsum("bij,bj->bi", vector, own), share
