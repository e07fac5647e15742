# SPDX-License-Identifier: BSD-3-Clause
"""Check of the units of masses, centers of mass and inertias in a description.

No option of a log corrects them, and with such bodies every torque would seem to be in another
unit. So this is the first check, and all others use the description with the units that it found.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from skidyn.measurement._check import Check
from skidyn.measurement._fits import Fits, Reading
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
from skidyn.measurement._suspicion import Certainty, Suspicion
from skidyn.robots import Robot

#: Log-likelihood that other units must gain to be certain, and to be preferred to likelier ones.
SURE, LEAST = 40.0, 15.0
#: Largest factor between torques and those of bodies of the right masses.
USUAL = 2.5
#: Number of links that are listed by name.
LISTED = 6
SI = {"mass": "kg", "center of mass": "m", "inertia": "kg m^2"}


class DescriptionUnits(Check):
    """Masses, centers of mass or inertias of the description in other units."""

    name = "description_units"
    suspects = "masses, centers of mass or inertias of the description in g, mm or g mm^2"

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        robot = measurement.robot
        found = [] if robot is None else wrong_units(robot)
        if robot is None or not found:
            return
        found, gain = _decided(measurement, robot, found)
        certain = gain > SURE and not measurement.identified
        certainty: Certainty = "certain" if certain else "suspected"
        told = (
            f"; with them in {'SI units' if len(found) > 1 else 'the right unit'}, the rigid-body "
            f"torque explains the measured torque better by {gain:.0f} (log-likelihood)"
            if gain > SURE
            else ""
        )
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
) -> tuple[list[WrongUnit], float]:
    """Units among likely ones that explain the torque best, and their log-likelihood gain.

    Other checks have not yet looked at the log, so its rows are not kept.
    """
    fits = Measurement(measurement.signals, measurement.torque, robot, measurement.joint_names).fits
    if fits is None or not any(fits.usable(k) for k in range(fits.n_joints)):
        return found, 0.0
    tried = []
    for units in product(*((wrong.unit, *wrong.others) for wrong in found)):
        own = [
            replace(wrong, unit=unit, factor=UNITS[wrong.quantity][unit]) if unit else wrong
            for wrong, unit in zip(found, units, strict=True)
        ]
        tried.append((own, _gain(fits, mended(robot, own))))
    likeliest, gain = tried[0]
    best, most = max(tried, key=lambda item: item[1])
    if most > gain + LEAST:
        likeliest, gain = [replace(wrong, others=()) for wrong in best], most
    elif len(tried) > 1 and gain > max(other for _, other in tried[1:]) + LEAST:
        likeliest = [replace(wrong, others=()) for wrong in likeliest]
    return _with_grams(fits, robot, likeliest), gain


def _gain(fits: Fits, robot: Robot) -> float:
    """Log-likelihood gain of another description with stated bodies."""
    here, there = fits.nominal(Reading()), fits.of(robot).nominal(Reading())
    return float(there.margin(here).sum())


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
    gain = fits.of(mended(robot, found)).nominal(Reading()).gain
    gain = gain[np.isfinite(gain) & (gain > 0)]
    if not len(gain) or abs(np.log(GRAMS * np.median(gain))) > np.log(USUAL):
        return found
    units = {factor: unit for unit, factor in UNITS["inertia"].items()}
    grams = [
        replace(w, factor=GRAMS * w.factor, unit=units.get(GRAMS * w.factor, f"g {w.unit[3:]}"))
        if w in inertias
        else w
        for w in found
    ]
    most = int(np.argmax(shape_of(robot).mass))
    return [WrongUnit("mass", "g", GRAMS, every, np.inf, most), *grams]


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
        f"the {wrong.quantity} of {links} in the description is in {units} instead of "
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
            return f"{states}, and all torques are a thousandth of those of such bodies"
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
