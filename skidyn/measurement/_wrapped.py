# SPDX-License-Identifier: BSD-3-Clause
"""Check of positions that were wrapped: they jump by a turn, or by the range of a counter."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from skidyn.measurement._check import Check
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._suspicion import Suspicion, remedy_of
from skidyn.measurement._wraps import NEARLY, TURN

#: A full turn in units in which positions may be.
TURNS = {TURN: "rad", 360.0: "degrees"}
#: How nearly a jump that is not measured is a turn, and most range over it.
NEAR, RANGE = 0.05, 1.1


class WrappedPosition(Check):
    """Positions that jump by a turn at its border, or by the range of a counter."""

    name = "wrapped_position"
    suspects = "positions that jump by a full turn, or by the range of a counter that overflows"

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        signals = measurement.signals
        for k in range(measurement.n_joints):
            period = measurement.periods.get(k)
            if period is not None and not _is_turn(period):
                yield self._wrapped(
                    measurement,
                    k,
                    f"it jumps by {period:.5g} {'m' if signals.prismatic[k] else 'rad'} "
                    f"{self._jumps(measurement, k, period)} time(s), always by the same, which is "
                    "no full turn: a counter of this range overflows",
                )
                continue
            if signals.prismatic[k]:
                continue
            for turn, unit in TURNS.items():
                count = self._jumps(measurement, k, turn)
                if count and np.ptp(signals.q[:, k]) < RANGE * turn:
                    evidence = f"it jumps by a full turn of {turn:.4g} {unit} {count} time(s)"
                    yield self._wrapped(measurement, k, evidence)
                    break

    def _jumps(self, measurement: Measurement, k: int, size: float) -> int:
        """Number of jumps of a position by about some size."""
        q, parts = measurement.signals.q[:, k], measurement.signals.segments
        jumps = [np.abs(np.abs(np.diff(q[rows])) - size) < NEAR * size for rows in parts]
        return int(sum(found.sum() for found in jumps))

    def _wrapped(self, measurement: Measurement, k: int, evidence: str) -> Suspicion:
        what = f"the position of {measurement.joint(k)} is wrapped"
        return self.suspicion(what, evidence, "certain", [k], remedy_of("unwrap", True))


def _is_turn(period: float) -> bool:
    """Whether jumps of a measured size are those of a full turn."""
    return any(abs(period / turn - 1) < NEARLY for turn in TURNS)
