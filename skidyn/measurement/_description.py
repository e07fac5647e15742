# SPDX-License-Identifier: BSD-3-Clause
"""Check of the units of masses, centers of mass and inertias in a description.

No option of a log corrects them, and with such bodies every torque would seem to be in another
unit. So this check comes before all that fit the robot, and these use the units that it found.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from skidyn.measurement._check import Check
from skidyn.measurement._fits import Fits
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._plausible import (
    GRAMS,
    HEAVIEST,
    UNITS,
    WrongUnit,
    mended,
    shape_of,
    wrong_units,
)
from skidyn.measurement._reading import Reading
from skidyn.measurement._suspicion import Certainty, Suspicion
from skidyn.robots import Robot

#: Log-likelihood that other units must gain to be certain, and to be preferred to likelier ones.
SURE, LEAST = 40.0, 15.0
#: Reach of a robot, m, that is longer than that of any crane.
LARGEST = 150.0
#: Largest factor between torques and those of bodies whose masses are about right.
USUAL = 2.5
#: Number of links that are listed by name.
LISTED = 6
SI = {"mass": "kg", "center of mass": "m", "inertia": "kg m^2"}


class DescriptionLengths(Check):
    """Lengths of the description in millimetres."""

    name = "description_lengths"
    suspects = "lengths of the description in mm"

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        robot = measurement.robot
        if robot is None or (reach := shape_of(robot).reach) < LARGEST:
            return
        yield self.suspicion(
            "the lengths of the description seem to be in mm instead of m",
            f"from its base to its last link the robot would reach {reach:.3g} m. Divide the "
            "origins of the joints by 1000, and the centers of mass if they are in mm, too; the "
            "other checks do not use the description",
            "certain",
        )
        measurement.robot = None


class DescriptionUnits(Check):
    """Masses, centers of mass or inertias of the description in other units."""

    name = "description_units"
    suspects = "masses, centers of mass or inertias of the description in g, mm or g mm^2"

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        robot = measurement.robot
        found = [] if robot is None else wrong_units(robot)
        if robot is None or not found:
            return
        found, told = _decided(measurement, robot, found)
        if not found:
            return
        certainty: Certainty = "certain" if told else "suspected"
        for wrong in found:
            yield self.suspicion(
                _suspicion(robot, wrong),
                f"{_evidence(robot, wrong)}{told}. Correct the description; the other checks use "
                "the corrected one",
                certainty,
                sorted({int(robot.tree.coordinates[body]) for body in wrong.bodies}),
            )
        measurement.robot = mended(robot, found)


def _decided(
    measurement: Measurement, robot: Robot, found: list[WrongUnit]
) -> tuple[list[WrongUnit], str]:
    """The likely units that explain the torque best, and its evidence; empty if it has none.

    None are wrong if the torque has the scale of the stated bodies and no other explains it better.
    Other checks have not yet looked at the log, so its rows are not kept.
    """
    fits = Measurement(measurement.signals, measurement.torque, robot, measurement.joint_names).fits
    if fits is None or not any(fits.usable(k) for k in range(fits.n_joints)):
        return found, ""
    fits = fits.few
    tried = [(own, _gain(fits, mended(robot, own))) for own in _readings(found)]
    heavier = [(own, _gain(fits, mended(robot, own))) for own in _with_masses(robot, found)]
    most = max(gain for _, gain in tried)
    if max((gain for _, gain in heavier), default=-np.inf) > most + SURE:
        tried = heavier
        most = max(gain for _, gain in tried)
    tried = [(own, gain) for own, gain in tried if gain >= most - LEAST]
    own, gain = tried[0]
    if gain > SURE and len(tried) == 1:
        own = [replace(wrong, others=()) for wrong in own]
    own = _with_grams(fits, robot, own)
    right = f"; with {'SI units' if len(own) > 1 else 'the right unit'}, "
    before, after = _multiple(fits), _multiple(fits.of(mended(robot, own)))
    if gain > SURE:
        return own, (
            f"{right}the rigid-body torque explains the measured torque better by {gain:.0f} "
            "(log-likelihood)"
        )
    if gain < LEAST and _usual(before) and not _usual(after):
        return [], ""
    if gain > -LEAST and _usual(after) and not _usual(before):
        return own, f"{right}the torque is {after:.2g} times that of the bodies, not {before:.2g}"
    return own, ""


def _multiple(fits: Fits) -> float:
    """Median multiple of the torque of the stated bodies; NaN if it contains none of it."""
    gain = fits.nominal(Reading()).gain
    gain = gain[np.isfinite(gain) & (gain > 0)]
    return float(np.median(gain)) if len(gain) else np.nan


def _usual(multiple: float) -> bool:
    """Whether a multiple may be due to masses that differ a little."""
    return bool(abs(np.log(multiple)) < np.log(USUAL))


def _readings(found: list[WrongUnit]) -> Iterator[list[WrongUnit]]:
    """The same quantities in all likely units, the likeliest first."""
    for units in product(*((wrong.unit, *wrong.others) for wrong in found)):
        yield [
            wrong
            if unit == wrong.unit
            else replace(wrong, unit=unit, factor=UNITS[wrong.quantity][unit], others=())
            for wrong, unit in zip(found, units, strict=True)
        ]


def _with_masses(robot: Robot, found: list[WrongUnit]) -> Iterator[list[WrongUnit]]:
    """The same with the masses of these links in grams, and what is then in another unit.

    Where lengths or inertias are in another unit, too, the density of links is hardly known.
    """
    for bodies in dict.fromkeys(tuple(w.bodies) for w in found if w.quantity != "mass"):
        heavy = _grams(robot, bodies)
        lighter = mended(robot, [heavy])
        beside = wrong_units(lighter)
        if not shape_of(lighter).matters[heavy.bodies].any():
            continue  # it would be a placeholder
        if not any(wrong.quantity == "mass" for wrong in beside):
            yield from _readings([heavy, *beside])


def _grams(robot: Robot, bodies: Sequence[int]) -> WrongUnit:
    """Masses of some bodies in grams, of which their density says nothing."""
    mass = np.asarray(robot.inertial_parameters)[list(bodies), 0]
    return WrongUnit("mass", "g", GRAMS, list(bodies), np.inf, bodies[int(np.argmax(mass))])


def _gain(fits: Fits, robot: Robot) -> float:
    """Log-likelihood gain of another description with stated bodies."""
    here, there = fits.nominal(Reading()), fits.of(robot).nominal(Reading())
    return there.gained_over(here)


def _with_grams(fits: Fits, robot: Robot, found: list[WrongUnit]) -> list[WrongUnit]:
    """The same with masses in grams, where all torques are a thousandth of those of the bodies.

    Where inertias are in another unit, too, the density of links is hardly known.
    """
    if any(wrong.quantity == "mass" for wrong in found):
        return found
    inertias = [w for w in found if w.quantity == "inertia" and w.unit]
    every = np.flatnonzero(np.asarray(robot.inertial_parameters)[:, 0] > 0).tolist()
    if not any(wrong.bodies == every for wrong in inertias):
        return found
    if not _usual(GRAMS * _multiple(fits.of(mended(robot, found)))):
        return found
    units = {factor: unit for unit, factor in UNITS["inertia"].items()}
    grams = [
        replace(w, factor=GRAMS * w.factor, unit=units.get(GRAMS * w.factor, w.unit))
        if w in inertias
        else w
        for w in found
    ]
    return [_grams(robot, every), *grams]


def _links(robot: Robot, bodies: Sequence[int]) -> str:
    """Names of links."""
    if len(bodies) == robot.n_bodies > 1:
        return "all links"
    names = [repr(robot.body_names[body]) for body in bodies]
    rest = f" and {len(names) - LISTED} more" if len(names) > LISTED else ""
    return f"{'links' if len(names) > 1 else 'link'} {', '.join(names[:LISTED])}{rest}"


def _suspicion(robot: Robot, wrong: WrongUnit) -> str:
    links = _links(robot, wrong.bodies)
    if not wrong.unit:
        return f"the description states an inertia, but no mass, of {links}"
    units = " or ".join((wrong.unit, *wrong.others))
    return (
        f"the {wrong.quantity} of {links} in the description seems to be in {units} instead of "
        f"{SI[wrong.quantity]}"
    )


def _evidence(robot: Robot, wrong: WrongUnit) -> str:
    """What value is out of proportion to what."""
    shape, name, k = shape_of(robot), repr(robot.body_names[wrong.most]), wrong.most
    reach = f"the robot reaches only {shape.reach:.3g} m"
    if wrong.quantity == "center of mass":
        return f"that of {name} would be {wrong.size:.3g} m from its joint, and {reach}"
    if wrong.quantity == "mass":
        states = f"{name} would have {shape.mass[k]:.4g} kg"
        if not np.isfinite(wrong.size):
            return f"{states}, of which the measured torque shows a thousandth"
        if wrong.size < HEAVIEST:
            rest = float(shape.mass.sum() - shape.mass[k])
            return f"{states}, and all other links {rest:.3g} kg"
        return (
            f"{states}, {wrong.size:.3g} kg/m^3 if it were a ball of its length, and no matter has "
            f"more than {HEAVIEST:g} kg/m^3"
        )
    inertia = f"that of {name} is {2 / 3 * shape.half_trace[k]:.3g} kg m^2"
    if not wrong.unit:
        return (
            f"{inertia}, more than the mass of the whole robot ({shape.mass.sum():.3g} kg) has at "
            f"its full reach ({shape.reach:.3g} m)"
        )
    return (
        f"{inertia}, and its mass {shape.mass[k]:.4g} kg, a radius of gyration of "
        f"{shape.radius[k]:.3g} m, and {reach}"
    )
