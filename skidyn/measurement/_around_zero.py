# SPDX-License-Identifier: BSD-3-Clause
"""Checks of torque around zero: a dead band, and torque that was set to zero for each recording."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array
from skidyn.measurement._check import Check
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._measures import position_step
from skidyn.measurement._suspicion import Suspicion
from skidyn.measurement._torque import cut_columns

Rows: TypeAlias = NDArray[np.intp]
#: Share of rows with a torque of zero, in runs of at least so many and so often (drives that are
#: switched off are so for long), that is a dead band; how many times as often as values one step
#: beside it, where the torque comes in steps; fewest values of a torque that is not so coarse that
#: zero is one of few.
BAND, RUN, PASSES, OFTENER, FINE = 0.01, 4, 10, 4.0, 50
#: Least speed of rows that count, as a share of the largest.
FAST = 0.02
#: Recordings at least; rows at the start of each; share of the spread that gravity has there; share
#: of gravity that may be left there or on average; slope of the torque on gravity in recordings.
RECORDINGS, ROWS, HEAVY, LEFT, FELT = 3, 5, 0.1, 0.1, 0.5


class DeadBand(Check):
    """Torque or current that is zero below some size."""

    name = "dead_band"
    suspects = "torque or current that is reported as zero where it is small"
    misnames = True

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        told = set(cut_columns(measurement))
        shares = {
            k: _zeros(measurement, k)
            for k in np.flatnonzero(measurement.excited).tolist()
            if k not in told
        }
        found = {k: share for k, share in shares.items() if share > BAND}
        if found:
            names = ", ".join(measurement.joint(k) for k in found)
            told_shares = ", ".join(f"{share:.1%}" for share in found.values())
            yield self.suspicion(
                f"the torque of {names} is zero where it is small",
                f"it is exactly zero in {told_shares} of the rows, in {PASSES} places or more for "
                f"{RUN} rows or more, although the joint moves, and no other value repeats so",
                "suspected",
                list(found),
            )


def _zeros(measurement: Measurement, k: int) -> float:
    """Share of rows in which the torque of a moving joint is exactly zero for a while."""
    torque, speed = measurement.torque[:, k], np.abs(measurement.signals.dq[:, k])
    if torque.min() >= 0 or torque.max() <= 0 or len(np.unique(torque)) < FINE:
        return 0.0
    zero = (torque == 0) & ~measurement.idle
    edges = np.flatnonzero(np.diff(np.r_[0, zero.astype(int), 0]))
    lengths = edges[1::2] - edges[::2]
    moves = np.r_[0, np.cumsum(speed > FAST * speed.max())]
    moving = moves[edges[1::2]] - moves[edges[::2]] > lengths / 2
    passes = lengths[(lengths >= RUN) & moving]
    if len(passes) < PASSES:
        return 0.0
    share = float(passes.sum()) / len(torque)
    step = position_step(torque)
    if np.isfinite(step):  # steps of a sensor come as often beside zero as there
        beside = np.mean(np.abs(np.abs(torque) - step) < 0.1 * step) / 2
        if np.mean(torque == 0) < OFTENER * beside:
            return 0.0
    return share


class TaredTorque(Check):
    """Torque that was set to zero for each recording, with the gravity that it held there."""

    name = "tared_torque"
    suspects = "torque that was set to zero at the start of recordings, or whose mean was taken off"
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
        pull, torque = robot.gravity_torque(s.q), measurement.torque
        parts = ("start", [rows[:ROWS] for rows in runs]), ("mean", runs)
        for what, rows in parts:
            joints = _without(torque, pull, rows, runs)
            if joints:
                how = (
                    "was set to zero at the start of every recording"
                    if what == "start"
                    else "has no mean in any recording: it was taken off"
                )
                yield self.suspicion(
                    f"the torque of {', '.join(measurement.joint(k) for k in joints)} {how}",
                    "gravity is felt as the joints move, but what it makes "
                    + ("at the start" if what == "start" else "on average")
                    + " is missing; record torque as it is measured, or add it again",
                    "suspected",
                    joints,
                )
                return


def _without(torque: Array, pull: Array, parts: Sequence[Rows], runs: Sequence[Rows]) -> list[int]:
    """Joints whose torque lacks the gravity of some rows but not its changes; none unless all."""
    there = np.array([pull[rows].mean(axis=0) for rows in parts])
    held = np.array([torque[rows].mean(axis=0) for rows in parts])
    heavy = np.sqrt(np.mean(there**2, axis=0)) > HEAVY * torque.std(axis=0)
    found = []
    for k in np.flatnonzero(heavy).tolist():
        if np.median(np.abs(held[:, k])) > LEFT * np.median(np.abs(there[:, k])):
            return []
        pairs = [(pull[r, k] - pull[r, k].mean(), torque[r, k]) for r in runs]
        change = sum(float(p @ p) for p, _ in pairs)
        seen = change > (HEAVY * torque[:, k].std()) ** 2 * sum(map(len, runs))
        if seen and sum(float(p @ t) for p, t in pairs) > FELT * change:
            found.append(k)
    return found
