# SPDX-License-Identifier: BSD-3-Clause
"""Checks of what is zero: a dead band, and torque or positions set to zero for each recording."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from skidyn._sensor_steps import position_step
from skidyn._signals import Array, runs_of
from skidyn.measurement._check import Check
from skidyn.measurement._fits import Fits
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._suspicion import Suspicion
from skidyn.measurement._torque import readable_fits

Rows: TypeAlias = NDArray[np.intp]
#: Dead band: least share of rows with zero torque; least length and number of their runs (drives
#: that are switched off have few long runs); least ratio to the frequency of values one step from
#: zero, for a torque in steps; least number of values of a torque that is not too coarse.
BAND, RUN, PASSES, OFTENER, FINE = 0.01, 4, 10, 4.0, 50
#: Least speed of rows that count, as a share of the largest.
FAST = 0.02
#: Least number of recordings; rows at the start of each; least share of gravity in the spread
#: there; largest share of gravity that may remain there or on average; slope of the torque on
#: gravity in recordings.
RECORDINGS, ROWS, HEAVY, LEFT, FELT = 3, 5, 0.1, 0.1, 0.5
#: Largest position at the start of recordings, in steps and as a share of the range; least share of
#: the range at their ends, and of recordings with it.
STEPS, NEAR, AWAY, OFTEN = 2.0, 1e-3, 0.1, 0.5


class DeadBand(Check):
    """Torque or current that is zero below some size."""

    name = "dead_band"
    of_sensor = True
    suspects = "torque or current that is reported as zero when it is small"
    misnames = True

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        found = dead_bands(measurement)
        if found:
            names = measurement.joints(found)
            told_shares = ", ".join(f"{share:.1%}" for share in found.values())
            yield self.suspicion(
                f"the torque of {names} is reported as zero when it is small",
                f"it is exactly zero in {told_shares} of the rows, in {PASSES} places or more for "
                f"{RUN} rows or more, although the joint moves, and no other value repeats so",
                "suspected",
                list(found),
            )


def dead_bands(measurement: Measurement) -> dict[int, float]:
    """Joints whose torque has a dead band, from 0, and the share of rows in which it is zero."""
    told = set(measurement.clipped) | set(np.flatnonzero(measurement.missing.any(axis=0)))
    moving = np.flatnonzero(measurement.excited).tolist()
    shares = {k: _zeros(measurement, k) for k in moving if k not in told}
    return {k: share for k, share in shares.items() if share > BAND}


def _zeros(measurement: Measurement, k: int) -> float:
    """Share of rows in which the torque of a moving joint is exactly zero for a while."""
    torque, speed = measurement.torque[:, k], np.abs(measurement.signals.dq[:, k])
    if torque.min() >= 0 or torque.max() <= 0:
        return 0.0
    zero = (torque == 0) & ~measurement.idle
    begins, ends = runs_of(zero)
    lengths = ends - begins
    moves = np.r_[0, np.cumsum(speed > FAST * speed.max())]
    moving = moves[ends] - moves[begins] > lengths / 2
    passes = lengths[(lengths >= RUN) & moving]
    if len(passes) < PASSES or len(np.unique(torque)) < FINE:
        return 0.0
    share = float(passes.sum()) / len(torque)
    step = position_step(torque)
    if np.isfinite(step):  # steps of a sensor are as frequent near zero as at zero
        beside, next_to = (
            float(np.mean(np.abs(np.abs(torque) - n * step) < 0.1 * step)) / 2 for n in (1, 2)
        )
        # and if small torques are frequent, more so the closer they are to zero
        rising = max(1.0, beside / max(next_to, 1e-12))
        if np.mean(torque == 0) < OFTENER * beside * rising:
            return 0.0
    return share


class TaredTorque(Check):
    """Torque that was set to zero for each recording, including its gravity."""

    name = "tared_torque"
    of_sensor = True
    suspects = "torque that was set to zero at the start of recordings, or whose mean was removed"
    misnames = True

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        robot, s = measurement.robot, measurement.signals
        runs = [
            np.flatnonzero((s.trajectory == run) & ~measurement.idle)
            for run in np.unique(s.trajectory)
        ]
        if robot is None or len(runs) < RECORDINGS or len(measurement.leaps):
            return
        if min(map(len, runs)) < 4 * ROWS:
            return
        fits = readable_fits(measurement)
        if fits is None:
            return
        pull, torque = robot.gravity_torque(s.q), measurement.torque
        parts = ("start", [rows[:ROWS] for rows in runs]), ("mean", runs)
        for what, rows in parts:
            joints = _without(torque, pull, rows)
            joints = [k for k in joints if _felt(fits, k)]
            if joints:
                how = (
                    "was set to zero at the start of every recording"
                    if what == "start"
                    else "has zero mean in every recording: the mean was removed"
                )
                yield self.suspicion(
                    f"the torque of {measurement.joints(joints)} {how}",
                    "the torque varies with gravity as the joints move, but the gravity torque "
                    + ("at the start" if what == "start" else "on average")
                    + " is missing; record the torque as measured, or add the gravity torque",
                    "suspected",
                    joints,
                )
                return


def _without(torque: Array, pull: Array, parts: Sequence[Rows]) -> list[int]:
    """Joints whose torque lacks the gravity of some rows of recordings; none unless all do."""
    there = np.array([pull[rows].mean(axis=0) for rows in parts])
    held = np.array([torque[rows].mean(axis=0) for rows in parts])
    heavy = np.flatnonzero(np.sqrt(np.mean(there**2, axis=0)) > HEAVY * torque.std(axis=0))
    there, held = (np.median(np.abs(x[:, heavy]), axis=0) for x in (there, held))
    return [] if np.any(held > LEFT * there) else heavy.tolist()


def _felt(fits: Fits, joint: int) -> bool:
    """Whether the torque of a joint contains changes of gravity, in addition to other parts."""
    torque, counts = fits.mean_torque(joint)
    pull, still, speed, sign = fits.read_columns()
    table = np.column_stack([torque, *(x[:, joint] for x in (pull, still, speed, sign))])[counts]
    runs = fits.recording[counts]
    for run in np.unique(runs):
        table[runs == run] -= table[runs == run].mean(axis=0)
    if table[:, 1].std() < HEAVY * torque.std():
        return False
    return bool(np.linalg.lstsq(table[:, 1:], table[:, 0], rcond=None)[0][0] > FELT)


class CountedPosition(Check):
    """Position that was set to zero at the start of each recording."""

    name = "counted_position"
    suspects = "positions that are counted from the start of each recording"
    misnames = True

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        s = measurement.signals
        runs = [np.flatnonzero(s.trajectory == run) for run in np.unique(s.trajectory)]
        moving = np.flatnonzero(measurement.excited)
        if len(runs) < RECORDINGS or len(moving) < 2 or min(map(len, runs)) < ROWS:
            return
        q = s.q[:, moving]
        first, last = (np.array([rows[at] for rows in runs]) for at in (0, -1))
        span = np.ptp(q, axis=0)
        step = np.array([position_step(column) for column in q.T])
        near = np.maximum(NEAR * span, np.where(np.isfinite(step), STEPS * step, 0.0))
        away = np.mean(np.abs(q[last]) > AWAY * span, axis=0) > OFTEN
        if np.any(np.abs(q[first]) > near) or not away.any():
            return
        names = measurement.joints(moving)
        speed = np.abs(s.dq[:, moving])
        swift = np.median(speed[first] / speed.max(axis=0), axis=0)
        if np.sum(swift > FAST) < 2:
            return  # at rest: every recording may begin in the zero pose
        yield self.suspicion(
            f"the positions of {names} are counted from the start of each recording",
            "all of them are zero in the first row of each, although the joints move; read the "
            "absolute positions, or add the pose at the start of each recording",
            "suspected",
            moving,
        )
