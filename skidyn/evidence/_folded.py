# SPDX-License-Identifier: BSD-3-Clause
"""Coefficients of fits that leave one fold out, from the Gram matrices of the folds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from skidyn._signals import Array
from skidyn.evidence._problem import RIDGE, Problem


def left_out_coefficients(
    problem: Problem, design: Sequence[Array], sigma: Array, target: Sequence[Array]
) -> tuple[Array, Array]:
    """Coefficients of the whole fit and of the fits that leave one fold out.

    Parameters
    ----------
    problem : Problem
        Rows and folds.
    design : sequence of ndarray of shape (n_rows_j, n_coefficients)
        Columns of every joint.
    sigma : ndarray of shape (n_joints,)
        Noise of one row.
    target : sequence of ndarray
        Averaged torque.

    Returns
    -------
    whole : ndarray of shape (n_coefficients,)
    left_out : ndarray of shape (n_folds, n_coefficients)
    """
    p = design[0].shape[1]
    grams, cross = np.zeros((problem.n_folds, p, p)), np.zeros((problem.n_folds, p))
    for j, (block, y) in enumerate(zip(design, target, strict=True)):
        edges = np.searchsorted(problem.fold[j], np.arange(problem.n_folds + 1))
        for f, (a, b) in enumerate(zip(edges[:-1], edges[1:], strict=True)):
            part = block[a:b] / sigma[j]
            grams[f] += part.T @ part
            cross[f] += part.T @ (y[a:b] / sigma[j])
    total, right = grams.sum(0), cross.sum(0)
    scale = np.sqrt(np.diag(total))
    scale[scale == 0] = 1.0

    def solve(gram: Array, r: Array) -> Array:
        normal = gram / scale[:, None] / scale + RIDGE * np.eye(p)
        return cho_solve(cho_factor(normal), r / scale) / scale

    left = [solve(total - g, right - c) for g, c in zip(grams, cross, strict=True)]
    return solve(total, right), np.array(left)
