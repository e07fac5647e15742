# SPDX-License-Identifier: BSD-3-Clause
"""Checks of values that are not new: held positions and torques, and zeros for missing values."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from skidyn._sensor_steps import step_of_values
from skidyn._signals import Array, Signals
from skidyn.measurement._check import Check
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._measures import (
    CATCHES,
    MANY_MISSING,
    RECURS,
    STRIDE,
    equal_values,
    is_held,
)
from skidyn.measurement._odd_motion import LEAST_SPEED, LEAST_SWEPT
from skidyn.measurement._placeholder import placeholder_remedy
from skidyn.measurement._suspicion import Suspicion, remedy_of, resample_to

#: Least share of rows with the torque of the previous row, for a torque that is not coarse.
HELD = 0.3
#: Share of the changes of a held value that are a multiple of its period apart.
REGULAR = 0.9
#: Least length of a stuck part in rows, and as a multiple of the longest other part of one value;
#: most stuck parts of a joint; least motion in it, as a share of the range of the joint.
LONG, LONGER, MOST_STUCK, STUCK_WAY = 40, 5, 8, 0.1
#: Usual difference of the way of a position from that of its velocity, as a share of it, at most.
FOLLOWING = 0.5


class HeldTorque(Check):
    """A torque that holds its last value while joints move on."""

    name = "held_torque"
    of_sensor = True
    suspects = "torque that holds its last value: reported less often than the positions"

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        s = measurement.signals
        moved = np.any(s.q[1:] != s.q[:-1], axis=1) & s.within
        if moved.sum() < 50:
            return
        held_all = is_held(measurement.torque, moved)
        if held_all.any():
            measurement.stale = True
            share = float(held_all.sum() / moved.sum())
            yield self.suspicion(
                "torques hold their last value",
                f"in {share:.0%} of the rows in which positions change, all of them at once: they "
                "are reported less often",
                "certain",
                remedy=remedy_of("drop_repeated", True),
            )
            return
        if measurement.lost_torque.any():
            yield self._lost(measurement.lost_torque)
            return
        shares, lost = np.zeros(measurement.n_joints), measurement.clipped
        for k in range(measurement.n_joints):
            torque = measurement.torque[:, k]
            if k not in lost:  # zeros follow each other in a dead band
                shares[k] = _share_held(torque, moved & (torque[1:] != 0), s.trajectory)
        held = np.flatnonzero(shares)
        if len(held):
            measurement.slow |= set(held.tolist())
            yield self.suspicion(
                f"the torque of {measurement.joints(held)} holds its last value",
                f"in {100 * shares[held].max():.0f} % of the rows in which positions change: it is "
                "reported less often",
                "suspected",
                [int(k) for k in held],
            )

    def _lost(self, lost: NDArray[np.bool_]) -> Suspicion:
        """Parts in which all torques keep their last values at once."""
        count = int(np.sum(lost[1:] & ~lost[:-1]))
        return self.suspicion(
            "all torques hold their last value in parts of recordings",
            f"in {count} parts of about {lost.sum() / count:.0f} rows, {lost.mean():.1%} of all, "
            "they do not change although joints move: their values were lost",
            "certain" if lost.mean() > MANY_MISSING else "suspected",
            remedy=remedy_of("drop_repeated", True),
        )


def _share_held(values: Array, moved: NDArray[np.bool_], trajectory: NDArray[np.int64]) -> float:
    """Share of the steps of motion in which a channel holds its value; 0 if that is usual for it.

    It is usual for a constant one, and for one in coarse steps that has no rhythm.
    """
    share = float(np.mean(values[1:][moved] == values[:-1][moved])) if moved.any() else 0.0
    steps = _comes_in_steps(values) and not _in_rhythm(values, trajectory)
    return share if share > HELD and not steps else 0.0


def _comes_in_steps(values: Array) -> bool:
    """Whether values are constant, or those of a coarse sensor: few ones recur, one step apart."""
    changes = np.abs(np.diff(values))
    changes = changes[changes > 0]
    if not len(changes):
        return True
    distinct = np.unique(values)
    step = step_of_values(distinct)
    if np.isfinite(step) and np.median(changes) < CATCHES * step:
        return True
    return len(distinct) < RECURS * len(changes)


def _in_rhythm(values: Array, trajectory: NDArray[np.int64]) -> bool:
    """Whether values change in every n-th row only, as those of a slower bus."""
    changes = np.flatnonzero((values[1:] != values[:-1]) & (trajectory[1:] == trajectory[:-1]))
    if len(changes) < LONG:
        return False
    apart, times = np.unique(np.diff(changes), return_counts=True)
    usual = int(apart[np.argmax(times)])
    # where two values are equal by chance, it takes two periods
    return usual > 1 and bool(times[apart % usual == 0].sum() > REGULAR * times.sum())


def _accelerates(position: Array) -> NDArray[np.bool_]:
    """Steps, one fewer than positions, around which the mean velocity of a joint changes."""
    way = position[STRIDE:] - position[:-STRIDE]
    change = np.abs(way[STRIDE:] - way[:-STRIDE])
    found = np.zeros(len(position) - 1, dtype=bool)
    if len(change):
        found[np.flatnonzero(change > 0.25 * np.quantile(change, 0.9)) + STRIDE] = True
    return found


class HeldVelocity(Check):
    """Velocities of joints that hold their last value while the joints move on."""

    name = "held_velocity"
    suspects = "velocities that hold their last value: reported less often than the positions"

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        if measurement.stale:
            return  # reported already
        s = measurement.signals
        shares = {}
        for k in range(s.n_joints):
            q, dq = s.q[:, k], s.dq[:, k]
            # the velocity of a joint at rest, or at constant speed, does not change
            moved = s.within & (q[1:] != q[:-1]) & (dq[1:] != 0) & _accelerates(q)
            if not measurement.excited[k] or moved.sum() < 50:
                continue
            if share := _share_held(dq, moved, s.trajectory):
                shares[k] = share
        measurement.held_velocities = set(shares)
        if shares:
            names = measurement.joints(shares)
            columns = [f"dq{k + 1}" for k in shares]
            yield self.suspicion(
                f"the velocity of {names} holds its last value",
                f"in {100 * max(shares.values()):.0f} % of the rows in which the joint "
                "accelerates: it is reported less often",
                "suspected",
                list(shares),
                remedy_of("derive", columns),
            )


class StuckTorque(Check):
    """A torque that holds one value for a part of a recording in which its joint moves."""

    name = "stuck_torque"
    of_sensor = True
    suspects = "torque that holds one value for a part of a recording"

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        s = measurement.signals
        for k in range(measurement.n_joints):
            for a, b in stuck_parts(measurement, k):
                yield self.suspicion(
                    f"the torque of {measurement.joint(k)} is stuck in a part of trajectory "
                    f"{int(measurement.recorded.trajectory[a])}",
                    f"from {s.clock[a]:.4g} s to {s.clock[b - 1]:.4g} s it is "
                    f"{measurement.torque[a, k]:.4g} although the joint moves; leave this part out",
                    "suspected",
                    [k],
                )


def stuck_parts(measurement: Measurement, k: int) -> list[tuple[int, int]]:
    """First rows of parts in which the torque of a joint, from 0, is stuck, and those after them.

    Constant parts of a coarse torque, of a torque at its limit, or of zeros are not among them.
    """
    s, torque = measurement.signals, measurement.torque[:, k]
    if np.ptp(torque) == 0 or measurement.idle.any():
        return []
    begins, ends = equal_values(torque, s.trajectory)
    lengths = ends - begins
    others = np.sort(lengths)[: max(len(lengths) - MOST_STUCK, 1)]
    long = np.flatnonzero(lengths >= max(LONG, LONGER * others[-1]))
    far = STUCK_WAY * float(np.ptp(s.q[:, k]))
    parts = list(zip(begins[long].tolist(), ends[long].tolist(), strict=True))
    limits = (torque.min(), torque.max(), 0.0)
    whole = [torque[s.trajectory == run] for run in np.unique(s.trajectory[[a for a, _ in parts]])]
    if any(np.ptp(own) == 0 for own in whole):
        return []  # reported as constant in these trajectories
    return [(a, b) for a, b in parts if torque[a] not in limits and np.ptp(s.q[a:b, k]) > far]


class HeldPosition(Check):
    """Positions of single joints that hold their last value while the joints move on."""

    name = "held_position"
    suspects = "positions of single joints that hold their last value: reported less often"

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        for k, share in measurement.held.items():
            measurement.stale = True
            rate = float(f"{measurement.rate * (1 - share):.3g}")
            yield self.suspicion(
                f"the position of {measurement.joint(k)} holds its last value",
                f"in {share:.0%} of the rows in which the joint moves, after which it catches up: "
                f"it is reported at about {rate:g} Hz",
                "certain",
                [k],
                resample_to(rate),
            )


class StuckPosition(Check):
    """A position that does not change in a part of a recording, although its velocity does."""

    name = "stuck_position"
    suspects = "positions that do not change in a part of a recording although the joint moves"

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        s = measurement.signals
        if measurement.lost or measurement.clock != 1:
            return
        known = measurement.stuck
        for k in np.flatnonzero(measurement.excited).tolist():
            begins, ends = equal_values(s.q[:, k], s.trajectory)
            lengths = ends - begins
            if not _follows(s, k, np.repeat(lengths, lengths) >= LONG):
                continue  # its velocity is another signal, which tells nothing about its position
            for i in np.flatnonzero(lengths >= LONG):
                a, b = int(begins[i]), int(ends[i])
                run, speed = int(s.trajectory[a]), s.dq[a:b, k]
                way = np.cumsum(speed[1:] * np.diff(s.clock[a:b]))  # noise cancels
                if np.ptp(way) < LEAST_SWEPT or speed.std() < LEAST_SPEED:
                    continue
                if run in known.get(k, ()) or b in measurement.leaps:
                    continue  # reported for the whole recording, or with the jump after it
                yield self.suspicion(
                    f"the position of {measurement.joint(k)} is stuck in a part of trajectory "
                    f"{int(measurement.recorded.trajectory[a])}",
                    f"from {s.clock[a]:.4g} s to {s.clock[b - 1]:.4g} s it is {s.q[a, k]:.4g} "
                    f"although the velocity reaches {np.abs(speed).max():.3g}; leave this part out",
                    "certain",
                    [k],
                )


def _follows(signals: Signals, joint: int, stuck: NDArray[np.bool_]) -> bool:
    """Whether a position follows its velocity from row to row where it is not stuck."""
    q, dq = signals.q[:, joint], signals.dq[:, joint]
    way = np.cumsum(np.r_[0.0, dq[1:] * np.diff(signals.clock)])
    a = np.arange(len(q) - LONG // 2)
    b = a + LONG // 2
    inside = (signals.trajectory[a] == signals.trajectory[b]) & ~(stuck[a] | stuck[b])
    moved, swept = (q[b] - q[a])[inside], (way[b] - way[a])[inside]
    fast = np.abs(swept) > np.median(np.abs(swept)) if len(swept) else swept > 0
    off = np.abs(moved - swept)[fast] / np.abs(swept[fast])
    return bool(len(off) and np.median(off) < FOLLOWING)  # the median, since values may be missing


class MissingTorque(Check):
    """Zeros in the place of missing torques."""

    name = "missing_torque"
    of_sensor = True
    suspects = "zeros in the place of missing torques"

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        missing = measurement.missing
        joints = np.flatnonzero(missing.any(axis=0)).tolist()
        if joints and not measurement.lost:
            rows = missing.any(axis=1)
            names = measurement.joints(joints)
            yield self.suspicion(
                f"missing torques of {names} were replaced by zero",
                f"in {int(rows.sum())} rows, {rows.mean():.1%} (the first in row "
                f"{int(np.argmax(rows))}), they are zero, but not close to zero in the rows beside "
                "them",
                "certain" if rows.mean() > MANY_MISSING else "suspected",
                joints,
                placeholder_remedy(0.0, [("tau", k) for k in joints], measurement.n_joints),
            )
