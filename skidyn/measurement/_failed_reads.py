# SPDX-License-Identifier: BSD-3-Clause
"""Check for numbers that a driver writes where it could not read a value."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array
from skidyn.measurement._check import Check
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._measures import MANY_MISSING, equal_values
from skidyn.measurement._placeholder import CHANNELS, in_words, placeholder_remedy
from skidyn.measurement._suspicion import Suspicion, exactly

#: Most rows of a failed read; no joint jumps to a position and back, however long it stays there.
MOST_ROWS = {"q": 50, "dq": 5, "tau": 5}
#: How many times as far as the values before and after it are from each other, and as nine tenths
#: of the other steps of the channel, it is from both; the same as a share of the spread of the
#: channel, against rounding errors beside zero.
AWAY, BEYOND, LARGE = 3.0, 3.0, 0.01
#: Fewest such places with one value in a channel, in all channels, and in all channels to be
#: certain. In none of 643 logs without failed reads, 31 of them recordings, a value has two.
FEWEST, FEWEST_OF_ALL, SURE = 2, 3, 10
#: Least share of the short runs of a value far from those before and after, and of all places to
#: which its channel jumps and from which it returns, that are such places.
MOSTLY, LEADING = 0.5, 1 / 3
#: Share of the other values of a channel that are nearer to the value than its long jumps, and
#: share of jumps that are long.
TYPICAL = 0.2
#: How many times as many places as its negative a value has: a velocity at rest jumps by as much in
#: both directions, whenever the position changes by a step and returns.
MIRRORED = 3
#: Least share of the failed reads of other channels in which a channel holds their value to have
#: failed with them, and largest share of its rows with it elsewhere.
TOGETHER, ELSEWHERE = 0.8, 0.5


@dataclass(frozen=True)
class FailedRead:
    """A value in the place of failed reads.

    Attributes
    ----------
    value : float
        As in the columns of the measurement.
    channels : tuple of (str, int)
        Quantity (``"q"``, ``"dq"``, ``"tau"``) and joint, from 0.
    places, times : int
        At how many rows a channel jumps to the value and returns, and how often in all channels.
    rows : ndarray of shape (n_samples,) of bool
        Rows in which one of the channels equals the value.
    """

    value: float
    channels: tuple[tuple[str, int], ...]
    places: int
    times: int
    rows: NDArray[np.bool_]


class FailedReads(Check):
    """A number in single rows that stands for a failed read."""

    name = "failed_reads"
    suspects = "numbers such as 9999, -1 or 0 that stand for failed reads"

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        found = failed_reads(measurement)
        if not found:
            return
        measurement.leave_out(np.any([read.rows for read in found], axis=0))
        for read in found:
            value, n = exactly(read.value), measurement.n_joints
            joints = sorted({k for _, k in read.channels})
            yield self.suspicion(
                f"{value} stands for failed reads in {in_words(read.channels, n)}",
                f"{int(read.rows.sum())} rows, {100 * read.rows.mean():.2g} % (the first is row "
                f"{int(np.argmax(read.rows))}), are exactly equal to it, and at {read.places} "
                "places signals jump to it and back; the other checks leave these rows out",
                "certain" if read.times >= SURE and _harmful(read) else "suspected",
                joints,
                placeholder_remedy(read.value, read.channels, n),
            )


def _harmful(read: FailedRead) -> bool:
    """Whether a diagnosis, which leaves out a few broken positions and torques, would be wrong."""
    of_velocity = any(quantity == "dq" for quantity, _ in read.channels)
    return of_velocity or read.rows.mean() > MANY_MISSING


def failed_reads(measurement: Measurement) -> list[FailedRead]:
    """Values in the place of failed reads, those in most rows first.

    Parameters
    ----------
    measurement : Measurement
        What was recorded.
    """
    s = measurement.recorded
    blocks = dict(zip(CHANNELS, (s.q, s.dq, measurement.torque), strict=True))
    columns = {(name, k): x for name, block in blocks.items() for k, x in enumerate(block.T)}
    places: dict[float, dict[tuple[str, int], NDArray[np.intp]]] = {}
    for channel, values in columns.items():
        for value, begins in _placed(values, s.trajectory, MOST_ROWS[channel[0]]).items():
            places.setdefault(value, {})[channel] = begins
    found = []
    for value, own in places.items():
        times = sum(map(len, own.values()))
        if times < FEWEST_OF_ALL:
            continue
        held = {channel: values == value for channel, values in columns.items()}
        rows = np.unique(np.concatenate(list(own.values())))
        others = np.ones(len(s.q), dtype=bool)
        others[rows] = False
        channels = tuple(
            channel
            for channel, mask in held.items()
            if channel in own or (mask[rows].mean() > TOGETHER and mask[others].mean() < ELSEWHERE)
        )
        lost = np.any([held[channel] for channel in channels], axis=0)
        found.append(FailedRead(value, channels, len(rows), times, lost))
    return sorted(found, key=lambda read: -int(read.rows.sum()))


def _placed(
    values: Array, trajectory: NDArray[np.int64], longest: int
) -> dict[float, NDArray[np.intp]]:
    """First rows of the places to which a channel jumps and from which it returns, by value.

    It stays there for at most so many rows.
    """
    together = trajectory[1:] == trajectory[:-1]
    begins, ends = equal_values(values, trajectory)
    inside = (begins > 0) & (ends < len(values)) & (ends - begins <= longest)
    begins, ends = begins[inside], ends[inside]
    inside = together[begins - 1] & together[ends - 1]
    begins, ends = begins[inside], ends[inside]
    held, before, after = values[begins], values[begins - 1], values[ends]
    jump = np.minimum(np.abs(held - before), np.abs(held - after))
    away = jump > AWAY * np.abs(after - before)
    if np.unique(held[away], return_counts=True)[1].max(initial=0) < FEWEST:
        return {}  # no value comes often enough
    near = np.zeros(len(values), dtype=int)
    near[begins[away] - 1] += 1  # the step to the value and all steps until the one from it
    near[ends[away]] -= 1
    usual = np.cumsum(near) == 0
    steps = np.abs(np.diff(values)[together & usual[:-1]])
    steps = steps[steps > 0]  # a joint may rest most of the time
    if not len(steps):
        return {}
    spread = float(np.diff(np.quantile(values[usual], [0.05, 0.95]))[0])
    far = jump > max(BEYOND * float(np.quantile(steps, 0.9)), LARGE * spread)
    away &= far
    found = {}
    names, counts = np.unique(held[away], return_counts=True)
    for value in names[(counts >= FEWEST) & (counts > LEADING * away.sum())]:
        there = away & (held == value)
        # a pause in the middle of steps always begins from the same value
        several = len(np.unique(before[there])) >= FEWEST
        # nor do values far from a dead band return to it at once
        apart = np.abs(values[usual & (values != value)] - value)
        typical = np.quantile(jump[there], 1 - TYPICAL) >= np.quantile(apart, TYPICAL)
        mirrored = value != 0 and there.sum() < MIRRORED * np.sum(away & (held == -value))
        mostly = there.sum() > MOSTLY * np.sum(far & (held == value))
        if several and typical and mostly and not mirrored:
            found[float(value) + 0.0] = begins[there]  # no negative zero
    return found
