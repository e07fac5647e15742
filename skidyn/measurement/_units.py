# SPDX-License-Identifier: BSD-3-Clause
"""Checks of units: time, position and velocity against each other, limits and torque."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array
from skidyn._text import trajectories_told
from skidyn.measurement._check import Check
from skidyn.measurement._consistency import PROPORTIONAL
from skidyn.measurement._fits import Fits
from skidyn.measurement._gears import factors_of_joints
from skidyn.measurement._measurement import ALIKE, Measurement
from skidyn.measurement._peak import climb
from skidyn.measurement._reading import Reading
from skidyn.measurement._suspicion import Suspicion, remedy_of

DEGREE = np.pi / 180
#: Units of time, of velocities and of positions, by the slope of integrated velocity on position.
CLOCKS = {1e3: "ms", 1e6: "us", 1e9: "ns", 1 / 60: "min"}
VELOCITIES = {1 / DEGREE: "deg/s", 30 / np.pi: "rpm", 0.5 / np.pi: "rev/s"}
POSITIONS = {DEGREE: "deg", 2 * np.pi: "rev"}
NAMES = {"deg": "degrees", "rev": "turns", "min": "minutes"}
#: How far the slope may be off a unit's factor, and off 1.
NEAR = 0.1
#: How nearly a slope is that of minutes, which are but 5 % from degrees.
MINUTES = 0.02
#: How nearly a slope is a power of a thousand: an exact velocity has no other error than that of
#: its unit, and 100 times rpm is but 5 % from ms.
THOUSANDS = 0.03
#: Least common factor of velocities, less 1, that is told; how nearly equal it must be in all
#: joints, and how much of what makes velocities unlike the rates of positions it must be, so that
#: it is not that of a filter, which changes fast motion more than slow one.
SMALL, EQUALLY, CLEAN = 0.02, 0.2, 0.125
#: Factor of velocities from which no clock of a usual rate, Hz, is off by it; ratios of gears of
#: robots, and what they are mostly a multiple of; how nearly a factor is that of a unit before
#: gears.
FASTER, USUAL_RATES, RATIOS, ROUND_RATIO, BEFORE_GEARS = 5.0, (20.0, 2e4), (20, 300), 10, 2e-3
#: How many times its limit a position reaches that is suspicious, and that is no position.
FAR, DISTANT = 1.5, 4.0
#: How many times its limit the position of a sliding joint reaches that is in millimetres.
MILLIMETRES = 20.0
#: Largest positions, rad, that would hardly be a motion if they were degrees.
LEAST_DEGREES = 6.0
#: Positions, rad, beyond which a joint with limits is not in another place.
SEVERAL_TURNS = 4 * np.pi
#: How nearly a factor is a round number that it is taken for.
WHOLE = 2e-3
#: First and last step of the search for the logarithm of a size at which identified bodies fit
#: best, distance of the points of a parabola there, and how far it may be from that of stated ones.
APART, FINEST, BEND, NOT_FAR = 0.02, 5e-4, 5e-3, 0.06
#: Log-likelihood with identified bodies by which another factor must be likelier than degrees.
DECISIVE = 60.0
#: Share of recordings in which positions may be in another unit, how many times as far they then
#: spread, and recordings at least.
FEW, SPREAD, RECORDINGS = 0.4, 10.0, 3
#: Log-likelihood by which one scale must explain the torque better than another.
LEAST = 15.0


def is_near(slope: float, factor: float) -> bool:
    """Whether a slope is that of a unit's factor."""
    near = MINUTES if factor == 1 / 60 else THOUSANDS if factor in CLOCKS else NEAR
    minutes = factor == DEGREE and abs(60 * slope - 1) < MINUTES
    return bool(abs(slope / factor - 1) < near) and not minutes


class ClockUnit(Check):
    """Time in another unit than seconds, or at another rate."""

    name = "clock_unit"
    suspects = "time in ms, us, ns or minutes, or a clock with a different rate"
    misnames = True

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        slopes = [s for s, r in measurement.velocities if np.isfinite(s) and r > ALIKE and s > 0]
        typical = float(np.median(slopes)) if slopes else np.nan
        for factor, unit in CLOCKS.items():
            if is_near(typical, factor):
                measurement.clock = factor
                yield self.suspicion(
                    f"time looks like {NAMES.get(unit, unit)}",
                    f"the integrated velocities are {typical:.4g} times the changes of position "
                    f"(median over {len(slopes)} joints)",
                    "certain",
                    remedy=remedy_of("units", {"time": unit}),
                )
                return
        shared = measurement.velocity_scale
        if measurement.rate < 2 and not (shared > 1 and unnamed_scale(measurement, shared)):
            # the unit in which a robot would have been sampled at a usual rate
            usual = [
                (factor, unit)
                for factor, unit in CLOCKS.items()
                if factor > 1 and 20 <= measurement.rate * factor <= 2e4
            ]
            factor, unit = usual[0] if usual else (1e3, "ms")
            agrees = np.isfinite(typical) and abs(typical - 1) < NEAR
            if not agrees:
                measurement.clock = factor  # velocities are told when time is in seconds
            yield self.suspicion(
                f"time may be in {unit}",
                f"the median time step is {1 / measurement.rate:.4g} s",
                "noted" if agrees else "suspected",
                remedy=remedy_of("units", {"time": unit}),
            )
            return
        if measurement.lost:
            return  # rows that are missing make every velocity too slow
        if unnamed_scale(measurement, shared) and not _too_far(measurement, DISTANT).any():
            yield self._rate(measurement, shared)

    def _rate(self, measurement: Measurement, shared: float) -> Suspicion:
        """Clock, velocities or positions at another scale, whichever explains the torque."""
        gains = {"time": 0.0, "dq": 0.0, "q": 0.0}
        fits = measurement.fits
        if fits is not None:
            gains["time"] = gained(fits, Reading(stretch=shared))
            gains["q"] = gained(fits, Reading(size=1 / shared))
        best = max(gains, key=lambda name: gains[name])
        others = [gain for name, gain in gains.items() if name != best]
        told = fits is not None and gains[best] - max(others) > LEAST
        sampled = USUAL_RATES[0] <= measurement.rate <= USUAL_RATES[1]
        if (best == "dq" if told else sampled) and shared > FASTER:
            return self._of_motors_alone(shared, told)
        best = best if told else "time"
        what = {"time": "the clock", "dq": "velocities", "q": "positions"}
        shared = _round(shared)
        value = float(f"{shared if best == 'q' else 1 / shared:.6g}")
        doubt = "" if told else "; the scale of velocities or positions may be off instead"
        return self.suspicion(
            "velocity is not the derivative of the position: the scale of "
            f"{what[best]} is off by a factor of {1 / value:.4g}",
            f"integrated velocities are {shared:.4g} times the changes of position, equally in "
            f"all joints{doubt}",
            "certain" if told else "suspected",
            remedy=remedy_of("gain", {best: value}),
        )

    def _of_motors_alone(self, shared: float, told: bool) -> Suspicion:
        """Velocities in another unit, or before the gears, beside positions that are as named."""
        words = ""
        for factor, unit in ((30 / np.pi, "rpm"), (1.0, "rad/s"), (1 / DEGREE, "deg/s")):
            ratio = ROUND_RATIO * round(shared / factor / ROUND_RATIO)
            usual = RATIOS[0] <= ratio <= RATIOS[1]
            if usual and abs(shared / factor / ratio - 1) < BEFORE_GEARS:
                words = f"; with a gear of {ratio}:1, they are those of the motors in {unit}"
                break
        return self.suspicion(
            "velocities are those of the motors before the gears, or in another unit",
            f"integrated velocities are {shared:.4g} times the changes of position, equally in "
            f"all joints, and the clock has a usual rate{words}",
            "certain" if told else "suspected",
            remedy=remedy_of("gain", {"dq": float(f"{1 / shared:.4g}")}),
        )


class PositionUnit(Check):
    """Positions in degrees, turns, counts or millimetres, or of the motors."""

    name = "position_unit"
    suspects = (
        "positions in degrees, turns, millimetres or encoder counts, or motor positions before "
        "the gears"
    )
    misnames = True

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        if measurement.shuffled:
            return  # turns and rates of positions follow from the order of the rows
        yield from self._sliding(measurement)
        slopes = [s for s, r in measurement.velocities if np.isfinite(s) and r > ALIKE]
        typical = float(np.median(slopes)) if slopes else 1.0
        for factor, unit in POSITIONS.items():
            if is_near(typical, factor):
                yield self.suspicion(
                    f"positions look like {NAMES[unit]}",
                    f"velocities are {typical:.4g} times the differentiated positions (median over "
                    f"{len(slopes)} joints)",
                    "certain",
                    remedy=remedy_of("units", {"q": unit}),
                )
                return
        odd = _odd_runs(measurement)
        if odd:
            measurement.odd = True
            largest = np.abs(measurement.signals.q).max()
            yield self.suspicion(
                f"in {trajectories_told(odd)} positions have a different unit than in the others",
                f"their spread there is {min(odd.values()):.3g} times that of the others, up to "
                f"{largest:.4g} rad; fix that file, or leave it out",
                "certain",
            )
            return
        far = _too_far(measurement, DISTANT)
        shared = measurement.velocity_scale
        if far.any() and unnamed_scale(measurement, shared) and shared < 1:
            counts = _round_counts(2 * np.pi / shared)
            shared = 2 * np.pi / counts
            yield self.suspicion(
                "positions are encoder counts, or motor positions",
                f"the largest is {np.abs(measurement.signals.q).max():.4g} rad, and they change "
                f"{1 / shared:.5g} times as fast as the velocities imply ({counts:.6g} per turn)",
                "certain",
                np.flatnonzero(far),
                remedy_of("gain", {"q": float(f"{shared:.9g}")}),
            )
            return
        both = {"q": "deg", "dq": "deg/s"} if abs(typical - 1) < NEAR else {"q": "deg"}
        if measurement.robot is None:
            yield from self._by_turns(measurement, both)
        elif _too_far(measurement, FAR).any():
            yield from self._beyond_limits(measurement, both)

    def _sliding(self, measurement: Measurement) -> Iterator[Suspicion]:
        """Sliding joints in millimetres."""
        if measurement.robot is None:
            return
        largest = np.abs(measurement.signals.q).max(axis=0)
        limits = np.abs(np.asarray(measurement.robot.position_limits)).max(axis=1)
        for k in np.flatnonzero(measurement.signals.prismatic & np.isfinite(limits)).tolist():
            if not MILLIMETRES * limits[k] < largest[k] < FAR * 1e3 * limits[k]:
                continue
            slope, likeness = measurement.velocities[k]
            both = likeness > ALIKE and abs(slope - 1) < NEAR
            gains = dict.fromkeys([f"q{k + 1}", f"dq{k + 1}"] if both else [f"q{k + 1}"], 1e-3)
            measurement.millimetres.add(k)
            yield self.suspicion(
                f"the position of {measurement.joint(k)} looks like millimetres",
                f"it reaches {largest[k]:.4g} where the limit is {limits[k]:.3g} m",
                "certain",
                [k],
                remedy_of("gain", gains),
            )

    def _by_turns(self, measurement: Measurement, both: dict[str, str]) -> Iterator[Suspicion]:
        """Without a robot: positions that run over several turns."""
        largest = np.abs(measurement.signals.q).max(axis=0)
        k = int(np.argmax(largest))
        span = float(np.ptp(measurement.signals.q[:, k]))
        if largest[k] > 4 * np.pi and span > 4 * np.pi:
            yield self.suspicion(
                "positions may be in degrees",
                f"q{k + 1} reaches {largest[k]:.4g} rad, {largest[k] / 2 / np.pi:.1f} turns",
                "suspected" if int(np.sum(largest > 4 * np.pi)) > 1 else "noted",
                [k],
                remedy_of("units", both),
            )

    def _beyond_limits(self, measurement: Measurement, both: dict[str, str]) -> Iterator[Suspicion]:
        """Positions far outside the limits: in degrees, or of the motors before the gears."""
        turning, limits, known = _limits(measurement)
        largest = np.abs(measurement.signals.q).max(axis=0)
        outside = _unnamed_outside(measurement)
        if not outside.any():
            return  # found by their velocities, joint by joint
        seen, farthest = _farthest(measurement, outside)
        degrees = bool(np.all(largest[turning] * DEGREE <= 1.1 * limits[turning]))
        usual = float(np.quantile(largest[turning], 0.5, method="lower"))  # of two the smaller
        if usual < LEAST_DEGREES and degrees:
            outside &= _too_far(measurement, DISTANT)  # else its zero may be elsewhere
            if not outside.any():
                return
            both = {f"{q}{j + 1}": u for q, u in both.items() for j in np.flatnonzero(outside)}
            joints = frozenset(np.flatnonzero(outside).tolist())
        else:
            joints = None
        ratio = _fitted_size(measurement, float((largest / limits)[turning].max()), joints)
        gained = _gained_over_degrees(measurement, ratio, joints) if ratio else 0.0
        if ratio is not None and (not degrees or gained >= DECISIVE):
            yield self._of_motors(seen, ratio, outside, both)
        elif degrees and joints is not None and ratio is not None and gained > LEAST:
            yield self._degrees_or_motors(seen, ratio, gained, outside)
        elif degrees and (own := _own_factors(measurement, _sized_joints(turning, joints))):
            yield self._of_each_motor(measurement, seen, *own)
        elif degrees:
            # a single joint may have another zero, or the name of another one
            whole = joints is None or bool(np.all(largest[outside] > SEVERAL_TURNS))
            certain = (bool((outside & known).any()) and whole) or usual > 25
            yield self.suspicion(
                "positions look like degrees",
                f"{seen}; read as degrees it would be {farthest * DEGREE:.3g} rad",
                "certain" if certain else "suspected",
                np.flatnonzero(outside),
                remedy_of("units", both),
            )
        elif _too_far(measurement, DISTANT).any():
            yield self.suspicion(
                "positions have an unknown unit, or are those of the motors before the gears",
                seen,
                "certain",
                np.flatnonzero(outside),
            )

    def _of_motors(
        self, seen: str, ratio: float, outside: NDArray[np.bool_], both: Iterable[str]
    ) -> Suspicion:
        """Positions and velocities before the gears."""
        value = float(f"{1 / ratio:.4g}")
        return self.suspicion(
            "positions and velocities are those of the motors before the gears, or have an "
            "unknown unit",
            f"{seen}; divided by {ratio:.3g} they explain the torque best",
            "certain",
            np.flatnonzero(outside),
            remedy_of("gain", dict.fromkeys(both, value)),
        )

    def _of_each_motor(
        self, measurement: Measurement, seen: str, factors: Array, gain: float
    ) -> Suspicion:
        """Positions that would be in degrees by their limits, but explain no torque as such."""
        joints = np.flatnonzero(factors != 1)
        told = ", ".join(f"{factors[k]:.3g} on {measurement.joint(int(k))}" for k in joints)
        return self.suspicion(
            "positions and velocities have another factor on each joint, as those of motors before "
            "gears of different ratios",
            f"{seen}; as degrees they would stay within the limits, but the torque is explained "
            f"better by {gain:.0f} (log-likelihood) if they are divided by about {told}, of which "
            "those of light joints are uncertain; divide them by the ratios of the gears, with "
            "their signs (--gain q1=0.01,dq1=0.01,... for a ratio of 100)",
            "certain",
            joints,
        )

    def _degrees_or_motors(
        self, seen: str, ratio: float, gained: float, outside: NDArray[np.bool_]
    ) -> Suspicion:
        """Positions that are likelier before the gears than in degrees, but not by far."""
        return self.suspicion(
            "positions are in degrees, or those of the motors before the gears",
            f"{seen}; divided by about {ratio:.3g} they explain the torque better by "
            f"{gained:.0f} (log-likelihood) than as degrees, which is not decisive; use the "
            "ratio of the gears, if it is known (--gain)",
            "certain",
            np.flatnonzero(outside),
        )


def _limits(measurement: Measurement) -> tuple[NDArray[np.bool_], Array, NDArray[np.bool_]]:
    """Which joints turn, the largest position of each, and whether the description states it."""
    robot = measurement.robot
    if robot is None:
        n = measurement.n_joints
        return ~measurement.signals.prismatic, np.full(n, 2 * np.pi), np.zeros(n, dtype=bool)
    turning = np.array([kind == "revolute" for kind in robot.joint_types])
    limits = np.abs(np.asarray(robot.position_limits)).max(axis=1)
    known = np.isfinite(limits)
    return turning, np.where(known, limits, 2 * np.pi), known


def _too_far(measurement: Measurement, times: float) -> NDArray[np.bool_]:
    """Turning joints whose positions go so many times their limits, or turns, away."""
    turning, limits, _ = _limits(measurement)
    return np.asarray(turning & (np.abs(_unwrapped(measurement)).max(axis=0) > times * limits))


def _unnamed_outside(measurement: Measurement) -> NDArray[np.bool_]:
    """Joints far outside their limits whose velocities do not tell the unit of the position."""
    named = [
        any(abs(slope / factor - 1) < NEAR for factor in POSITIONS)
        for slope, _ in measurement.velocities
    ]
    return np.asarray(_too_far(measurement, FAR) & ~np.array(named))


def _farthest(measurement: Measurement, outside: NDArray[np.bool_]) -> tuple[str, float]:
    """In words, how far the joint goes that is farthest outside its limits, and this position."""
    _, limits, known = _limits(measurement)
    largest = np.abs(measurement.signals.q).max(axis=0)
    k = int(np.argmax(np.where(outside, largest / limits, 0)))
    where = f"the limit is {limits[k]:.3g} rad" if known[k] else "one turn is 6.28 rad"
    farthest = float(largest[k])
    if farthest < FAR * limits[k]:  # it was wrapped
        farthest = float(np.abs(_unwrapped(measurement)[:, k]).max())
    seen = f"q{k + 1} ({measurement.joint_names[k]}) reaches {farthest:.4g} rad where {where}"
    return seen, farthest


def _unwrapped(measurement: Measurement) -> Array:
    """Positions without jumps by a turn, and without whole turns, which are no other unit."""
    q = measurement.unwrapped
    return np.asarray(q - 2 * np.pi * np.round(np.median(q, axis=0) / (2 * np.pi)))


def _odd_runs(measurement: Measurement) -> dict[int, float]:
    """Recordings in which all turning joints move many times as far, beyond what any can."""
    turning, limits, _ = _limits(measurement)
    moves = turning & np.array(measurement.excited)
    number, q = measurement.signals.trajectory, measurement.signals.q
    runs = np.unique(number)
    if len(runs) < RECORDINGS or len(measurement.leaps) or not moves.any():
        return {}
    spread = np.array([np.ptp(q[number == run], axis=0) for run in runs])[:, moves]
    times = np.median(spread / np.maximum(np.median(spread, axis=0), 1e-12), axis=1)
    odd = times > SPREAD
    beyond = (spread > 2 * FAR * limits[moves]).any(axis=1)
    if not odd.any() or not beyond[odd].all() or beyond[~odd].any() or odd.mean() > FEW:
        return {}
    return {int(run): float(x) for run, x in zip(runs[odd], times[odd], strict=True)}


def unnamed_scale(measurement: Measurement, shared: float) -> bool:
    """Whether velocities share a scale that is neither 1 nor that of a unit."""
    moving = [
        r
        for (_, r), moves in zip(measurement.velocities, measurement.excited, strict=True)
        if moves
    ]
    several = len(moving) > 1 and min(moving) > PROPORTIONAL  # not of a filtered velocity
    if not several or not shared > 0:
        return False
    if abs(shared - 1) < NEAR:
        return _is_small_scale(measurement, shared)
    if any(is_near(shared, factor) for factor in CLOCKS):
        return False
    return not any(abs(shared / f - 1) < NEAR for f in (*VELOCITIES, *POSITIONS))


def _is_small_scale(measurement: Measurement, shared: float) -> bool:
    """Whether a common scale of velocities near 1 is that of a clock, and not that of a filter.

    A clock changes all velocities by the same share. A filter of velocities or positions changes
    fast motion more than slow one, so that it makes joints differ, and velocities less like the
    rates of the positions.
    """
    off = shared - 1
    slopes, likeness = np.transpose(
        [v for v, moves in zip(measurement.velocities, measurement.excited, strict=True) if moves]
    )
    equal = np.ptp(slopes) < EQUALLY * abs(off)
    return bool(abs(off) > SMALL and equal and np.all(1 - likeness < CLEAN * off**2))


def gained(fits: Fits, reading: Reading) -> float:
    """Log-likelihood that a reading gains over the log as it is."""
    return fits.nominal(reading).gained_over(fits.nominal(Reading()))


def _fitted_size(
    measurement: Measurement, least: float, joints: frozenset[int] | None
) -> float | None:
    """Factor of positions at which the robot explains the torque best; None if it is unsure."""
    fits = measurement.fits
    if fits is None or least < DISTANT:
        return None
    sizes: Array = (
        0.8 * least * np.power(1.03, np.arange(90), dtype=float)
    )  # up to a tenth of the range of the joint
    if joints is not None:  # bodies that other joints move as well
        return _sharpened(fits, _identified_size(fits, sizes, joints)[0], joints)
    likely = np.array([fits.nominal(_sized(x, joints), 2).likelihood.sum() for x in sizes])
    best = int(np.argmax(likely))
    far = np.abs(np.arange(len(sizes)) - best) > 4
    other = sizes[far][int(np.argmax(likely[far]))]
    there, elsewhere = (fits.nominal(_sized(x, joints), 2) for x in (sizes[best], other))
    sure = there.gained_over(elsewhere) > LEAST
    if not sure or not 0 < best < len(sizes) - 1:
        # beside a load or an effect, stated bodies with a scale of every torque decide little
        size, gain = _identified_size(fits, sizes, joints)
        inside = sizes[0] < size < sizes[-1]
        return _sharpened(fits, size, joints) if gain > DECISIVE and inside else None
    finer = sizes[best] * 1.002 ** np.arange(-14, 15)
    likely = np.array([fits.nominal(_sized(x, joints), 2).likelihood.sum() for x in finer])
    return _sharpened(fits, float(finer[int(np.argmax(likely))]), joints)


def _identified_size(
    fits: Fits, sizes: Array, joints: frozenset[int] | None
) -> tuple[float, float]:
    """Factor of positions at which identified bodies fit best, and its gain over far ones."""
    few = fits.few.with_loads()
    fitted = [few.identified(_sized(x, joints)) for x in sizes]
    likely = np.array([outcome.likelihood.sum() for outcome in fitted])
    best = int(np.argmax(likely))
    far = np.flatnonzero(np.abs(np.arange(len(sizes)) - best) > 4)
    other = int(far[np.argmax(likely[far])])
    return float(sizes[best]), fitted[best].gained_over(fitted[other])


def _gained_over_degrees(
    measurement: Measurement, ratio: float, joints: frozenset[int] | None
) -> float:
    """Log-likelihood with bodies of any mass that a factor of positions gains over degrees.

    A usual unit is likelier than a gear before which position was measured, unless this decides.
    """
    fits = measurement.fits
    if abs(ratio * DEGREE - 1) < 0.06 or fits is None:
        return 0.0
    fits = fits.loaded(_sized(ratio, joints))
    there, degrees = (fits.identified(_sized(x, joints)) for x in (ratio, 1 / DEGREE))
    return there.gained_over(degrees)


def _own_factors(measurement: Measurement, outside: list[int]) -> tuple[Array, float] | None:
    """Factors of positions of some joints that explain far more than degrees, and their gain."""
    fits = measurement.fits
    if fits is None or len(outside) < 2:
        return None
    return factors_of_joints(fits, outside, 1 / DEGREE)


def _sized_joints(turning: NDArray[np.bool_], joints: frozenset[int] | None) -> list[int]:
    """Joints, from 0, whose positions have another unit; all that turn if None."""
    return sorted(joints) if joints is not None else np.flatnonzero(turning).tolist()


def _sized(size: float, joints: frozenset[int] | None) -> Reading:
    return Reading(size=float(size), sized=joints)


def _sharpened(fits: Fits, size: float, joints: frozenset[int] | None) -> float:
    """Factor of positions at which identified bodies fit best: those stated are not exact.

    Gears have whole ratios, mostly round ones.
    """
    fits = fits.loaded(_sized(size, joints))
    inflation = fits.identified(_sized(size, joints)).inflation

    def likelihood(log: float) -> float:
        outcome = fits.identified(_sized(float(np.exp(log)), joints))
        return float(np.sum(outcome.likelihood / inflation))

    first = float(np.log(size))
    log, best = climb(likelihood, first, APART, FINEST, NOT_FAR)
    bend = 2 * best - likelihood(log - BEND) - likelihood(log + BEND)
    if bend <= 0 or abs(log - first) > NOT_FAR:
        return size  # bodies compensate any size
    error = BEND / np.sqrt(bend)
    if error > NOT_FAR:
        return size
    found = float(np.exp(log))
    for whole in (10, 5, 1):
        near = float(whole * round(found / whole))
        if near > 2 and abs(np.log(near / found)) < min(2 * error, NOT_FAR / 2):
            return near
    return found


def _round(factor: float) -> float:
    """The whole number, or its reciprocal, or the short decimal fraction that a factor is near."""
    large = max(factor, 1 / factor)
    near = [x for x in (round(large), round(large, 1)) if abs(x / large - 1) < WHOLE]
    whole = near[0] if near else large
    return whole if factor > 1 else 1 / whole


def _round_counts(counts: float) -> float:
    """Power of two or round number close to the counts of a turn."""
    digits = 10.0 ** max(0, np.floor(np.log10(counts)) - 1)
    near = (2.0 ** round(np.log2(counts)), round(counts / digits) * digits)
    return next((x for x in near if abs(x / counts - 1) < WHOLE), counts)
