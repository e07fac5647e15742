# SPDX-License-Identifier: BSD-3-Clause
"""Weighted least squares for a payload, together with the robot that carries it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array
from skidyn.evidence import without_each
from skidyn.payload._runs import Runs, open_columns, triangle

#: Number of times that the noise of the joints is estimated and the fit repeated.
PASSES = 3


@dataclass(frozen=True)
class PayloadFit:
    """The fit of all runs, and those without a fold.

    Attributes
    ----------
    free : ndarray of shape (10, n_free)
        The payload's parameters by its fitted numbers, which are the first of the solution.
    designs : list of ndarray of shape (n_rows_j, n_columns)
        Columns of every joint.
    factors : list of ndarray
        Triangular factor of [columns | torque] of every fold, joints weighted by their noise.
    solution : ndarray of shape (n_columns,)
        Coefficients of the columns.
    """

    free: Array
    designs: list[Array]
    factors: list[Array]
    solution: Array

    @classmethod
    def of(cls, runs: Runs, com: Array | None) -> PayloadFit:
        """Fit of some runs; with a known centre of mass one number is mass and first moment."""
        free = np.eye(10)
        if com is not None:
            free = np.delete(free, [1, 2, 3], axis=1)
            free[1:4, 0] = com
        bodies = [body @ free for body in runs.body]
        designs = [np.hstack(pair) for pair in zip(bodies, runs.rest, strict=True)]
        noise = np.ones(len(designs))
        for _ in range(PASSES):
            factors = _fold_factors(designs, runs, noise)
            solution = solve_rows(np.vstack(factors))
            noise = _noise(designs, runs.target, solution)
        return cls(free, designs, _fold_factors(designs, runs, noise), solution)

    @property
    def width(self) -> int:
        """Number of columns of the payload."""
        return int(self.free.shape[1])

    @property
    def body(self) -> Array:
        """The payload's ten parameters."""
        return np.asarray(self.free @ self.solution[: self.width])

    @cached_property
    def whole(self) -> Array:
        """Triangular factor of all rows."""
        return triangle(np.vstack(self.factors))

    @cached_property
    def is_open(self) -> NDArray[np.bool_]:
        """Which of the ten parameters the motion does not determine."""
        hidden = open_columns(self.whole[:, :-1], range(self.width))
        return np.asarray(np.any(np.abs(self.free[:, hidden]) > 0, axis=1))

    @cached_property
    def left_out(self) -> Array:
        """The ten parameters without each fold, shape (n_folds, 10)."""
        left = np.array([solve_rows(rows) for rows in without_each(self.factors)])
        return np.asarray(left[:, : self.width] @ self.free.T)

    def expected(self, left_out: NDArray[np.int64]) -> list[Array]:
        """Torque of every joint, as the runs without some folds predict it."""
        kept = [rows for f, rows in enumerate(self.factors) if f not in left_out]
        others = solve_rows(np.vstack(kept))
        return [design @ others for design in self.designs]


def solve_rows(factor: Array) -> Array:
    """Least squares, with the smallest solution for dependent columns."""
    columns, target = factor[:, :-1], factor[:, -1]
    size = np.linalg.norm(columns, axis=0)
    size[size == 0] = 1.0
    return np.asarray(np.linalg.lstsq(columns / size, target, rcond=1e-9)[0] / size)


def _fold_factors(designs: list[Array], runs: Runs, noise: Array) -> list[Array]:
    """Triangular factor of [columns | torque] of every fold, joints weighted by their noise."""
    factors = []
    for f in range(runs.n_folds):
        parts = [
            np.column_stack([design, target])[fold == f] / s
            for design, target, fold, s in zip(designs, runs.target, runs.fold, noise, strict=True)
        ]
        factors.append(triangle(np.vstack(parts)))
    return factors


def _noise(designs: list[Array], targets: list[Array], solution: Array) -> Array:
    pairs = zip(designs, targets, strict=True)
    return np.array([np.sqrt(np.mean((y - a @ solution) ** 2)) + 1e-100 for a, y in pairs])
