# SPDX-License-Identifier: BSD-3-Clause
"""Recordings that are in a log twice: they would vouch for what was found in their twins."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array, Signals
from skidyn.measurement._check import Check
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._suspicion import Suspicion


def copied_rows(signals: Signals, torque: Array) -> NDArray[np.bool_]:
    """Rows of recordings that repeat an earlier one sample by sample.

    Held-out error presumes that the recordings left out are new: a copy of one that is not left
    out makes any function look right.

    Parameters
    ----------
    signals : Signals
        Motion.
    torque : ndarray of shape (n_samples, n_joints), N m or N
        Measured torque.

    Returns
    -------
    ndarray of shape (n_samples,) of bool
        Whether positions and torque of the whole recording are those of an earlier one.
    """
    copied = np.zeros(len(torque), dtype=bool)
    seen: set[bytes] = set()
    for name in dict.fromkeys(signals.trajectory.tolist()):
        rows = signals.trajectory == name
        content = signals.q[rows].tobytes() + torque[rows].tobytes()
        if content in seen:
            copied |= rows
        seen.add(content)
    return copied


class RepeatedRecordings(Check):
    """Recordings that repeat an earlier one sample by sample."""

    name = "repeated_recordings"
    suspects = "recordings that are in the log twice"

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        trajectory = measurement.signals.trajectory
        copied = copied_rows(measurement.signals, measurement.torque)
        if copied.any():
            names = np.unique(trajectory[copied]).tolist()
            yield self.suspicion(
                "recordings are in the log twice",
                f"{len(names)} of {len(np.unique(trajectory))} recordings repeat positions and "
                "torque of an earlier one sample by sample; a diagnosis uses each once",
                "suspected",
            )
