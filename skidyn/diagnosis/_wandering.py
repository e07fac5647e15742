# SPDX-License-Identifier: BSD-3-Clause
"""Torques that wander slowly in time: the zero of a sensor, a temperature that is not logged.

No logged signal predicts such a torque, but its own values before and after do, at distances over
which the motion reverses: what depends on the motion has the opposite sign there as often.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from skidyn._signals import Array
from skidyn._text import joints_told, listed
from skidyn.diagnosis._findings import Finding
from skidyn.diagnosis._hypothesis import UNKNOWN
from skidyn.diagnosis._rule import WANDERS
from skidyn.evidence import Problem

#: Distances, in mean times between reversals, between which rows before and after predict a row.
NEAREST, FARTHEST = 0.5, 1.5
#: Share of the largest speed above which a joint moves.
MOVES = 0.1
#: Rows on each side, and predicted rows of a joint, at least.
FEWEST_BESIDE, FEWEST = 3, 40


def find_wandering(
    problem: Problem, residual: Sequence[Array], joints: Sequence[int]
) -> dict[int, tuple[float, float]]:
    """Joints whose residual wanders slowly.

    Parameters
    ----------
    problem : Problem
        Rows.
    residual : sequence of ndarray of shape (n_rows_j,)
        Residual rows of every joint of the completed model, N m or N.
    joints : sequence of int
        Joints, from 0, that are judged.

    Returns
    -------
    dict of int to (float, float)
        Share of the squared residual that rows at other times predict, and least distance of these,
        s, by joint.
    """
    apart = _between_reversals(problem)
    found = {}
    for j in joints:
        trajectory, time = problem.rows.trajectory[j], problem.rows.time[j]
        before, after = 0.0, 0.0
        count = 0
        for name in np.unique(trajectory):
            own = trajectory == name
            predicted = _from_others(time[own], residual[j][own], apart)
            known = np.isfinite(predicted)
            y = residual[j][own][known]
            before += float(y @ y)
            after += float(np.sum((y - predicted[known]) ** 2))
            count += int(known.sum())
        if count >= FEWEST and before > 0 and 1 - after / before > WANDERS:
            found[j] = (1 - after / before, NEAREST * apart)
    return found


def _between_reversals(problem: Problem) -> float:
    """Mean time between reversals of the joint that reverses least often, s."""
    signals = problem.signals
    duration = sum(float(np.ptp(signals.clock[rows])) for rows in signals.segments)
    longest = 0.0
    for j in np.flatnonzero(problem.rows.counts):
        dq, turns = signals.dq[:, j], 0
        moves = np.abs(dq) > MOVES * np.abs(dq).max()
        for rows in signals.segments:
            sign = np.sign(dq[rows][moves[rows]])
            turns += int(np.sum(sign[1:] != sign[:-1]))
        longest = max(longest, duration / max(1, turns))
    return longest


def _from_others(time: Array, values: Array, apart: float) -> Array:
    """Line through the values before and after each time; NaN where too few are known."""
    order = np.argsort(time)
    t = time[order] - time.mean()
    moments = np.column_stack([np.ones_like(t), t, t**2, values[order], t * values[order]])
    # of all rows before each one, so that the memory grows with the rows and not their square
    before = np.vstack([np.zeros(moments.shape[1]), np.cumsum(moments, axis=0)])

    def between(low: float, high: float) -> Array:
        """Sums over the rows between two distances from each one."""
        first = np.searchsorted(t, t + low * apart, side="right")
        last = np.searchsorted(t, t + high * apart, side="left")
        return np.asarray(before[np.maximum(first, last)] - before[first])

    sides = between(-FARTHEST, -NEAREST), between(NEAREST, FARTHEST)
    fewest = np.minimum(sides[0][:, 0], sides[1][:, 0])
    count, *sums = np.add(*sides).T
    mean_t, square, level, product = (total / np.maximum(count, 1.0) for total in sums)
    spread = np.maximum(square - mean_t**2, np.finfo(float).tiny)
    predicted = level + (product - mean_t * level) / spread * (t - mean_t)
    found: Array = np.empty(len(t))
    found[order] = np.where(fewest >= FEWEST_BESIDE, predicted, np.nan)
    return found


def wandering_torque(found: dict[int, tuple[float, float]]) -> Finding:
    """A slow torque as a finding; no model predicts it.

    Parameters
    ----------
    found : dict
        Result of :func:`find_wandering`.
    """
    joints = tuple(j + 1 for j in found)
    shares = listed([f"{share:.0%}" for share, _ in found.values()])
    distance = max(apart for _, apart in found.values())
    sentence = (
        f"A torque that wanders slowly in time acts on {joints_told(joints)}: its own values at "
        f"least {distance:.2g} s before and after predict {shares} of the remaining squared error "
        "there, and no logged signal does. The zero of the sensor may drift, or the torque may "
        "follow a signal that is not logged, such as a temperature."
    )
    return Finding(
        UNKNOWN,
        "Torque that wanders in time",
        joints,
        {},
        ("time",),
        float(np.mean([share for share, _ in found.values()])),
        0.0,
        (),
        "the same motion again, and rest at the same pose, where only time changes the torque",
        sentence,
        "diagnosis.comparison_after.residual",
        (),
    )
