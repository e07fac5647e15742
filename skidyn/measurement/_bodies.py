# SPDX-License-Identifier: BSD-3-Clause
"""Checks of the torque against bodies: its scale, other bodies, no friction, no measurement."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array
from skidyn.measurement._check import Check
from skidyn.measurement._crosstalk import find_shares
from skidyn.measurement._fits import SAMPLES, Fits, Outcome, Reading, friction, lines_between
from skidyn.measurement._gains import Scales, refined_scales
from skidyn.measurement._joint_gravity import without_gravity
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._peak import peak
from skidyn.measurement._readings import DECISIVE, FEWEST_ROWS, MOST_ROWS
from skidyn.measurement._robust import ROUNDS, fit_admissible
from skidyn.measurement._size import find_size
from skidyn.measurement._suspicion import Suspicion
from skidyn.measurement._torque import asked_changes, readable_fits

#: Least log-likelihood gain of another scale, and its value if the stated bodies do not confirm it.
LEAST, SURE = 15.0, 40.0
#: Least share of a torque's spread that the robot must explain for its multiple to be reported.
EXPLAINED = 0.5
#: Multiples of the robot's own torque that may be due to wrong masses.
USUAL = (0.4, 2.5)
#: Multiples that are attributed to wrong masses unless the other joints contradict.
CLEARLY = (0.62, 1.6)
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
#: Rates of clock and velocities that are tried.
RATES = (0.1, 0.2, 0.33, 0.5, 2.0, 3.0, 5.0, 10.0)
#: Distance of the points of a parabola through the likelihood of the logarithm of a rate, how far
#: identified bodies may move it, and how near it is to a whole multiple that is one.
RATE_STEP, RATE_MOVES, RATE_WHOLE = 0.02, 0.2, 0.02
AS_IT_IS = Reading()
#: Factors of units of torque.
UNITS = {1e3: "Nmm", 1e2: "Ncm", 1e-3: "kNm"}
#: That of torques beyond what their joints can have.
KILO = 1e3
#: Error with stated bodies, as a share of the spread, and as a multiple of that with identified
#: ones, from which the stated ones are wrong; least share of the bodies in a torque.
WRONG, TIMES, HEAVY = 0.2, 3.0, 0.3
#: Error of any bodies, as a share of the spread, and in errors of the mean of a row, from which a
#: torque is nearly unrelated to the motion; or of the stated ones, if others predict no part of the
#: log from the rest of it better than a constant does.
UNRELATED, BEYOND = 0.67, 4.0
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
        fits = self.fits
        return np.asarray(fits.average(fits.torque[:, k])[fits.moving[:, k]])

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


class TorqueScale(Check):
    """Torque in another unit, at the motor, or currents."""

    name = "torque_scale"
    suspects = "currents, motor torque or another unit instead of joint torque"
    stage = 2

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        fits = readable_fits(measurement)
        if fits is None or any(not c.joints for c in asked_changes(measurement, fits)):
            return  # with another gravity, torques have other scales
        known = _known_gains(fits)
        odd = [k for k, gain in known.items() if not USUAL[0] <= gain <= USUAL[1]]
        here = fits.nominal(Reading()).gain
        gains = {k: float(g) for k, g in enumerate(here) if np.isfinite(g) and g > 0}
        values = np.array(list(gains.values()))
        sure = np.array(list(known.values()))
        # accelerations of held positions are too small
        rate = None if measurement.stale else _other_rate(fits.loaded(), bool(odd))
        if rate is not None:
            value = float(f"{rate:.4g}")
            words = f"time={1 / value:.6g},dq={value:g}"
            yield self.suspicion(
                "the clock runs at a different rate, and the velocities were derived with it",
                f"with a sampling rate {value:g} times as high, the rigid-body torque explains "
                f"the measured torque better by {_rate_gain(fits, rate):.0f} (log-likelihood)",
                "suspected",
                remedy=(f"--gain {words}", f"gain={{'time': {1 / value:.6g}, 'dq': {value:g}}}"),
            )
            return
        every = bool(odd) and (_one_sided(values) or (len(sure) > 1 and _one_sided(sure)))
        # another unit of all torques, also where an effect is as large as the torque of the bodies
        every |= len(values) > 1 and 2 * sum(value > FAR for value in values) > len(values)
        if not every:
            yield from self._of_joints(measurement, fits, gains, known)
            return
        typical = float(np.median(sure if len(sure) > 1 else values))
        gains = gains if _one_sided(values) or not known else known
        # the multiple of a torque that bodies hardly explain may be anything
        gains = {
            k: gain
            for k, gain in gains.items()
            if k in known or abs(np.log(gain / typical)) < np.log(DRIVES)
        }
        told = ", ".join(f"{measurement.joint_names[k]} {gain:.3g}" for k, gain in gains.items())
        unit = next((u for f, u in UNITS.items() if abs(np.log(typical / f)) < 0.3), None)
        if unit is not None:
            yield self.suspicion(
                f"torque looks like {unit}",
                f"it is the rigid-body torque times {told}",
                "certain",
                sorted(gains),
                (f"--units tau={unit}", f"units={{'tau': '{unit}'}}"),
            )
            return
        factors = _all_factors(fits, gains, typical)
        other = find_size(fits, factors)
        if other is not None:
            yield self.suspicion(
                "the description is that of a robot of another size",
                f"torques are at another scale than those of its bodies ({told}), and with "
                f"{other[0]:.2g} times its lengths, bodies of any mass explain them better by "
                f"{other[1]:.0f} (log-likelihood), and better than gains do; use the description "
                "of this robot",
                "suspected",
                sorted(gains),
            )
            return
        seen = explained(measurement)
        left = 1.0 if seen is None else float(np.median(seen.shares[0]))
        what, little = "torques look like motor currents, motor torques or another unit", ""
        if left < SUBTRACTED:
            what += ", or the torque of a model was subtracted from them"
            little = f", which makes up {left:.0%} of a torque (the median of the joints)"
        yield self.suspicion(
            what,
            f"they follow the rigid-body torque at a different scale ({told}){little}. The gains "
            "below assume the bodies of the description; if known, use the torques per ampere of "
            "the drives instead (--drive-gains with i columns)",
            "suspected",
            sorted(gains),
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
        found = {}
        # If bodies need a torque of this scale, the joint can provide it, and the limit is wrong.
        usual = {k for k, gain in gains.items() if USUAL[0] <= gain <= USUAL[1]}
        reached = {k: x for k, x in _beyond_limits(measurement).items() if k not in usual}
        far = {k for k, times in reached.items() if times > FAR}
        for k, gain in gains.items():
            low, high = CLEARLY if k in known else USUAL
            if low <= gain <= high or (k not in known and gain < low):
                continue  # the multiple of a torque that bodies hardly explain is small by itself
            own, gained = joint_gain(fits.loaded(), k, gain)
            wrong = not USUAL[0] <= gain <= USUAL[1] and k in known
            sure = gained > (LEAST if wrong else SURE) and not low <= own <= high
            far_off = (scale_gain(fits.loaded(), k, times * own) for times in (0.25, 4.0))
            if sure and gained - max(far_off) > LEAST:
                found[k] = own
            elif wrong and gained > 0 and k not in far:
                yield self.suspicion(
                    f"either the torque of {measurement.joint(k)} has a different scale than that "
                    "of the other joints, or the bodies it moves differ from the description",
                    f"it is {gain:.3g} times that of the stated bodies; the other joints do not "
                    "determine which",
                    "noted",
                    [k],
                    _gain_remedy({k: float(f"{1 / (_unit_like(gain) or gain):.3g}")}),
                )
        if found:  # gravity that was removed from one torque makes it small, too
            found = {k: found[k] for k in set(found) - set(without_gravity(measurement, fits))}
        told, evidence = ", ".join(f"{gains[k]:.3g}" for k in found), []
        if found:
            fitted = ", ".join(f"{gain:.3g}" for gain in found.values())
            evidence.append(
                f"it is {told} times that of the stated bodies, and {fitted} times that of bodies "
                "that explain the other joints"
            )
        if far or any(_unit_like(gain) == KILO for gain in found.values()):
            far |= set(reached)
        beyond = {k: times for k, times in reached.items() if k in far and k not in found}
        for k, multiple in reached.items():
            if k not in far and k not in known and k not in found:
                yield self.suspicion(
                    f"either the torque of {measurement.joint(k)} is in another unit, or its "
                    "effort limit in the description is wrong",
                    f"it reaches {multiple:.3g} times that limit; the bodies that it moves do not "
                    "determine its scale",
                    "noted",
                    [k],
                    _gain_remedy({k: 1 / KILO}),
                )
        if beyond:
            names = ", ".join(measurement.joint(k) for k in beyond)
            sizes = ", ".join(f"{size:.3g}" for size in beyond.values())
            evidence.append(f"it reaches {sizes} times the effort limit of {names}")
        if found or beyond:
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
            joints = sorted(factors)
            yield self.suspicion(
                f"the torque of {', '.join(measurement.joint(k) for k in joints)} has a different "
                "scale than that of the other joints",
                "; ".join(evidence),
                "suspected",
                joints,
                _gain_remedy({k: factors[k] for k in joints}),
            )


def _all_factors(fits: Fits, gains: dict[int, float], typical: float) -> dict[int, float]:
    """Factors of torques all of which have a wrong scale; those of unknown ones are free, too."""
    usable = [k for k in range(fits.n_joints) if fits.usable(k)]
    found = refined_scales(fits, {}, {k: gains.get(k, typical) for k in usable})
    known = [k for k in usable if k in gains or found.errors[k] < TELLING]
    return Scales({k: found.gains[k] for k in known}, {k: found.errors[k] for k in known}).factors


def _rate_gain(fits: Fits, rate: float, rounds: int = ROUNDS) -> float:
    """Log-likelihood gain of another rate of clock and velocities."""
    here, there = (fits.nominal(Reading(stretch=x), rounds) for x in (1.0, rate))
    return float(there.margin(here).sum())


def _other_rate(fits: Fits, odd: bool) -> float | None:
    """Rate of clock and velocities that explains the torque better; None if there is none.

    Inertia grows with its square and gravity does not, so no scale of a torque is equivalent. If
    the scales of some torques are odd, it must make all of them usual, or identified bodies,
    which have no scale, must confirm it.
    """
    few = fits.thinned(max(FEWEST_ROWS, MOST_ROWS // fits.n_joints))
    best, log = max((_rate_gain(few, rate, 1), float(np.log(rate))) for rate in RATES)
    if best < LEAST and not odd:
        return None
    step, best = 0.2, _rate_gain(fits, float(np.exp(log)))
    while step > 0.01:
        near, other = max((_rate_gain(fits, float(np.exp(x))), x) for x in (log - step, log + step))
        if near > best:
            best, log = near, other
        else:
            step /= 2
    rate = float(np.exp(log))
    if best < SURE or CLEARLY[0] < rate < CLEARLY[1]:
        return None
    gains = list(_known_gains(fits, Reading(stretch=rate)).values())
    usual = odd and len(gains) > 1 and all(USUAL[0] <= gain <= USUAL[1] for gain in gains)
    here, there = (fits.identified(Reading(stretch=x)) for x in (1.0, rate))
    confirmed = float(there.margin(here).sum()) > DECISIVE
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
    pairs = {f"tau{k + 1}": value for k, value in factors.items()}
    words = ",".join(f"{name}={value:g}" for name, value in pairs.items())
    return f"--gain {words}", f"gain={pairs}"


def _unit_like(gain: float) -> float | None:
    """The factor of a unit close to a multiple of the robot's torque."""
    return next((f for f in UNITS if abs(np.log(gain / f)) < 0.3), None)


def scale_gain(fits: Fits, k: int, gain: float) -> float:
    """Log-likelihood gain of another scale of one torque, with bodies that all joints share."""
    other = fits.scaled({k: gain}).identified(Reading())
    # the density of a torque is that of the scaled torque divided by the gain
    change = other.margin(fits.identified(Reading()))
    rows = float(fits.moving[:, k].sum())
    change[k] -= rows * np.log(gain) / max(other.inflation_of(k), 1.0)
    return float(change.sum())


def joint_gain(fits: Fits, k: int, gain: float) -> tuple[float, float]:
    """Scale of one torque at which identified bodies, which all joints share, explain it best.

    Parameters
    ----------
    fits : Fits
        Rows.
    k : int
        Joint, from 0.
    gain : float
        Ratio of its torque to that of the stated bodies.

    Returns
    -------
    gain, gained : float
        Scale, and its log-likelihood gain over none.
    """

    @cache  # a search comes back to where it was
    def at(place: int) -> float:
        return scale_gain(fits, k, float(np.exp(np.log(gain) + 0.01 * place)))

    step = 8  # maxima are narrow if the noise is small
    best, place = max((at(x), x) for x in range(-5 * step, 6 * step, step))
    while step:
        near, other = max((at(x), x) for x in (place - step, place + step))
        if near > best:
            best, place = near, other
        else:
            step //= 2
    return float(np.exp(np.log(gain) + 0.01 * place)), best


def _known_gains(fits: Fits, reading: Reading = AS_IT_IS) -> dict[int, float]:
    """Multiple of the robot's own torque, for columns of which it explains enough."""
    here = fits.nominal(reading)
    s = fits.motion(reading)
    known = {}
    for k in range(fits.n_joints):
        if not fits.usable(k) or not here.gain[k] > 0:
            continue
        use = fits.moving[:, k]
        y = fits.average(fits.torque[:, k])[use]
        bare = fit_admissible(fits.average(friction(s, k))[use], y)
        if here.scale[k] ** 2 < (1 - EXPLAINED) * bare.scale**2 * (1 - EXPLAINED):
            known[k] = float(here.gain[k])
    return known


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
            f"{seen.stated.scale[k] / seen.identified.scale[k]:.2g} on {measurement.joint(k)}"
            for k in joints
        )
        gains = ", ".join(f"{seen.stated.gain[k]:.2g}" for k in joints)
        yield self.suspicion(
            "masses or inertias of the description differ from those of the robot",
            f"the error with the stated bodies is {ratios} times that with identified ones, "
            f"although friction and the scale of each torque ({gains}) were fitted with them. A "
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
        carried = seen.fits.loaded().identified(Reading()).scale[seen.joints] / seen.spread
        least = np.minimum(np.minimum(*seen.errors), carried)  # a load is no other signal
        steady = seen.scatter / np.sqrt(6)  # white noise is not an error of the log
        bad: NDArray[np.bool_] = (least > UNRELATED) & (least > BEYOND * steady)
        held = _held_out(seen)
        bad |= (held > 1.0) & (seen.errors[0] > UNRELATED) & (held > BEYOND * steady)
        unlike = [k for k, found in zip(seen.joints, bad, strict=True) if found]
        joints = [k for k in unlike if _left_by_position(seen, k) > LEFT]
        if joints:  # that of another joint may be larger than its own
            shared = {share.joint for share in find_shares(measurement, seen.fits)}
            joints = [k for k in joints if k not in shared]
        bad = np.isin(seen.joints, joints)
        if joints:
            names = ", ".join(measurement.joint(k) for k in joints)
            shares = ", ".join(f"{100 * share:.0f} %" for share in least[bad])
            others = ", ".join(f"{100 * share:.0f} %" for share in held[bad])
            yield self.suspicion(
                f"the torque of {names} is nearly unrelated to the motion",
                f"stated or identified bodies with any friction leave {shares} of its spread, and "
                f"bodies identified on the other parts of the log {others} of it; it may be "
                "another signal, of another joint or another time",
                "suspected",
                joints,
            )


def _held_out(seen: Explained) -> Array:
    """Errors of parts of a log predicted by bodies identified on the others, as shares of a torque.

    The share is 1 if a constant, the median of the torque, would have the same error.
    """
    fits = seen.fits
    number = fits.signals.trajectory[::SAMPLES]
    if len(np.unique(number)) < FEWEST_PARTS:
        number = np.arange(fits.n_rows) * FEWEST_PARTS // fits.n_rows
    parts = [np.isin(number, own) for own in np.array_split(np.unique(number), FEWEST_PARTS)]
    left, whole = np.zeros((2, fits.n_joints))
    for out, predicted in zip(parts, fits.predicted_without(parts), strict=True):
        for k, (torque, _) in predicted.items():
            y, use = fits.mean_torque(k)
            left[k] += np.sum((y[use & out] - torque) ** 2)
            whole[k] += np.sum((y[use & out] - np.median(y[use])) ** 2)
    return np.sqrt(left / np.where(whole > 0, whole, np.inf))[seen.joints]


def _left_by_position(seen: Explained, k: int) -> float:
    """Share of the residual of identified bodies that no function of the position explains.

    A spring of any form, or a stop, is related to the motion, and is the same in all recordings, by
    the others of which each is predicted: slow noise would be followed otherwise.
    """
    residual, use = seen.identified.residual[k], seen.fits.moving[:, k]
    q = seen.fits.average(seen.fits.signals.q[:, k])[use]
    part = seen.fits.signals.trajectory[::SAMPLES][use]
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
    return 1.4826 * float(np.median(np.abs(values - np.median(values))))
