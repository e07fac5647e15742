# SPDX-License-Identifier: BSD-3-Clause
"""Checks of the order of rows, by the time between two rows according to the velocities."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array, Signals
from skidyn._text import trajectories_told
from skidyn.measurement._check import Check
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._suspicion import Suspicion

#: Least share of the squared step of all positions along their velocities for a step to determine
#: its time, with two joints and with more.
ALONG_TWO, ALONG = 0.98, 0.9
#: Steps of a position, in units of its scatter, from which single rows can be judged.
CLEAR = 4.0
#: Share of moving rows backwards in time, and of rows that skip others, for a suspicion and for
#: certainty.
BACKWARDS, SKIPPED, SURELY = 0.1, 0.004, 0.02
#: Moving rows from which a recording is judged by itself.
FEWEST_TURNED = 20
#: Squared steps by velocities, over their mean, from which rows are fast.
FAST = 0.25
#: Steps of the clock from which a step is a burst of lost rows, and bursts for a suspicion and for
#: certainty.
LONG, FEWEST_BURSTS, SURE_BURSTS = 4.0, 4, 12
#: How far the usual step may be off that of the clock.
USUAL = 0.5
#: Ratio of the number of steps of two or more to that of zero, or between one and two.
OTHERS = 3.0
#: Share of the rows that skip others from which rows backwards in time are exchanged with them.
EXCHANGED = 0.3
#: Tolerance for the time of a step to be a whole number of steps of the clock.
WHOLE = 0.25
#: Steps from row to row, as shares of a joint's spread and of what velocities make of them, that
#: rows in no order at all have.
LARGE, FASTER = 0.05, 5.0
#: The latter of rows that are in order.
ORDERLY = 1.5
#: Velocities against the others, as a share of the largest, of a velocity with one sign; way back,
#: as a share of the way forth, of a joint that moves both ways.
ONE_SIGN, BOTH_WAYS = 0.01, 0.05


@dataclass(frozen=True)
class Elapsed:
    """Time of every step of the positions according to the velocities, in steps of the clock.

    Attributes
    ----------
    steps : ndarray of shape (n_steps,)
        Time of every step over that of the clock.
    along : ndarray of shape (n_steps,) of bool
        Whether the step of all positions lies along the velocities.
    moving : ndarray of shape (n_steps,) of bool
        Rows in the faster half.
    clear : ndarray of shape (n_steps,) of bool
        Rows whose steps stand out of the scatter of the positions.
    disorder : float
        Steps of the positions over those that velocities make of the clock, in the middle.
    size : float
        Steps of the positions over the spread of the positions, in the middle.
    index : ndarray of shape (n_steps,) of int
        Row after every step.
    fast : ndarray of shape (n_steps,) of bool
        Rows that are not slow compared with the mean, unlike those of a robot that mostly rests.
    """

    steps: Array
    along: NDArray[np.bool_]
    moving: NDArray[np.bool_]
    clear: NDArray[np.bool_]
    disorder: float
    size: float
    index: NDArray[np.intp]
    fast: NDArray[np.bool_]


def elapsed_steps(measurement: Measurement) -> Elapsed | None:
    """Time between rows according to the velocities; None where fewer than two joints move.

    Parameters
    ----------
    measurement : Measurement
        What was recorded.
    """
    return _steps_of(measurement.signals, measurement.unwrapped, _used(measurement))


def _used(measurement: Measurement) -> NDArray[np.intp]:
    """Joints that move, whose steps are those of time."""
    s = measurement.signals
    used = np.flatnonzero((s.q.std(axis=0) > 1e-3) & (s.dq.std(axis=0) > 1e-3))
    used = np.setdiff1d(used, list(measurement.held))  # a held position catches up in one step
    return np.asarray(used[~_one_way(s, measurement.unwrapped)[used]])


def _steps_of(s: Signals, position: Array, used: NDArray[np.intp]) -> Elapsed | None:
    """Time between rows according to the velocities of some joints; None with too few of them."""
    spread = s.q.std(axis=0)
    time = np.diff(s.clock)
    together = s.within & (time > 0)
    if len(used) < 2 or together.sum() < 200:
        return None
    q, dq, time = position[:, used], s.dq[:, used], time[together]
    moved = np.diff(q, axis=0)[together] / spread[used]
    expected = ((dq[1:] + dq[:-1]) / 2)[together] * time[:, None] / spread[used]
    product = np.sum(moved * expected, axis=1)
    square, size = np.sum(expected**2, axis=1), np.sum(moved**2, axis=1)
    steps = product / np.maximum(square, 1e-300)
    cosine = product**2 / np.maximum(square * size, 1e-300)
    moving = square > np.median(square)
    scatter = np.median(np.abs(np.diff(moved, axis=0)), axis=0)
    clear = square > CLEAR**2 * np.sum(scatter**2)
    ratio = np.sqrt(size[moving] / square[moving])
    return Elapsed(
        steps,
        cosine > (ALONG_TWO if len(used) == 2 else ALONG),
        moving,
        clear,
        float(np.median(ratio)),
        float(np.median(np.sqrt(size / len(used)))),
        np.flatnonzero(together) + 1,
        square > FAST * np.mean(square),
    )


def _one_way(signals: Signals, position: Array) -> NDArray[np.bool_]:
    """Joints whose velocity has one sign although they move both ways: theirs is a speed."""
    moved = np.diff(position, axis=0)[signals.within]
    forth, back = np.maximum(moved, 0).sum(axis=0), np.maximum(-moved, 0).sum(axis=0)
    small = ONE_SIGN * np.abs(signals.dq).max(axis=0)
    one_sign = (signals.dq.min(axis=0) > -small) | (signals.dq.max(axis=0) < small)
    return np.asarray(one_sign & (np.minimum(forth, back) > BOTH_WAYS * np.maximum(forth, back)))


def _friction_work(measurement: Measurement, rows: NDArray[np.bool_]) -> float:
    """Work of the drives against dry friction along the recorded velocities.

    It is positive if velocities belong to the torques. The rest of a torque is taken for a function
    of the positions, and for that of the stated bodies.
    """
    s = measurement.signals.take(rows)
    turns = np.column_stack([np.ones(s.n_samples), np.sin(s.q), np.cos(s.q)])
    torque, work = measurement.torque[rows], 0.0
    robot = measurement.robot
    bodies = None if robot is None else robot.inverse_dynamics(s.q, s.dq, np.zeros_like(s.q))
    for k in range(s.n_joints):
        own = [] if bodies is None else [bodies[:, k]]
        columns = np.column_stack([np.sign(s.dq[:, k]), turns, *own])
        dry = np.linalg.lstsq(columns, torque[:, k], rcond=1e-9)[0][0]
        work += float(dry * np.sum(np.abs(s.dq[:, k])))
    return work


def _turned_trajectories(
    measurement: Measurement, found: Elapsed, backwards: NDArray[np.bool_]
) -> list[int]:
    """Recordings in which joints move against their velocities, if all others have none of it."""
    number = measurement.recorded.trajectory[found.index]
    counted = found.moving & found.along
    shares = {
        int(run): float(np.mean(backwards[own]))
        for run in np.unique(number)
        if (own := counted & (number == run)).sum() > FEWEST_TURNED
    }
    turned = [run for run, share in shares.items() if share > 1 - BACKWARDS]
    clear = all(share < BACKWARDS or share > 1 - BACKWARDS for share in shares.values())
    return turned if clear and len(turned) < len(shares) else []


def _alternate(measurement: Measurement) -> bool:
    """Whether every second row of all recordings, and the others, are in the order of time."""
    s, used = measurement.signals, _used(measurement)
    second = np.zeros(s.n_samples, dtype=bool)
    for own in s.segments:
        second[own][1::2] = True
    for rows in (second, ~second):
        found = _steps_of(s.take(rows), measurement.unwrapped[rows], used)
        if found is None or found.disorder > ORDERLY:
            return False
        if np.mean(found.steps[found.moving] < -WHOLE) > BACKWARDS:
            return False
    return True


class LostRows(Check):
    """Rows in wrong order of time, or with lost rows between them."""

    name = "lost_rows"
    suspects = "rows that are not in the order of time, or between which rows are missing"
    misnames = True

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        found = elapsed_steps(measurement)
        if found is None or not found.moving.any():
            return
        backwards = found.along & (found.steps < -WHOLE) & found.moving
        turned = _turned_trajectories(measurement, found, backwards)
        if turned:
            yield from self._turned(measurement, turned)
            return
        share = float(backwards.sum() / found.moving.sum())
        along = found.moving & found.along
        forwards = float(np.sum(found.steps[along] > WHOLE) / max(along.sum(), 1))
        anyhow = found.size > LARGE and found.disorder > FASTER
        if anyhow or (share > BACKWARDS and forwards > BACKWARDS):
            measurement.lost = measurement.shuffled = True
            evidence = (
                f"positions step by {100 * found.size:.0f} % of their spread from row to row, "
                f"{found.disorder:.2g} times as far as their velocities imply"
                if anyhow
                else f"in {100 * share:.0f} % of the moving rows all joints move against their "
                "velocities at once"
            )
            yield self._shuffled(measurement, evidence)
            return
        rows = found.clear & found.moving
        if rows.sum() < 200:
            return
        if abs(float(np.median(found.steps[rows])) - 1) > USUAL:
            return  # all steps have another size: a matter of units
        yield from self._bursts(measurement, found, rows)
        if not measurement.lost:
            yield from self._skipped(measurement, found, rows)

    def _shuffled(self, measurement: Measurement, evidence: str) -> Suspicion:
        """Rows in no order, or in the order of two sources that alternate."""
        if _alternate(measurement):
            return self.suspicion(
                "every second row is of another source",
                "from row to row the joints move against their velocities or farther than "
                "these imply, but from every row to the next but one as they imply: two "
                "sources were written into one log; keep the rows of one of them",
                "certain",
            )
        return self.suspicion(
            "rows are not in the order of time: they were shuffled", evidence, "certain"
        )

    def _turned(self, measurement: Measurement, turned: list[int]) -> Iterator[Suspicion]:
        """Recordings in reversed order, unless their torque agrees with the positions instead."""
        if _friction_work(measurement, np.isin(measurement.recorded.trajectory, turned)) < 0:
            return  # then velocities have the wrong sign
        measurement.lost = True
        yield self.suspicion(
            f"the rows of {trajectories_told(turned)} are in reversed order of time",
            "in nearly all their moving rows all joints move against their velocities at once, "
            "although friction opposes these velocities; reverse the rows of these recordings",
            "certain",
        )

    def _bursts(
        self, measurement: Measurement, found: Elapsed, rows: NDArray[np.bool_]
    ) -> Iterator[Suspicion]:
        """Rows lost in bursts: a few long steps along the velocities, and no other odd ones."""
        q, before = measurement.signals.q, found.index - 1
        held = (before > 0) & np.all(q[before] == q[before - 1], axis=1)  # a held packet catches up
        long = rows & ~held & found.fast & found.along & (found.steps > LONG)
        others = rows & ~held & ~long & (np.abs(found.steps - 1) > 1 + WHOLE)
        if long.sum() < FEWEST_BURSTS or long.sum() < OTHERS * others.sum():
            return
        measurement.lost = True
        measurement.cut(
            found.index[found.along & found.clear & (found.steps > LONG)]
        )  # slow ones too
        yield self.suspicion(
            "rows are missing in bursts without a gap in the clock",
            f"{int(long.sum())} times all joints move along their velocities, but by "
            f"{np.median(found.steps[long]):.0f} times as far as in one step (the median), and "
            "hardly ever otherwise; use the time stamps of the robot. Other checks treat the parts "
            "as separate trajectories",
            "certain" if long.sum() > SURE_BURSTS else "suspected",
        )

    def _skipped(
        self, measurement: Measurement, found: Elapsed, rows: NDArray[np.bool_]
    ) -> Iterator[Suspicion]:
        """Single rows that are missing, or exchanged with others."""
        back = float(np.sum(found.along & (found.steps < -WHOLE) & rows) / rows.sum())
        steps = found.steps[rows & (found.along | (found.steps == 0))]
        whole = np.abs(steps - np.round(steps)) < WHOLE
        share, usual, between, none = (
            float(np.sum(these) / rows.sum())
            for these in (
                whole & (steps > 1.5),
                whole & (np.round(steps) == 1),
                ~whole & (steps > 1) & (steps < 2),  # stamps that jitter
                whole & (np.round(steps) == 0),  # rows that repeat, and catch up afterwards
            )
        )
        if share <= SKIPPED or usual <= 0.5 or share <= OTHERS * max(between, none):
            return
        measurement.lost = True
        if back > max(SKIPPED, EXCHANGED * share):
            yield self.suspicion(
                "rows are exchanged with others close to them in time",
                f"in {100 * back:.2g} % of the moving rows all joints move against their "
                f"velocities at once, and in {100 * share:.2g} % at least twice as far as "
                "these imply; sort the rows by the clock of the robot",
                "certain" if share > SURELY else "suspected",
            )
            return
        yield self.suspicion(
            "rows are missing without a gap in the clock",
            f"in {100 * share:.2g} % of the moving rows all joints move at least twice as far "
            "in one step as their velocities imply",
            "certain" if share > SURELY else "suspected",
        )
