# SPDX-License-Identifier: BSD-3-Clause
"""Check of the clock of the torque: late or early, in all joints, one of them or one recording."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from skidyn._text import counted
from skidyn.measurement._check import Check
from skidyn.measurement._delay import Delay, RunDelay, find_delay
from skidyn.measurement._drift import Drift, find_drift
from skidyn.measurement._fits import Fits
from skidyn.measurement._joint_fit import lag_gain, refined_lag
from skidyn.measurement._lags_of_recordings import LagsOfRecordings, lags_of_recordings
from skidyn.measurement._late_motion import LateMotion, find_late_motion
from skidyn.measurement._late_run import LateRun, find_late_run, is_of_friction
from skidyn.measurement._lowpass import lowpass_of_torque, suspect_lowpass
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._measures import is_short
from skidyn.measurement._score import Score
from skidyn.measurement._suspicion import Suspicion, remedy_of
from skidyn.measurement._torque import LEAST, SURE, readable_fits

#: Smallest delay that is reported, s, how many standard errors it must have, and how far the lag of
#: a joint may be from it.
SMALLEST, ERRORS, ALIKE = 0.004, 5.0, 0.006
#: The same with positions in coarse steps, whose lag must gain as much as to be sure: their errors
#: are not independent from row to row.
SMALLEST_COARSE = 0.01
#: How many standard errors lags in the halves of recordings must differ by: that there is a lag is
#: known then.
DRIFTING = 3.0
#: Least difference of these lags, s, and in standard errors, from which a growing lag is fitted to
#: all joints together, which decides, if it is less than the smallest lag that is reported.
DRIFTED, TRIED = 1.5e-3, 2.0
#: Share of the joints whose lags must be alike, or of what they gain; friction shifts each joint by
#: another amount.
AGREEING = 0.75
#: Number of joints and lag, s, from which their lags need not be the same in slower and faster rows
#: if all of them are alike: where it is large, the first order in it is only about the lag.
MANY, LARGE = 5, 0.02
#: How far the lag of one joint must be from those of others, s, and how nearly it must be the same
#: in its slower and its faster rows, as a share of it.
APART, SAME = 0.008, 0.3
#: Fewest other joints of known lag to compare with it, in robots that have as many, and the largest
#: lag of these, as a share of it, if it is more than the smallest that is reported.
FEWEST_SURE, LITTLE = 2, 0.2
#: Log-likelihood that the lag of a single joint must gain; an unknown effect may look like one.
ALONE = 60.0
#: The same of the motion of a joint, by the torques of all joints: nothing else looks like it. It
#: promises at most 9 on 20 logs without a mistake (``mistakes.py --seed 6610027``), and 33 where
#: joints move one at a time.
MOVED = 40.0
#: Share of the recordings that may be late by themselves, and log-likelihood that they must gain:
#: what one carries shifts the lag of few rows, too. How many times as much they leave without it:
#: friction that is missing is late by itself, but leaves little, and not on all joints, which need
#: less where they agree.
ODD, RUN_SURE, TIMES, FEWER, ALL_AGREE = 0.34, 80.0, 1.75, 1.4, 0.95
#: Least lag, s, that may be that of a low pass, and log-likelihood by which that must be likelier
#: than a delay. The smoothing of the motion is a low pass, too: delays up to 15 ms gain up to 60 by
#: one, delays from 20 ms on at most 6 (ten logs of ``mistakes.py --seed 7319054``).
FILTERED, LIKELIER = 0.017, 10.0
#: How near a lag is to a whole number of samples that is one, s, and in samples.
WHOLE, MOST_WHOLE = 4e-4, 0.1


class TorqueDelay(Check):
    """Torque that is late or early relative to the motion, equally in all joints."""

    name = "torque_delay"
    suspects = (
        "torque that is late or early relative to the motion, or whose clock runs at a different "
        "rate"
    )
    stage = 2

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        found, fits = measured_delay(measurement), readable_fits(measurement)
        if found is None or fits is None or not np.isfinite(found.common):
            return
        fits = fits.loaded()
        if measurement.stale or measurement.computed or measurement.smoothed:
            return  # held and interpolated values are always late or early
        drift = _drift(measurement, fits, found)
        if drift is not None:
            # where positions jump, trajectories were cut that a file does not separate
            known = not (drift.is_of_log or len(measurement.leaps))
            yield self._drifting(found, drift if known and _is_sure(drift) else None)
            return
        score = Score(fits)
        of_runs = self._of_single_runs(measurement, score, found)
        if of_runs is not None:
            yield from of_runs
            return
        # if positions are late, the torque is early by the same time
        early = measurement.late_position
        if early and abs(found.common + early) < max(ALIKE, 0.3 * early):
            return
        late_run = None if measurement.dead else find_late_run(score)
        if late_run is not None and _is_late(late_run):
            gained = f"{late_run.gain:.0f} (log-likelihood)"
            yield self._late_run(late_run.run, late_run.lag, gained)
            return
        moved = _late_motion(measurement, score, found)
        if moved is not None:
            of_torque = moved.gain <= moved.own_gain + LEAST and not moved.with_torque
            told = self._late_torque if of_torque else self._late_motion
            yield told(measurement, moved)
            return
        yield from self._of_all(measurement, fits, found)

    def _of_single_runs(
        self, measurement: Measurement, score: Score, found: Delay
    ) -> list[Suspicion] | None:
        """Recordings that have lags of their own; None if there are none."""
        apart = lags_of_recordings(measurement)
        if apart is not None and not is_of_friction(score, apart.lags):
            return list(self._of_runs(apart))
        odd = late_runs(found)
        most = max((one.gain for one in odd.values()), default=0.0)
        if most < found.gains[late_joints(found)].sum():
            odd = {}  # one joint is late in all of them, and felt more in some
        told = []
        for run, one in odd.items():
            if not is_of_friction(score, {run: one.lag}):
                gained = f"{one.gain:.0f} (log-likelihood), {one.agreeing:.0%} of which is on"
                told.append(self._late_run(run, one.lag, f"{gained} joints that agree"))
        return told or None

    def _of_all(self, measurement: Measurement, fits: Fits, found: Delay) -> Iterator[Suspicion]:
        """Torque of all joints, or of those whose lag is not that of all."""
        # a joint whose own lag is uncertain agrees with any
        use = np.isfinite(found.joints) & (found.errors < max(abs(found.common), SMALLEST))
        agreeing, n_alike = _agree_at_any_speed(found, use)
        # a low pass delays faster motion less
        if not (_is_large(measurement, found) and (agreeing or _agree(found, use)[0])):
            yield from self._of_joints(measurement, fits, found)
            return
        every = range(fits.n_joints)
        lag = refined_lag(fits, found.common, found.error, every)
        least = LIKELIER if agreeing else SURE
        constant = None if measurement.late_position else _lowpass(fits, lag, every, least)
        if constant is not None:
            yield self._filtered("torque", "tau", constant, lag)
            return
        if not agreeing:
            yield from self._of_joints(measurement, fits, found)
            return
        lag = _whole(measurement, lag)
        if abs(lag) < SMALLEST:
            return
        only = int(np.nanargmax(found.gains))
        if n_alike < 2 and lag_gain(fits, lag, [only]) > lag_gain(fits, lag, every) + LEAST:
            yield self._late_joint(measurement, found, only, lag)
        elif not measurement.of_servos:
            yield self._late_torques(measurement, lag, found.error, n_alike)
        elif lag < 0:
            yield self._late_command(-lag, found.error, n_alike)

    def _late_torques(
        self, measurement: Measurement, lag: float, error: float, n_alike: int
    ) -> Suspicion:
        """Torques of all joints that are late or early."""
        ms, n = 1e3 * lag, measurement.n_joints
        equally = f", equal in {n_alike} of {n} joints" if n > 1 else ""
        return self.suspicion(
            f"torque is {'late' if ms > 0 else 'early'} relative to the motion by about "
            f"{abs(ms):.1f} ms",
            "bodies, friction and rotor inertia explain it best at that lag (standard error "
            f"{1e3 * error:.1f} ms{equally})",
            "suspected",
            remedy=remedy_of("late", {"tau": float(f"{lag + measurement.late_position:.5f}")}),
        )

    def _of_runs(self, found: LagsOfRecordings) -> Iterator[Suspicion]:
        """Recordings that have lags of their own, or a few of them."""
        usual = float(np.median(list(found.lags.values())))
        odd = {run: lag - usual for run, lag in found.lags.items() if abs(lag - usual) > APART}
        gained = f"{found.gain:.0f} (log-likelihood)"
        if len(odd) <= ODD * len(found.lags):
            for run, lag in odd.items():
                yield self._late_run(run, lag, gained)
            return
        told = ", ".join(f"{1e3 * lag:.0f} ms in {run}" for run, lag in found.lags.items())
        yield self.suspicion(
            "the torque has another lag relative to the motion in every trajectory",
            f"it is late by {told}; with these lags, common bodies explain the torques of all "
            f"trajectories better by {gained} than with one lag, and leave "
            f"{100 * found.left:.0f} % of the residual of a joint; stamp torque and motion with "
            "one clock, or shift the torque of every file",
            "suspected",
        )

    def _late_run(self, run: int, lag: float, gained: str) -> Suspicion:
        """A recording with late torque."""
        return self.suspicion(
            f"in trajectory {run} torque is {'late' if lag > 0 else 'early'} by about "
            f"{abs(1e3 * lag):.0f} ms relative to the others",
            f"at that lag it is explained better by {gained}; fix that file, or leave it out",
            "suspected",
        )

    def _drifting(self, found: Delay, drift: Drift | None) -> Suspicion:
        """Clocks with different rates."""
        fitted, remedy = "", None
        if drift is not None:
            fitted = (
                f"; a lag of {1e3 * drift.lag:.1f} ms at the beginning of every recording and "
                f"{1e3 * drift.growth:.3g} ms more per second explain it better than a constant "
                f"one by {drift.gain:.0f} (log-likelihood)"
            )
            both = (drift.lag, drift.growth)
            remedy = (f"--late tau={drift.option}", f"late={{'tau': {both}}}")
        return self.suspicion(
            "the clock of the torque runs at a different rate than that of the motion",
            f"torque is late by {1e3 * found.early:.1f} ms in the first half of the "
            f"recordings and by {1e3 * found.late:.1f} ms in the second (standard error of "
            f"the difference {1e3 * found.drift_error:.1f} ms){fitted}; if possible, stamp both "
            "with one clock",
            "suspected",
            remedy=remedy,
        )

    def _of_joints(self, measurement: Measurement, fits: Fits, found: Delay) -> Iterator[Suspicion]:
        """Torques of single joints that are late or early."""
        for k in late_joints(found, LEAST):
            lag = refined_lag(fits, found.joints[k], found.errors[k], [k])
            if found.gains[k] <= ALONE and lag_gain(fits, lag, [k]) < SURE:
                continue
            constant = _lowpass(fits, lag, [k])
            if constant is not None:
                what = f"torque of {measurement.joint(k)}"
                yield self._filtered(what, f"tau{k + 1}", constant, lag, [k])
                continue
            yield self._late_joint(measurement, found, k, lag)

    def _late_joint(self, measurement: Measurement, found: Delay, k: int, lag: float) -> Suspicion:
        """Torque of one joint that is late or early."""
        lag = float(f"{_whole(measurement, lag):.5f}")
        slow, fast = 1e3 * found.halves[k]
        return self.suspicion(
            f"the torque of {measurement.joint(k)} is {'late' if lag > 0 else 'early'} by "
            f"about {abs(1e3 * lag):.1f} ms, but that of other joints is not"
            + ("" if lag > 0 else ", or its position and velocity are late"),
            f"it is {slow:.1f} ms in its slower rows and {fast:.1f} ms in its faster rows, "
            f"which improves the fit by {found.gains[k]:.0f} (log-likelihood)",
            "suspected",
            [k],
            remedy_of("late", {f"tau{k + 1}": lag}),
        )

    def _late_motion(self, measurement: Measurement, moved: LateMotion) -> Suspicion:
        """Position and velocity of one joint that are late, or its torque as well."""
        lag, k = float(f"{_whole(measurement, moved.lag):.5f}"), moved.joint
        late = {f"q{k + 1}": lag, f"dq{k + 1}": lag}
        what, of_what = "position and velocity", "those of the other joints and to the torque"
        if moved.with_torque:
            late[f"tau{k + 1}"] = lag
            what, of_what = "position, velocity and torque", "those of the other joints"
        return self.suspicion(
            f"{what} of {measurement.joint(k)} are {'late' if lag > 0 else 'early'} by about "
            f"{abs(1e3 * lag):.1f} ms relative to {of_what}",
            "without this delay, bodies, friction and rotor inertia explain all torques better by "
            f"{moved.gain:.0f} (log-likelihood), and with one of torque instead by "
            f"{max(moved.own_gain, moved.common_gain):.0f}",
            "suspected",
            [k],
            remedy_of("late", late),
        )

    def _late_torque(self, measurement: Measurement, moved: LateMotion) -> Suspicion:
        """Torque of one joint that is late or early, or its motion, which no other joint feels."""
        lag, k = float(f"{_whole(measurement, -moved.lag):.5f}"), moved.joint
        return self.suspicion(
            f"the torque of {measurement.joint(k)} is {'late' if lag > 0 else 'early'} by about "
            f"{abs(1e3 * lag):.1f} ms, or its position and velocity are "
            f"{'early' if lag > 0 else 'late'}",
            "without this delay of its torque, bodies, friction and rotor inertia explain all "
            f"torques better by {moved.own_gain:.0f} (log-likelihood), and with one of its motion "
            f"instead by {moved.gain:.0f}",
            "suspected",
            [k],
            remedy_of("late", {f"tau{k + 1}": lag}),
        )

    def _late_command(self, lag: float, error: float, n_alike: int) -> Suspicion:
        """A torque of servos that is early, since commands are used before their arrival."""
        return self.suspicion(
            "commands reach the servos later than the controller states, by about "
            f"{1e3 * lag:.0f} ms of delay or more",
            "bodies, friction and rotor inertia explain the servos' torque best at that lag "
            f"(standard error {1e3 * error:.1f} ms, equal in {counted(n_alike, 'joint')})",
            "suspected",
            remedy=("--controller fit, or its delay", "Controller(delay=...), fit_servo"),
        )

    def _filtered(
        self, what: str, column: str, constant: float, lag: float, joints: Iterable[int] = ()
    ) -> Suspicion:
        evidence = (
            "bodies, friction and rotor inertia explain it better with a first-order low-pass "
            f"filter (time constant {1e3 * constant:.1f} ms) undone than with a delay, which "
            f"would be {1e3 * lag:.1f} ms"
        )
        return suspect_lowpass(self, f"the {what}", column, constant, evidence, joints)


def _agree(found: Delay, use: NDArray[np.bool_]) -> tuple[bool, int]:
    """Whether the lags of some joints are alike, and how many of them are near the common one."""
    near = max(ALIKE, 0.3 * abs(found.common))
    alike = np.abs(found.joints[use] - found.common) < np.maximum(near, 2 * found.errors[use])
    weight = found.gains[use] / max(float(found.gains[use].sum()), 1e-12)
    count = int(alike.sum())
    enough = count >= len(use) / 2 and count > len(alike) / 2
    most = count >= AGREEING * len(alike) or float(weight[alike].sum()) >= AGREEING
    return enough and most, count


def _is_large(measurement: Measurement, found: Delay) -> bool:
    """Whether the common lag is more than that of errors and of coarse positions."""
    return (
        abs(found.common) > max(SMALLEST, ERRORS * found.error)
        and found.gain > (SURE if measurement.coarse else LEAST)
        and abs(found.common) > _least_lag(measurement)
    )


def _agree_at_any_speed(found: Delay, use: NDArray[np.bool_]) -> tuple[bool, int]:
    """As ``_agree``, for joints whose lag is not another in their faster rows.

    That is the lag of a missing effect, unless all of many joints have it.
    """
    slow, fast = found.halves.T
    same = use & (np.abs(slow - fast) < np.maximum(ALIKE, SAME * np.abs(found.joints)))
    agreeing, n_alike = _agree(found, same)
    if not agreeing and _all_alike(found, use):
        return True, len(found.joints)
    return agreeing, n_alike


def _all_alike(found: Delay, use: NDArray[np.bool_]) -> bool:
    """Whether a large lag is that of every one of many joints, as no missing effect of them is."""
    many = use.sum() >= MANY and use.all()
    return bool(many and abs(found.common) > LARGE and _agree(found, use)[1] == use.sum())


def _lowpass(fits: Fits, lag: float, late: Sequence[int], least: float = LIKELIER) -> float | None:
    """Time constant of a low pass that delays torque; None if a pure delay is more likely."""
    if lag < FILTERED:
        return None
    constant, gain = lowpass_of_torque(fits, lag, late)
    return constant if gain > least else None


def _is_late(run: LateRun) -> bool:
    """Whether the lag of a recording is large, and not that of all of them."""
    return abs(run.lag) > APART and run.gain > max(SURE, run.common_gain + LEAST)


def _late_motion(measurement: Measurement, score: Score, found: Delay) -> LateMotion | None:
    """A single joint whose motion is late; None if a lag of torques explains as much."""
    if measurement.of_servos:
        return None  # the torque of servos follows from this motion
    moved = find_late_motion(score, found.common)
    if moved is None:
        return None
    # positions in steps have errors that are not independent from row to row
    k = moved.joint
    coarse = measurement.coarse or np.isfinite(measurement.position_steps[k])
    coarse |= is_short(measurement.signals.q[:, k])
    if abs(moved.lag) < 2 * (SMALLEST_COARSE if coarse else SMALLEST):
        return None
    late = late_joints(found)
    if moved.joint in measurement.slow or (moved.joint in late and not moved.with_torque):
        return None  # a joint that no other feels, or whose torque is late by itself
    if moved.gain > MOVED and moved.gain > LEAST + max(
        moved.own_gain, moved.common_gain, float(found.gains[late].sum())
    ):
        return moved
    if moved.with_torque:
        return None
    # of a joint that no other feels, either may be late
    alike = abs(moved.gain - moved.own_gain) <= LEAST
    alone = moved.own_gain > LEAST + max(moved.common_gain, float(found.gains[late].sum()))
    return moved if alike and alone and moved.own_gain > SURE else None


def _least_lag(measurement: Measurement) -> float:
    """Smallest lag of the torque that is reported, s; coarse positions cause lags of their own."""
    return SMALLEST_COARSE if measurement.coarse else SMALLEST


def _whole(measurement: Measurement, lag: float) -> float:
    """A lag, rounded to whole samples if it is close, since buffers delay by whole samples."""
    samples = lag * measurement.rate
    near = min(WHOLE * measurement.rate, MOST_WHOLE)
    return (
        float(np.round(samples)) / measurement.rate
        if abs(samples - np.round(samples)) < near
        else lag
    )


def _drifts(found: Delay) -> bool:
    """Whether the lag is different in the halves of the recordings."""
    drift = found.late - found.early
    known = abs(drift) > max(SMALLEST, DRIFTING * found.drift_error)
    return bool(known and found.gain > LEAST and _all_drift(found, drift))


def _drift(measurement: Measurement, fits: Fits, found: Delay) -> Drift | None:
    """Lag that grows with time, on more than a single joint; None if there is none.

    That the lags in the halves of recordings differ is not enough: a filter delays faster motion
    less, and halves have other motion.
    """
    apart = abs(found.late - found.early)
    least = _least_lag(measurement)
    if not measurement.coarse:
        least = min(least, max(DRIFTED, TRIED * found.drift_error))
    differ = _drifts(found)
    if not (differ or (apart > least and not len(measurement.leaps))):
        return None
    drift = find_drift(fits, found)
    if drift is None:
        return None
    return drift if differ or (_is_sure(drift) and not drift.is_of_log) else None


def _is_sure(drift: Drift) -> bool:
    """Whether a growing lag gains much, and not on a single joint only."""
    most = max(drift.gains) if len(drift.gains) > 1 else 0.0
    return drift.gain >= SURE and drift.gain - most > (1 - AGREEING) * drift.gain


def _all_drift(found: Delay, drift: float) -> bool:
    """Whether the lags of most joints change alike: a clock is that of all torques."""
    known = np.isfinite(found.drifts)
    weight = np.maximum(found.gains[known], 0)
    alike = np.abs(found.drifts[known] - drift) < 0.5 * abs(drift)
    enough = alike.sum() >= min(2, known.sum())
    return bool(enough and weight[alike].sum() >= AGREEING * max(float(weight.sum()), 1e-12))


def late_runs(found: Delay) -> dict[int, RunDelay]:
    """Single recordings with late or early torque."""
    odd = {
        run: one
        for run, one in found.runs.items()
        if abs(one.lag) > max(APART, ERRORS * one.error)
        and abs(one.usual + one.lag) > abs(one.usual)  # in time itself, it is not the odd one
        and one.gain > RUN_SURE
        # friction of a single joint that moves alone may look late
        and one.joints >= min(2, len(found.joints))
        and one.agreeing >= AGREEING
        and one.before > (TIMES if one.agreeing < ALL_AGREE else FEWER) * one.left
    }
    # one that is late makes others look early
    first = max(odd.values(), key=lambda one: one.gain, default=None)
    odd = {r: one for r, one in odd.items() if first and one.lag * first.lag > 0}
    return odd if len(odd) <= ODD * len(found.runs) else {}


def late_joints(found: Delay, least: float = ALONE) -> list[int]:
    """Single joints with late or early torque, from 0.

    Friction that changes late looks like a delay of its joint, but by another time if the joint is
    faster.
    """
    late = []
    for k, lag in enumerate(found.joints):
        others = np.delete(found.joints, k)
        sure = others[np.isfinite(others) & (np.delete(found.errors, k) < SMALLEST)]
        if not np.isfinite(lag) or len(sure) < max(1, min(FEWEST_SURE, len(others))):
            continue
        common = float(np.median(sure))
        apart = abs(lag - common) > max(APART, ERRORS * found.errors[k])
        apart &= abs(common) < max(SMALLEST, LITTLE * abs(lag))
        slow, fast = found.halves[k]
        if apart and found.gains[k] > least and abs(slow - fast) < SAME * abs(lag):
            late.append(k)
    return late if len(late) < len(found.joints) / 2 or len(found.joints) == 2 else []


def measured_delay(measurement: Measurement) -> Delay | None:
    """Delay of the torque of a measurement; None without a robot or rows."""
    fits = readable_fits(measurement)
    return None if fits is None else measurement.once("delay", lambda: _delay(measurement, fits))


def _delay(measurement: Measurement, fits: Fits) -> Delay:
    found = find_delay(fits.loaded())
    for k in measurement.slow:  # held and interpolated values are always late or early
        found.joints[k] = found.errors[k] = np.nan
        found.gains[k] = 0.0
    return found
