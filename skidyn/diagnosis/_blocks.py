# SPDX-License-Identifier: BSD-3-Clause
"""Blocks of time that are nearly independent of each other, and the correlation that sets them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array
from skidyn.diagnosis._rule import CORRELATION_TIMES, MOST_LAGS, SHORTEST_BLOCK, SMALL
from skidyn.evidence import Problem


def time_blocks(problem: Problem, length: float) -> tuple[list[NDArray[np.int64]], int]:
    """Blocks of time within the trajectories, common to all joints.

    Parameters
    ----------
    problem : Problem
        Rows.
    length : float, s
        Desired length; the blocks of a trajectory have equal lengths close to it.

    Returns
    -------
    index : list of ndarray of shape (n_rows_j,)
        Block of every row, per joint.
    count : int
        Number of blocks.
    """
    rows = problem.rows
    if problem.signals.time is None:  # rows are successive samples
        length = float(len(np.unique(np.concatenate(rows.time)))) / 50
    place, span, share = rows.spans
    number = np.maximum(1, np.round(span / length)).astype(np.int64)
    first = np.cumsum(number) - number
    block = first[place] + np.minimum((share * number[place]).astype(np.int64), number[place] - 1)
    return rows.split(block), int(number.sum())


def block_length(problem: Problem, inflation: float) -> float:
    """Length of blocks of time that are nearly independent, in s.

    Parameters
    ----------
    problem : Problem
        Rows.
    inflation : float
        Of the variance, the largest of :func:`variance_inflation` of some joints.
    """
    return float(max(SHORTEST_BLOCK, CORRELATION_TIMES * problem.rows.hop * inflation))


def variance_inflation(
    problem: Problem, residual: Sequence[Array], joints: Sequence[int] | range
) -> Array:
    """Variance of a slow column's coefficient relative to that for independent rows, by joint.

    One plus twice the sum of the residual's autocorrelations up to the first small one.

    Parameters
    ----------
    problem : Problem
        Rows.
    residual : sequence of ndarray of shape (n_rows_j,)
        Residual rows of some joints.
    joints : sequence of int
        These joints, from 0.

    Returns
    -------
    ndarray of shape (len(joints),)
    """
    inflation = np.ones(len(joints))
    for i, (j, r) in enumerate(zip(joints, residual, strict=True)):
        x = r[problem.rows.in_time(j)]
        power = float(x @ x)
        if power <= 0:
            continue
        for lag in range(1, min(MOST_LAGS, len(x))):
            earlier = problem.rows.earlier(j, lag)
            rho = float(x[earlier] @ x[earlier + lag]) / power
            if rho < SMALL:
                break
            inflation[i] += 2 * rho
    return inflation
