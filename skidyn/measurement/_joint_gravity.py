# SPDX-License-Identifier: BSD-3-Clause
"""Check for a single joint from whose torque gravity was removed.

A controller may compensate gravity on the joints that need it, and log what is left of the torque.
The gravity of the stated bodies is added to one torque at a time. It was removed only if all of it
is missing, and no effect, as a gravity compensator or a spring, takes its place.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from skidyn.measurement._check import Check
from skidyn.measurement._duel import duel_of
from skidyn.measurement._fits import Fits
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._near_bodies import LOOSE, ExtraColumns, Factored, NearBodies
from skidyn.measurement._reading import Reading
from skidyn.measurement._suspicion import Suspicion
from skidyn.measurement._torque import asked_changes, readable_fits

#: Log-likelihood that the gravity of a joint must gain, also beside any effect, and the least share
#: of it there.
SURE, LEAST, BESIDE = 20.0, 15.0, 0.3
#: How far the share of gravity that is missing may be from all of it, and its largest standard
#: error: a gain, another body or a compensator takes off another share.
ALL, KNOWN = 0.25, 0.1


class JointGravity(Check):
    """Torque of a single joint that contains no gravity."""

    name = "joint_gravity"
    suspects = "torque of a single joint from which gravity was removed"
    stage = 2
    misnames = True

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        fits = readable_fits(measurement)
        if fits is None or measurement.scaled:
            return
        for k, (share, error, gain) in without_gravity(measurement, fits).items():
            yield self.suspicion(
                f"the torque of {measurement.joint(k)} contains no gravity, but that of other "
                "joints does",
                f"{100 * share:.0f} % of the gravity of the stated bodies is missing there "
                f"(standard error {100 * error:.0f} %), and with it bodies near the stated ones "
                f"explain the torque better by {gain:.0f} (log-likelihood); record the torque with "
                "gravity, or add that of the controller",
                "suspected",
                [k],
            )


def without_gravity(measurement: Measurement, fits: Fits) -> dict[int, tuple[float, float, float]]:
    """Joints, from 0, whose torque has no gravity, in a measurement that is read correctly.

    Parameters
    ----------
    measurement : Measurement
        Recording and robot.
    fits : Fits
        Its rows.

    Returns
    -------
    dict of int to (float, float, float)
        Missing share, its standard error, and gain.
    """
    if measurement.odd or measurement.computed:
        return {}
    if not np.any(fits.robot.inertial_parameters) or not np.any(fits.robot.gravity):
        return {}
    if any(not change.other for change in asked_changes(measurement, fits)):
        return {}
    return {k: (x, error, gain) for k, x, error, gain in find_without_gravity(fits)}


def find_without_gravity(fits: Fits) -> list[tuple[int, float, float, float]]:
    """Joints whose torque has no gravity: joint, from 0, missing share, its error, and gain.

    Parameters
    ----------
    fits : Fits
        Rows.
    """
    gravity = fits.robot.gravity_torque(Reading().motion(fits.signals).q)
    pull = fits.average(gravity)
    fits = fits.loaded()
    torque = fits.torque + gravity
    before, after = (rows.nominal(Reading()) for rows in (fits, fits.with_torque(torque)))
    gained = after.likelihood - before.likelihood
    promising = []
    for k in range(fits.n_joints):
        if not fits.usable(k):
            continue
        y, use = fits.mean_torque(k)
        if np.std(pull[use, k]) < 0.2 * np.std(y[use] + pull[use, k]):
            continue
        if gained[k] > 0:  # bodies near the stated ones decide
            promising.append(k)
    if not promising:
        return []
    inflation = fits.identified(Reading()).inflation
    gains, found = np.ones(fits.n_joints), []
    here = NearBodies(fits, Reading(), gains, inflation)
    for k in promising:
        size = float(np.std(pull[:, k]))
        extra = ExtraColumns({k: pull[:, [k]] / size}, (), np.array([LOOSE]))
        free = here.fit(extra)
        share = -float(free.coefficients[-1]) / size
        error = float(np.sqrt(Factored(free.gram).solve(np.eye(len(free.gram))[-1])[-1])) / size
        if abs(share - 1) > ALL or error > KNOWN:
            continue
        torque = fits.torque.copy()
        torque[:, k] += gravity[:, k]
        there = NearBodies(fits.with_torque(torque), Reading(), gains, inflation)
        duel = duel_of(here, there, range(fits.n_joints))
        if duel.gain > SURE and duel.beside > max(LEAST, BESIDE * duel.gain):
            found.append((k, share, error, duel.gain))
    return found
