# SPDX-License-Identifier: BSD-3-Clause
"""Checks of velocities against positions: sign, scale, order, delay, and jumps of positions."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from skidyn._signals import Array, Signals
from skidyn.measurement._check import Check
from skidyn.measurement._delay import find_delay
from skidyn.measurement._lowpass import TRIED, summit, suspect_lowpass, without_lowpass
from skidyn.measurement._measurement import ALIKE, Measurement
from skidyn.measurement._measures import velocity_consistency
from skidyn.measurement._peak import vertex
from skidyn.measurement._reading import Reading
from skidyn.measurement._suspicion import Suspicion, remedy_of
from skidyn.measurement._tachometer import Fault, find_fault
from skidyn.measurement._torque import readable_fits
from skidyn.measurement._units import (
    CLOCKS,
    LEAST,
    NEAR,
    POSITIONS,
    VELOCITIES,
    gained,
    is_near,
    unnamed_scale,
)

#: Range of a position, rad or m, and spread of a velocity, that are those of a joint that moves.
LEAST_MOTION, LEAST_SPEED = 0.02, 0.02
#: Rows in which the position of a joint does not change before it jumps.
STUCK = 10
#: Velocity of a joint that moves while another one jumps, as a share of its largest, and share of
#: the jumps at which some joint does.
MOVING, MOST_MOVE = 0.05, 0.5
#: Correlation of a velocity with the rate of its position above which it has no fault.
SURE = 0.995
#: How much smaller a coarse velocity may be whose digits were cut, in steps over its spread.
CUT = 0.5
#: Windows over which velocities are compared with positions, at most.
WINDOWS = 3000
#: Lags of the velocity that are tried, s, and how many times as long ones if none of them is best;
#: the least that is reported, s and in time steps; the
#: share of the difference that it takes away; joints that agree and how nearly, s.
LAGS, FARTHER = np.linspace(-0.1, 0.1, 21), 4.0
SMALLEST, STEPS, TAKEN, AGREEING, NEARLY = 0.006, 1.2, 0.3, 0.75, 0.01
#: Largest residual of a low pass to be reported, as a share of that of a delay; largest difference
#: of a common time constant between joints.
FILTERED, SAME_FILTER = 0.4, 0.15
#: Largest lag of the torque, as a share of that of the position behind the velocity, of which the
#: latter is the one that is early; number of standard errors that must be less than this lag.
IN_TIME, ERRORS = 0.3, 5.0


class Velocity(Check):
    """Velocities that are not the derivative of the positions."""

    name = "velocity"
    suspects = (
        "velocities with the opposite sign, in degrees or turns, of another joint, or of a "
        "signal other than the positions"
    )

    def look(self, measurement: Measurement) -> Iterable[Suspicion]:
        shared = measurement.velocity_scale
        if (
            measurement.lost
            or _of_units(shared)
            or (np.isfinite(shared) and unnamed_scale(measurement, shared))
        ):
            return []  # the unit of the clock or of the positions
        order = _other_order(measurement)
        if order is not None:
            moved = [k for k, column in enumerate(order) if column != k]
            numbers = [column + 1 for column in order]
            names = measurement.joints(moved)
            told = self.suspicion(
                f"the velocities of {names} are exchanged",
                "each is the derivative of another joint's position",
                "certain",
                moved,
                remedy_of("order", {"dq": numbers}),
            )
            return [told]
        constant = _constant(measurement)
        if constant:
            names = measurement.joints(constant)
            told = self.suspicion(
                f"the velocity of {names} does not belong to the position: one of them is constant",
                "the other changes in most rows",
                "certain",
                constant,
            )
            return [told]
        groups: dict[str, list[int]] = {}
        faults = []
        for k, (slope, correlation) in enumerate(measurement.velocities):
            slope /= measurement.clock
            if not np.isfinite(slope) or not measurement.excited[k]:
                continue
            if k in measurement.stuck and _cause(slope, correlation) == "other":
                continue
            fault = _fault(measurement, k) if correlation < SURE else None
            if fault is not None:
                faults.append(self._faulty(measurement, k, fault))
                continue
            if abs(slope - 1) < max(NEAR, CUT * _coarseness(measurement, k)):
                continue
            if k in measurement.millimetres:
                continue
            if measurement.clock != 1 and _cause(slope, correlation) in ("scale", "other"):
                continue  # reported when time is in seconds
            groups.setdefault(_cause(slope, correlation), []).append(k)
        if "other" in groups and set(groups["other"]) <= set(
            _common_lag(measurement, _lags(measurement))[1]
        ):
            del groups["other"]  # they are late
        if not groups:  # in another unit, the noise of a joint at rest looks like motion
            faults += [self._held(measurement, k, runs) for k, runs in measurement.stuck.items()]
        return faults + [self._told(measurement, cause, joints) for cause, joints in groups.items()]

    def _faulty(self, measurement: Measurement, k: int, fault: Fault) -> Suspicion:
        name, column = measurement.joint(k), f"dq{k + 1}"
        unit = "m/s" if measurement.signals.prismatic[k] else "rad/s"
        what = {
            "unsigned": f"the velocity of {name} has no sign",
            "offset": f"the velocity of {name} has an offset of {fault.value:.3g} {unit}",
            "clipped": f"the velocity of {name} is clipped at {fault.value:.3g} {unit}",
        }[fault.kind]
        remedy = remedy_of("derive", [column])
        if fault.kind == "offset":
            remedy = remedy_of("zero", {column: float(f"{fault.value:.4g}")})
        return self.suspicion(
            what,
            f"this explains {1 - fault.left:.0%} of the squared difference from the rate of the "
            "position",
            "certain" if fault.kind == "unsigned" else "suspected",
            [k],
            remedy,
        )

    def _held(self, measurement: Measurement, k: int, runs: list[int]) -> Suspicion:
        return self.suspicion(
            f"the position of {measurement.joint(k)} does not change in some trajectories, "
            "although its velocity is not zero",
            f"in {', '.join(map(str, runs[:8]))}; leave these trajectories out",
            "suspected",
            [k],
        )

    def _told(self, measurement: Measurement, cause: str, joints: list[int]) -> Suspicion:
        names = measurement.joints(joints)
        slopes = ", ".join(
            f"{slope / measurement.clock:.4g} (correlation {likeness:.3f})"
            for slope, likeness in (measurement.velocities[k] for k in joints)
        )
        evidence = f"the velocity is {slopes} times the differentiated position"
        if cause == "sign" and _runs_backwards(measurement, joints):
            return self.suspicion(
                "rows run backwards in time",
                f"{evidence}, and friction opposes the motion only if time is reversed; reverse "
                "the order of the rows of every recording, and keep the clock as it is",
                "certain",
            )
        if cause == "sign":
            columns = [f"dq{k + 1}" for k in joints]
            return self.suspicion(
                f"the velocity of {names} has the opposite sign",
                evidence,
                "certain",
                joints,
                remedy_of("flip", columns),
            )
        every = len(joints) == measurement.n_joints
        if cause in ("scale", "other"):
            what = f"the velocity of {names} is not the derivative of the position"
            if cause == "other":
                columns = [f"dq{k + 1}" for k in joints]
                derive = remedy_of("derive", columns)
                return self.suspicion(what, evidence, "suspected", joints, derive)
            pairs = {f"dq{k + 1}": float(f"{1 / measurement.velocities[k][0]:.4g}") for k in joints}
            return self.suspicion(
                what,
                f"{evidence}; its scale differs",
                "suspected",
                joints,
                remedy_of("gain", pairs),
            )
        quantity, unit = cause.split("=")
        units = {quantity: unit} if every else {f"{quantity}{k + 1}": unit for k in joints}
        what = "velocities" if quantity == "dq" else "positions"
        unit = {"deg": "degrees", "rev": "turns"}.get(unit, unit)
        return self.suspicion(
            f"{what} look like {unit} on {names}",
            evidence,
            "certain",
            joints,
            remedy_of("units", units),
        )


def _fault(measurement: Measurement, k: int) -> Fault | None:
    """Fault of the velocity of a joint, from 0; None if another relation explains it better."""
    if measurement.clock != 1:
        return None  # reported when time is in seconds
    s = measurement.signals
    return find_fault(s.clock, measurement.unwrapped[:, k], s.dq[:, k], s.segments)


def _runs_backwards(measurement: Measurement, joints: list[int]) -> bool:
    """Whether the torque is also explained better with reversed time."""
    every = set(joints) >= {k for k, moves in enumerate(measurement.excited) if moves}
    fits = measurement.fits
    return every and fits is not None and gained(fits, Reading(stretch=-1.0)) > LEAST


def _constant(measurement: Measurement) -> list[int]:
    """Joints of which the position or the velocity never changes although the other does."""
    s = measurement.signals
    still, stands = np.ptp(s.q, axis=0) == 0, np.ptp(s.dq, axis=0) == 0
    moves = np.mean(np.diff(s.q, axis=0) != 0, axis=0) > 0.5
    moves &= np.ptp(s.q, axis=0) > LEAST_MOTION
    turns = (np.mean(np.diff(s.dq, axis=0) != 0, axis=0) > 0.5) & (s.dq.std(axis=0) > LEAST_SPEED)
    return [int(k) for k in np.flatnonzero((still & turns) | (stands & moves))]


def _coarseness(measurement: Measurement, k: int) -> float:
    """Step of a coarse velocity, as a share of its spread; 0 if it is not coarse."""
    step, spread = measurement.velocity_steps[k], float(measurement.signals.dq[:, k].std())
    return step / spread if np.isfinite(step) and spread else 0.0


def _of_units(slope: float) -> bool:
    """Whether a common slope of all joints is reported as a unit of the clock or of positions."""
    return any(is_near(slope, factor) for factor in (*CLOCKS, *POSITIONS))


def _cause(slope: float, correlation: float) -> str:
    if abs(slope + 1) < NEAR and correlation < -ALIKE:
        return "sign"
    if correlation > ALIKE:
        for factor, unit in VELOCITIES.items():
            if abs(slope / factor - 1) < NEAR:
                return f"dq={unit}"
        for factor, unit in POSITIONS.items():
            if is_near(slope, factor):
                return f"q={unit}"
    return "scale" if abs(correlation) > 0.99 else "other"


def _other_order(measurement: Measurement) -> list[int] | None:
    """Column of the velocity of each joint, if they are exchanged; None otherwise."""
    n = measurement.n_joints
    own = np.array([likeness for _, likeness in measurement.velocities])
    odd = [k for k in range(n) if measurement.excited[k] and abs(own[k]) < ALIKE]
    if len(odd) < 2:
        return None
    s = measurement.signals
    likeness = np.array(
        [
            [velocity_consistency(s.clock, s.q[:, k], s.dq[:, m], s.segments)[1] for m in odd]
            for k in odd
        ]
    )
    from scipy.optimize import linear_sum_assignment  # half a second of imports that few logs need

    rows, found = linear_sum_assignment(-likeness)
    order = list(range(n))
    for k, m in zip(rows, found, strict=True):
        if likeness[k, m] > ALIKE:
            order[odd[k]] = odd[m]
    moved = sorted(column for k, column in enumerate(order) if column != k)
    if not moved or sorted(order) != list(range(n)):
        return None
    return order


class VelocityDelay(Check):
    """Velocities that are late or early relative to the positions, equally in all joints."""

    name = "velocity_delay"
    suspects = (
        "velocities that are late or early relative to the positions: filtered, commanded, or "
        "stamped by another clock"
    )

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        lags = _lags(measurement)
        common, own = _common_lag(measurement, lags)
        if not own:
            if np.isfinite(common):
                yield from self._single(measurement, lags)
            return
        late, early = ("velocity", "position") if common > 0 else ("position", "velocity")
        column = "dq" if common > 0 else "q"
        value = float(f"{abs(_refined(measurement.signals, own)):.3g}")
        if late == "position" and _in_time(measurement, value):
            yield self.suspicion(
                f"the velocity is early relative to the position by about {1e3 * value:g} ms, and "
                "the torque is not",
                f"at that lag it is the derivative of the position, equally in {len(own)} of "
                f"{sum(map(np.isfinite, lags.values()))} moving joints, but bodies, friction and "
                "rotor inertia explain the torque best at the time of the position: the velocity "
                "was commanded or predicted, not measured",
                "suspected",
                remedy=remedy_of("derive", ["dq"]),
            )
            return
        measurement.late_position = value if late == "position" else 0.0
        constant = _lowpass(measurement.signals, own)
        if constant is not None:
            yield self._filtered(f"the {late}", early, column, constant)
            return
        yield self.suspicion(
            f"the {late} is late relative to the {early} by about {1e3 * value:g} ms",
            f"at that lag it is the derivative of the position, equally in {len(own)} of "
            f"{sum(map(np.isfinite, lags.values()))} moving joints: it was filtered, or stamped by "
            "another clock",
            "suspected",
            remedy=remedy_of("late", {column: value}),
        )

    def _filtered(
        self, what: str, other: str, column: str, constant: float, joints: Iterable[int] = ()
    ) -> Suspicion:
        evidence = (
            f"after undoing a first-order filter with a time constant of {1e3 * constant:.1f} ms "
            f"it agrees with the {other}, far better than at any delay"
        )
        return suspect_lowpass(self, what, column, constant, evidence, joints)

    def _single(self, measurement: Measurement, lags: dict[int, float]) -> Iterator[Suspicion]:
        """Single joints with late or early velocity."""
        least = max(SMALLEST, STEPS / measurement.rate)
        odd = [k for k, lag in lags.items() if abs(lag) > least]
        right = sum(abs(lag) < SMALLEST / 2 for lag in lags.values())
        if right < len(lags) / 2 or len(odd) > max(1, len(lags) / 3):
            return
        for k in odd:
            value = float(f"{abs(_refined(measurement.signals, {k: lags[k]})):.3g}")
            late, early = ("velocity", "position") if lags[k] > 0 else ("position", "velocity")
            column = f"dq{k + 1}" if lags[k] > 0 else f"q{k + 1}"
            if late == "position" and _in_time(measurement, value, k):
                yield self.suspicion(
                    f"the velocity of {measurement.joint(k)} is early relative to its position by "
                    f"about {1e3 * value:g} ms, and its torque is not",
                    "at that lag it is the derivative of the position, but the torque is in time "
                    "with the position: the velocity was commanded or predicted, not measured",
                    "suspected",
                    [k],
                    remedy_of("derive", [f"dq{k + 1}"]),
                )
                continue
            constant = _lowpass(measurement.signals, {k: lags[k]})
            if constant is not None:
                what = f"the {late} of {measurement.joint(k)}"
                yield self._filtered(what, early, column, constant, [k])
                continue
            yield self.suspicion(
                f"the {late} of {measurement.joint(k)} is late relative to its {early} by about "
                f"{1e3 * value:g} ms, but that of other joints is not",
                "at that lag it is the derivative of the position: it was filtered, or stamped "
                "by another clock",
                "suspected",
                [k],
                remedy_of("late", {column: value}),
            )


def _in_time(measurement: Measurement, late: float, joint: int | None = None) -> bool:
    """Whether the torque is in time with positions that are late relative to the velocity.

    Of all joints, or of one, from 0.
    """
    fits = readable_fits(measurement)
    if fits is None or measurement.stale:
        return False
    delay = find_delay(fits.loaded())
    lag, error = delay.common, delay.error
    if joint is not None:
        lag, error = delay.joints[joint], delay.errors[joint]
    return bool(abs(lag) < IN_TIME * late and ERRORS * error < late)


def _lags(measurement: Measurement) -> dict[int, float]:
    """Lag of the velocity of every moving joint behind its position, s; NaN where none is found."""
    if measurement.stale:
        return {}  # held or interpolated values are always late
    return {
        k: _lag(measurement.signals, k)
        for k, (slope, likeness) in enumerate(measurement.velocities)
        if measurement.excited[k]
        and likeness > 0.5
        and slope > 0.5
        and k not in measurement.held_velocities  # these are late by themselves
    }


def _common_lag(
    measurement: Measurement, lags: Mapping[int, float]
) -> tuple[float, dict[int, float]]:
    """The usual lag of velocities, s, and those of the joints that share it; none if few do.

    The lag is NaN if those of too few joints are known.
    """
    known = {k: lag for k, lag in lags.items() if np.isfinite(lag)}
    if not known or len(known) < AGREEING * sum(measurement.excited):
        return float("nan"), {}
    common = float(np.median(list(known.values())))
    own = {
        k: lag
        for k, lag in known.items()
        # of two joints one may not be late at all
        if abs(lag - common) < max(NEARLY, 0.3 * abs(common)) and abs(lag) > 0.5 * abs(common)
    }
    shared = len(own) >= max(AGREEING * len(known), min(2, measurement.n_joints))
    late = abs(common) >= max(SMALLEST, STEPS / measurement.rate)
    return common, own if shared and late else {}


def _lag(signals: Signals, k: int) -> float:
    """Lag of a joint's velocity behind the rate of its position, s; NaN if undetermined."""
    for lags in (LAGS, FARTHER * LAGS):
        errors, plain = np.zeros(len(lags)), 0.0
        for window in _windows(signals, k, lags[-1]):
            errors += [window.error(lag) for lag in lags]
            plain += float(np.sum(window.change**2))
        best = int(np.argmin(errors))
        if plain <= 0:
            return float("nan")
        if best not in (0, len(lags) - 1):
            break
    else:
        return float("nan")
    if errors[best] > 0.1 * plain:
        return float("nan")
    step = lags[1] - lags[0]
    lag = lags[best] + step * (vertex(*-errors[best - 1 : best + 2]) or 0.0)
    return float(lag) if errors[best] < (1 - TAKEN) * errors[len(lags) // 2] else 0.0


@dataclass(frozen=True)
class Windows:
    """Windows of a stretch over which the way of a joint is compared with that by its velocity.

    Attributes
    ----------
    time, q, dq : ndarray of shape (n_samples,)
        The stretch.
    begin : ndarray of shape (n_windows,), s
        Where windows begin.
    """

    time: Array
    q: Array
    dq: Array
    begin: Array

    @cached_property
    def change(self) -> Array:
        """Change of the position over windows, so that steps of an encoder do not count."""
        return self._over(self.q, 0.0)

    @cached_property
    def _area(self) -> Array:
        way = np.cumsum((self.dq[1:] + self.dq[:-1]) / 2 * np.diff(self.time))
        return np.asarray(np.r_[0.0, way])

    def _over(self, values: Array, lag: float) -> Array:
        start = self.begin + lag
        later, sooner = (np.interp(x, self.time, values) for x in (start + 0.05, start))
        return np.asarray(later - sooner)

    def error(self, lag: float) -> float:
        """Squared differences if the velocity is so late."""
        return float(np.sum((self._over(self._area, lag) - self.change) ** 2))


def _windows(signals: Signals, k: int, reach: float) -> Iterator[Windows]:
    """Windows of a joint that velocities with a lag of up to ``reach`` (s) overlap."""
    for rows in signals.segments:
        time, q, dq = signals.clock[rows], signals.q[rows, k], signals.dq[rows, k]
        if len(time) < 20 or time[-1] - time[0] < 10 * LAGS[-1] or np.any(np.diff(time) <= 0):
            continue
        begin = time[(time > time[0] + reach + 0.05) & (time < time[-1] - reach - 0.1)]
        yield Windows(time, q, dq, begin[:: 1 + len(begin) * len(signals.segments) // WINDOWS])


def _refined(signals: Signals, lags: Mapping[int, float]) -> float:
    """Lag of some velocities, all of one sign, at which they agree best with the positions, s."""
    middle = float(np.median(list(lags.values())))
    sign, own = np.sign(middle), []
    for k in lags:
        windows = list(_windows(signals, k, max(LAGS[-1], 1.2 * abs(middle))))

        def likelihood(size: float, windows: list[Windows] = windows) -> float:
            return -sum(w.error(sign * size) for w in windows)

        own.append(summit(likelihood, [share * abs(middle) for share in (0.8, 1.0, 1.2)])[0])
    return float(sign * np.median(own))


def _lowpass(signals: Signals, lags: Mapping[int, float]) -> float | None:
    """Time constant of a low pass of all the positions, or velocities, that are late.

    Parameters
    ----------
    signals : Signals
        Recorded motion.
    lags : mapping of int to float, s
        Lag of the velocity of each joint that is late, all of one sign; of the position if
        negative.

    Returns
    -------
    float or None
        None where a delay explains it as well.
    """
    constants = []
    for k, lag in lags.items():
        windows = list(_windows(signals, k, max(LAGS[-1], 1.2 * abs(lag))))

        def likelihood(
            constant: float, windows: list[Windows] = windows, lag: float = lag
        ) -> float:
            total = 0.0
            for w in windows:
                q, dq = w.q, w.dq
                if lag < 0:
                    q = without_lowpass(w.time, q, constant)
                else:
                    dq = without_lowpass(w.time, dq, constant)
                total -= Windows(w.time, q, dq, w.begin).error(0.0)
            return total

        size = abs(lag)
        constant, best = summit(likelihood, [x * size for x in TRIED])
        delayed = min(
            sum(w.error(share * lag) for w in windows) for share in (0.8, 0.9, 1.0, 1.1, 1.2)
        )
        if -best > FILTERED * delayed:
            return None
        constants.append(constant)
    middle = float(np.median(constants))
    alike = np.all(np.abs(np.array(constants) / middle - 1) < SAME_FILTER)
    return middle if alike else None


def _was_held(measurement: Measurement, joint: int) -> bool:
    """Whether the position of a joint, from 0, was constant before most jumps."""
    q, rows = measurement.signals.q[:, joint], measurement.leaps
    rows = rows[rows > STUCK]
    held = [np.ptp(q[row - STUCK : row]) == 0 and q[row] != q[row - 1] for row in rows]
    others = np.delete(measurement.signals.q, joint, axis=1)
    move = [np.ptp(others[row - STUCK : row], axis=0).any() for row in rows]
    return bool(held) and min(np.mean(held), np.mean(move)) >= MOST_MOVE


def _of_one_joint(measurement: Measurement, joint: int) -> bool:
    """Whether a joint, from 0, jumps alone while others move; joined recordings differ in all."""
    s, rows = measurement.signals, measurement.leaps
    expected = s.dq[rows] * (s.clock[rows] - s.clock[rows - 1])[:, None]
    moved = s.q[rows] - s.q[rows - 1]
    others = np.arange(s.n_joints) != joint
    within = s.trajectory[1:] == s.trajectory[:-1]  # a trajectory ends before a jump
    usual = np.abs(np.diff(s.q, axis=0))[within].max(axis=0, initial=0.0)
    even = np.abs(moved - expected) <= usual
    fast = np.abs(s.dq[rows]) > MOVING * np.abs(s.dq).max(axis=0)
    alone = ~even[:, joint] & even[:, others].all(axis=1)
    return bool(alone.all() and np.any(fast[:, others], axis=1).mean() > MOST_MOVE)


class JoinedRecordings(Check):
    """Positions that jump and continue from there: joined recordings, or missing parts."""

    name = "joined"
    suspects = (
        "recordings that were joined into one, or from which a part was cut out; positions of a "
        "joint whose encoder loses its zero"
    )

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        s = measurement.signals
        rows = measurement.leaps
        if len(rows) and not measurement.lost:  # lost rows make positions jump as well
            shown = ", ".join(str(int(row)) for row in rows[:6]) + (" .." if len(rows) > 6 else "")
            joint = int(np.argmax(np.abs(s.q[rows[0]] - s.q[rows[0] - 1])))
            if _was_held(measurement, joint):
                yield self.suspicion(
                    f"the position of {measurement.joint(joint)} is stuck in parts of recordings",
                    f"it does not change in {STUCK} rows or more before it jumps in {len(rows)} "
                    f"place(s) (rows {shown}); leave these parts out",
                    "certain",
                    [joint],
                )
                return
            if _of_one_joint(measurement, joint):
                yield self.suspicion(
                    f"the zero of the position of {measurement.joint(joint)} changes within "
                    "recordings: its encoder loses steps",
                    f"it jumps in {len(rows)} place(s) farther than any velocity implies, and "
                    f"continues from there (rows {shown}), while other joints move on evenly; "
                    "home the joint again and record anew, or leave these recordings out",
                    "certain",
                    [joint],
                )
                return
            yield self.suspicion(
                "recordings were joined, or a part was cut out of one",
                f"positions jump in {len(rows)} place(s) farther than any velocity implies, and "
                f"continue from there (rows {shown}; {measurement.joint(joint)} by "
                f"{abs(s.q[rows[0], joint] - s.q[rows[0] - 1, joint]):.3g})",
                "certain",
                remedy=remedy_of("split_leaps", True),
            )
