# SPDX-License-Identifier: BSD-3-Clause
"""Averaged columns of the rigid body, and which of them the data determines."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import scipy
from numpy.typing import NDArray

from skidyn._progress import tell
from skidyn._signals import Array, joined
from skidyn.evidence._rows import RowsInTime
from skidyn.robots import Robot, with_whole_turns

if TYPE_CHECKING:
    from skidyn.evidence._problem import Problem

#: Samples whose regressor is computed at once.
CHUNK = 3072
#: Columns of the rigid body weaker than this (relative, after pivoting) are dependent on others.
RANK_TOLERANCE = 2e-6


def regressor_rows(problems: Sequence[Problem], index: NDArray[np.int64]) -> list[list[Array]]:
    """Averaged columns of the torque regressor of one robot, by problem and joint.

    The regressor is computed chunk by chunk; short recordings share one.
    """
    assert problems[0].robot is not None
    robot, columns = with_whole_turns(problems[0].robot), tuple(index.tolist())
    rows = [[np.zeros((n, len(columns))) for n in problem.rows.counts] for problem in problems]
    sampled = [problem.sampled(problem.rows.step) for problem in problems]
    in_time = [[RowsInTime.of(own) for own in weights] for _, weights in sampled]
    motion = {k: joined([getattr(s, k) for s, _ in sampled]) for k in ("q", "dq", "ddq")}
    starts = np.cumsum([0, *(s.n_samples for s, _ in sampled)]).tolist()
    first = first_columns(robot, columns)
    for chunk, regressor in robot._engine.iter_regressor_columns(motion, columns, 0, CHUNK):
        for k, samples, part in _in_chunk(chunk, starts):
            for j, block in enumerate(rows[k]):
                here, shares = in_time[k][j].within(samples)
                block[here, first[j] :] += shares @ regressor[j, first[j] :, part].T
        tell("Computing the rigid body", chunk.stop / starts[-1])
    return rows


def _in_chunk(chunk: slice, starts: Sequence[int]) -> Iterator[tuple[int, slice, slice]]:
    """Recordings with samples in a chunk, these samples, and their places in the chunk."""
    for k, (start, stop) in enumerate(pairwise(starts)):
        a, b = max(start, chunk.start), min(stop, chunk.stop)
        if a < b:
            yield k, slice(a - start, b - start), slice(a - chunk.start, b - chunk.start)


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
