# SPDX-License-Identifier: BSD-3-Clause
"""Check for torque from a slower bus, interpolated or held, also with noise added afterwards.

A value that is held changes in every n-th row only, a line bends in every n-th row only, and a
cubic spline has a new third derivative there. So the size of the differences of the torque depends
on the number of the row modulo n, which no motion, friction or noise can cause. A wave of constant
frequency can, such as hum of the mains in a sensor, if a multiple of its half period is n rows:
what is left without such waves must show it, too.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator

import numpy as np

from skidyn._signals import Array
from skidyn.measurement._check import Check
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._measures import divided_differences
from skidyn.measurement._suspicion import Suspicion, resample_to

#: Rows between two values of the slower bus that are tried, and orders of the differences: of held
#: values, lines and cubic splines.
PERIODS, ORDERS = range(2, 17), (1, 2, 4)
#: Least log-likelihood gain of a period, on all joints or on one of them alone; share of the joints
#: that must gain by it to have one bus; how many times as large the largest differences are as the
#: smallest ones, on one of them.
SURE, AGREEING, TIMES = 40.0, 0.6, 1.7
#: Share of the steps of a recording that may differ from the usual one by more than half of it:
#: over a shorter step, the noise of a difference is larger.
UNEVEN = 0.01
#: Fewest differences of each phase, and least size of them as a share of the spread of the torque.
FEWEST, ROUNDING = 30, 1e-9
#: Degree of the polynomial of time by which the amplitude and phase of a wave may change.
CHANGES = 2


class SlowTorque(Check):
    """Torque that is interpolated or held between the values of a slower bus."""

    name = "slow_torque"
    of_sensor = True
    suspects = "torque from a slower bus that was interpolated or held, also with noise added"
    misnames = True

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        if measurement.stale or measurement.smoothed or measurement.lost:
            return  # reported by another check, or rows have no number
        tables = [(order, _periods(measurement, order)) for order in ORDERS]
        for order, table in tables:
            most = _best([(period, _total(own)) for period, own in table])
            alike = {k: one for k, one in dict(table).get(most, {}).items() if one[0] > 0}
            agree = len(alike) >= AGREEING * sum(measurement.excited)
            if agree and _shows(alike) and _shows(_without_waves(measurement, order, most, alike)):
                measurement.stale = True
                gained = f"equally on {len(alike)} joints, which improves"
                yield self._of(measurement, order, most, alike, "the torque", gained)
                return
        for order, table in tables:
            joints = sorted({k for _, own in table for k in own} - measurement.slow)
            for k in joints:
                most = _best([(period, own[k][0]) for period, own in table])
                alone = {k: dict(table)[most][k]} if most else {}
                if _shows(alone) and _shows(_without_waves(measurement, order, most, alone)):
                    measurement.slow.add(k)
                    torque = f"the torque of {measurement.joint(k)}"
                    yield self._of(measurement, order, most, alone, torque, "which improves")

    def _of(
        self,
        measurement: Measurement,
        order: int,
        period: int,
        alike: dict[int, tuple[float, float]],
        what: str,
        gained: str,
    ) -> Suspicion:
        """A torque that has a new value every few rows."""
        rate = float(f"{measurement.rate / period:.4g}")
        way = "held" if order == 1 else "interpolated"
        return self.suspicion(
            f"{what} was {way} between the values of a slower bus, at about {rate:g} Hz",
            f"every {period} rows it {'changes' if order == 1 else 'bends'} up to "
            f"{max(times for _, times in alike.values()):.3g} times as much as in the rows "
            f"between, {gained} the likelihood of these changes by "
            f"{sum(gain for gain, _ in alike.values()):.0f}",
            "suspected",
            alike,
            resample_to(rate),
        )


def _total(own: dict[int, tuple[float, float]]) -> float:
    """What all joints gain together."""
    return sum(max(gain, 0.0) for gain, _ in own.values())


def _shows(alike: dict[int, tuple[float, float]]) -> bool:
    """Whether joints gain enough by a period, and the sizes differ enough in it."""
    return _total(alike) >= SURE and max(times for _, times in alike.values()) >= TIMES


def _best(gains: list[tuple[int, float]]) -> int:
    """The period that gains most, 0 if none does; multiples of it gain as much."""
    most, best = 0.0, 0
    for period, gain in gains:
        if gain > max(1.1 * most, most + 5.0):
            most, best = gain, period
    return best


def _without_waves(
    measurement: Measurement, order: int, period: int, joints: Collection[int]
) -> dict[int, tuple[float, float]]:
    """What differences of some joints, from 0, gain by a period without waves that repeat in it."""
    ((_, own),) = _periods(measurement, order, only=period)
    return {k: own[k] for k in joints}


def _periods(
    measurement: Measurement, order: int, only: int | None = None
) -> list[tuple[int, dict[int, tuple[float, float]]]]:
    """What the differences of the torque of every joint, from 0, gain by every period.

    The values of one bus come at the same time, so that joints with much noise need not show by
    themselves what others show. Every gain of log-likelihood is given with the largest ratio of
    sizes; joints that do not move and torques that never change are left out. For a period alone,
    ``only``, the differences are taken without waves that repeat in it.
    """
    s, spread = measurement.signals, np.std(measurement.torque, axis=0)
    joints = np.flatnonzero(measurement.excited & (spread > 0))
    torque, rounding = measurement.torque[:, joints], ROUNDING * spread[joints]
    differences = [
        divided_differences(torque[rows], s.clock[rows], order)
        for rows in s.segments
        if rows.stop - rows.start > 4 * FEWEST and _is_even(s.clock[rows])
    ]
    if only is not None:
        differences = [own - _waves(own, only) for own in differences]
    parts = [np.log(np.abs(own) + rounding) for own in differences]
    parts = [part - part.mean(axis=0) for part in parts]  # for squares without cancellation
    squares = [np.sum(part**2, axis=0) for part in parts]
    found: list[tuple[int, dict[int, tuple[float, float]]]] = []
    if not len(joints) or max(map(len, parts), default=0) < 4 * FEWEST:
        return found
    for period in PERIODS if only is None else [only]:
        sizes = [
            _sizes(part, square, period)
            for part, square in zip(parts, squares, strict=True)
            if len(part) >= period * FEWEST
        ]
        if not sizes:
            continue
        counts = np.array([n for _, n, _ in sizes])
        gains = sum(gain for _, _, gain in sizes) - 0.5 * np.log(counts.sum()) * (period - 1)
        logs = np.average([_from_largest(x) for x, _, _ in sizes], axis=0, weights=counts)
        times = np.exp(np.ptp(logs, axis=0))
        both = zip(gains.tolist(), times.tolist(), strict=True)
        found.append((period, dict(zip(joints.tolist(), both, strict=True))))
    return found


def _is_even(clock: Array) -> bool:
    """Whether nearly all steps of a recording have the same length."""
    steps = np.diff(clock)
    usual = np.median(steps)
    return bool(np.mean(np.abs(steps - usual) > 0.5 * usual) <= UNEVEN)


def _waves(differences: Array, period: int) -> Array:
    """The part of differences, (n_rows, n_joints), whose square repeats after a number of rows.

    It is the sum of all waves of which the period, or half of it, is that number of rows or a whole
    part of it; their amplitudes and phases may change slowly.
    """
    row = np.arange(len(differences))
    phase = np.pi * np.outer(row, np.arange(1, period + 1)) / period
    waves = np.hstack([np.cos(phase), np.sin(phase)])
    slow = np.polynomial.legendre.legvander(2 * row / max(len(row) - 1, 1) - 1, CHANGES)
    columns = (waves[:, :, None] * slow[:, None, :]).reshape(len(row), -1)
    return np.asarray(columns @ np.linalg.lstsq(columns, differences, rcond=None)[0])


def _sizes(logs: Array, square: Array, period: int) -> tuple[Array, int, Array]:
    """Mean logarithms by phase, their number, and what phases gain.

    Parameters
    ----------
    logs : ndarray of shape (n_differences, n_joints)
        Logarithms of the sizes of differences, less their mean.
    square : ndarray of shape (n_joints,)
        Sum of their squares.
    period : int
        Number of phases.
    """
    count = len(logs) // period * period
    means = logs[:count].reshape(-1, period, logs.shape[1]).mean(axis=0)
    total = (square - np.sum(logs[count:] ** 2, axis=0)) / count - means.mean(axis=0) ** 2
    within = total - means.var(axis=0)
    gain = 0.5 * count * np.log(np.maximum(total, 1e-12) / np.maximum(within, 1e-12))
    # one phase and size of every recording that is fitted
    return means, count, gain - 0.5 * (period - 1) * (1 + np.log(period))


def _from_largest(means: Array) -> Array:
    """Means by phase from the largest on, (n_phases, n_joints).

    Recordings begin at any row of the slower bus, and its values are evenly long.
    """
    phases = (np.argmax(means, axis=0) + np.arange(len(means))[:, None]) % len(means)
    return np.take_along_axis(means, phases, axis=0)
