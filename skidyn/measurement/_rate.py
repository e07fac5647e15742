# SPDX-License-Identifier: BSD-3-Clause
"""Another rate of clock and velocities, from the torque; torque that contains gravity only.

Inertia grows with the square of the rate and gravity does not, so that no scale of a torque is
equivalent. A torque without inertia is like that at a rate of zero.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from skidyn.measurement._changes import tilt_gain
from skidyn.measurement._check import Check
from skidyn.measurement._fits import Fits
from skidyn.measurement._gains import CLEARLY, USUAL, known_gains
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._peak import climb, peak
from skidyn.measurement._reading import Reading
from skidyn.measurement._readings import DECISIVE
from skidyn.measurement._robust import ROUNDS
from skidyn.measurement._suspicion import Suspicion
from skidyn.measurement._torque import asked_changes, readable_fits

#: Least log-likelihood gain of another rate, and its value where the scales of torques are usual.
LEAST, SURE = 15.0, 40.0
#: Rates of clock and velocities that are tried.
RATES = (0.1, 0.2, 0.33, 0.5, 2.0, 3.0, 5.0, 10.0)
#: Share of the residual of identified bodies that another rate may leave on the joint that it helps
#: most: noise of accelerations makes inertia look smaller, but its removal leaves most.
HALF = 0.5
#: Distance of the points of a parabola through the likelihood of the logarithm of a rate, how far
#: identified bodies may move it, and how near it is to a whole multiple that is one.
RATE_STEP, RATE_MOVES, RATE_WHOLE = 0.02, 0.2, 0.02
#: Rate below which no clock is wrong: the torque has next to no inertia.
STATIC = 0.05


class GravityOnly(Check):
    """Torque without inertia, as the gravity compensation of a controller has it."""

    name = "gravity_only"
    of_sensor = True
    suspects = "torque that contains gravity only, as that of a gravity compensation"
    stage = 2
    misnames = True

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        fits = readable_fits(measurement)
        if fits is None or any(not c.joints for c in asked_changes(measurement, fits)):
            return  # with another gravity, there is another rate
        rate = asked_rate(measurement, fits)
        if rate is None or rate > STATIC:
            return
        gained = rate_gain(fits.loaded(), STATIC)
        yield self.suspicion(
            "the torque contains gravity only: it is that of a gravity compensation, and was not "
            "measured",
            "without the inertia and the Coriolis torques of the stated bodies it is explained "
            f"better by {gained:.0f} (log-likelihood), although the joints accelerate; log the "
            "measured torque",
            "suspected",
        )


def asked_rate(measurement: Measurement, fits: Fits) -> float | None:
    """Rate of clock and velocities that the torque of all joints asks for; None if as logged."""
    if measurement.stale:  # accelerations of held positions are too small
        return None

    def rate() -> float | None:
        odd = any(not USUAL[0] <= gain <= USUAL[1] for gain in known_gains(fits).values())
        return other_rate(fits.loaded(), odd)

    return measurement.once("rate", rate)


def rate_gain(fits: Fits, rate: float, rounds: int = ROUNDS) -> float:
    """Log-likelihood gain of another rate of clock and velocities."""
    here, there = (fits.nominal(Reading(stretch=x), rounds) for x in (1.0, rate))
    return there.gained_over(here)


def other_rate(fits: Fits, odd: bool) -> float | None:
    """Rate of clock and velocities that explains the torque better; None if there is none.

    Inertia grows with its square and gravity does not, so no scale of a torque is equivalent. If
    the scales of some torques are odd, it must make all of them usual, or identified bodies,
    which have no scale, must confirm it.
    """
    few = fits.few
    best, log = max((rate_gain(few, rate, 1), float(np.log(rate))) for rate in RATES)
    if best < LEAST and not odd:
        return None
    log, best = climb(lambda log: rate_gain(fits, float(np.exp(log))), log, 0.2, 0.01)
    rate = float(np.exp(log))
    if best < SURE or CLEARLY[0] < rate < CLEARLY[1]:
        return None
    if best < tilt_gain(fits):
        return None  # the inertia of an upright first joint is small beside gravity on a slope
    gains = list(known_gains(fits, Reading(stretch=rate)).values())
    usual = odd and len(gains) > 1 and all(USUAL[0] <= gain <= USUAL[1] for gain in gains)
    here, there = (fits.identified(Reading(stretch=x)) for x in (1.0, rate))
    confirmed = there.gained_over(here) > DECISIVE
    shares = (
        np.std(after) / max(float(np.std(before)), 1e-300)
        for before, after in zip(here.residual, there.residual, strict=True)
        if len(before)
    )
    if min(shares, default=1.0) > HALF:
        return None
    return _sharpened(fits, rate) if usual or confirmed else None


def _sharpened(fits: Fits, rate: float) -> float:
    """Rate at which identified bodies fit best, since stated ones are not exact.

    Rates that are set wrongly are mostly whole multiples or parts of the right one.
    """

    def likelihood(log: float) -> float:
        return float(fits.identified(Reading(stretch=float(np.exp(log)))).likelihood.sum())

    log = peak(likelihood, float(np.log(rate)), RATE_STEP)
    found = float(np.exp(log)) if abs(log - np.log(rate)) < RATE_MOVES else rate
    times = max(found, 1 / found)
    whole = float(round(times)) if abs(times / round(times) - 1) < RATE_WHOLE else times
    return whole if found > 1 else 1 / whole
