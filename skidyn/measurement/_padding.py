# SPDX-License-Identifier: BSD-3-Clause
"""Check for recordings that were filled up with zeros to a common length."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array
from skidyn.measurement._check import Check
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._placeholder import placeholder_remedy
from skidyn.measurement._suspicion import Suspicion

#: Fewest rows of zeros at an end of a recording.
FEWEST_ROWS = 3


class PaddedRows(Check):
    """Rows at the ends of recordings in which all positions and torques are zero."""

    name = "padded"
    suspects = "rows of zeros that were added at the ends of recordings"

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        s = measurement.recorded
        rows = padded_rows(s.q, measurement.torque, s.trajectory)
        if not rows.any():
            return
        recordings = np.unique(s.trajectory[rows])
        measurement.leave_out(rows)
        n = measurement.n_joints
        yield self.suspicion(
            "recordings were filled up with zeros at their ends",
            f"in {int(rows.sum())} rows, {100 * rows.mean():.2g} %, at the ends of "
            f"{len(recordings)} recordings every position and torque is exactly zero, and the "
            "positions before are not; the other checks leave these rows out",
            "certain",
            remedy=placeholder_remedy(0.0, [("q", k) for k in range(n)], n),
        )


def padded_rows(
    positions: Array, torque: Array, trajectory: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Rows of zeros at the ends of recordings, to which positions jump, as a mask.

    Velocities may have been derived from the positions, so that they jump at the first such row.

    Parameters
    ----------
    positions : ndarray of shape (n_samples, n_joints), rad or m
        Recorded positions.
    torque : ndarray of shape (n_samples, n_joints), N m or N
        Recorded torque.
    trajectory : ndarray of shape (n_samples,)
        Recording of every row.

    Returns
    -------
    ndarray of shape (n_samples,) of bool
    """
    zero: NDArray[np.bool_] = np.all((positions == 0) & (torque == 0), axis=1)
    found = np.zeros_like(zero)
    for name in np.unique(trajectory):
        rows = np.flatnonzero(trajectory == name)
        steps = np.abs(np.diff(positions[rows[~zero[rows]]], axis=0)).max(axis=0, initial=0.0)
        for end in (rows, rows[::-1]):
            count = int(np.argmin(zero[end]))
            if count < FEWEST_ROWS:
                continue  # also where no other row is left
            if np.any(np.abs(positions[end[count]]) > 2 * steps):
                found[end[:count]] = True
    return found
