# SPDX-License-Identifier: BSD-3-Clause
"""Coefficients of fits that leave one fold out, from the Gram matrices of the folds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from skidyn._signals import Array
from skidyn.evidence._problem import RIDGE


class Folded(Protocol):
    """Rows that are sorted by fold, joint by joint."""

    @property
    def fold(self) -> list[NDArray[np.int64]]:
        """Fold of every row, per joint."""

    @property
    def n_folds(self) -> int:
        """Number of folds."""


def fold_products(
    folds: Folded,
    design: Sequence[Array],
    sigma: Array,
    target: Sequence[Array],
    instruments: Sequence[Array] | None = None,
) -> tuple[Array, Array]:
    """Weighted products of the rows of every fold.

    Parameters
    ----------
    folds : Folded
        Folds of the rows.
    design : sequence of ndarray of shape (n_rows_j, n_coefficients)
        Columns A of every joint.
    sigma : ndarray of shape (n_joints,)
        Noise of one row.
    target : sequence of ndarray
        Averaged torque y.
    instruments : sequence of ndarray of shape (n_rows_j, n_coefficients), optional
        What stands left in the products; the columns themselves by default.

    Returns
    -------
    grams : ndarray of shape (n_folds, n_coefficients, n_coefficients)
        Z^T A.
    cross : ndarray of shape (n_folds, n_coefficients)
        Z^T y.
    """
    p = design[0].shape[1]
    grams, cross = np.zeros((folds.n_folds, p, p)), np.zeros((folds.n_folds, p))
    left = design if instruments is None else instruments
    for j, (block, y) in enumerate(zip(design, target, strict=True)):
        edges = np.searchsorted(folds.fold[j], np.arange(folds.n_folds + 1))
        for f, (a, b) in enumerate(zip(edges[:-1], edges[1:], strict=True)):
            part = left[j][a:b] / sigma[j]
            grams[f] += part.T @ (block[a:b] / sigma[j])
            cross[f] += part.T @ (y[a:b] / sigma[j])
    return grams, cross


def left_out_coefficients(
    folds: Folded,
    design: Sequence[Array],
    sigma: Array,
    target: Sequence[Array],
    instruments: Sequence[Array] | None = None,
) -> tuple[Array, Array]:
    """Coefficients of the whole fit and of the fits that leave one fold out.

    Parameters
    ----------
    folds : Folded
        Folds of the rows.
    design : sequence of ndarray of shape (n_rows_j, n_coefficients)
        Columns of every joint.
    sigma : ndarray of shape (n_joints,)
        Noise of one row.
    target : sequence of ndarray
        Averaged torque.
    instruments : sequence of ndarray of shape (n_rows_j, n_coefficients), optional
        Instruments of the columns; the columns themselves by default.

    Returns
    -------
    whole : ndarray of shape (n_coefficients,)
    left_out : ndarray of shape (n_folds, n_coefficients)
    """
    grams, cross = fold_products(folds, design, sigma, target, instruments)
    return solve_left_out(grams, cross, symmetric=instruments is None)


def solve_left_out(
    grams: Array,
    cross: Array,
    prior: tuple[Array, Array] | None = None,
    *,
    symmetric: bool = True,
) -> tuple[Array, Array]:
    """Solutions of the sum of all folds' normal equations, and of all sums without one fold.

    Parameters
    ----------
    grams : ndarray of shape (n_folds, n_coefficients, n_coefficients)
        Left sides.
    cross : ndarray of shape (n_folds, n_coefficients)
        Right sides.
    prior : (ndarray of shape (n_coefficients, n_coefficients), ndarray), optional
        Left and right side that are added to all: a quadratic pull.
    symmetric : bool, default=True
        Whether the left sides are symmetric.

    Returns
    -------
    whole : ndarray of shape (n_coefficients,)
    left_out : ndarray of shape (n_folds, n_coefficients)
    """
    total, right = grams.sum(0), cross.sum(0)
    if prior is not None:
        total, right = total + prior[0], right + prior[1]
    scale = np.sqrt(np.abs(np.diag(total)))
    scale[scale == 0] = 1.0
    ridge = RIDGE * np.eye(len(scale))

    def solve(gram: Array, r: Array) -> Array:
        normal = gram / scale[:, None] / scale + ridge
        if symmetric:
            return np.asarray(cho_solve(cho_factor(normal), r / scale) / scale)
        return np.asarray(np.linalg.solve(normal, r / scale) / scale)

    left = [solve(total - g, right - c) for g, c in zip(grams, cross, strict=True)]
    return solve(total, right), np.array(left)
