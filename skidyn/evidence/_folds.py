# SPDX-License-Identifier: BSD-3-Clause
"""Folds left out: products of every fold, their sums without one, their solutions, the jackknife.

A least-squares problem depends on its rows only through the products of their columns. These are
sums over folds, so a fold is left out by subtraction, without another pass over the rows.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from skidyn._cholesky import factored, solved
from skidyn._signals import Array, Signals

#: Diagonal added to normalised normal equations, far below any information in the data.
RIDGE = 1e-9
#: Norm of a column, as a share of the largest one, up to which it consists of rounding errors.
VANISHING = 1e-13


class Folded(Protocol):
    """Rows that are sorted by fold, joint by joint."""

    @property
    def fold(self) -> list[NDArray[np.int64]]:
        """Fold of every row, per joint."""

    @property
    def n_folds(self) -> int:
        """Number of folds."""


class Normal:
    """Normal equations with columns scaled to unit size, factored once.

    Parameters
    ----------
    gram : ndarray of shape (p, p)
        Left side.
    right : ndarray of shape (p,)
        Right side.
    scale : ndarray of shape (p,)
        Sizes of the columns, by :func:`column_sizes`.
    ridge : float, default=1e-9
        Added to the diagonal of the scaled left side.

    Attributes
    ----------
    solution : ndarray of shape (p,)
    """

    def __init__(self, gram: Array, right: Array, scale: Array, ridge: float = RIDGE) -> None:
        self._scale = scale
        normal = gram / scale[:, None] / scale
        normal.flat[:: len(scale) + 1] += ridge
        self._factor = factored(normal)
        self.solution = self.solve(right)

    def solve(self, right: Array) -> Array:
        """Solution for other right sides, shape (p,) or (p, k)."""
        scale = self._scale if right.ndim == 1 else self._scale[:, None]
        return solved(self._factor, right / scale) / scale


def column_sizes(gram: Array) -> Array:
    """Norms of the columns behind a Gram matrix; 1 for those that vanish up to rounding errors."""
    size = np.sqrt(np.abs(np.diag(gram)))
    size[size <= VANISHING * size.max(initial=0.0)] = 1.0
    return np.asarray(size)


def fold_slices(fold: NDArray[np.int64], n_folds: int) -> Iterator[slice]:
    """Rows of every fold, if the rows are sorted by fold."""
    edges = np.searchsorted(fold, np.arange(n_folds + 1)).tolist()
    for start, stop in zip(edges[:-1], edges[1:], strict=True):
        yield slice(start, stop)


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
        Left factors Z of the products; the columns themselves by default.

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
        for f, rows in enumerate(fold_slices(folds.fold[j], folds.n_folds)):
            part = left[j][rows] / sigma[j]
            grams[f] += part.T @ (block[rows] / sigma[j])
            cross[f] += part.T @ (y[rows] / sigma[j])
    return grams, cross


def left_out_coefficients(
    folds: Folded,
    design: Sequence[Array],
    sigma: Array,
    target: Sequence[Array],
    instruments: Sequence[Array] | None = None,
    soft: Sequence[tuple[slice, float]] = (),
    kept: Callable[[Array], NDArray[np.bool_]] | None = None,
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
    soft : sequence of (slice, float), default=()
        Coefficients that are drawn to zero where no row determines them, see :func:`soft_prior`.
    kept : callable, optional
        Function of the products of every fold that returns the coefficients that
        :func:`solve_left_out` keeps.

    Returns
    -------
    whole : ndarray of shape (n_coefficients,)
    left_out : ndarray of shape (n_folds, n_coefficients)
    """
    grams, cross = fold_products(folds, design, sigma, target, instruments)
    prior = soft_prior(grams.sum(0), soft) if soft else None
    stay = None if kept is None else kept(grams)
    return solve_left_out(grams, cross, prior, symmetric=instruments is None, kept=stay)


def soft_prior(gram: Array, soft: Sequence[tuple[slice, float]]) -> tuple[Array, Array]:
    """Left and right side that draw coefficients of flexible functions to zero.

    They would be arbitrary where only the fold that is left out determines them.

    Parameters
    ----------
    gram : ndarray of shape (p, p)
        Of all rows.
    soft : sequence of (slice, float)
        Coefficients of each function, and the share of its largest column's square by which they
        are drawn.

    Returns
    -------
    (ndarray of shape (p, p), ndarray of shape (p,))
        Arguments of :func:`solve_left_out`.
    """
    size, pull = np.diag(gram), np.zeros(len(gram))
    for own, share in soft:
        pull[own] = share * size[own].max(initial=0.0)
    return np.diag(pull), np.zeros(len(size))


def solve_left_out(
    grams: Array,
    cross: Array,
    prior: tuple[Array, Array] | None = None,
    *,
    symmetric: bool = True,
    ridge: float = RIDGE,
    kept: NDArray[np.bool_] | None = None,
) -> tuple[Array, Array]:
    """Solutions of the sum of all folds' normal equations, and of all sums without one fold.

    Parameters
    ----------
    grams : ndarray of shape (n_folds, n_coefficients, n_coefficients)
        Left sides.
    cross : ndarray of shape (n_folds, n_coefficients)
        Right sides.
    prior : (ndarray of shape (n_coefficients, n_coefficients), ndarray), optional
        Left and right side that are added to all, as a quadratic prior.
    symmetric : bool, default=True
        Whether the left sides are symmetric.
    ridge : float, default=1e-9
        Added to the diagonal of the scaled left sides.
    kept : ndarray of shape (n_folds, n_coefficients) of bool, optional
        Coefficients that stay near those of all folds where a fold is left out, see
        :func:`kept_pull`; none by default.

    Returns
    -------
    whole : ndarray of shape (n_coefficients,)
    left_out : ndarray of shape (n_folds, n_coefficients)
    """
    total, right = grams.sum(0), cross.sum(0)
    if prior is not None:
        total, right = total + prior[0], right + prior[1]
    scale = column_sizes(total)

    def solve(gram: Array, r: Array) -> Array:
        if symmetric:
            return Normal(gram, r, scale, ridge).solution
        normal = gram / scale[:, None] / scale + ridge * np.eye(len(scale))
        return np.asarray(np.linalg.solve(normal, r / scale) / scale)

    whole = solve(total, right)
    pulls = np.zeros(cross.shape) if kept is None else kept_pull(grams, kept)
    left = [
        solve(total - g + np.diag(pull), right - c + pull * whole)
        for g, c, pull in zip(grams, cross, pulls, strict=True)
    ]
    return whole, np.array(left)


def kept_pull(grams: Array, kept: NDArray[np.bool_]) -> Array:
    """Weights by which coefficients are drawn to those of all folds, (n_folds, n_coefficients).

    The weight is the information of all rows about each coefficient alone.

    Parameters
    ----------
    grams : ndarray of shape (n_folds, n_coefficients, n_coefficients)
        Left sides.
    kept : ndarray of shape (n_folds, n_coefficients) of bool
        Coefficients that are kept where each fold is left out.
    """
    return np.where(kept, np.diag(grams.sum(0)), 0.0)


def left_out_errors(grams: Array, ridge: float = 10 * RIDGE) -> Array:
    """Squared error of every fold under the solution without it.

    Parameters
    ----------
    grams : ndarray of shape (n_folds, p + 1, p + 1)
        Gram matrices of [columns | torque].
    ridge : float, default=1e-8
        As in :func:`solve_left_out`.

    Returns
    -------
    ndarray of shape (n_folds,)
    """
    _, left = solve_left_out(grams[:, :-1, :-1], grams[:, :-1, -1], ridge=ridge)
    b = np.column_stack([-left, np.ones(len(left))])
    return np.asarray(np.einsum("fa,fab,fb->f", b, grams, b))


def without_each(parts: Sequence[Array]) -> Iterator[Array]:
    """Stacks of all parts but one, each part left out in turn."""
    for k in range(len(parts)):
        yield np.vstack([*parts[:k], *parts[k + 1 :]])


def jackknife(left_out: Array) -> Array:
    """Standard errors from estimates that leave one fold out each.

    Parameters
    ----------
    left_out : ndarray of shape (n_folds, ...)
        Estimates without one fold each.

    Returns
    -------
    ndarray of shape (...)
        NaN with fewer than two folds.

    References
    ----------
    B. Efron, C. Stein (1981), The jackknife estimate of variance, Annals of Statistics 9(3),
    586-596.
    """
    if len(left_out) < 2:
        return np.full(np.shape(left_out)[1:], np.nan)
    return np.asarray(np.linalg.norm(jackknife_rows(left_out), axis=0))


def jackknife_rows(left_out: Array) -> Array:
    """Rows whose Gram matrix is the covariance by the jackknife, shape as given."""
    n = len(left_out)
    return np.asarray(np.sqrt((n - 1) / n) * (left_out - left_out.mean(0)))


def nearest_folds(
    signals: Signals,
    rows: NDArray[np.int64],
    trajectory: NDArray[np.int64],
    time: Array,
    fold: NDArray[np.int64],
) -> NDArray[np.int64]:
    """Fold of some samples: that of the averaged row of the trajectory nearest in time.

    Parameters
    ----------
    signals : Signals
        Motion.
    rows : ndarray of shape (n,) of int
        Which of its samples.
    trajectory, time, fold : ndarray of shape (n_averaged,)
        Of the averaged rows of a joint.

    Returns
    -------
    ndarray of shape (n,) of int
        0 for a trajectory without averaged rows, which is in no fold.
    """
    number, clock = signals.trajectory[rows], signals.clock[rows]
    found = np.zeros(len(rows), dtype=np.int64)
    for name in np.unique(number):
        own = np.flatnonzero(trajectory == name)
        if len(own):
            own = own[np.argsort(time[own], kind="stable")]
            middle = time[own]
            here = number == name
            nearest = np.searchsorted((middle[1:] + middle[:-1]) / 2, clock[here])
            found[here] = fold[own[nearest]]
    return found
