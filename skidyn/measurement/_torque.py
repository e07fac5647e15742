# SPDX-License-Identifier: BSD-3-Clause
"""Checks that fit the robot: sign, order, gravity, zero, scale and delay of the recording."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array
from skidyn.measurement._check import Check
from skidyn.measurement._copies import copied_columns
from skidyn.measurement._delay import Delay, RunDelay, find_delay, lag_gain, refined_lag
from skidyn.measurement._drift import Drift, find_drift
from skidyn.measurement._fits import Fits, Reading, friction
from skidyn.measurement._late_motion import LateMotion, find_late_motion
from skidyn.measurement._late_run import LateRun, find_late_run
from skidyn.measurement._lowpass import lowpass_of_torque, suspect_lowpass
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._measures import is_short, reversals
from skidyn.measurement._readings import DECISIVE, HALF, Change, find_changes
from skidyn.measurement._robust import fit_admissible
from skidyn.measurement._score import Score
from skidyn.measurement._suspicion import Certainty, Suspicion

#: Share of the largest torque below zero that a magnitude may reach, and reversals it must see.
BELOW, TURNS = 0.01, 4
#: Share of zeros from which a torque is not a magnitude but only its one direction.
CUT = 0.05
#: Log-likelihood that the magnitude must gain over the torque itself, and to be sure.
LEAST, SURE = 15.0, 40.0
#: Share of a torque's spread that the robot must explain for its multiple to be reported.
EXPLAINED = 0.5
#: Multiples of the robot's own torque that may be due to wrong masses.
USUAL = (0.4, 2.5)
#: Factors of units of torque.
UNITS = {1e3: "Nmm", 1e2: "Ncm", 1e-3: "kNm"}
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
#: How far the lag of one joint must be from those of others, s, and how nearly it must be the same
#: in its slower and its faster rows, as a share of it.
APART, SAME = 0.008, 0.3
#: Fewest other joints of known lag to compare with it, in robots that have as many, and the largest
#: lag of these, as a share of it, if it is more than the smallest that is reported.
FEWEST_SURE, LITTLE = 2, 0.2
#: Log-likelihood that the lag of a single joint must gain; an unknown effect may look like one.
ALONE = 60.0
#: The same of the motion of a joint, by the torques of all joints: nothing else looks like it. It
#: promises at most 9 on 20 logs without a mistake (``mistakes.py --seed 6610027``).
MOVED = 25.0


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


class UnsignedTorque(Check):
    """Magnitudes in place of torques, as for currents reported by servos."""

    name = "unsigned_torque"
    of_sensor = True
    suspects = "torque or current without its sign"
    misnames = True

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        cut = measurement.clipped
        if cut:
            names = ", ".join(measurement.joint(k) for k in cut)
            shares = ", ".join(f"{np.mean(measurement.torque[:, k] == 0):.0%}" for k in cut)
            yield self.suspicion(
                f"the torque of {names} is clipped at zero",
                f"it has only one sign, and {shares} of it are zero although the joint moves: "
                "values of the opposite sign were lost",
                "certain",
                cut,
            )
        unsigned, gains = unsigned_columns(measurement)
        if not unsigned:
            return
        moving = [k for k, moves in enumerate(measurement.excited) if moves]
        every = len(unsigned) >= 3 and set(moving) <= set(unsigned)
        names = ", ".join(measurement.joint(k) for k in unsigned)
        evidence = (
            f"of {measurement.n_samples} rows none is negative although the joints reverse "
            f"{sum(_turns(measurement, k) for k in unsigned)} times"
        )
        if gains:
            evidence += (
                "; the magnitude of the rigid-body torque explains it better by "
                f"{max(gains.values()):.0f} (log-likelihood)"
            )
        yield self.suspicion(
            f"the torque of {names} has no sign",
            evidence,
            "certain" if every or max(gains.values(), default=0) > SURE else "suspected",
            unsigned,
            ("--torque-sign command", "torque_sign='command'"),
        )


def _cut(torque: Array) -> float:
    """Share of zeros beyond that of a coarse magnitude, which equals that of its first step."""
    least = float(torque[torque > 0].min(initial=np.inf))
    first = float(np.mean((torque > 0) & (torque < 1.5 * least)))
    return max(0.0, float(np.mean(torque == 0)) - 3 * first)


def cut_columns(measurement: Measurement) -> list[int]:
    """Columns of the torque of which one sign was lost: zero in its place."""
    found, measured = [], ~measurement.idle
    for k in range(measurement.n_joints):
        torque = measurement.torque[measured, k]
        speed = np.abs(measurement.signals.dq[measured, k])
        rows = speed > 0.02 * speed.max(initial=0.0)
        one_sided = rows.any() and 0 in (torque.min(), torque.max()) and np.ptp(torque) > 0
        if one_sided and _turns(measurement, k) >= TURNS:
            values = np.abs(torque[rows])
            # a joint that is not driven has zeros alone
            if CUT < _cut(values) < 0.98 and len(np.unique(values)) > 50:
                found.append(k)
    moving = {k for k, moves in enumerate(measurement.excited) if moves}
    others = [k for k in sorted(moving - set(found)) if measurement.torque[:, k].min() >= 0]
    # among magnitudes, zeros belong to a joint at rest
    return [] if len(others) >= 2 and moving <= {*found, *others} else found


def _turns(measurement: Measurement, k: int) -> int:
    return reversals(measurement.signals.dq[:, k], measurement.signals.segments)


def unsigned_columns(measurement: Measurement) -> tuple[list[int], dict[int, float]]:
    """Columns of the torque that contain magnitudes, and their log-likelihood gains.

    A single column is found by a fit of the magnitude of the robot's torque; if no column of three
    or more is ever negative although all joints reverse, none has a sign.
    """
    if measurement.unsigned is None:
        measurement.unsigned = _unsigned(measurement)
    return measurement.unsigned


def _unsigned(measurement: Measurement) -> tuple[list[int], dict[int, float]]:
    torque = measurement.torque
    cut = measurement.clipped
    one_sided = [
        k
        for k in range(measurement.n_joints)
        if k not in cut
        and np.ptp(torque[:, k]) > 0
        and torque[:, k].min() >= -BELOW * torque[:, k].max()
        and _turns(measurement, k) >= TURNS
    ]
    moving = [k for k, moves in enumerate(measurement.excited) if moves]
    gains = {}
    if measurement.readable and measurement.fits is not None:
        for k in one_sided:
            gain = _magnitude_gain(measurement.fits, k)
            if gain > LEAST:
                gains[k] = gain
    enough = len(one_sided) >= 3 or max(gains.values(), default=0.0) > SURE
    if enough and set(moving) <= set(one_sided):
        return one_sided, gains  # a logger of magnitudes records no sign in any column
    return sorted(gains), gains  # gravity alone may give one a single sign


def _magnitude_gain(fits: Fits, k: int) -> float:
    """Log-likelihood gain of the magnitude of the robot's torque over the torque itself."""
    if not fits.usable(k):
        return 0.0
    s = fits.motion(Reading())
    own = fits.robot.inverse_dynamics(s.q, s.dq, s.ddq)[:, k]
    use = fits.moving[:, k]
    columns = fits.average(np.column_stack([own, friction(s, k)]))[use]
    y = fits.average(fits.torque[:, k])[use]
    # a torque of the opposite sign is one-sided too where gravity is
    plain = max(fit_admissible(columns, sign * y).likelihood for sign in (1.0, -1.0))
    best = -np.inf
    size = float(np.abs(columns[:, 0]).mean()) + 1e-12
    for share in (0.0, 0.3, 3.0):  # amounts of friction before any fit
        guess = columns[:, 0] + share * size * columns[:, 2]
        for _ in range(8):
            sign = np.where(guess < 0, -1.0, 1.0)
            fit = fit_admissible(columns, sign * y)
            guess = sign * y - fit.residual
        best = max(best, fit.likelihood)
    return best - plain if np.isfinite(best) else 0.0


#: Least share of the residual torque that another zero must remove to be certain.
MOSTLY = 0.8


class Columns(Check):
    """Signs, order and zero of joints, and gravity, that differ from those of the robot."""

    name = "reading"
    suspects = (
        "the sign of single joints, their order, the zero of a position, angles relative to the "
        "base, the direction of gravity, or torque from which gravity was removed"
    )
    stage = 1

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        fits = measurement.fits
        if fits is None or measurement.odd or measurement.mixed:
            return  # contradictory recordings, and mixed torques, have no common reading
        changes = asked_changes(measurement, fits)
        orders = [change for change in changes if change.kind in ORDERS]
        for kind in dict.fromkeys(change.kind for change in changes):
            alike = [change for change in changes if change.kind == kind]
            if kind in ORDERS and len(alike) < len(orders):
                if kind != orders[0].kind:
                    continue  # one order after another is one order of each quantity
                alike = orders
            yield _one_of_two(self._told(measurement, kind, alike, changes[-1].reading), alike)

    def _told(
        self, measurement: Measurement, kind: str, changes: list[Change], final: Reading
    ) -> Suspicion:
        turned = [j for change in changes for j in change.joints]
        joints = sorted(set(turned))
        if kind.endswith("_sign"):  # a sign changed twice is unchanged
            joints = [j for j in joints if turned.count(j) % 2]
        names = ", ".join(measurement.joint(j) for j in joints)
        best = max(changes, key=lambda change: change.gain)
        evidence = (
            "with this correction, the rigid-body torque explains the measured torque better by "
            f"{best.gain:.0f} (log-likelihood) and leaves {100 * best.drop:.0f} % less residual"
        )
        certainty: Certainty = "certain" if _sure(changes) else "suspected"
        if kind == "zero" and min(change.drop for change in changes) < MOSTLY:
            certainty = "suspected"  # an offset or a spring that is missing looks like it
        rivals = {_RIVALS[rival] for change in changes for rival in change.rivals}
        if rivals:
            certainty = "suspected"
            evidence += f"; {', or '.join(sorted(rivals))} would explain it equally well"
        if kind == "torque_sign":
            columns = [f"tau{j + 1}" for j in joints]
            what = f"the torque of {names} has the opposite sign"
            remedy = (f"--flip {','.join(columns)}", f"flip={columns}")
        elif kind == "motion_sign":
            columns = [f"q{j + 1}" for j in joints]
            what = f"position and velocity of {names} have the opposite sign"
            remedy = (f"--flip {','.join(columns)}", f"flip={columns}")
        elif kind == "joint_sign":
            columns = [f"{q}{j + 1}" for j in joints for q in ("q", "tau")]
            what = f"the direction of {names} is opposite to that of the robot's description"
            remedy = (f"--flip {','.join(columns)}", f"flip={columns}")
        elif kind in ORDERS:
            what, remedy = _ordered(measurement, final)
        elif kind == "summed":
            what = (
                f"the position of {names} includes that of the previous joint: its angle is "
                "relative to a link other than its parent"
            )
            others = {f"q{j + 1}": f"{'-' * (x < 0)}q{j}" for j, x in final.summed if j in joints}
            words = ",".join(f"{name}={other}" for name, other in others.items())
            remedy = (f"--summed {words}", f"summed={others}")
        elif kind == "zero":
            values = ", ".join(f"{np.rad2deg(v):.0f} deg" for j, v in final.zero if j in joints)
            what = f"the zero of {names} is off by about {values}"
            pairs = {f"q{j + 1}": round(v, 4) for j, v in final.zero if j in joints}
            words = ",".join(f"{name}={value}" for name, value in pairs.items())
            remedy = (f"--zero {words}", f"zero={pairs}")
        else:
            gravity = [round(x, 2) + 0.0 for x in (final.gravity or ())]
            words = ",".join(f"{x:g}" for x in gravity)
            if kind == "gravity":
                what = (
                    f"gravity points along ({words}) in the base frame: the robot is mounted in "
                    "this orientation"
                )
            else:
                what = "the torque contains no gravity: it was removed"
                if changes[0].restorable:
                    what += " with the bodies of the description"
                    remedy = ("--restore-gravity", "restore_gravity=True")
                    return self.suspicion(what, evidence, certainty, joints, remedy)
            remedy = (f"--gravity={words}", f"Robot.from_urdf(..., gravity={tuple(gravity)})")
        return self.suspicion(what, evidence, certainty, joints, remedy)


#: Kinds of changes that exchange columns.
ORDERS = ("order", "motion_order", "torque_order")


def _ordered(measurement: Measurement, final: Reading) -> tuple[str, tuple[str, str]]:
    """Text for columns in another order, and the remedy."""
    every = range(measurement.n_joints)
    motion = [k + 1 for k in (final.order or every)]
    torque = [final_column + 1 for final_column in _torque_order(final, every)]
    own = [k + 1 for k in every]
    orders = {"motion": motion, "tau": torque}
    moved = sorted(
        {k for order in orders.values() for k, c in zip(every, order, strict=True) if c != k + 1}
    )
    names = ", ".join(measurement.joint(k) for k in moved)
    if motion == torque:
        words = ",".join(map(str, motion))
        what = f"the columns of {names} are not in the order of the robot's joints"
        return what, (f"--order {words}", f"order={motion}")
    orders = {q: order for q, order in orders.items() if order != own}
    called = {"motion": "positions and velocities", "tau": "torques"}
    said = " and ".join(called[q] for q in orders)
    words = ",".join(f"{q}={','.join(map(str, order))}" for q, order in orders.items())
    return f"the {said} of {names} are exchanged", (f"--order {words}", f"order={orders}")


def _torque_order(reading: Reading, every: Iterable[int]) -> list[int]:
    """Column of the torque of every joint."""
    own = [k if reading.torque_order is None else reading.torque_order[k] for k in every]
    return [k if reading.order is None else reading.order[k] for k in own]


#: Meaning of another reading of the same joints.
_RIVALS = {
    "torque_sign": "the torque with the opposite sign",
    "motion_sign": "the position with the opposite sign",
    "joint_sign": "position and torque with the opposite sign",
    "convention": "a position that counts in the opposite direction from another zero",
    "order": "a different order of all columns",
    "motion_order": "a different order of the positions and velocities",
    "torque_order": "a different order of the torques",
    "summed": "a position relative to another link",
    "zero": "a different zero of a position",
    "gravity": "a different direction of gravity",
    "no_gravity": "no gravity",
}


def _one_of_two(told: Suspicion, changes: Iterable[Change]) -> Suspicion:
    """Text of the suspicion: one of two causes if another one explains the torque equally well."""
    others = dict.fromkeys(change.other for change in changes if change.other)
    if not others:
        return told
    names = " or ".join(other[:1].lower() + other[1:] for other in others)
    return replace(
        told,
        suspicion=f"either {told.suspicion}, or there is another cause: {names}",
        evidence=f"{told.evidence}; the other cause, on the same joints, explains it equally well",
        certainty="noted",
    )


def asked_changes(measurement: Measurement, fits: Fits) -> list[Change]:
    """Changes to the reading of all recordings that the measurement implies."""
    if measurement.changes is None:
        measurement.changes = find_changes(fits.without(_lost_columns(measurement)))
    return measurement.changes


def asked_gain(measurement: Measurement, fits: Fits) -> float:
    """Log-likelihood gain of these changes with stated or with identified bodies."""
    asked = [c for c in asked_changes(measurement, fits) if not c.other]
    return max(sum(c.gain for c in asked), sum(c.confirmed for c in asked))


def _sure(changes: Iterable[Change]) -> bool:
    """Whether every change gains much, and takes off most of what the log as it is leaves."""
    return all(
        (c.gain > SURE and c.drop > 0.3 and c.confirmed >= 0)
        or (c.confirmed > DECISIVE and c.drop > HALF)
        for c in changes
    )


def readable_fits(measurement: Measurement) -> Fits | None:
    """Rows of a measurement without torques that lost their sign; None where none can be fitted."""
    fits = measurement.fits if measurement.readable else None
    if fits is None:
        return None
    return fits.without(_lost_columns(measurement))


def _lost_columns(measurement: Measurement) -> list[int]:
    """Columns of the torque without a sign, or that are not the torque of their joint."""
    unsigned, _ = unsigned_columns(measurement)
    copies = copied_columns(measurement)
    copied = [k for k, _, _ in copies]
    originals = [j for _, what, j in copies if what == "torque"]  # either may be the copy
    lost = [*unsigned, *measurement.clipped, *measurement.overflowed]
    return [*lost, *copied, *originals]


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
        if drift is not None or _drifts(found):
            yield self._drifting(found, drift)
            return
        odd = late_runs(found)
        if (
            max((one.gain for one in odd.values()), default=0.0)
            < found.gains[late_joints(found)].sum()
        ):
            odd = {}  # one joint is late in all of them, and felt more in some
        for run, one in odd.items():
            gained = f"{one.gain:.0f} (log-likelihood), {one.agreeing:.0%} of which is on joints"
            yield self._late_run(run, one.lag, f"{gained} that agree")
        if odd:
            return
        # a joint whose own lag is uncertain agrees with any
        use = np.isfinite(found.joints) & (found.errors < max(abs(found.common), SMALLEST))
        # nor one whose lag is another in its faster rows, as that of a missing effect
        slow, fast = found.halves.T
        same = use & (np.abs(slow - fast) < np.maximum(ALIKE, SAME * np.abs(found.joints)))
        agreeing, n_alike = _agree(found, same)
        # if positions are late, the torque is early by the same time
        early = measurement.late_position
        if early and abs(found.common + early) < max(ALIKE, 0.3 * early):
            return
        score = Score(fits)
        run = None if measurement.dead else find_late_run(score)
        if run is not None and _is_late(run):
            yield self._late_run(run.run, run.lag, f"{run.gain:.0f} (log-likelihood)")
            return
        moved = _late_motion(measurement, score, found)
        if moved is not None:
            of_torque = moved.gain <= moved.own_gain + LEAST
            told = self._late_torque if of_torque else self._late_motion
            yield told(measurement, moved)
            return
        if (
            abs(found.common) > max(SMALLEST, ERRORS * found.error)
            and found.gain > (SURE if measurement.coarse else LEAST)
            and abs(found.common) > _least_lag(measurement)
            # a low pass delays faster motion less
            and (agreeing or _agree(found, use)[0])
        ):
            every = range(fits.n_joints)
            lag = refined_lag(fits, found.common, found.error, every)
            least = LIKELIER if agreeing else SURE
            constant = _lowpass(fits, lag, every, least) if not early else None
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
                return
            ms = 1e3 * lag
            if measurement.of_servos:
                if lag < 0:
                    yield self._late_command(-lag, found.error, n_alike)
                return
            late = float(f"{lag + early:.5f}")
            yield self.suspicion(
                f"torque is {'late' if ms > 0 else 'early'} relative to the motion by about "
                f"{abs(ms):.1f} ms",
                "bodies, friction and rotor inertia explain it best at that lag (standard error "
                f"{1e3 * found.error:.1f} ms, equal in {n_alike} of "
                f"{measurement.n_joints} joints)",
                "suspected",
                remedy=(f"--late tau={late:g}", f"late={{'tau': {late:g}}}"),
            )
            return
        yield from self._of_joints(measurement, fits, found)

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
            (f"--late tau{k + 1}={lag:g}", f"late={{'tau{k + 1}': {lag:g}}}"),
        )

    def _late_motion(self, measurement: Measurement, moved: LateMotion) -> Suspicion:
        """Position and velocity of one joint that are late."""
        lag, k = float(f"{_whole(measurement, moved.lag):.5f}"), moved.joint
        late = {f"q{k + 1}": lag, f"dq{k + 1}": lag}
        words = ",".join(f"{name}={value:g}" for name, value in late.items())
        return self.suspicion(
            f"position and velocity of {measurement.joint(k)} are "
            f"{'late' if lag > 0 else 'early'} by about {abs(1e3 * lag):.1f} ms relative to those "
            "of the other joints and to the torque",
            "without this delay, bodies, friction and rotor inertia explain all torques better by "
            f"{moved.gain:.0f} (log-likelihood), and with one of torque instead by "
            f"{max(moved.own_gain, moved.common_gain):.0f}",
            "suspected",
            [k],
            (f"--late {words}", f"late={late}"),
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
            (f"--late tau{k + 1}={lag:g}", f"late={{'tau{k + 1}': {lag:g}}}"),
        )

    def _late_command(self, lag: float, error: float, n_alike: int) -> Suspicion:
        """A torque of servos that is early, since commands are used before their arrival."""
        return self.suspicion(
            "commands reach the servos later than the controller states, by about "
            f"{1e3 * lag:.0f} ms of delay or more",
            "bodies, friction and rotor inertia explain the servos' torque best at that lag "
            f"(standard error {1e3 * error:.1f} ms, equal in {n_alike} joints)",
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
    if moved.joint in late:
        return None  # a joint that no other feels
    if moved.gain > MOVED and moved.gain > LEAST + max(
        moved.own_gain, moved.common_gain, float(found.gains[late].sum())
    ):
        return moved
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

    Where positions jump, trajectories were cut that a file does not separate.
    """
    apart = abs(found.late - found.early)
    least = _least_lag(measurement)
    if not measurement.coarse:
        least = min(least, max(DRIFTED, TRIED * found.drift_error))
    if not apart > least or len(measurement.leaps):
        return None
    drift = find_drift(fits, found)
    if drift is None or drift.gain < SURE:
        return None
    most = max(drift.gains) if len(drift.gains) > 1 else 0.0
    return drift if drift.gain - most > (1 - AGREEING) * drift.gain else None


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
        if not np.isfinite(lag) or len(sure) < min(FEWEST_SURE, len(others)):
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
    if fits is None:
        return None
    if measurement.delay is None:
        measurement.delay = find_delay(fits.loaded())
    return measurement.delay
