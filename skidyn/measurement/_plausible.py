# SPDX-License-Identifier: BSD-3-Clause
"""Masses, centers of mass and inertias of a description that no link of its robot can have.

Every bound follows from the description itself: the lengths between joints, to which a center of
mass or a radius of gyration in another unit is out of proportion, and the density of matter, beyond
which a mass in grams is. Units differ by a factor of 100 or more, so the bounds are far from what
links have. The largest values below are those of 84 descriptions: of example-robot-data 6.0, of
this package, of public recordings, and of generated robots.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array
from skidyn.dynamics import central_parts, inertial_vector, skew
from skidyn.robots import Robot

#: Least distance of a center of mass from its joint that is in another unit, in reaches of the
#: robot; that of real links is at most 0.8.
CENTER_REACHES = 5.0
#: The same of most links at once, in halves of their sizes, where one is farther than the reach;
#: that of real robots is at most 2.1.
CENTER_SIZES = 10.0
#: Least radius of gyration of an inertia in another unit, in reaches of the robot and in usual
#: radii of a link of its mass and length; those of real links are at most 1.3 and 35.
RADIUS_REACHES, RADIUS_USUAL = 3.0, 100.0
#: Density of osmium, kg/m^3, the heaviest matter: a ball with the length of a link that is denser
#: has a mass in another unit. Real links reach 6750.
HEAVIEST = 22600.0
#: Ratio of a mass to that of all other links, from which a mass too dense for the moments alone is
#: in another unit: those may be mere placeholders. Real links reach 3.5.
OUTWEIGHS = 30.0
#: Share of the mass of the robot below which a link has no influence: placeholders for frames.
LIGHT = 1e-3
#: Usual mean density of a link, kg/m^3, and usual radius of gyration over the geometric mean of the
#: radius of a ball of this density and of the length of the link (within a factor of 1.5).
USUAL_DENSITY, USUAL_RADIUS = 500.0, 0.66
#: Logarithm of the ratio of a value to a usual one up to which a unit is likely.
LIKELY = np.log(10.0)
#: Usual size of a link of which none is known, in reaches of the robot.
SIZE = 0.2
#: Length of the longest single link, m, that is told from a length in millimetres without others.
LONGEST = 2.0
GRAMS = 1e3
#: Factors of units that descriptions have in the place of kg, m and kg m^2.
UNITS: Mapping[str, Mapping[str, float]] = {
    "mass": {"g": GRAMS},
    "center of mass": {"mm": 1e3, "cm": 1e2},
    "inertia": {"g mm^2": 1e9, "g cm^2": 1e7, "kg mm^2": 1e6, "kg cm^2": 1e4},
}


@dataclass(frozen=True)
class WrongUnit:
    """One quantity of some bodies that is in another unit.

    Attributes
    ----------
    quantity : str
        ``"mass"``, ``"center of mass"`` or ``"inertia"``.
    unit : str
        Its unit; empty for an inertia without a mass, which no unit explains.
    factor : float
        Its size; infinite for an inertia that has to be left out.
    bodies : list of int
        Bodies concerned.
    size : float
        Size of the most conspicuous one of them: kg/m^3, or m.
    most : int
        The most conspicuous body.
    others : tuple of str
        Other units that are nearly as likely.
    """

    quantity: str
    unit: str
    factor: float
    bodies: list[int]
    size: float
    most: int
    others: tuple[str, ...] = ()


@dataclass(frozen=True)
class Shape:
    """Masses, centers and lengths of the bodies of a robot.

    Attributes
    ----------
    mass : ndarray of shape (n_bodies,), kg
    center : ndarray of shape (n_bodies, 3), m
    inertia : ndarray of shape (n_bodies, 3, 3), kg m^2
        About the center of mass.
    length : ndarray of shape (n_bodies,), m
        Distance of the farthest joint or fixed frame from the joint of a body.
    reach : float, m
        Largest sum of distances from the base to a joint or frame; that of single links, if they
        are longer.
    """

    mass: Array
    center: Array
    inertia: Array
    length: Array
    reach: float

    @property
    def far(self) -> Array:
        """Distance of every center of mass from its joint, m."""
        return np.asarray(np.linalg.norm(self.center, axis=1))

    @property
    def half_trace(self) -> Array:
        """Integral of the squared distance from the center of mass over the mass, kg m^2."""
        return np.asarray(np.trace(self.inertia, axis1=1, axis2=2) / 2).clip(0.0)

    @property
    def radius(self) -> Array:
        """Radius of gyration about the center of mass, m; zero without a mass."""
        none = self.mass <= 0
        return np.where(none, 0.0, np.sqrt(self.half_trace / np.where(none, 1.0, self.mass)))

    @property
    def matters(self) -> NDArray[np.bool_]:
        """Bodies that have a noticeable part of the mass."""
        return np.asarray((self.mass > 0) & (self.mass >= LIGHT * self.mass.sum()))

    @property
    def usual(self) -> Array:
        """Radius of gyration that bodies of these masses and lengths usually have, m."""
        ball = np.cbrt(self.mass / (USUAL_DENSITY * 4 / 3 * np.pi))
        long = np.maximum(self.far, self.length)
        return np.asarray(USUAL_RADIUS * np.sqrt(ball * np.where(long > 0, long, ball)))


def shape_of(robot: Robot) -> Shape:
    """Masses, centers and lengths of a robot as described."""
    tree, n = robot.tree, robot.n_bodies
    parts = [central_parts(p) for p in np.asarray(robot.inertial_parameters, dtype=float)]
    mass, center, inertia = (np.array(x) for x in zip(*parts, strict=True))
    travel = np.ptp(np.asarray(robot.position_limits, dtype=float), axis=1)[tree.coordinates]
    slides = np.where(tree.prismatic & np.isfinite(travel), travel, 0.0)
    steps = np.linalg.norm(tree.translations, axis=1) + slides
    reach, length = steps.copy(), np.zeros(n)
    for body, parent in enumerate(tree.parents):
        if parent >= 0:
            reach[body] += reach[parent]
            length[parent] = max(length[parent], float(steps[body]))
    for link in robot.links.values():
        if link.body >= 0:
            length[link.body] = max(length[link.body], float(np.linalg.norm(link.translation)))
    whole = float((reach + length).max())
    shape = Shape(mass, center, inertia, length, whole)
    single = np.minimum(shape.far, shape.radius)  # one of the two may be in another unit
    own = float(single[single < LONGEST].max(initial=0.0))
    return replace(shape, reach=max(whole, own))


def wrong_units(robot: Robot) -> list[WrongUnit]:
    """Quantities of a description that are in other units; empty if all are possible.

    Each is found with those before it in the right unit: lengths first, on which the others depend.

    Parameters
    ----------
    robot : Robot
        As described.
    """
    shape = shape_of(robot)
    if not shape.mass.sum() > 0 or not shape.reach > 0:
        return []
    found = []
    for look in (_centers, _masses, _inertias, _without_mass):
        wrong = look(shape)
        if wrong is not None:
            found.append(wrong)
            shape = _divided(shape, wrong)
    return found


def mended(robot: Robot, found: Sequence[WrongUnit]) -> Robot:
    """A robot with quantities of its description converted from other units."""
    shape = shape_of(robot)
    for wrong in found:
        shape = _divided(shape, wrong)
    parameters = np.array(robot.inertial_parameters, dtype=float)
    for body in {body for wrong in found for body in wrong.bodies}:
        mass, center = float(shape.mass[body]), shape.center[body]
        arm = skew(center)
        inertia = shape.inertia[body] - mass * arm @ arm
        parameters[body] = inertial_vector(mass, mass * center, inertia)
    return replace(robot, inertial_parameters=parameters)


def _divided(shape: Shape, wrong: WrongUnit) -> Shape:
    name = {"center of mass": "center"}.get(wrong.quantity, wrong.quantity)
    values = getattr(shape, name).copy()
    values[wrong.bodies] /= wrong.factor
    return replace(shape, **{name: values})


def _told(
    quantity: str, shape: Shape, out: NDArray[np.bool_], size: Array, ratio: Array
) -> WrongUnit | None:
    """Unit of values that are far from usual ones, and the bodies that have it.

    Units are those of whole descriptions or of single links, so with one link in another unit, so
    are all that are nearer to it than to the right one; and if most links are, also those that are
    in between.
    """
    if not out.any():
        return None
    log = float(np.median(np.log(ratio[out])))
    units = UNITS[quantity]
    apart = {unit: abs(np.log(factor) - log) for unit, factor in units.items()}
    unit, *others = (u for u in sorted(apart, key=apart.__getitem__))
    likely = tuple(u for u in others if apart[u] < LIKELY)
    worst = int(np.argmax(np.where(out, size, 0.0)))
    alike = out | (shape.matters & (ratio > units[unit] ** 0.5))
    if 2 * int(alike.sum()) > int((shape.mass > 0).sum()):
        alike |= ratio > units[unit] ** 0.1
    bodies = np.flatnonzero(alike).tolist()
    return WrongUnit(quantity, unit, units[unit], bodies, float(size[worst]), worst, likely)


def _centers(shape: Shape) -> WrongUnit | None:
    far, radius = shape.far, shape.radius
    possible = np.where(radius < RADIUS_REACHES * shape.reach, radius, 0.0)
    own = np.maximum(possible, shape.length)
    own = np.where(own > 0, own, SIZE * shape.reach)
    ratio = 2 * far / own
    out = far > CENTER_REACHES * shape.reach
    counted = ratio[shape.matters & (far > 0)]
    beyond = bool(np.any(far[shape.matters] > shape.reach))
    if beyond and len(counted) > 1 and np.median(counted) > CENTER_SIZES:
        out |= ratio > CENTER_SIZES
    return _told("center of mass", shape, shape.matters & out, far, ratio)


def _masses(shape: Shape) -> WrongUnit | None:
    possible = shape.radius < RADIUS_REACHES * shape.reach
    ball = np.sqrt(5 / 3) * shape.radius  # the radius of a ball of these moments
    long = np.where(possible, ball, SIZE * shape.reach)
    long = np.maximum.reduce([long, shape.far, shape.length])
    density = _density(shape.mass, np.where(long > 0, long, shape.reach))
    by_moments = _density(shape.mass, np.where(ball > 0, ball, np.inf))
    others = shape.mass.sum() - shape.mass
    alone = (shape.mass > OUTWEIGHS * others) & (others > 0) & (by_moments > HEAVIEST)
    out = shape.matters & ((density > HEAVIEST) | alone)
    # a mass that is too large makes the radius of gyration too small in turn
    ratio = np.maximum(density, by_moments / GRAMS**1.5) / USUAL_DENSITY
    return _told("mass", shape, out, density, ratio)


def _inertias(shape: Shape) -> WrongUnit | None:
    radius = shape.radius
    usual = np.where(shape.usual > 0, shape.usual, SIZE * shape.reach)
    times = radius / usual
    out = shape.matters & (radius > RADIUS_REACHES * shape.reach) & (times > RADIUS_USUAL)
    ratio = np.where(shape.mass > 0, times**2, np.where(shape.half_trace > 0, np.inf, 0.0))
    return _told("inertia", shape, out, radius, ratio)


def _without_mass(shape: Shape) -> WrongUnit | None:
    """Inertias of links without a mass that exceed those of the whole robot at its full reach."""
    mass = float(shape.mass.sum())
    out = ~shape.matters & (shape.half_trace > mass * shape.reach**2)
    if not out.any():
        return None
    worst = int(np.argmax(np.where(out, shape.half_trace, 0.0)))
    size = float(np.sqrt(shape.half_trace[worst] / mass))
    return WrongUnit("inertia", "", np.inf, np.flatnonzero(out).tolist(), size, worst)


def _density(mass: Array, radius: Array) -> Array:
    """Mean density of balls, kg/m^3."""
    return np.asarray(mass / (4 / 3 * np.pi * radius**3))
