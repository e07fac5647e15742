# SPDX-License-Identifier: BSD-3-Clause
"""Comparison of recordings: velocities, positions or a clock unlike those of the others."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array, Signals
from skidyn.measurement._check import Check
from skidyn.measurement._consistency import velocity_consistency
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._suspicion import Suspicion

#: Correlation of integrated velocity with position from which its slope is a scale, and below which
#: a velocity is of something else; that of the other recordings where it is so, and from which a
#: slope is that of another unit.
SCALED, UNLIKE, USUALLY = 0.9, 0.5, 0.98
#: How far a slope must be off those of the other recordings, as a share of them, how near these are
#: to each other, how many there are at least, and the share of recordings that are alike.
FAR, NEAR, FEWEST, MOST = 0.25, 0.1, 3, 0.6
#: Way of a joint in a recording, as a share of that in the others, from which it is compared.
MOVED = 0.25
#: Steps of a coarse velocity that a recording must reach to be compared.
RESOLVED = 6.0
#: How nearly joints share a slope.
SHARED = 0.05
#: Least correlation of velocity and position, largest difference of their slopes between joints,
#: and least one between recordings, for clocks with another rate in each of them.
ALIKE, SAME, OTHER = 0.99, 0.02, 0.04
#: Spread of a velocity, and its way through a recording whose position is stuck, in rad or m.
LEAST_SPEED, LEAST_SWEPT = 0.02, 0.1


class OddMotion(Check):
    """A recording with velocities, positions or a clock inconsistent with the others."""

    name = "odd_motion"
    suspects = (
        "single recordings whose clock, positions or velocities have a different unit or sign"
    )

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        if measurement.clock != 1:
            return  # what is short or a gap is another in the wrong unit
        motion = measurement.motion_by_recording
        rates = {} if motion is None else own_rates(motion)
        if rates:
            measurement.stale = True  # no value is that of its time
            told = ", ".join(f"{rate:.3g} in {run}" for run, rate in rates.items())
            yield self.suspicion(
                "the clock has another rate in every trajectory",
                f"velocities are so many times the differentiated positions: {told}, equally in "
                "all joints; recordings were stretched to a common duration, or have different "
                "sampling rates; use their own times",
                "certain",
            )
            return
        for run, slopes in measurement.odd_motion.items():
            names = measurement.joints(slopes)
            sizes = np.array(list(slopes.values()))
            known = np.isfinite(sizes)
            told = ", ".join(f"{size:.4g}" for size in sizes[known])
            every = len(slopes) == sum(measurement.excited) and len(slopes) > 1
            if every and known.all() and np.ptp(sizes) < SHARED * abs(float(np.median(sizes))):
                what = "clock, positions or velocities have a different unit than in the others"
            elif known.all() and np.all(np.abs(sizes + 1) < FAR):
                what = f"the velocity or the position of {names} has the opposite sign"
            else:
                what = f"the velocity of {names} is not the derivative of its position"
            evidence = "; it is a different signal" if not known.all() else ""
            yield self.suspicion(
                f"in trajectory {run} {what}",
                (
                    f"velocities are {told} times the differentiated positions there"
                    if told
                    else "there"
                )
                + f", in the other trajectories they agree{evidence}; fix that file, or leave it "
                "out",
                "certain",
                () if every else list(slopes),
            )


@dataclass(frozen=True)
class MotionByRecording:
    """How velocities follow positions in every recording.

    Attributes
    ----------
    runs : ndarray of shape (n_recordings,)
        Numbers of the recordings.
    slopes, likeness : ndarray of shape (n_recordings, n_joints)
        Slope of integrated velocity on position, and their correlation.
    way : ndarray of shape (n_recordings, n_joints)
        Range of the positions, rad or m; NaN where a coarse velocity is hardly resolved.
    """

    runs: NDArray[np.int64]
    slopes: Array
    likeness: Array
    way: Array

    @classmethod
    def of(cls, signals: Signals, position: Array, steps: Sequence[float]) -> MotionByRecording:
        """Motion of all recordings.

        Parameters
        ----------
        signals : Signals
            Recorded motion.
        position : ndarray of shape (n_samples, n_joints)
            Positions without leaps by a turn.
        steps : sequence of float
            Steps of coarse velocities, NaN for others.
        """
        number = signals.trajectory
        runs, n = np.unique(number), signals.n_joints
        slopes, likeness, way = (np.full((len(runs), n), np.nan) for _ in range(3))
        for r, run in enumerate(runs):
            parts = [rows for rows in signals.segments if number[rows.start] == run]
            for k in range(n):
                slopes[r, k], likeness[r, k] = velocity_consistency(
                    signals.clock, position[:, k], signals.dq[:, k], parts
                )
                if not np.ptp(signals.dq[number == run, k]) < RESOLVED * steps[k]:
                    way[r, k] = np.ptp(position[number == run, k])
        return cls(runs, slopes, likeness, way)


def own_rates(motion: MotionByRecording) -> dict[int, float]:
    """Slopes of velocity on differentiated position if they differ from recording to recording.

    A clock is that of all joints: on each joint, the slopes have to be the same.

    Parameters
    ----------
    motion : MotionByRecording
        Slopes of all joints.

    Returns
    -------
    dict of int to float
        By recording; empty if most recordings have the same, or joints differ.
    """
    rates = {}
    for run, slopes, likeness in zip(
        motion.runs.tolist(), motion.slopes, motion.likeness, strict=True
    ):
        own = slopes[likeness > ALIKE]
        if len(own) < 2 or not np.ptp(own) < SAME * abs(float(np.median(own))):
            return {}
        rates[run] = float(np.median(own))
    off = np.abs(np.array(list(rates.values())) / np.median(list(rates.values())) - 1)
    return rates if np.mean(off > OTHER) > 1 - MOST else {}


def odd_motion(motion: MotionByRecording) -> dict[int, dict[int, float]]:
    """Slopes of integrated velocity on position in recordings in which it is not the usual one.

    Parameters
    ----------
    motion : MotionByRecording
        Slopes of all joints.

    Returns
    -------
    dict of int to dict of int to float
        By recording and joint, from 0; NaN where the velocity is not that of the joint at all.
    """
    runs, slopes, likeness, way = motion.runs, motion.slopes, motion.likeness, motion.way
    if len(runs) <= FEWEST:
        return {}
    found: dict[int, dict[int, float]] = {}
    for k in np.flatnonzero(np.isfinite(way).any(axis=0)).tolist():
        moves = way[:, k] > MOVED * np.nanmedian(way[:, k])
        scaled = moves & (np.abs(likeness[:, k]) > SCALED)
        if scaled.sum() <= FEWEST:
            continue
        usual = float(np.median(slopes[scaled, k]))
        off = np.abs(slopes[:, k] / usual - 1) if usual else np.full(len(runs), np.inf)
        alike = scaled & (off < NEAR)
        if alike.sum() < max(FEWEST, MOST * len(runs)):
            continue
        other = moves & (np.abs(likeness[:, k]) < UNLIKE)
        other &= bool(np.median(likeness[alike, k]) > USUALLY)
        proportional = moves & (np.abs(likeness[:, k]) > USUALLY)
        for r in np.flatnonzero((proportional & (off > FAR)) | other).tolist():
            slope = float(slopes[r, k]) if scaled[r] else float("nan")
            found.setdefault(int(runs[r]), {})[k] = slope
    # a difference in many is not one of single recordings
    return found if len(found) <= (1 - MOST) * len(runs) else {}


def stuck_positions(signals: Signals) -> dict[int, list[int]]:
    """Recordings in which a position never changes although its velocity does, by joint.

    Parameters
    ----------
    signals : Signals
        Recorded motion.

    Returns
    -------
    dict of int to list of int
        Numbers of recordings by joint, from 0.
    """
    runs = np.unique(signals.trajectory)
    if len(runs) < 2:
        return {}
    found: dict[int, list[int]] = {}
    for run in runs:
        rows = signals.trajectory == run
        for k in np.flatnonzero(np.ptp(signals.q[rows], axis=0) == 0):
            steps = signals.dq[rows, k][1:] * np.abs(np.diff(signals.clock[rows]))
            swept = np.ptp(np.cumsum(np.append(0.0, steps)))  # noise of the velocity cancels
            if swept > LEAST_SWEPT and signals.dq[rows, k].std() > LEAST_SPEED:
                found.setdefault(int(k), []).append(int(run))
    return found
