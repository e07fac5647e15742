# SPDX-License-Identifier: BSD-3-Clause
"""Orthogonal matching pursuit, judged by the error of the held-out folds.

Leaving folds out needs only products of columns within each fold: the rows are read once at the
start, and once for every chosen column.

References
----------
Y. C. Pati, R. Rezaiifar, P. S. Krishnaprasad (1993), Orthogonal matching pursuit, Asilomar
Conference on Signals, Systems and Computers.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array


@dataclass(frozen=True)
class Products:
    """Products of columns and of a residual within each fold.

    Attributes
    ----------
    square : ndarray of shape (n_folds, n_columns)
        Of every column with itself.
    right : ndarray of shape (n_folds, n_columns)
        With the residual.
    energy : ndarray of shape (n_folds,)
        Of the residual with itself.
    along : callable
        Products of one column, by its number, with all: (n_folds, n_columns).
    """

    square: Array
    right: Array
    energy: Array
    along: Callable[[int], Array]

    @classmethod
    def of_columns(cls, columns: Array, residual: Array, fold: NDArray[np.int64]) -> Products:
        """Products of given columns.

        Parameters
        ----------
        columns : ndarray of shape (n_rows, n_columns)
            Candidates.
        residual : ndarray of shape (n_rows,)
            Residual to be explained.
        fold : ndarray of shape (n_rows,)
            Number of the fold of every row.

        Returns
        -------
        Products
            Products of columns of unit size.
        """
        size = np.sqrt(np.einsum("ij,ij->j", columns, columns))
        columns = columns / np.where(size > 0, size, 1.0)
        parts = [(columns[fold == f], residual[fold == f]) for f in np.unique(fold)]
        return cls(
            np.array([np.einsum("ij,ij->j", a, a) for a, _ in parts]),
            np.array([a.T @ y for a, y in parts]),
            np.array([y @ y for _, y in parts]),
            lambda k: np.array([a[:, k] @ a for a, _ in parts]),
        )

    def errors_with_each(self, chosen: Sequence[int], with_chosen: Sequence[Array]) -> Array:
        """Held-out squared error with each column added to the chosen ones, (n_columns,)."""
        n_folds, n_columns = self.square.shape
        chosen = list(chosen)
        cross = np.zeros((n_folds, len(chosen), n_columns))
        for k, block in enumerate(with_chosen):
            cross[:, k] = block
        errors = np.zeros(n_columns)
        for f in range(n_folds):
            # Eliminate the chosen columns from the others and from the residual of all other folds.
            mixed = cross.sum(0) - cross[f]
            square, right = self.square.sum(0) - self.square[f], self.right.sum(0)
            right = right - self.right[f]
            inverse = np.linalg.pinv(mixed[:, chosen], rcond=1e-12, hermitian=True)
            mimic, base = inverse @ mixed, inverse @ right[chosen]
            size = square - np.einsum("kc,kc->c", mimic, mixed)
            new = size > 1e-9 * np.maximum(square, 1e-300)
            gain = np.where(new, (right - right[chosen] @ mimic) / np.where(new, size, 1.0), 0.0)
            # The error of the fold itself, expanded.
            own, here = cross[f], cross[f][:, chosen]
            level = self.energy[f] - 2 * base @ self.right[f, chosen] + base @ here @ base
            slope = self.right[f] - self.right[f, chosen] @ mimic - base @ own
            slope += (here @ base) @ mimic
            bend = self.square[f] - 2 * np.einsum("kc,kc->c", mimic, own)
            bend += np.einsum("kc,kc->c", mimic, here @ mimic)
            errors += level - 2 * gain * slope + gain**2 * bend
        return errors


def pursue(
    products: Products,
    *,
    worth: float,
    longest: int,
    admissible: Callable[[Sequence[int]], NDArray[np.bool_]] | None = None,
) -> tuple[list[int], float]:
    """Choose columns one by one, each time the one that reduces the held-out error most.

    Parameters
    ----------
    products : Products
        Products of the columns and of the residual to be explained.
    worth : float
        Squared error that a further column must remove.
    longest : int
        Most columns.
    admissible : callable, optional
        Function that returns the columns that may be added to the chosen ones; all by default.

    Returns
    -------
    chosen : list of int
    reached : float
        Held-out squared error with them.
    """
    chosen: list[int] = []
    with_chosen: list[Array] = []
    reached = float(products.energy.sum())
    while len(chosen) < longest:
        errors = products.errors_with_each(chosen, with_chosen)
        if admissible is not None:
            errors[~admissible(chosen)] = np.inf
        best = int(np.argmin(errors))
        if reached - errors[best] < worth:
            break
        chosen.append(best)
        with_chosen.append(products.along(best))
        reached = float(errors[best])
    return chosen, reached
