# SPDX-License-Identifier: BSD-3-Clause
"""Check for commanded positions: without noise, and ahead of the torque."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from skidyn._signals import Array, scatter
from skidyn.measurement._check import Check
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._measures import divided_differences
from skidyn.measurement._suspicion import Suspicion
from skidyn.measurement._torque_delay import ERRORS, SMALLEST, measured_delay

#: Order of the differences, which motion hardly reaches.
ORDER = 6
#: Scatter of a position, rad (m for a slider), below what encoders and vibrations leave; and of a
#: torque that is measured, as a share of its spread.
NOISELESS, NOISY = 1e-7, 1e-3
#: Fewest rows of a recording.
ENOUGH = 100


class CommandedMotion(Check):
    """Positions that were commanded, not measured."""

    name = "commanded_motion"
    of_sensor = True
    suspects = "commanded positions instead of measured ones"
    stage = 2

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        s = measurement.signals
        moving = [k for k, moves in enumerate(measurement.excited) if moves]
        parts = [rows for rows in s.segments if rows.stop - rows.start > ENOUGH]
        if measurement.stale or measurement.computed or not moving or not parts:
            return
        positions: list[float] = []
        for k in moving:
            positions += _scatter(s.q[:, [k]], s.clock, parts).tolist()
            if positions[-1] > NOISELESS:
                return  # mostly the first one
        torque = measurement.torque[:, moving]
        noise = _scatter(torque, s.clock, parts) / (np.std(torque, axis=0) + 1e-300)
        if noise.min() < NOISY:
            return
        delay = measured_delay(measurement)
        if delay is None or not delay.common > max(SMALLEST, ERRORS * delay.error):
            return  # a simulation without noise is in time
        unit = "m" if s.prismatic[moving[int(np.argmax(positions))]] else "rad"
        yield self.suspicion(
            "positions were commanded, not measured",
            f"they scatter by at most {max(positions):.1g} {unit} from sample to sample, less "
            f"than any encoder, and are ahead of the torque by {1e3 * delay.common:.0f} ms; "
            "commands differ from the motion by the error of the controller, so record measured "
            "positions",
            "noted",
            moving,
        )


def _scatter(values: Array, time: Array, parts: list[slice]) -> Array:
    """Scatter of every channel, from differences that smooth functions do not have."""
    rest = [divided_differences(values[rows], time[rows], ORDER) for rows in parts]
    return np.asarray(scatter(np.concatenate(rest), axis=0))
