# SPDX-License-Identifier: BSD-3-Clause
"""Gravity that the torque of some recordings contains, and that of others does not.

A controller may offer the measured torque with its gravity compensation or without. If the option
is switched between recordings, the difference looks like a load that some of them carry.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from skidyn._signals import Array
from skidyn._text import trajectories_told
from skidyn.measurement._bodies import explained
from skidyn.measurement._check import Check
from skidyn.measurement._fits import Fits
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._reading import Reading
from skidyn.measurement._suspicion import Suspicion

#: Fewest recordings; fewest rows of one to be judged.
RECORDINGS, FEWEST = 3, 12
#: Share of the gravity of the stated bodies from which a recording has it, and below which not.
HAS, LACKS = 0.6, 0.4
#: How much the share of one that lacks it may differ from that of the others minus one: a contact
#: that carries the tool leaves any share.
ALIKE = 0.2
#: Log-likelihood that gravity in the others must gain with identified bodies, and the share of the
#: residual that it must take off on some joint.
SURE, DROP = 40.0, 0.5
#: Share of the square of a gravity torque from which it varies; what keeps a ratio finite.
LEAST, LITTLE = 1e-4, 1e-300


class GravityOfRecordings(Check):
    """Torque that contains gravity in some recordings only."""

    name = "gravity_of_recordings"
    of_sensor = True
    suspects = "torque that contains gravity in some recordings and not in others"
    stage = 1
    misnames = True

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        if measurement.stale or measurement.lost or measurement.odd:
            return
        seen = explained(measurement)
        if seen is None or not np.any(seen.fits.robot.gravity):
            return
        fits = seen.fits.loaded()
        shares = gravity_shares(fits)
        judged = [run for run, share in shares.items() if not LACKS < share < HAS]
        if len(shares) < RECORDINGS or len(judged) < len(shares):
            return
        # one with too few rows is as that before it
        runs = np.unique(fits.recording)
        before = np.maximum(np.searchsorted(judged, runs, side="right") - 1, 0)
        lacks = np.array([shares[judged[at]] < HAS for at in before])
        if lacks.all() or not lacks.any():
            return
        without = [shares[run] for run in judged if shares[run] < HAS]
        with_it = float(np.median([shares[run] for run in judged if shares[run] >= HAS]))
        if abs(float(np.median(without)) - (with_it - 1)) > ALIKE:
            return
        lacking = runs[lacks].tolist()
        torque = fits.torque.copy()
        rows = np.isin(fits.signals.trajectory, lacking)
        torque[rows] += fits.robot.gravity_torque(fits.signals.q[rows])
        here, there = (f.identified(Reading()) for f in (fits, fits.with_torque(torque)))
        gain = there.gained_over(here)
        left = [
            np.std(there.residual[k]) / (np.std(here.residual[k]) + LITTLE) for k in seen.joints
        ]
        drop = 1 - float(min(left))
        if gain < SURE or drop < DROP:
            return
        measurement.odd = True
        yield self.suspicion(
            f"the torque contains no gravity in {trajectories_told(lacking)}, and in the others it "
            "does",
            "with the gravity of the stated bodies there, identified bodies explain the torque of "
            f"all trajectories better by {gain:.0f} (log-likelihood) and leave up to "
            f"{100 * drop:.0f} % less residual; record all of them with gravity, or diagnose them "
            "separately",
            "suspected",
        )


def gravity_shares(fits: Fits) -> dict[int, float]:
    """Share of the gravity of the stated bodies in the torque of each recording with enough rows.

    Within a recording, and beside inertia, friction and an offset of every joint.

    Parameters
    ----------
    fits : Fits
        Rows.
    """
    pull, still, speed, sign = fits.read_columns()
    found = {}
    for run in np.unique(fits.recording).tolist():
        along = square = 0.0
        for k in range(fits.n_joints):
            torque, use = fits.mean_torque(k)
            rows = use & (fits.recording == run)
            if not fits.usable(k) or rows.sum() < FEWEST:
                continue
            others = np.column_stack(
                [still[rows, k], speed[rows, k], sign[rows, k], np.ones(int(rows.sum()))]
            )
            p, t = _beside(others, np.column_stack([pull[rows, k], torque[rows]])).T
            if p @ p < LEAST * float(np.sum(pull[rows, k] ** 2)):
                continue  # constant, as on a vertical slide
            noise = float(np.var(torque[use])) + LITTLE  # joints weigh as their torques vary
            along, square = along + float(p @ t) / noise, square + float(p @ p) / noise
        if square > 0:
            found[run] = along / square
    return found


def _beside(columns: Array, values: Array) -> Array:
    """What some columns leave of values."""
    size = np.linalg.norm(columns, axis=0) + LITTLE
    solution = np.linalg.lstsq(columns / size, values, rcond=1e-9)[0]
    return np.asarray(values - columns / size @ solution)
