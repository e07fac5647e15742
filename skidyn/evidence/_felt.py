# SPDX-License-Identifier: BSD-3-Clause
"""Columns of a model that act on each joint, without those that vanish on the joint's rows.

The torque of a joint depends on the bodies beyond it and on its own effects. In a chain of many
joints these are a small part of the model's columns; the others are zeros, which products can omit.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array

if TYPE_CHECKING:
    from skidyn.evidence._problem import Problem


@dataclass(frozen=True)
class Felt:
    """Columns of a model that act on a joint.

    Attributes
    ----------
    places : ndarray of shape (k,) of int
        Indices of these columns among the model's, ascending.
    rows : ndarray of shape (n_rows_j, k)
        Their averaged rows.
    """

    places: NDArray[np.int64]
    rows: Array

    def with_columns(self, start: int, block: Array) -> Felt:
        """Add further columns of the model, from a given index on.

        Parameters
        ----------
        start : int
            Index of the first one.
        block : ndarray of shape (n_rows_j, k)
            Their rows.
        """
        places = np.append(self.places, start + np.arange(block.shape[1]))
        return Felt(places, np.hstack([self.rows, block]))


def felt_columns(
    problem: Problem, blocks: Iterable[dict[int, Array]], sigma: Array | None = None
) -> tuple[list[Felt], int]:
    """Columns of the rigid body and of some blocks that act on each joint, side by side.

    Parameters
    ----------
    problem : Problem
        Rows.
    blocks : iterable of dict of int to ndarray of shape (n_rows_j, k)
        Columns beside the rigid body, per joint that they reach.
    sigma : ndarray of shape (n_joints,), optional
        Noise of one row of every joint, by which its rows are divided.

    Returns
    -------
    felt : list of Felt
        By joint.
    width : int
        Columns of the whole model.
    """
    start = len(problem.rigid_index)
    columns = [[rows] for rows in problem.rigid_rows]
    places = [[np.arange(rows.shape[1])] for rows in problem.rigid_rows]
    for j, rows in enumerate(problem.rigid_rows):
        moved = np.flatnonzero(rows.any(axis=0))
        if len(moved) < rows.shape[1]:
            columns[j], places[j] = [rows[:, moved]], [moved]
    for block in blocks:
        width = next(iter(block.values())).shape[1]
        for j, rows in block.items():
            columns[j].append(rows)
            places[j].append(np.arange(start, start + width))
        start += width
    scale = np.ones(len(columns)) if sigma is None else sigma
    felt = [
        Felt(np.concatenate(p), np.hstack(c) / s)
        for p, c, s in zip(places, columns, scale, strict=True)
    ]
    return felt, start


def gram_of(felt: Sequence[Felt], width: int) -> Array:
    """Products of all columns of a model, summed over the joints, shape (width, width)."""
    gram = np.zeros((width, width))
    for own in felt:
        gram[own.places[:, None], own.places] += own.rows.T @ own.rows
    return gram


def products_with(felt: Sequence[Felt], blocks: dict[int, Array], width: int) -> Array:
    """Products of a model's columns with others, summed over the joints on which these act.

    Parameters
    ----------
    felt : sequence of Felt
        By joint.
    blocks : dict of int to ndarray of shape (n_rows_j, k) or (n_rows_j,)
        By joint.
    width : int
        Columns of the model.

    Returns
    -------
    ndarray of shape (width, k) or (width,)
    """
    first = next(iter(blocks.values()))
    cross = np.zeros((width, *first.shape[1:]))
    for j, block in blocks.items():
        cross[felt[j].places] += felt[j].rows.T @ block
    return cross
