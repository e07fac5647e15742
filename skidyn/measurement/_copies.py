# SPDX-License-Identifier: BSD-3-Clause
"""Recordings and channels that occur twice in a log."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array, Signals
from skidyn.measurement._check import Check
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._suspicion import Suspicion

#: Rounding error of a copy, as a share of its spread, and least number of its values.
ROUNDING, FEWEST_VALUES = 1e-6, 50


def copied_rows(signals: Signals, torque: Array) -> NDArray[np.bool_]:
    """Rows of recordings that repeat an earlier one sample by sample.

    The held-out error assumes that the held-out recordings are new: with a copy in the training
    data any function would seem correct.

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
    suspects = "recordings that occur twice in the log"

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        trajectory = measurement.signals.trajectory
        copied = copied_rows(measurement.signals, measurement.torque)
        if copied.any():
            names = np.unique(trajectory[copied]).tolist()
            yield self.suspicion(
                "recordings occur twice in the log",
                f"{len(names)} of {len(np.unique(trajectory))} recordings repeat positions and "
                "torque of an earlier one sample by sample; a diagnosis uses each recording once",
                "suspected",
            )


class CopiedTorque(Check):
    """A torque that is another channel of the log."""

    name = "copied_torque"
    of_sensor = True
    suspects = "torque that is a copy of another channel: another torque, a position or a velocity"
    misnames = True

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        for k, what, j in copied_columns(measurement):
            yield self.suspicion(
                f"the torque of {measurement.joint(k)} is the {what} of {measurement.joint(j)}",
                "they agree in every row up to rounding and a constant factor",
                "certain" if what != "torque" else "suspected",
                [k] if what != "torque" else [j, k],
            )


def copied_columns(measurement: Measurement) -> list[tuple[int, str, int]]:
    """Torques that equal another channel: joint, channel, and its joint, from 0."""
    return measurement.once("copies", lambda: list(_copies(measurement)))


def _copies(measurement: Measurement) -> Iterator[tuple[int, str, int]]:
    s, torque = measurement.signals, measurement.torque
    channels = {"torque": torque, "position": s.q, "velocity": s.dq}
    for k in range(measurement.n_joints):
        for what, values in channels.items():
            for j in range(k if what == "torque" else measurement.n_joints):
                if _is_line(values[:, j], torque[:, k]):
                    yield k, what, j


def _is_line(x: Array, y: Array) -> bool:
    """Whether one channel is a multiple of another, with an offset, up to rounding."""
    few = slice(None, None, max(1, len(x) // 50))
    if not _nearly(x[few], y[few]):
        return False
    return len(np.unique(x)) > FEWEST_VALUES and _nearly(x, y)


def _nearly(x: Array, y: Array) -> bool:
    x, y = x - x.mean(), y - y.mean()
    size = float(y @ y)
    if size <= 0 or not x @ x > 0:
        return False
    return float(np.sum((y - (x @ y) / (x @ x) * x) ** 2)) < ROUNDING**2 * size
