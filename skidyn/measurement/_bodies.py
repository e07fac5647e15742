# SPDX-License-Identifier: BSD-3-Clause
"""Checks of the torque against bodies: other bodies, no friction, no measurement."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array, scatter
from skidyn.measurement._check import Check
from skidyn.measurement._crosstalk import find_shares
from skidyn.measurement._fits import Fits, lines_between
from skidyn.measurement._gains import CLEARLY
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._measures import COARSE
from skidyn.measurement._outcome import Outcome
from skidyn.measurement._reading import Reading
from skidyn.measurement._suspicion import Suspicion
from skidyn.measurement._torque import readable_fits

#: Error with stated bodies, as a share of the spread, and as a multiple of that with identified
#: ones, from which the stated ones are wrong; least share of the bodies in a torque.
WRONG, TIMES, HEAVY = 0.2, 3.0, 0.3
#: Error of any bodies, as a share of the spread, and in errors of the mean of a row, from which a
#: torque is nearly unrelated to the motion; or of the stated ones, if others predict no part of the
#: log from the rest of it better than a constant does, and leave this share even of the whole.
UNRELATED, BEYOND, FOLLOWED = 0.67, 4.0, 0.5
#: Least share of it that any function of the position must leave, the fewest parts of a log that
#: are predicted by the others, and the least share of it that can be.
LEFT, FEWEST_PARTS, MOSTLY = 0.8, 3, 0.5
#: Largest share of friction, and that of the joint in the middle, where there is none.
FRICTIONLESS, HARDLY = 0.12, 0.05
#: A computed torque: largest difference from that of the stated bodies, largest share of friction,
#: and largest gain by any other bodies.
EQUAL, CLOSE, NONE, NO_BETTER = 0.01, 0.1, 0.01, 1.25


@dataclass
class Explained:
    """Fits of the torque of every used joint with stated and identified bodies.

    Attributes
    ----------
    fits : Fits
        Rows.
    stated, identified : Outcome
        Fits with the bodies of the description and with others.
    joints : list of int
        Joints whose torque is used, from 0.
    """

    fits: Fits
    stated: Outcome
    identified: Outcome
    joints: list[int]

    def _torque(self, k: int) -> Array:
        torque, use = self.fits.mean_torque(k)
        return torque[use]

    @cached_property
    def spread(self) -> Array:
        """Spread of the torque; at least half its standard deviation, if it is mostly constant."""
        torques = [self._torque(k) for k in self.joints]
        return np.array([max(_spread(t), 0.5 * float(np.std(t))) + 1e-12 for t in torques])

    @cached_property
    def errors(self) -> tuple[Array, Array]:
        """Errors with stated and with identified bodies, as shares of the spread."""
        stated, identified = self.stated.scale, self.identified.scale
        return stated[self.joints] / self.spread, identified[self.joints] / self.spread

    @cached_property
    def shares(self) -> tuple[Array, Array]:
        """Parts of the stated bodies and of friction, as shares of the spread."""
        columns = self.fits.columns(Reading())
        held = []
        for k in self.joints:
            use = self.fits.moving[:, k]
            own, viscous, dry, _ = np.moveaxis(columns[use, :, k], 1, 0)
            c = self.fits.coefficients(k)
            held.append([_spread(c[0] * own), np.mean(np.abs(c[1] * viscous + c[2] * dry))])
        bodies, rubs = np.array(held).T / self.spread
        return bodies, rubs

    @cached_property
    def scatter(self) -> Array:
        """Scatter of the samples within rows, as share of the spread of the torque."""
        fits = self.fits
        rows = fits.torque.reshape(fits.n_rows, -1, fits.n_joints)
        bend = rows[:, 2:] - 2 * rows[:, 1:-1] + rows[:, :-2]
        size = [_spread(bend[:, :, k].ravel()) / np.sqrt(6) for k in self.joints]
        return np.array(size) / self.spread


def explained(measurement: Measurement) -> Explained | None:
    """Fits of a measurement with stated and with identified bodies; None where there are none."""
    fits = readable_fits(measurement)
    if fits is None or not np.any(fits.robot.inertial_parameters):
        return None
    joints = [k for k in range(fits.n_joints) if fits.usable(k)]
    if not joints:
        return None
    return Explained(fits, fits.nominal(Reading()), fits.identified(Reading()), joints)


class Bodies(Check):
    """Bodies of the description that are not those of the robot."""

    name = "bodies"
    suspects = "masses or inertias of the description that differ from those of the robot"
    stage = 2

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        if measurement.identified or measurement.scaled:
            return
        seen = explained(measurement)
        if seen is None:
            return
        stated, identified = seen.errors
        wrong = (stated > WRONG) & (stated > TIMES * identified)
        gain = seen.stated.gain[seen.joints]
        heavy = (seen.shares[0] > HEAVY) & (stated < WRONG)
        odd = heavy & ((gain < CLEARLY[0]) | (gain > CLEARLY[1]))
        if not wrong.any() and odd.sum() < 2:
            return
        joints = [k for k, bad in zip(seen.joints, wrong | odd, strict=True) if bad]
        ratios = ", ".join(
            f"{seen.stated.scale[k] / seen.identified.scale[k]:.2g} times on {measurement.joint(k)}"
            for k in joints
        )
        gains = ", ".join(f"{np.round(seen.stated.gain[k], 2) + 0.0:.2g}" for k in joints)
        yield self.suspicion(
            "masses or inertias of the description differ from those of the robot",
            f"the error with the stated bodies is larger than with identified ones, {ratios}, "
            "although friction and a factor of each torque were fitted to the stated ones as well "
            f"({gains}). A "
            "model that keeps the stated bodies (--nominal) would show spurious effects; a model "
            "that identifies them is not affected",
            "noted" if measurement.identified is None else "suspected",
            joints,
        )


class UnexplainedTorque(Check):
    """A torque that neither the stated bodies nor any others, with friction, explain."""

    name = "unexplained"
    suspects = "torque that is unrelated to the motion: another signal, joint or time"
    stage = 2

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        seen = explained(measurement)
        if seen is None or measurement.stale or measurement.frictionless:
            return  # rough derivatives, or another friction, are no other signal
        if not np.any(seen.errors[0] > UNRELATED):
            return
        loaded = seen.fits.loaded()
        carried = loaded.identified(Reading()).scale[seen.joints] / seen.spread
        least = np.minimum(np.minimum(*seen.errors), carried)  # a load is no other signal
        steady = seen.scatter / np.sqrt(6)  # white noise is not an error of the log
        bad: NDArray[np.bool_] = (least > UNRELATED) & (least > BEYOND * steady)
        held = _held_out(loaded, seen.joints)
        unlike_others = (held > 1.0) & (held > BEYOND * steady) & (least > FOLLOWED)
        bad |= unlike_others & (seen.errors[0] > UNRELATED)
        unlike = [k for k, found in zip(seen.joints, bad, strict=True) if found]
        joints = [k for k in unlike if _left_by_position(seen, k) > LEFT]
        if joints:  # that of another joint may be larger than its own
            shared = {share.joint for share in find_shares(measurement, seen.fits)}
            joints = [k for k in joints if k not in shared]
        # accelerations from coarse positions may be unrelated to the motion themselves
        rough = [k for k in joints if COARSE < measurement.position_steps[k] < np.inf]
        for own in (rough, [k for k in joints if k not in rough]):
            bad = np.isin(seen.joints, own)
            if not own:
                continue
            shares = ", ".join(f"{100 * share:.0f} %" for share in least[bad])
            others = ", ".join(f"{100 * share:.0f} %" for share in held[bad])
            what = f"the torque of {measurement.joints(own)} is nearly unrelated to the motion"
            if own is rough:
                what += ", or its positions are too coarse for accelerations"
            yield self.suspicion(
                what,
                f"stated or identified bodies with any friction leave {shares} of its spread, and "
                f"bodies identified on the other parts of the log {others} of it; it may be "
                "another signal, of another joint or another time",
                "noted" if own is rough else "suspected",
                own,
            )


def _held_out(fits: Fits, joints: list[int]) -> Array:
    """Errors of parts of a log predicted by bodies identified on the others, as shares of a torque.

    The share is 1 if a constant, the median of the torque, would have the same error. The load of a
    recording is known from its other parts only.
    """
    number = fits.recording
    if len(np.unique(number)) < FEWEST_PARTS:
        number = np.arange(fits.n_rows) * FEWEST_PARTS // fits.n_rows
    elif fits.loads:
        borders = np.flatnonzero(np.diff(number, prepend=number[0] - 1, append=number[-1] - 1))
        lengths = np.diff(borders)
        number = np.concatenate([np.arange(n) * FEWEST_PARTS // n for n in lengths])
    parts = [np.isin(number, own) for own in np.array_split(np.unique(number), FEWEST_PARTS)]
    left, whole = np.zeros((2, fits.n_joints))
    for out, predicted in zip(parts, fits.predicted_without(parts), strict=True):
        for k, (torque, _) in predicted.items():
            y, use = fits.mean_torque(k)
            left[k] += np.sum((y[use & out] - torque) ** 2)
            whole[k] += np.sum((y[use & out] - np.median(y[use])) ** 2)
    return np.sqrt(left / np.where(whole > 0, whole, np.inf))[joints]


def _left_by_position(seen: Explained, k: int) -> float:
    """Share of the residual of identified bodies that no function of the position explains.

    A spring of any form, or a stop, is related to the motion, and is the same in all recordings, by
    the others of which each is predicted: slow noise would be followed otherwise.
    """
    residual, use = seen.identified.residual[k], seen.fits.moving[:, k]
    q = seen.fits.average(seen.fits.signals.q[:, k])[use]
    part = seen.fits.recording[use]
    if len(np.unique(part)) < FEWEST_PARTS:
        part = np.arange(len(q)) * FEWEST_PARTS // len(q)
    hats = lines_between(q)
    rest, known = residual.copy(), np.zeros(len(q), dtype=bool)
    for one in np.unique(part):
        out = part == one
        seen_nodes = hats[~out].sum(axis=0) > FEWEST_PARTS
        known[out] = hats[out][:, seen_nodes].sum(axis=1) > 0.99
        fitted = np.linalg.lstsq(hats[~out][:, seen_nodes], residual[~out], rcond=1e-6)[0]
        rest[out] -= hats[out][:, seen_nodes] @ fitted
    if known.mean() < MOSTLY:  # recordings in different places predict nothing
        rest = residual - hats @ np.linalg.lstsq(hats, residual, rcond=None)[0]
        known[:] = True
    return float(np.std(rest[known]) / (np.std(residual[known]) + 1e-300))


class NoFriction(Check):
    """Torque without friction."""

    name = "no_friction"
    of_sensor = True
    suspects = "torque from which friction was removed, or that was measured behind the gears"
    stage = 2

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        seen = explained(measurement)
        if seen is None:
            return
        bodies, rubs = seen.shares
        rubs = rubs[bodies > HEAVY]  # the rest of a light joint is small beside nothing
        if len(rubs) > 1 and rubs.max() < FRICTIONLESS and np.median(rubs) < HARDLY:
            measurement.frictionless = True
            yield self.suspicion(
                "the torque contains no friction",
                f"viscous and dry friction account for at most {100 * rubs.max():.1f} % of its "
                "spread: friction was removed, the torque was measured behind the gears, or the "
                "log was computed",
                "noted",
            )


class ComputedTorque(Check):
    """Torque that equals a model: commanded or computed, not measured."""

    name = "computed_torque"
    of_sensor = True
    suspects = "commanded or computed torque instead of a measured one"
    stage = 2

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        seen = explained(measurement)
        if seen is None:
            return
        stated, identified = seen.errors
        gain = seen.stated.gain[seen.joints]
        equal = float(np.median(np.abs(gain - 1)))
        rubs = seen.shares[1]
        if (
            equal < EQUAL
            and np.median(stated) < CLOSE
            and rubs.max() < NONE
            and np.median(stated / identified) < NO_BETTER
        ):
            measurement.computed = True
            yield self.suspicion(
                "the torque equals that of the description: it was commanded or computed, not "
                "measured",
                f"it is {np.median(gain):.4g} times the torque of the stated bodies, friction "
                f"accounts for at most {rubs.max():.1g} of its spread, and no other bodies "
                "explain it better",
                "suspected",
            )
        elif identified.max() < 1e-4 and seen.fits.n_rows > 200:
            measurement.computed = True
            yield self.suspicion(
                "the torque has no noise: it was commanded or computed, not measured",
                f"a rigid body with friction explains all of it except {identified.max():.1g}",
                "noted",
            )


def _spread(values: Array) -> float:
    return float(scatter(values - np.median(values)))
