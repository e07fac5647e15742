# SPDX-License-Identifier: BSD-3-Clause
"""Check for torque from a slower bus, interpolated or held, also with noise added afterwards.

A value that is held changes in every n-th row only, a line bends in every n-th row only, and a
cubic spline has a new third derivative there. So the size of the differences of the torque depends
on the number of the row modulo n, which no motion, friction or noise can cause.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from skidyn._signals import Array
from skidyn.measurement._check import Check
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._measures import divided_differences
from skidyn.measurement._suspicion import Suspicion

#: Rows between two values of the slower bus that are tried, and orders of the differences: of held
#: values, lines and cubic splines.
PERIODS, ORDERS = range(2, 17), (1, 2, 4)
#: Least log-likelihood gain of a period on a joint; share of the joints that must agree; how many
#: times as large the largest differences are as the smallest ones.
SURE, AGREEING, TIMES = 40.0, 0.6, 1.7
#: Fewest differences of each phase, and least size of them as a share of the spread of the torque.
FEWEST, ROUNDING = 30, 1e-9


class SlowTorque(Check):
    """Torque that is interpolated or held between the values of a slower bus."""

    name = "slow_torque"
    of_sensor = True
    suspects = "torque from a slower bus that was interpolated or held, also with noise added"
    misnames = True

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        if measurement.stale or measurement.smoothed or measurement.lost:
            return  # reported by another check, or rows have no number
        for order in ORDERS:
            found = {}
            for k in np.flatnonzero(measurement.excited).tolist():
                period, gain, times = _period(measurement, k, order)
                if gain > SURE and times > TIMES:
                    found[k] = (period, gain, times)
            periods = [period for period, _, _ in found.values()]
            common = max(set(periods), key=periods.count) if periods else 0
            alike = {k: one for k, one in found.items() if one[0] == common}
            if not alike or len(alike) < AGREEING * sum(measurement.excited):
                continue
            measurement.stale = True
            rate = float(f"{measurement.rate / common:.4g}")
            way = "held" if order == 1 else "interpolated"
            yield self.suspicion(
                f"the torque was {way} between the values of a slower bus, at about {rate:g} Hz",
                f"every {common} rows it {'changes' if order == 1 else 'bends'} up to "
                f"{max(times for _, _, times in alike.values()):.3g} times as much as in the rows "
                f"between, equally on {len(alike)} joints, which improves the likelihood of these "
                f"changes by {sum(gain for _, gain, _ in alike.values()):.0f}",
                "suspected",
                alike,
                (f"--resample {rate:g}", f"resample_rate={rate:g}"),
            )
            return


def _period(measurement: Measurement, joint: int, order: int) -> tuple[int, float, float]:
    """Period of a torque's differences, its log-likelihood gain, and their largest ratio."""
    s, torque = measurement.signals, measurement.torque[:, joint]
    parts = [
        np.abs(divided_differences(torque[rows], s.clock[rows], order))
        for rows in s.segments
        if rows.stop - rows.start > 4 * FEWEST
    ]
    if not parts:
        return 0, 0.0, 1.0
    longest = max(parts, key=len)
    spread = float(np.std(torque))
    if spread == 0 or len(longest) < 4 * FEWEST:
        return 0, 0.0, 1.0
    best = (0, 0.0, 1.0)
    logs_of = [np.log(part + ROUNDING * spread) for part in parts]
    for period in PERIODS:
        sizes = [_sizes(logs, period) for logs in logs_of if len(logs) >= period * FEWEST]
        if not sizes:
            continue
        # recordings begin at any row of the slower bus, and its values are evenly long
        turned = [np.roll(logs, -int(np.argmax(logs))) for logs, _, _ in sizes]
        counts = np.array([n for _, n, _ in sizes])
        gain = float(sum(g for _, _, g in sizes)) - 0.5 * np.log(counts.sum()) * (period - 1)
        logs = np.average(turned, axis=0, weights=counts)
        if gain > max(best[1] * 1.1, best[1] + 5.0):  # multiples of the period gain as much
            best = (period, gain, float(np.exp(np.ptp(logs))))
    return best


def _sizes(logs: Array, period: int) -> tuple[Array, int, float]:
    """Mean logarithms of differences by phase, their number, and what phases gain."""
    rows = logs[: len(logs) // period * period].reshape(-1, period)
    means = rows.mean(axis=0)
    apart = (rows - means).ravel()
    within = float(apart @ apart) / rows.size
    total = within + float(np.var(means))
    gain = 0.5 * rows.size * np.log(total / max(within, 1e-12)) if total > 0 else 0.0
    # one phase and size of every recording that is fitted
    return means, rows.size, gain - 0.5 * (period - 1) * (1 + np.log(period))
