# SPDX-License-Identifier: BSD-3-Clause
"""Weighted least squares of averaged rows, and of a joint by itself."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from skidyn._signals import Array
from skidyn.effects import TermSum
from skidyn.evidence._folds import RIDGE, Normal

#: Combinations of columns smaller than the root of this, relative to their parts, may be
#: undetermined.
LARGEST_RIDGE = 1e-6
#: Directions weaker than this, relative to the strongest one, are due to rounding.
RANK = 1e-7
#: Residual, as a share of the torque, up to which it consists of rounding errors.
EXACT = 1e-10
#: Rows for each direction of the columns of a joint from which its residual determines its noise.
ROWS_A_DIRECTION = 2.0


@dataclass(frozen=True)
class Fit:
    """A weighted least-squares fit of the model with some terms.

    Attributes
    ----------
    terms : TermSum
        Terms beside the rigid body, in the order of the coefficients.
    coefficients : ndarray of shape (n_coefficients,)
        First the rigid body's independent parameters, then those of the terms.
    residual : list of ndarray of shape (n_rows_j,)
        Residual of the averaged rows of every joint, N m or N.
    sigma : ndarray of shape (n_joints,)
        Noise of one row of every joint, by which the rows were weighted.
    rounding : ndarray of shape (n_joints,)
        Root mean square of the rounding errors of a row.
    """

    terms: TermSum
    coefficients: Array
    residual: list[Array]
    sigma: Array
    rounding: Array

    @property
    def noise(self) -> Array:
        """Root mean square of the residual rows of every joint, at least that of rounding errors.

        Rows of a joint that is explained exactly would otherwise outweigh those of all others.
        """
        own = [np.sqrt(np.mean(r**2)) + 1e-100 if len(r) else 1.0 for r in self.residual]
        return np.maximum(own, self.rounding)


@dataclass(frozen=True)
class FittedAlone:
    """Residual of a joint fitted by itself, so that errors of other joints have no influence.

    Attributes
    ----------
    left, whole : float
        Squared residual and squared torque.
    rank : int
        Number of directions of the columns that the rows determine.
    """

    left: float
    whole: float
    rank: int

    @classmethod
    def of(cls, design: Array, target: Array) -> FittedAlone:
        """Fit rows, or their triangular factor."""
        if not len(target):
            return cls(0.0, 0.0, 0)
        size = np.linalg.norm(design, axis=0)
        used = size > 0
        scaled = design[:, used] / size[used]
        solution, _, rank, _ = np.linalg.lstsq(scaled, target, rcond=RANK)
        left, whole = np.sum((target - scaled @ solution) ** 2), np.sum(target**2)
        return cls(float(left), float(whole), int(rank))

    def noise(self, count: float, rows: float | None = None) -> float:
        """Root of the squared residual divided by ``count``.

        ``rows``, by default the same, is the number of rows that were fitted. With too few rows to
        determine the noise, the torque itself is its bound; without any, the noise is 1.
        """
        if not count:
            return 1.0
        rows = count if rows is None else rows
        left = self.left
        if rows <= ROWS_A_DIRECTION * self.rank:
            left = self.whole  # of a joint that hardly slides: a few rows are fitted by anything
        return float(np.sqrt(max(left, RANK**2 * self.whole) / count)) or 1.0


def own_noise(design: Array, target: Array, count: float, rows: float | None = None) -> float:
    """Noise of a joint fitted alone (:meth:`FittedAlone.noise`)."""
    return FittedAlone.of(design, target).noise(count, rows)


def weighted_least_squares(design: list[Array], target: list[Array], sigma: Array) -> Array:
    """Coefficients of least squares with joints weighted by their noise."""
    return fit_weighted(TermSum(), design, target, sigma).coefficients


def fit_weighted(terms: TermSum, design: list[Array], target: list[Array], sigma: Array) -> Fit:
    """Least squares of all joints with rows weighted by the noise of their joint."""
    gram, right, whole = np.zeros((design[0].shape[1],) * 2), np.zeros(design[0].shape[1]), 0.0
    for block, y, s in zip(design, target, sigma, strict=True):  # not stacked: they may be large
        gram += block.T @ block / s**2
        right += block.T @ y / s**2
        whole += float(y @ y / s**2)
    size = np.sqrt(np.diag(gram))
    size[size == 0] = 1.0
    # No single column explains more than the whole torque. Undetermined quantities, such as the
    # share of a rotor in an inertia, are set by the smallest corrections, so that the loads of the
    # joints, which depend on them, stay realistic.
    normal = Normal(gram, right, size, max(RIDGE, 1 / max(whole, 1 / LARGEST_RIDGE)))
    # One refinement step recovers the accuracy lost by forming the Gram matrix.
    rough, parts = normal.solution, zip(design, target, sigma, strict=True)
    left = sum(block.T @ (y - block @ rough) / s**2 for block, y, s in parts)
    coefficients = rough + normal.solve(np.asarray(left))
    residual = [t - block @ coefficients for block, t in zip(design, target, strict=True)]
    rounding = [EXACT * np.sqrt(np.mean(t**2)) if len(t) else 0.0 for t in target]
    noise = np.asarray(sigma, dtype=float)
    return Fit(terms, coefficients, residual, noise, np.array(rounding))
