# SPDX-License-Identifier: BSD-3-Clause
"""Check of the lengths of links, by the torque of bodies near the stated ones.

Bodies cannot fully compensate a wrong length, because the coupling inertia of joints depends on it.
So the factor of every length is found step by step, together with the bodies, and both have a
penalty for the distance from the description. A length on which no torque depends, such as that
before the last joints of a wrist, is not changed and not reported.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from skidyn._signals import Array
from skidyn.measurement._channels import NOISELESS
from skidyn.measurement._check import Check
from skidyn.measurement._duel import duel_of
from skidyn.measurement._fits import Fits
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._near_bodies import LOOSE, ExtraColumns, Factored, NearBodies
from skidyn.measurement._peak import climb
from skidyn.measurement._reading import Reading
from skidyn.measurement._suspicion import Suspicion, remedy_of
from skidyn.measurement._torque import readable_fits
from skidyn.robots import Robot

#: Factor, as a logarithm, to which the lengths of a description may be known (one standard
#: deviation), the largest step of it, and how many steps are made.
KNOWN_TO, STEP, ROUNDS = 0.2, 0.3, 3
#: Largest logarithm of a factor; beyond it, something else is wrong.
FARTHEST = 0.6
#: Least log-likelihood gain of a step.
LITTLE = 4.0
#: Least length, m, and the change of a factor for a slope.
LEAST_LENGTH, SLOPE = 1e-3, 1e-3
#: Log-likelihood that other lengths must gain with bodies near the stated ones, also where the
#: effect is there that takes most of their place, and with any bodies; and the first of these if
#: positions are coarse, because errors of the accelerations are then not white.
LEAST, CONFIRMED, LEAST_COARSE = 25.0, 3.0, 100.0
#: First and last step in which another zero, rad, and scale, as a logarithm, of the positions of a
#: joint are searched.
ZERO_STEPS, SIZE_STEPS = (np.deg2rad(16), np.deg2rad(1.5)), (0.24, 0.025)
#: Least error of a length to be reported, in standard errors, and as a share.
ERRORS, SHARE = 3.0, 0.03


@dataclass(frozen=True)
class Stretched:
    """Lengths that explain the torque better than those of the description.

    Attributes
    ----------
    bodies : list of int
        Bodies whose distance from their parent is estimated.
    factors, errors : ndarray of shape (n_bodies,)
        Logarithms of their factors, and standard errors.
    gain : float
        Log-likelihood gain minus the penalty of the lengths.
    here, there : NearBodies
        Fits with the lengths of the description and with these.
    """

    bodies: list[int]
    factors: Array
    errors: Array
    gain: float
    here: NearBodies
    there: NearBodies


class Lengths(Check):
    """Links that are longer or shorter than in the description."""

    name = "lengths"
    suspects = (
        "lengths of links in the description that differ from those of the robot, or a zero or "
        "scale of the positions of a joint that look like them"
    )
    stage = 2

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        found = asked_lengths(measurement)
        if found is None or found.gain < (LEAST_COARSE if measurement.coarse else LEAST):
            return
        if not SHARE < np.abs(found.factors).max() < FARTHEST:
            return  # beyond, it is another robot
        fits = found.here.fits
        plain = fits.identified(Reading())
        confirmed = found.there.fits.identified(Reading()).gained_over(plain)
        if confirmed < CONFIRMED:
            return
        # arbitrary bodies include any payload
        duel = duel_of(
            found.here,
            found.there,
            range(fits.n_joints),
            but=("payload",) if confirmed >= LEAST else (),
        )
        if min(duel.beside, _beside_gains(found)) < LEAST:
            return
        other = _other_cause(fits, found)
        if other is not None:
            yield self._of_motion(measurement, other, found.gain)
            return
        robot = fits.robot
        off = {
            body: f"from {_before(robot, body)} to {robot.body_joints[body]} by "
            f"{100 * np.expm1(factor):+.0f} % (standard error {100 * error:.0f} %)"
            for body, factor, error in zip(found.bodies, found.factors, found.errors, strict=True)
            if abs(factor) > max(ERRORS * error, SHARE)
        }
        shares = ", ".join(off.values()) or "none of which can be determined individually"
        yield self.suspicion(
            "lengths of links differ from the description",
            f"other lengths, {shares}, explain the torque better by {found.gain:.0f} "
            "(log-likelihood); use the description of this robot, or measure the distances "
            "between its joints",
            "suspected",
            sorted({int(robot.tree.coordinates[body]) for body in off}),
        )

    def _of_motion(self, measurement: Measurement, other: OtherCause, lengths: float) -> Suspicion:
        """Positions of a joint from another zero, or of another scale."""
        k, joint = other.joint, measurement.joint(other.joint)
        if other.zero:
            what = f"the zero of {joint} is off by about {np.rad2deg(other.zero):.0f} deg"
            remedy = remedy_of("zero", {f"q{k + 1}": round(other.zero, 4)})
        else:
            what = f"positions and velocities of {joint} are {other.size:.3g} times as large"
            factor = float(f"{1 / other.size:.4g}")
            remedy = remedy_of("gain", {f"q{k + 1}": factor, f"dq{k + 1}": factor})
        return self.suspicion(
            what,
            "with this correction, bodies near those of the description explain the torque better "
            f"by {other.gain:.0f} (log-likelihood), and with other lengths of links by "
            f"{lengths:.0f}",
            "suspected",
            [k],
            remedy,
        )


@dataclass(frozen=True)
class OtherCause:
    """Positions of a joint that, corrected, explain more than other lengths do.

    Attributes
    ----------
    joint : int
        Joint, from 0.
    zero : float, rad
        Recorded position at its zero; 0 if its scale is wrong.
    size : float
        Factor of its positions.
    gain : float
        Log-likelihood gain.
    """

    joint: int
    zero: float
    size: float
    gain: float


def _other_cause(fits: Fits, found: Stretched) -> OtherCause | None:
    """Another zero, or scale, of the positions of one joint that explains more than lengths."""
    inflation, gains = fits.identified(Reading()).inflation, np.ones(fits.n_joints)

    def posterior(reading: Reading) -> float:
        return NearBodies(fits, reading, gains, inflation).plain.posterior

    def with_zero(joint: int, angle: float) -> float:
        return posterior(Reading(zero=((joint, angle),)))

    def with_size(joint: int, logarithm: float) -> float:
        return posterior(Reading(size=float(np.exp(logarithm)), sized=frozenset({joint})))

    plain, causes = found.here.plain.posterior, []
    for joint in np.flatnonzero(~fits.signals.prismatic).tolist():
        zero, value = climb(partial(with_zero, joint), 0.0, *ZERO_STEPS)
        causes.append(OtherCause(joint, float(zero), 1.0, value - plain))
        size, value = climb(partial(with_size, joint), 0.0, *SIZE_STEPS)
        causes.append(OtherCause(joint, 0.0, float(np.exp(size)), value - plain))
    best = max(causes, key=lambda cause: cause.gain, default=None)
    return best if best is not None and best.gain > found.gain + LITTLE else None


def _beside_gains(found: Stretched) -> float:
    """Least gain of the lengths where the torque of any one joint may have another scale."""
    return min(
        _with_gain(found.there, k) - _with_gain(found.here, k)
        for k in range(len(found.here.joints))
    )


def _with_gain(near: NearBodies, k: int) -> float:
    """Posterior of a fit in which the torque of one of the joints has a free scale."""
    joint, use, place = near.joints[k], near.rows[k], near.places[k]
    bodies = place < near.n_bodies
    column = near.fits.mean_torque(joint)[0][use] - near.targets[k]  # of the stated bodies
    column += near.designs[k][:, bodies] @ near.plain.coefficients[place[bodies]]
    columns = np.zeros((near.fits.n_rows, 1))
    columns[use, 0] = column / (float(np.std(column)) + 1e-12)
    return near.fit(ExtraColumns({joint: columns}, (), np.array([LOOSE]))).posterior


def _before(robot: Robot, body: int) -> str:
    """Name of the joint before a body's own."""
    return robot.body_joints[int(robot.tree.parents[body])]


def asked_lengths(measurement: Measurement) -> Stretched | None:
    """Lengths that a measurement implies; None where its torque decides none.

    Parameters
    ----------
    measurement : Measurement
        Recording and robot.
    """
    fits = readable_fits(measurement)
    if fits is None or measurement.scaled or measurement.lost or measurement.smoothed:
        return None
    if measurement.stale or measurement.computed or measurement.odd:
        return None
    if measurement.late_position:
        return None  # poses of another time
    if measurement.torque_scatter < NOISELESS:
        return None  # without noise, errors of the derivatives are significant
    fine = fits.without(list(measurement.coarse_torques))  # rounding is not white noise
    return measurement.once("lengths", lambda: find_lengths(fine))


def find_lengths(fits: Fits) -> Stretched | None:
    """Lengths at which bodies near those of the description explain the torque best.

    Parameters
    ----------
    fits : Fits
        Rows.

    Returns
    -------
    Stretched or None
        None where no link has a length.
    """
    tree = fits.robot.tree
    long = np.linalg.norm(tree.translations, axis=1) > LEAST_LENGTH
    bodies = np.flatnonzero(long & (tree.parents >= 0)).tolist()
    if not bodies or not np.any(fits.robot.inertial_parameters):
        return None
    inflation = fits.identified(Reading()).inflation
    gains = np.ones(fits.n_joints)
    here = there = NearBodies(fits, Reading(), gains, inflation)
    factors: Array = np.zeros(len(bodies))
    covariance: Array = np.eye(len(bodies)) * KNOWN_TO**2
    for _ in range(ROUNDS):
        slopes = _slopes(fits.robot, bodies, factors, there)
        left, right = there.without_bodies(slopes, Factored(there.plain.gram))
        covariance = np.asarray(np.linalg.inv(left + np.eye(len(bodies)) / KNOWN_TO**2))
        right = right - factors / KNOWN_TO**2
        if 0.5 * right @ covariance @ right < LITTLE:
            break
        factors = factors + np.clip(covariance @ right, -STEP, STEP)
        longer = fits.of(stretched(fits.robot, bodies, factors))
        there = NearBodies(longer, Reading(), gains, inflation)
    # lengths are integrated out, which penalises uncertain ones
    cost = 0.5 * float(np.sum((factors / KNOWN_TO) ** 2))
    cost -= 0.5 * float(np.linalg.slogdet(covariance / KNOWN_TO**2)[1])
    gain = there.plain.posterior - here.plain.posterior - cost
    return Stretched(bodies, factors, np.sqrt(np.diag(covariance)), gain, here, there)


def stretched(robot: Robot, bodies: list[int], factors: Array) -> Robot:
    """A robot whose bodies are farther from, or nearer to, those that carry them.

    Parameters
    ----------
    robot : Robot
        As described.
    bodies : list of int
        Bodies that are moved.
    factors : ndarray of shape (n_bodies,)
        Logarithms of the factors of their distances.

    Returns
    -------
    Robot
    """
    translations = robot.tree.translations.copy()
    translations[bodies] *= np.exp(factors)[:, None]
    return replace(robot, tree=replace(robot.tree, translations=translations))


def _slopes(robot: Robot, bodies: list[int], factors: Array, near: NearBodies) -> ExtraColumns:
    """Change of the torque with every factor, for the bodies that explain most."""
    s, parameters = near.signals, near.parameters

    def torque(factors: Array) -> Array:
        own = stretched(robot, bodies, factors)
        torque = own.inverse_dynamics(s.q, s.dq, s.ddq, parameters=parameters, backend="once")
        return near.fits.average(torque)

    here, steps = torque(factors), SLOPE * np.eye(len(bodies))
    slopes = np.stack([(torque(factors + step) - here) / SLOPE for step in steps], axis=2)
    by_joint = {j: near.gains[j] * slopes[:, j] for j in near.joints}
    return ExtraColumns(by_joint, (), np.full(len(bodies), KNOWN_TO**-2))
