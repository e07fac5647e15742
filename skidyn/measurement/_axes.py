# SPDX-License-Identifier: BSD-3-Clause
"""Check of the axes of joints, one of which may turn about another axis of its frame.

Descriptions of other variants of a robot, or written by hand, may have a joint about a wrong axis,
which no bodies can compensate. Every joint is tried about the other axes of its own frame; the
opposite direction of its own axis is a sign, which another check finds.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from skidyn._signals import Array
from skidyn.measurement._bodies import explained
from skidyn.measurement._check import Check
from skidyn.measurement._divided import divided_zeros
from skidyn.measurement._duel import duel_of
from skidyn.measurement._fits import Fits
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._near_bodies import NearBodies
from skidyn.measurement._outcome import Outcome
from skidyn.measurement._reading import Reading
from skidyn.measurement._readings import DECISIVE, HALF, NEEDED, WEAKEST
from skidyn.measurement._suspicion import Suspicion
from skidyn.measurement._torque import asked_changes
from skidyn.robots import Robot

#: Error of the stated bodies, as a share of a torque's spread, from which axes are tried.
WORTH = 0.08
#: Least log-likelihood gain of another axis with stated bodies, and in addition to any effect;
#: least share of it there; number of axes that are examined in detail.
LEAST, SURE, BESIDE, FINALISTS = 15.0, 40.0, 0.3, 4
#: What it must gain with identified bodies where stated ones hardly decide, as on a wrist, of whose
#: torque friction is the largest part.
CONFIRMED = 2 * DECISIVE
#: Difference of gains up to which two axes are the same.
TIED = 0.1
#: Largest constant torque that the stated bodies leave about another axis, relative to that about
#: the stated one and to its residual: a weight that the latter explains would be chance.
CONSTANT = 2.0


@dataclass(frozen=True)
class Axis:
    """Another axis of a joint, and its gain."""

    joint: int
    direction: Array
    fits: Fits
    gain: float
    confirmed: float
    drop: float

    @property
    def total(self) -> float:
        """Both gains."""
        return self.gain + self.confirmed

    @property
    def likely(self) -> tuple[bool, bool]:
        """Order of axes of equal gain: most descriptions have the z axis, in its direction."""
        return abs(self.direction[2]) > 0.5, bool(self.direction.sum() > 0)


class Axes(Check):
    """A joint with another axis than in the description."""

    name = "axes"
    suspects = "the axis of a joint in the description that differs from that of the robot"
    stage = 1
    misnames = True

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        seen = None if measurement.stale or measurement.lost else explained(measurement)
        if seen is None or seen.errors[0].max() < WORTH:
            return
        fits = seen.fits.loaded()
        every = find_axes(fits)
        if not every:
            return
        found, *others = every
        # a sign, an order or a zero may look like another axis, and vice versa
        asked = [c for c in asked_changes(measurement, fits) if not c.other]
        if sum(c.gain for c in asked) > found.gain and (
            any(NEEDED[c.kind] < 0 for c in asked if c.kind in NEEDED)
            or any(c.kind == "no_gravity" for c in asked)
            or sum(c.gain + c.confirmed for c in asked) > found.total
        ):
            return
        gains = np.nan_to_num(found.fits.nominal(Reading()).gain)
        inflation = fits.identified(Reading()).inflation
        here, there = (NearBodies(f, Reading(), gains, inflation) for f in (fits, found.fits))
        duel = duel_of(here, there, range(fits.n_joints))
        if duel.beside < (LEAST if found.confirmed > CONFIRMED else max(LEAST, BESIDE * duel.gain)):
            return
        # so may another zero in some of the recordings
        if any(zero.gain > found.confirmed for zero in divided_zeros(seen.fits)):
            return
        measurement.odd = True
        words = _words(found.direction)
        same = "".join(
            f'; {measurement.joint(axis.joint)} about <axis xyz="{_words(axis.direction)}"/> '
            "instead explains it equally well"
            for axis in others
        )
        yield self.suspicion(
            f"{measurement.joint(found.joint)} turns about a different axis than in the "
            "description",
            f'about <axis xyz="{words}"/> of its frame the rigid-body torque explains the '
            f"measured torque better by {found.gain:.0f} (log-likelihood), or by "
            f"{found.confirmed:.0f} with identified bodies, and leaves {100 * found.drop:.0f} % "
            f"less residual{same}; use the description of this robot, or correct the axis there",
            "certain",
            [found.joint],
        )


def turned(robot: Robot, body: int, direction: Array) -> Robot:
    """A robot with a joint about another axis of its frame.

    Parameters
    ----------
    robot : Robot
        As described.
    body : int
        Body that the joint moves.
    direction : ndarray of shape (3,)
        Unit vector.

    Returns
    -------
    Robot
    """
    axes = np.array(robot.tree.axes)
    axes[body] = direction
    return replace(robot, tree=replace(robot.tree, axes=axes))


def _words(direction: Array) -> str:
    """A direction, as in a description."""
    return " ".join(f"{x + 0.0:g}" for x in direction)


def find_axes(fits: Fits) -> list[Axis]:
    """The other axis of a joint that explains most, if bodies with it explain far more.

    Others that explain exactly as much follow, as of two joints that are parallel about either.

    Parameters
    ----------
    fits : Fits
        Rows.
    """
    robot, tree = fits.robot, fits.robot.tree
    if len(tree.parents) != robot.n_joints:
        return []  # bodies of mimic joints have no separate columns
    few = fits.with_loads(False).few
    rough = few.nominal(Reading(), 1)
    every = np.vstack([np.eye(3), -np.eye(3)])
    tried: list[tuple[float, int, int, Array]] = []
    for body, axis in enumerate(tree.axes):
        for direction in every[np.abs(every @ axis) < 0.5]:
            read = few.of(turned(robot, body, direction)).nominal(Reading(), 1)
            tried.append((read.gained_over(rough), len(tried), body, direction))
    here, before = fits.nominal(Reading()), fits.identified(Reading())
    most = CONSTANT * np.maximum(np.abs(fits.offsets(Reading())), here.scale)
    found = []
    for rough_gain, _, body, direction in sorted(tried, reverse=True)[:FINALISTS]:
        if rough_gain < 0:
            break
        other = fits.of(turned(robot, body, direction))
        after = other.identified(Reading())
        confirmed, own = _gained(before, after)
        joint = int(tree.coordinates[body])
        if confirmed < DECISIVE or abs(other.offsets(Reading())[joint]) > most[joint]:
            continue
        gain, drop = _gained(here, other.nominal(Reading()))
        stated = gain >= SURE and drop >= HALF
        decided = gain >= WEAKEST and confirmed >= CONFIRMED and own >= HALF
        if stated or (decided and after.margin(before)[joint] >= 0):
            found.append(Axis(joint, direction, other, gain, confirmed, max(drop, own)))
    best = max((axis.total for axis in found), default=0.0)
    return sorted(
        (axis for axis in found if axis.total > best - TIED), key=lambda a: a.likely, reverse=True
    )


def _gained(before: Outcome, after: Outcome) -> tuple[float, float]:
    """Gain of a fit, and the share of the residual it takes off, on the joint that gains most."""
    margin = after.margin(before)
    k = int(np.argmax(margin))
    return float(margin.sum()), float(1 - after.scale[k] / before.scale[k])
