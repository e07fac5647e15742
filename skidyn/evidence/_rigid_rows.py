# SPDX-License-Identifier: BSD-3-Clause
"""Averaged columns of the rigid body, and which of them the data determines."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
import scipy
from numpy.typing import NDArray

from skidyn._progress import tell
from skidyn._signals import Array
from skidyn.evidence._rows import RowsInTime
from skidyn.robots import Robot, with_whole_turns

if TYPE_CHECKING:
    from skidyn.evidence._problem import Problem

#: Samples whose regressor is computed at once.
CHUNK = 3072
#: Columns of the rigid body weaker than this (relative, after pivoting) are dependent on others.
RANK_TOLERANCE = 2e-6


def regressor_rows(problem: Problem, index: NDArray[np.int64] | None = None) -> list[Array]:
    """Averaged columns of the torque regressor, chunk by chunk; only the given ones if any."""
    assert problem.robot is not None
    robot = with_whole_turns(problem.robot)
    columns = tuple(range(10 * robot.n_bodies) if index is None else index.tolist())
    rows = [np.zeros((count, len(columns))) for count in problem.rows.counts]
    s, weights = problem.sampled(problem.rows.step)
    in_time = [RowsInTime.of(own) for own in weights]
    first = first_columns(robot, columns)
    motion = {"q": s.q, "dq": s.dq, "ddq": s.ddq}
    for chunk, regressor in robot._engine.iter_regressor_columns(motion, columns, 0, CHUNK):
        for j, block in enumerate(rows):
            here, shares = in_time[j].within(chunk)
            block[here, first[j] :] += shares @ regressor[j, first[j] :].T
        tell("Computing the rigid body", chunk.stop / len(s.q))
    return rows


@lru_cache(maxsize=64)
def first_columns(robot: Robot, columns: tuple[int, ...]) -> list[int]:
    """The first of some columns of the regressor that does not vanish, by joint.

    A joint moves none of the bodies before it.
    """
    used = robot._engine.program("torque_regressor", robot._engine.gravity_key()).outputs
    return [
        min((i for i, c in enumerate(columns) if (j, c) in used), default=len(columns))
        for j in range(robot.n_joints)
    ]


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
