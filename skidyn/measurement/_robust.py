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
from functools import cached_property
from itertools import product
from math import lgamma

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from skidyn._signals import Array

#: Degrees of freedom of the residuals, and rounds of the fit.
FREEDOM, ROUNDS = 4.0, 5
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
        weight = (FREEDOM + 1) / (FREEDOM + (residual / scale) ** 2)
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
    a = columns * weight[:, :, None]
    size = np.sqrt(np.sum(a**2, axis=1))
    size[size == 0] = 1.0
    a = a / size[:, None]
    b = a - weight[:, :, None] * (a.sum(1) / total[:, None])[:, None]
    z = weight * (y - np.sum(weight * y, axis=1, keepdims=True) / total[:, None])
    gram = b.transpose(0, 2, 1) @ b
    p = gram.shape[1]
    gram += (1e-9 * np.trace(gram, axis1=1, axis2=2) / p + 1e-300)[:, None, None] * np.eye(p)
    coefficients = _not_negative(gram, np.matmul(z[:, None], b)[:, 0])
    residual = z - np.matmul(b, coefficients[:, :, None])[:, :, 0]
    scale = np.sqrt(np.sum(residual**2, axis=1) / total) + 1e-12
    return [
        RobustFit(c, float(s), r[w], student(r[w], float(s)))
        for c, s, r, w in zip(coefficients / size, scale, residual, use, strict=True)
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
    p = gram.shape[1]
    sets = np.array(list(product((0.0, 1.0), repeat=p)))  # (2**p, p)
    left_out = np.eye(p) * (1 - sets)[:, None, :]
    solved = np.linalg.solve(
        gram[:, None] * (sets[:, :, None] * sets[:, None]) + left_out,
        (right[:, None] * sets)[..., None],
    )[..., 0]
    drop = np.where((solved >= 0).all(2), np.sum(solved * right[:, None], axis=2), -np.inf)
    return np.asarray(solved[np.arange(len(gram)), np.argmax(drop, axis=1)])


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
    scaled = [d / size[place] for d, place in zip(designs, places, strict=True)]
    into = [np.ix_(place, place) for place in places]
    y, counts = np.concatenate(targets), np.array([len(target) for target in targets])
    joint, starts = np.repeat(np.arange(len(counts)), counts), np.cumsum(counts) - counts
    parts = [slice(start, start + n) for start, n in zip(starts.tolist(), counts, strict=True)]
    scales = np.array([float(np.std(target)) for target in targets]) + 1e-12
    weight, residual, coefficients = np.ones(len(y)), y, np.zeros(len(size))
    for _ in range(ROUNDS + 2):
        gram = 1e-9 * np.eye(len(size)) * float(weight.sum())
        cross = np.zeros(len(size))
        root = np.sqrt(weight) / scales[joint]
        right = root * y
        for d, place, square, rows in zip(scaled, places, into, parts, strict=True):
            weighted = d * root[rows, None]
            gram[square] += weighted.T @ weighted  # symmetric: half the work
            cross[place] += weighted.T @ right[rows]
        diagonal = np.sqrt(np.diag(gram))
        gram = gram / diagonal[:, None] / diagonal + 1e-10 * np.eye(len(size))
        coefficients = cho_solve(cho_factor(gram), cross / diagonal) / diagonal
        fitted = [d @ coefficients[place] for d, place in zip(scaled, places, strict=True)]
        residual = y - np.concatenate(fitted)
        scales = np.sqrt(np.add.reduceat(weight * residual**2, starts) / counts) + 1e-12
        weight = (FREEDOM + 1) / (FREEDOM + (residual / scales[joint]) ** 2)
    return [
        RobustFit(coefficients[place] / size[place], s, residual[rows], student(residual[rows], s))
        for place, rows, s in zip(places, parts, scales.tolist(), strict=True)
    ]


def student(residual: Array, scale: float) -> float:
    """Log-likelihood of residuals under Student's t."""
    constant = lgamma((FREEDOM + 1) / 2) - lgamma(FREEDOM / 2) - np.log(FREEDOM * np.pi) / 2
    spread = np.log1p((residual / scale) ** 2 / FREEDOM)
    return float(len(residual) * (constant - np.log(scale)) - (FREEDOM + 1) / 2 * spread.sum())


def robust_likelihood(residual: Array) -> float:
    """Log-likelihood of residuals at approximately the best scale."""
    scale = float(np.std(residual)) + 1e-12
    for _ in range(ROUNDS):
        weight = (FREEDOM + 1) / (FREEDOM + (residual / scale) ** 2)
        scale = float(np.sqrt(np.mean(weight * residual**2))) + 1e-12
    return student(residual, scale)


def _inflation(residual: Array) -> float:
    """Variance inflation of a mean of rows, from the correlation of neighbouring rows."""
    if len(residual) < FEWEST:
        return 1.0
    r = residual - _median(residual)
    far = 3 * (1.4826 * _median(np.abs(r)) + 1e-300)
    r = np.clip(r, -far, far)
    alike = float(r[1:] @ r[:-1] / (r @ r)) if r @ r > 0 else 0.0
    alike = float(np.clip(alike, 0.0, MOST_ALIKE))
    return (1 + alike) / (1 - alike)


def _median(values: Array) -> float:
    """The median; NumPy's spends most of its time on looking for values that are not finite."""
    half = len(values) // 2
    if len(values) % 2:
        return float(np.partition(values, half)[half])
    parts = np.partition(values, (half - 1, half))
    return 0.5 * float(parts[half - 1] + parts[half])
