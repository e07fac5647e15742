# SPDX-License-Identifier: BSD-3-Clause
"""Robust fits of linear models, whose residuals follow Student's t distribution.

References
----------
K. L. Lange, R. J. A. Little, J. M. G. Taylor (1989), Robust statistical modeling using the t
distribution, J. American Statistical Association 84(408), 881-896.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from itertools import product
from math import lgamma

import numpy as np
import scipy
from numpy.typing import NDArray

from skidyn._signals import Array, scatter

#: Degrees of freedom of the residuals, and rounds of the fit.
FREEDOM, ROUNDS = 4.0, 5
#: Logarithm of their density at zero, with a scale of one.
DENSITY = lgamma((FREEDOM + 1) / 2) - lgamma(FREEDOM / 2) - np.log(FREEDOM * np.pi) / 2
#: Largest correlation of neighbouring rows: the residual of slightly wrong bodies is correlated
#: over seconds, and would make any log too short.
MOST_ALIKE = 0.875
#: Fewest rows of a joint for a fit.
FEWEST = 25


@dataclass(frozen=True)
class RobustFit:
    """Coefficients, scale, residual and log-likelihood of a fit with Student's t residuals."""

    coefficients: Array
    scale: float
    residual: Array
    likelihood: float

    @cached_property
    def inflation(self) -> float:
        """Overestimation of the likelihood due to correlated neighbouring rows."""
        return _inflation(self.residual)


def fit_admissible(columns: Array, y: Array, rounds: int = ROUNDS) -> RobustFit:
    """Robust fit with a free offset and coefficients that are not negative."""
    size = np.linalg.norm(columns, axis=0)
    size[size == 0] = 1.0
    a = columns / size
    weight = np.ones(len(y))
    p = a.shape[1]
    coefficients, residual, scale = np.zeros(p), y, 1.0
    for _ in range(rounds):
        total = weight.sum()
        b, z = a - weight @ a / total, y - weight @ y / total
        weighted = weight[:, None] * b
        gram = weighted.T @ b
        gram[np.diag_indices(p)] += 1e-9 * np.trace(gram) / p + 1e-300
        coefficients = _not_negative(gram[None], (weighted.T @ z)[None])[0]
        residual = z - b @ coefficients
        scale = float(np.sqrt(np.mean(weight * residual**2))) + 1e-12
        weight = student_weights(residual, scale)
    return RobustFit(coefficients / size, scale, residual, student(residual, scale))


def fit_at_once(columns: Array, y: Array, use: NDArray[np.bool_]) -> list[RobustFit]:
    """First round of :func:`fit_admissible` for many joints, four columns each.

    Parameters
    ----------
    columns : ndarray of shape (n_fits, n_rows, 4)
    y : ndarray of shape (n_fits, n_rows), N m or N
    use : ndarray of shape (n_fits, n_rows) of bool
        Rows that count.
    """
    weight = use.astype(float)
    total = weight.sum(1)
    a = np.ascontiguousarray(columns.transpose(0, 2, 1)) * weight[:, None]
    size = np.sqrt(np.sum(a**2, axis=2))
    size[size == 0] = 1.0
    a = a / size[:, :, None]
    b = a - weight[:, None] * (a.sum(2) / total[:, None])[:, :, None]
    z = weight * (y - np.sum(weight * y, axis=1, keepdims=True) / total[:, None])
    gram = b @ b.transpose(0, 2, 1)
    p = gram.shape[1]
    gram += (1e-9 * np.trace(gram, axis1=1, axis2=2) / p + 1e-300)[:, None, None] * np.eye(p)
    coefficients = _not_negative(gram, np.matmul(b, z[:, :, None])[:, :, 0])
    residual = z - np.matmul(coefficients[:, None], b)[:, 0]
    scale = np.sqrt(np.sum(residual**2, axis=1) / total) + 1e-12
    parts = [r[w] for r, w in zip(residual, use, strict=True)]
    return [
        RobustFit(c, s, r, student(r, s))
        for c, s, r in zip(coefficients / size, scale.tolist(), parts, strict=True)
    ]


def _not_negative(gram: Array, right: Array) -> Array:
    """Least squares without negative coefficients: the best of all admissible sets of columns.

    Parameters
    ----------
    gram : ndarray of shape (n_fits, p, p)
    right : ndarray of shape (n_fits, p)

    Returns
    -------
    ndarray of shape (n_fits, p)
    """
    sets, both, left_out = _sets(gram.shape[1])
    solved = np.linalg.solve(
        gram[:, None] * both + left_out,
        (right[:, None] * sets)[..., None],
    )[..., 0]
    drop = np.where((solved >= 0).all(2), np.sum(solved * right[:, None], axis=2), -np.inf)
    return np.asarray(solved[np.arange(len(gram)), np.argmax(drop, axis=1)])


@cache
def _sets(p: int) -> tuple[Array, Array, Array]:
    """All sets of p columns, pairs of columns in a set, and a diagonal for the others."""
    sets = np.array(list(product((0.0, 1.0), repeat=p)))
    return sets, sets[:, :, None] * sets[:, None], np.eye(p) * (1 - sets)[:, None, :]


def fit_together(
    designs: Sequence[Array], places: Sequence[NDArray[np.int64]], targets: Sequence[Array]
) -> list[RobustFit]:
    """Robust fit of several joints with common coefficients.

    Parameters
    ----------
    designs : sequence of ndarray of shape (n_rows_k, n_columns_k)
        Columns of each joint that do not vanish.
    places : sequence of ndarray of shape (n_columns_k,)
        Their places among all coefficients.
    targets : sequence of ndarray of shape (n_rows_k,), N m or N
    """
    if not designs:
        return []
    size = np.zeros(1 + max(int(place.max()) for place in places))
    for d, place in zip(designs, places, strict=True):
        size[place] += (d**2).sum(axis=0)
    size = np.sqrt(size)
    size[size == 0] = 1.0
    # rows of a joint in the direction of memory: every step below goes along it
    scaled = [
        np.divide(d.T, size[p][:, None], order="C") for d, p in zip(designs, places, strict=True)
    ]
    corners = [np.ix_(place, place) for place in places]
    scales = [float(np.std(y)) + 1e-12 for y in targets]
    weights = [np.ones(len(y)) for y in targets]
    residuals = list(targets)
    coefficients = np.zeros(len(size))
    for _ in range(ROUNDS + 2):
        gram = np.zeros((len(size), len(size)))
        cross = np.zeros(len(size))
        for d, corner, place, y, s, w in zip(
            scaled, corners, places, targets, scales, weights, strict=True
        ):
            root = np.sqrt(w) / s
            weighted = d * root
            gram[corner] += weighted @ weighted.T  # symmetric: half the work
            cross[place] += weighted @ (root * y)
        diagonal = np.sqrt(np.diag(gram))
        diagonal[diagonal == 0] = 1.0
        # relative: an absolute one would outweigh the torques of a heavy robot
        gram = gram / diagonal[:, None] / diagonal + 1e-10 * np.eye(len(size))
        factor = scipy.linalg.cho_factor(gram)
        coefficients = scipy.linalg.cho_solve(factor, cross / diagonal) / diagonal
        residuals = [
            y - coefficients[place] @ d for d, place, y in zip(scaled, places, targets, strict=True)
        ]
        scales = [
            float(np.sqrt(np.mean(w * r**2))) + 1e-12
            for w, r in zip(weights, residuals, strict=True)
        ]
        weights = [student_weights(r, s) for r, s in zip(residuals, scales, strict=True)]
    return [
        RobustFit(coefficients[place] / size[place], s, r, student(r, s))
        for place, r, s in zip(places, residuals, scales, strict=True)
    ]


def student_weights(residual: Array, scale: float) -> Array:
    """Weights of residuals under Student's t, close to one for those within their scale."""
    return (FREEDOM + 1) / (FREEDOM + (residual / scale) ** 2)


def student(residual: Array, scale: float) -> float:
    """Log-likelihood of residuals under Student's t."""
    spread = np.log1p((residual / scale) ** 2 / FREEDOM)
    return float(len(residual) * (DENSITY - np.log(scale)) - (FREEDOM + 1) / 2 * spread.sum())


def gains_of(before: Sequence[RobustFit], after: Sequence[RobustFit]) -> list[float]:
    """Log-likelihood that fits of the same rows gain over others, by joint.

    Parameters
    ----------
    before, after : sequence of RobustFit
        Fits of the same joints.
    """
    return [
        (there.likelihood - here.likelihood) / there.inflation
        for here, there in zip(before, after, strict=True)
    ]


def robust_weights(fit: RobustFit) -> Array:
    """Weight of every row of a robust fit, over the square of its scale."""
    return student_weights(fit.residual, fit.scale) / fit.scale**2


def robust_likelihood(residual: Array) -> float:
    """Log-likelihood of residuals at approximately the best scale."""
    scale = float(np.std(residual)) + 1e-12
    for _ in range(ROUNDS):
        weight = student_weights(residual, scale)
        scale = float(np.sqrt(np.mean(weight * residual**2))) + 1e-12
    return student(residual, scale)


def _inflation(residual: Array) -> float:
    """Variance inflation of a mean of rows, from the correlation of neighbouring rows."""
    if len(residual) < FEWEST:
        return 1.0
    r = residual - np.median(residual)
    r = np.clip(r, *(np.array([-3, 3]) * (scatter(r) + 1e-300)))
    alike = float(r[1:] @ r[:-1] / (r @ r)) if r @ r > 0 else 0.0
    alike = float(np.clip(alike, 0.0, MOST_ALIKE))
    return (1 + alike) / (1 - alike)
