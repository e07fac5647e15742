# SPDX-License-Identifier: BSD-3-Clause
"""Averaged columns of the rigid body, and which of them the data determines."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import scipy
from numpy.typing import NDArray

from skidyn._progress import tell
from skidyn._signals import Array
from skidyn.evidence._rows import RowsInTime
from skidyn.robots import with_whole_turns

if TYPE_CHECKING:
    from skidyn.evidence._problem import Problem

#: Columns of the rigid body weaker than this (relative, after pivoting) are dependent on others.
RANK_TOLERANCE = 2e-6


def regressor_rows(problem: Problem, index: NDArray[np.int64] | None = None) -> list[Array]:
    """Averaged columns of the torque regressor, chunk by chunk; only the given ones if any."""
    assert problem.robot is not None
    robot = with_whole_turns(problem.robot)
    index = np.arange(10 * robot.n_bodies) if index is None else index
    rows = [np.zeros((count, len(index))) for count in problem.rows.counts]
    s, weights = problem.sampled(problem.rows.step)
    in_time = [RowsInTime.of(own) for own in weights]
    for chunk, regressor in robot.iter_torque_regressor(s.q, s.dq, s.ddq):
        for j, block in enumerate(rows):
            here, shares = in_time[j].within(chunk)
            block[here] += shares @ regressor[j][index].T
        tell("Computing the rigid body", chunk.stop / len(s.q))
    return rows


def independent_columns(rows: Array) -> NDArray[np.int64]:
    """Columns of base parameters that the data determines, by QR with pivoting; sorted.

    The triangular factor of the rows gives the same answer as the rows themselves.
    """
    size = np.linalg.norm(rows, axis=0)
    moved = np.flatnonzero(size > 1e-9 * max(size.max(initial=0.0), 1e-300))
    if not len(moved):
        return moved
    scaled = np.empty((len(rows), len(moved)), order="F")  # in the order of LAPACK: no copy
    for k, column in enumerate(moved):
        np.divide(rows[:, column], size[column], out=scaled[:, k])
    triangle, pivots = scipy.linalg.qr(scaled, overwrite_a=True, mode="r", pivoting=True)
    diagonal = np.abs(np.diag(triangle))
    rank = int(np.sum(diagonal > RANK_TOLERANCE * diagonal[0]))
    return np.sort(moved[pivots[:rank]])
