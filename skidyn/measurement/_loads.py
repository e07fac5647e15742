# SPDX-License-Identifier: BSD-3-Clause
"""Columns of a load that differs from recording to recording, as of a workpiece."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array

#: Parameters of the last body of which a load consists, its mass and first moments, from the end.
LOAD = np.arange(-10, -6)
#: Most recordings that may carry loads of their own.
MOST_RUNS = 16


def n_loads(number: NDArray[np.int64]) -> int:
    """Number of coefficients of loads of single recordings; none in one, or in many recordings.

    Parameters
    ----------
    number : ndarray of shape (n_rows,)
        Recording of every row.
    """
    n = len(np.unique(number))
    return len(LOAD) * (n - 1) if 1 < n <= MOST_RUNS else 0


def by_recording(columns: Array, number: NDArray[np.int64]) -> Array:
    """Columns of every recording but the first, of a load that differs between them.

    Parameters
    ----------
    columns : ndarray of shape (n_rows, n_columns)
        Columns of the mass and first moments of the last body.
    number : ndarray of shape (n_rows,)
        Recording of every row.

    Returns
    -------
    ndarray of shape (n_rows, n_columns * (n_recordings - 1))
        No columns for a single recording, or for more than may carry loads of their own.
    """
    runs = np.unique(number) if n_loads(number) else number[:1]
    rows = [(number == run)[:, None] for run in runs[1:]]
    return np.hstack([columns * own for own in rows]) if rows else columns[:, :0]


def span(columns: Array) -> Array:
    """Orthonormal columns that span the same, by the small matrix of their products.

    Parameters
    ----------
    columns : ndarray of shape (n_rows, n_columns)
    """
    size = np.linalg.norm(columns, axis=0)
    columns = columns[:, size > 0] / size[size > 0]
    values, vectors = np.linalg.eigh(columns.T @ columns)
    kept = values > 1e-8 * values[-1]
    return np.asarray(columns @ (vectors[:, kept] / np.sqrt(values[kept])))
