# SPDX-License-Identifier: BSD-3-Clause
"""Checks of values that are not new: held positions and torques, and zeros for missing values."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from skidyn.measurement._check import Check
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._measures import is_held, position_step
from skidyn.measurement._suspicion import Suspicion
from skidyn.measurement._torque import cut_columns

#: Least share of rows with the torque of the previous row, for a torque that is not coarse.
HELD = 0.3


class HeldTorque(Check):
    """A torque that holds its last value while joints move on."""

    name = "held_torque"
    of_sensor = True
    suspects = "torque that holds its last value: reported less often than the positions"

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        s = measurement.signals
        together = s.trajectory[1:] == s.trajectory[:-1]
        moved = np.any(s.q[1:] != s.q[:-1], axis=1) & together
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
                remedy=("--drop-repeated", "drop_repeated=True"),
            )
            return
        shares, lost = np.zeros(measurement.n_joints), cut_columns(measurement)
        for k in range(measurement.n_joints):
            torque = measurement.torque[:, k]
            # equal steps are due to a coarse sensor, not a slow one
            fine = len(np.unique(torque)) > 0.1 * len(torque) and np.isnan(position_step(torque))
            if k not in lost and fine:
                shares[k] = np.mean(torque[1:][moved] == torque[:-1][moved])
        held = np.flatnonzero(shares > HELD)
        if len(held):
            yield self.suspicion(
                f"the torque of {', '.join(measurement.joint(int(k)) for k in held)} holds its "
                "last value",
                f"in {100 * shares[held].max():.0f} % of the rows in which positions change: it is "
                "reported less often",
                "suspected",
                [int(k) for k in held],
            )


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
                (f"--resample {rate:g}", f"resample_rate={rate:g}"),
            )


class MissingTorque(Check):
    """Zeros in the place of missing torques."""

    name = "missing_torque"
    of_sensor = True
    suspects = "zeros in the place of missing torques"

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        rows = measurement.missing
        if rows.any():
            yield self.suspicion(
                "missing torques were replaced by zero",
                f"in {int(rows.sum())} rows, {rows.mean():.1%} (the first in row "
                f"{int(np.argmax(rows))}), all torques are zero at once, but not close to zero in "
                "the rows beside them; write missing values as empty cells, and read the log with "
                "missing='drop', or leave these rows out",
                "certain",
            )
