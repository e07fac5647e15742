# SPDX-License-Identifier: BSD-3-Clause
"""Check of the scale of torques: another unit, currents, or torques of the motors."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from skidyn._signals import Array
from skidyn.measurement._bodies import explained
from skidyn.measurement._check import Check
from skidyn.measurement._fits import Fits
from skidyn.measurement._gains import (
    CLEARLY,
    USUAL,
    Scales,
    joint_gain,
    known_gains,
    refined_scales,
    scale_gain,
    spring_gain,
)
from skidyn.measurement._joint_gravity import without_gravity
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._rate import STATIC, asked_rate, rate_gain
from skidyn.measurement._reading import Reading
from skidyn.measurement._size import find_size
from skidyn.measurement._suspicion import Remedy, Suspicion, remedy_of
from skidyn.measurement._torque import asked_changes, readable_fits

#: Least log-likelihood gain of another scale, and its value if the stated bodies do not confirm it.
LEAST, SURE = 15.0, 40.0
#: Share of the stated bodies in a torque, at the scale that fits best, below which little of them
#: is left, as after a model was subtracted.
SUBTRACTED = 0.3
#: Multiples of an effort limit, and of the torque of the bodies, that only another unit reaches.
FAR = 20.0
#: Multiple of its effort limit that a joint cannot reach, beside one whose torque is in another
#: unit: drives of a wrist report the same unit, and friction alone has no scale.
WITH_ANOTHER = 1.5
#: Largest standard error of a scale that is reported without confirmation by the stated bodies.
TELLING = 0.15
#: Largest ratio of the torques per ampere of drives of one robot.
DRIVES = 20.0
#: Factors of units of torque.
UNITS = {1e3: "Nmm", 1e2: "Ncm", 1e-3: "kNm"}
#: How many times a unit's factor the scale of a joint may be, whose bodies are not those stated.
SAME_UNIT = 2.0
#: That of torques beyond what their joints can have.
KILO = 1e3


class TorqueScale(Check):
    """Torque in another unit, at the motor, or currents."""

    name = "torque_scale"
    suspects = "currents, motor torque or another unit instead of joint torque"
    stage = 2

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        fits = readable_fits(measurement)
        if fits is None or any(not c.joints for c in asked_changes(measurement, fits)):
            return  # with another gravity, torques have other scales
        known = known_gains(fits)
        here = fits.nominal(Reading()).gain
        gains = {k: float(g) for k, g in enumerate(here) if np.isfinite(g) and g > 0}
        rate = asked_rate(measurement, fits)
        if rate is not None and rate <= STATIC:
            return  # the torque contains gravity only
        if rate is not None:
            yield self._rate(fits, rate)
        elif _all_odd(gains, known):
            yield self._of_all(measurement, fits, gains, known)
        else:
            yield from self._of_joints(measurement, fits, gains, known)

    def _rate(self, fits: Fits, rate: float) -> Suspicion:
        """A clock at another rate, which changes the scale of all torques of motion."""
        value = float(f"{rate:.4g}")
        scales = {"time": float(f"{1 / value:.6g}"), "dq": value}
        return self.suspicion(
            "the clock runs at a different rate, and the velocities were derived with it",
            f"with a sampling rate {value:g} times as high, the rigid-body torque explains "
            f"the measured torque better by {rate_gain(fits, rate):.0f} (log-likelihood)",
            "suspected",
            remedy=remedy_of("gain", scales),
        )

    def _of_all(
        self,
        measurement: Measurement,
        fits: Fits,
        gains: dict[int, float],
        known: dict[int, float],
    ) -> Suspicion:
        """All torques at another scale: a unit, a robot of another size, or currents."""
        values = list(gains.values())
        typical = float(np.median(list(known.values()) if len(known) > 1 else values))
        gains = gains if _one_sided(np.array(values)) or not known else known
        # the multiple of a torque that bodies hardly explain may be anything
        gains = {
            k: gain
            for k, gain in gains.items()
            if k in known or abs(np.log(gain / typical)) < np.log(DRIVES)
        }
        told = ", ".join(f"{measurement.joint_names[k]} {gain:.3g}" for k, gain in gains.items())
        unit, factor = next(
            ((u, f) for f, u in UNITS.items() if abs(np.log(typical / f)) < 0.3), (None, 1.0)
        )
        # the same unit in all columns; motors have several scales
        alike = all(abs(np.log(gain / factor)) < np.log(SAME_UNIT) for gain in gains.values())
        if unit is not None and alike:
            return self.suspicion(
                f"torque looks like {unit}",
                f"it is the rigid-body torque times {told}",
                "certain",
                sorted(gains),
                remedy_of("units", {"tau": unit}),
            )
        factors = _all_factors(fits, gains, typical)
        other = find_size(fits, factors)
        if other is not None:
            return self.suspicion(
                "the description is that of a robot of another size",
                f"torques are at another scale than those of its bodies ({told}), and with "
                f"{other[0]:.2g} times its lengths, bodies of any mass explain them better by "
                f"{other[1]:.0f} (log-likelihood), and better than gains do; use the description "
                "of this robot",
                "suspected",
                sorted(gains),
            )
        return self._of_motors(measurement, sorted(gains), told, factors)

    def _of_motors(
        self, measurement: Measurement, joints: list[int], told: str, factors: dict[int, float]
    ) -> Suspicion:
        """Currents or torques of motors, or what is left where those of a model were subtracted."""
        seen = explained(measurement)
        left = 1.0 if seen is None else float(np.median(seen.shares[0]))
        what, little = "torques look like motor currents, motor torques or another unit", ""
        if left < SUBTRACTED:
            what += ", or the torque of a model was subtracted from them"
            little = f", which makes up {left:.0%} of a torque (the median of the joints)"
        return self.suspicion(
            what,
            f"they follow the rigid-body torque at a different scale ({told}){little}. The gains "
            "below assume the bodies of the description; if known, use the torques per ampere of "
            "the drives instead (--drive-gains with i columns)",
            "suspected",
            joints,
            _gain_remedy(factors),
        )

    def _of_joints(
        self,
        measurement: Measurement,
        fits: Fits,
        gains: dict[int, float],
        known: dict[int, float],
    ) -> Iterator[Suspicion]:
        """Single joints at another scale than the others."""
        # If bodies need a torque of this scale, the joint can provide it, and the limit is wrong.
        usual = {k for k, gain in gains.items() if USUAL[0] <= gain <= USUAL[1]}
        reached = {k: x for k, x in _beyond_limits(measurement).items() if k not in usual}
        far = {k for k, times in reached.items() if times > FAR}
        found, undecided = _at_own_scale(fits, gains, known)
        for k in undecided:
            if k not in far:
                yield self._or_other_bodies(measurement, k, gains[k])
        if found:  # gravity that was removed from one torque makes it small, too
            found = {k: found[k] for k in set(found) - set(without_gravity(measurement, fits))}
        if far or any(_unit_like(gain) == KILO for gain in found.values()):
            far |= set(reached)
        for k, multiple in reached.items():
            if k not in far and k not in known and k not in found:
                yield self._or_wrong_limit(measurement, k, multiple)
        beyond = {k: times for k, times in reached.items() if k in far and k not in found}
        evidence = []
        if found:
            told = ", ".join(f"{gains[k]:.3g}" for k in found)
            fitted = ", ".join(f"{gain:.3g}" for gain in found.values())
            evidence.append(
                f"it is {told} times that of the stated bodies, and {fitted} times that of bodies "
                "that explain the other joints"
            )
        if beyond:
            names = measurement.joints(beyond)
            sizes = ", ".join(f"{size:.3g}" for size in beyond.values())
            evidence.append(f"it reaches {sizes} times the effort limit of {names}")
        if evidence:
            factors = _factors(fits, found, beyond)
            yield self.suspicion(
                f"the torque of {measurement.joints(factors)} has a different "
                "scale than that of the other joints",
                "; ".join(evidence),
                "suspected",
                factors,
                _gain_remedy(factors),
            )

    def _or_other_bodies(self, measurement: Measurement, k: int, gain: float) -> Suspicion:
        """A torque at another scale, or bodies that differ from the description."""
        return self.suspicion(
            f"either the torque of {measurement.joint(k)} has a different scale than that "
            "of the other joints, or the bodies it moves differ from the description",
            f"it is {gain:.3g} times that of the stated bodies, which the other joints do "
            "not decide; correct the description, or, if it is the scale, the torque by "
            + _gain_option(k, 1 / (_unit_like(gain) or gain)),
            "noted",
            [k],
        )

    def _or_wrong_limit(self, measurement: Measurement, k: int, multiple: float) -> Suspicion:
        """A torque in another unit, or a wrong limit in the description."""
        return self.suspicion(
            f"either the torque of {measurement.joint(k)} is in another unit, or its "
            "effort limit in the description is wrong",
            f"it reaches {multiple:.3g} times that limit, and the bodies that it moves do "
            "not determine its scale; correct the limit, or, if it is the unit, the torque "
            f"by {_gain_option(k, 1 / KILO)}",
            "noted",
            [k],
        )


def _all_odd(gains: dict[int, float], known: dict[int, float]) -> bool:
    """Whether all torques are at another scale than the robot's own."""
    values, sure = np.array(list(gains.values())), np.array(list(known.values()))
    odd = any(not USUAL[0] <= gain <= USUAL[1] for gain in known.values())
    # another unit of all torques, also where an effect is as large as the torque of the bodies
    far = len(values) > 1 and 2 * int(np.sum(values > FAR)) > len(values)
    return far or (odd and (_one_sided(values) or (len(sure) > 1 and _one_sided(sure))))


def _at_own_scale(
    fits: Fits, gains: dict[int, float], known: dict[int, float]
) -> tuple[dict[int, float], list[int]]:
    """Scales of single torques by the other joints, and joints whose scale these do not decide."""
    found, undecided = {}, []
    for k, gain in gains.items():
        low, high = CLEARLY if k in known else USUAL
        if low <= gain <= high or (k not in known and gain < low):
            continue  # the multiple of a torque that bodies hardly explain is small by itself
        own, gained = joint_gain(fits.loaded(), k, gain)
        wrong = not USUAL[0] <= gain <= USUAL[1] and k in known
        sure = gained > (LEAST if wrong else SURE) and not low <= own <= high
        told = sure or (wrong and gained > 0)
        if not told or spring_gain(fits.loaded(), k) > gained:
            continue  # nothing, or a spring or a counterweight, and no scale
        far_off = (scale_gain(fits.loaded(), k, times * own) for times in (0.25, 4.0))
        if sure and gained - max(far_off) > LEAST:
            found[k] = own
        elif wrong and gained > 0:
            undecided.append(k)
    return found, undecided


def _factors(fits: Fits, found: dict[int, float], beyond: dict[int, float]) -> dict[int, float]:
    """Factors of single torques at another scale, and of those beyond their limits, by joint."""
    units = {k: unit for k, gain in found.items() if (unit := _unit_like(gain))}
    units |= dict.fromkeys(beyond, KILO)
    refined = {k: gain for k, gain in found.items() if k not in units}
    factors = {k: 1 / unit for k, unit in units.items()}
    if refined:
        scales = refined_scales(fits, units, refined)
        # of two torques, each is at another scale than the other
        usual = {k for k, gain in scales.gains.items() if CLEARLY[0] < gain < CLEARLY[1]}
        if usual and len(usual) < len(refined):
            refined = {k: gain for k, gain in refined.items() if k not in usual}
            scales = refined_scales(fits, units, refined)
        factors |= scales.factors
    return dict(sorted(factors.items()))


def _all_factors(fits: Fits, gains: dict[int, float], typical: float) -> dict[int, float]:
    """Factors of torques all of which have a wrong scale; those of unknown ones are free, too."""
    usable = [k for k in range(fits.n_joints) if fits.usable(k)]
    found = refined_scales(fits, {}, {k: gains.get(k, typical) for k in usable})
    known = [k for k in usable if k in gains or found.errors[k] < TELLING]
    return Scales({k: found.gains[k] for k in known}, {k: found.errors[k] for k in known}).factors


def _beyond_limits(measurement: Measurement) -> dict[int, float]:
    """Torques beyond the effort limit of the description, while most others are within."""
    robot = measurement.robot
    if robot is None:
        return {}
    limits = np.where(robot.effort_limits > 0, robot.effort_limits, np.inf)
    reached = np.quantile(np.abs(measurement.torque), 0.95, axis=0) / limits
    far = np.flatnonzero(reached > WITH_ANOTHER)
    if np.mean(reached < 1) < 0.5:
        return {}  # the limits, or all torques, are in another unit
    return {int(k): float(reached[k]) for k in far}


def _one_sided(gains: Array) -> bool:
    """Whether all multiples are too small, or all too large, to be due to wrong masses."""
    return bool(np.all(gains < USUAL[0]) or np.all(gains > USUAL[1]))


def _gain_remedy(factors: dict[int, float]) -> tuple[str, str]:
    """Factors of torques as an option."""
    return remedy_of("gain", {f"tau{k + 1}": value for k, value in factors.items()})


def _gain_option(joint: int, factor: float) -> str:
    """The factor of one torque for a sentence that leaves the choice to the user."""
    return str(Remedy(*_gain_remedy({joint: float(f"{factor:.3g}")})))


def _unit_like(gain: float) -> float | None:
    """The factor of a unit close to a multiple of the robot's torque."""
    return next((f for f in UNITS if abs(np.log(gain / f)) < 0.3), None)
