# SPDX-License-Identifier: BSD-3-Clause
"""Comparison of recordings: one with other units, signs, or the torque of another."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from itertools import repeat

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array
from skidyn._text import trajectories_told
from skidyn.measurement._bodies import Explained, explained
from skidyn.measurement._check import Check
from skidyn.measurement._duel import left_by_effects
from skidyn.measurement._fits import Fits
from skidyn.measurement._gains import USUAL
from skidyn.measurement._lags_of_recordings import lags_of_recordings
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._odd_order import find_exchanges
from skidyn.measurement._peak import climb
from skidyn.measurement._reading import Reading
from skidyn.measurement._robust import robust_likelihood, student
from skidyn.measurement._suspicion import Suspicion
from skidyn.measurement._torque import asked_gain

#: Fewest rows of a recording to be judged.
FEWEST = 12
#: Log-likelihood that another multiple must gain in a recording, beside the logarithm of their
#: number, and another zero, which is free.
LEAST, SURE = 15.0, 40.0
#: Least spread of what the other recordings predict, in residuals, for its multiple to be reported.
CLEAR = 2.0
#: Correlation with the prediction from which a recording is only at another scale, and below which
#: it has nothing to do with it.
SCALED, UNLIKE = 0.8, 0.4
#: Multiples that are those of the other recordings, and the share of these that have one.
ONE, MOST = (0.7, 1.4), 0.6
#: Share of rows at the extreme torque from which its multiple in a recording is meaningless.
CUT = 0.1
#: Residual of a recording over that of all from which its torque is of something else.
LARGER = 3.0
#: What another zero may leave in a recording, as a share of what the best effect leaves.
BETTER = 0.8
#: Share of its residual that the best effect may leave, and still be what is odd in a recording.
LEFT = 0.5
#: Residual from which a different zero of a position is tried, and the least that is reported, rad.
SHIFTED, LEAST_ZERO = 3.0, np.deg2rad(4)
#: Error of identified bodies, as a share of the spread, from which recordings are predicted by the
#: bodies of the others alone.
SPOILED = 0.12
#: Size of torques over that of other recordings below which they may be only noise, least mean
#: square of its successive differences over its own (2 of white noise), and least speed over that
#: of the others.
QUIET, WHITE, MOVES = 0.15, 1.0, 0.3
#: How many times as far as in the others all torques of a recording spread that is in another unit.
FAR = 50.0


@dataclass(frozen=True)
class Multiple:
    """Torque of a joint in a recording relative to the prediction from all recordings."""

    joint: int
    run: int
    multiple: float
    likeness: float
    gain: float
    larger: float
    #: Whether the error of the other recordings falls to less than half without this one.
    spoils: bool


class OddRecording(Check):
    """A recording whose torque is inconsistent with the others."""

    name = "odd_recording"
    suspects = (
        "single recordings with different units, signs or joint zeros, or with the torque of "
        "another recording"
    )
    stage = 1

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        if measurement.stale or measurement.lost or measurement.odd:
            return  # the rest is due to the clock, or another robot
        silent = _silent(measurement)
        if silent:
            measurement.odd = True
            yield self._without_torque(silent)
            return
        seen = explained(measurement)
        if seen is None:
            return
        told = list(self._of_all_torques(measurement)) or list(self._exchanged(measurement, seen))
        if told:
            measurement.odd = True
            yield from told
            return
        yield from self._of_single_torques(measurement, seen)

    def _without_torque(self, runs: list[int]) -> Suspicion:
        """Recordings without torque."""
        return self.suspicion(
            f"in {trajectories_told(runs)} the torques of all joints are only noise near zero",
            "joints move there as in the other trajectories, but torques spread less than "
            f"{QUIET:.0%} of theirs and change at random from row to row: the motors were off, "
            "or no torque was recorded; leave these files out",
            "certain",
        )

    def _of_all_torques(self, measurement: Measurement) -> Iterator[Suspicion]:
        """Recordings in which all torques are in another unit."""
        for run, size in _sizes(measurement).items():
            yield self.suspicion(
                f"in trajectory {run} all torques have a different unit or scale than in the "
                "other trajectories",
                f"their spread is {size:.3g} times that of the others; fix that file, or leave it "
                "out",
                "certain",
            )

    def _exchanged(self, measurement: Measurement, seen: Explained) -> Iterator[Suspicion]:
        """Recordings in which the torques of two joints are exchanged."""
        for pair in find_exchanges(seen):
            names = measurement.joints(pair.joints)
            yield self.suspicion(
                f"in trajectory {pair.run} the torques of {names} are exchanged",
                "each is what the other trajectories predict for the other joint, which improves "
                f"the fit by {pair.gain:.0f} (log-likelihood); fix that file, or leave it out",
                "suspected",
                pair.joints,
            )

    def _of_single_torques(self, measurement: Measurement, seen: Explained) -> Iterator[Suspicion]:
        """Recordings in which a joint has another zero, or its torque another scale or source."""
        told = _multiples(seen)
        scaled, unlike = _odd_torques(measurement, seen, told)
        shifted = _other_zeros(measurement, seen.fits, told, scaled)
        unlike = [one for one in unlike if one.run not in shifted]
        if shifted or scaled:
            # a wrong reading of all recordings may affect one most
            asked = asked_gain(measurement, seen.fits)
            shifted = {run: zero for run, zero in shifted.items() if zero[2] > asked}
            scaled = [one for one in scaled if one.gain > asked]
        if (scaled or unlike or shifted) and lags_of_recordings(measurement) is not None:
            return  # their torques are of other times
        measurement.odd = bool(scaled or unlike or shifted)
        for run, (joint, angle, gain) in shifted.items():
            yield self._shifted(measurement, run, joint, angle, gain)
        for run, own in _by_run(scaled):
            yield self._scaled(measurement, run, own)
        if measurement.frictionless:
            return  # the rest is due to another friction
        known = {one.run for one in scaled}
        for run, own in _by_run([one for one in unlike if one.run not in known]):
            yield self._unlike(measurement, run, own)

    def _shifted(
        self, measurement: Measurement, run: int, joint: int, angle: float, gain: float
    ) -> Suspicion:
        """A recording with another zero of a joint."""
        return self.suspicion(
            f"in trajectory {run} the zero of {measurement.joint(joint)} differs by about "
            f"{np.rad2deg(angle):.0f} deg from that of the others",
            "with this correction, common bodies explain the torques of that "
            f"trajectory better by {gain:.0f} (log-likelihood); fix that file, or leave it out",
            "suspected",
            [joint],
        )

    def _scaled(self, measurement: Measurement, run: int, own: list[Multiple]) -> Suspicion:
        """A recording with torques at another scale."""
        names = measurement.joints(one.joint for one in own)
        multiples = ", ".join(f"{one.multiple:.3g}" for one in own)
        return self.suspicion(
            f"in trajectory {run} the torque of {names} has a different sign or scale than in "
            "the others",
            f"it is {multiples} times the prediction from the other trajectories, which "
            f"improves the fit by up to {max(one.gain for one in own):.0f} (log-likelihood); "
            "fix that file, or leave it out",
            "suspected",
            [one.joint for one in own],
        )

    def _unlike(self, measurement: Measurement, run: int, own: list[Multiple]) -> Suspicion:
        """A recording with torques of something else."""
        names = measurement.joints(one.joint for one in own)
        shares = ", ".join(f"{one.larger:.2g}" for one in own)
        return self.suspicion(
            f"in trajectory {run} the torque of {names} is nearly unrelated to the motion",
            f"the prediction from the other trajectories leaves {shares} times as much "
            "residual there as in all; it may be the torque of another recording, or its "
            "positions may have a different zero",
            "suspected",
            [one.joint for one in own],
        )


def _odd_torques(
    measurement: Measurement, seen: Explained, told: list[Multiple]
) -> tuple[list[Multiple], list[Multiple]]:
    """Torques at another scale than in most recordings, and those unrelated to the motion."""
    least = LEAST + np.log(max(1, len(told)))  # of so many torques one may gain by chance
    scaled, unlike = [], []
    for k in sorted({one.joint for one in told}):
        own = [one for one in told if one.joint == k]
        usual = np.mean([ONE[0] < one.multiple < ONE[1] for one in own])
        alike = len(own) >= 3 and usual >= MOST
        for one in own:
            if not (alike or one.spoils):
                continue
            if _clipped(measurement, one):
                continue  # its torque has another multiple because it is saturated
            within = USUAL[0] <= one.multiple <= USUAL[1]
            if not within and one.gain > least and abs(one.likeness) > SCALED:
                scaled.append(one)
            elif one.gain > least and one.larger > LARGER and one.likeness < UNLIKE:
                # a contact, or a payload of one recording, would look like it
                without, left, _ = left_by_effects(seen.fits, k, seen.fits.recording == one.run)
                if left > max(LARGER, LEFT * without):
                    unlike.append(one)
    return scaled, unlike


def _other_zeros(
    measurement: Measurement, fits: Fits, told: list[Multiple], scaled: list[Multiple]
) -> dict[int, tuple[int, float, float]]:
    """Joint, angle and gain of another zero in the recording that is explained worst, if any."""
    worst = max(told, key=lambda one: one.larger, default=None)
    if worst and worst.larger > SHIFTED and worst.run not in {one.run for one in scaled}:
        zero = _zero_of(fits, worst.run)
        if zero is not None:
            return {worst.run: zero}
    divided = measurement.one_zero
    if divided is None or scaled:
        return {}
    (run,) = divided.runs
    return {run: (divided.joint, divided.value, divided.gain)}


def _by_run(multiples: list[Multiple]) -> Iterator[tuple[int, list[Multiple]]]:
    """Every recording with its torques."""
    for run in sorted({one.run for one in multiples}):
        yield run, [one for one in multiples if one.run == run]


def _clipped(measurement: Measurement, one: Multiple) -> bool:
    """Whether much of the torque in a recording stays at its extreme values."""
    torque = measurement.torque[:, one.joint]
    own = torque[measurement.signals.trajectory == one.run]
    cut = float(np.mean((own >= torque.max()) | (own <= torque.min())))
    return measurement.at_limit[one.joint] > 0 and cut > CUT


def _sizes(measurement: Measurement) -> dict[int, float]:
    """Recordings in which all torques spread far more, or less, than in the others."""
    number = measurement.signals.trajectory
    runs = np.unique(number)
    if len(runs) < 3:
        return {}
    spread = np.array([measurement.torque[number == run].std(axis=0) for run in runs])
    size = spread / np.maximum(np.median(spread, axis=0), 1e-300)
    odd = (size > FAR).all(axis=1) | ((size < 1 / FAR) & (size > 0)).all(axis=1)
    return {int(run): float(np.median(x)) for run, x in zip(runs[odd], size[odd], strict=True)}


def _silent(measurement: Measurement) -> list[int]:
    """Recordings in which joints move as in the others, but all torques are noise near zero."""
    signals, torque = measurement.signals, measurement.torque
    runs, counts = np.unique(signals.trajectory, return_counts=True)
    runs = runs[counts >= FEWEST]
    if len(runs) < 3:
        return []
    parts = [signals.trajectory == run for run in runs]
    size = np.array([np.sqrt(np.mean(torque[rows] ** 2, axis=0)) for rows in parts])
    speed = np.array([np.sqrt(np.mean(signals.dq[rows] ** 2, axis=0)) for rows in parts])
    rough = np.array([np.mean(np.diff(torque[rows], axis=0) ** 2, axis=0) for rows in parts])
    usual = np.median(size, axis=0)
    quiet = (size < QUIET * usual) & (rough > WHITE * size**2)
    moves = np.mean(speed > MOVES * np.median(speed, axis=0), axis=1) > 0.5
    silent = quiet.all(axis=1) & moves & (usual > 0).all()
    return [int(run) for run in runs[silent]] if np.mean(silent) < 0.5 else []


def _zero_of(fits: Fits, run: int) -> tuple[int, float, float] | None:
    """Joint, angle and gain of another zero in a recording, for bodies of the others."""
    rows = fits.recording == run
    if rows.all() or rows.sum() < FEWEST:
        return None
    bodies, scales = fits.only(~rows).bodies()
    own = fits.only(rows)
    inflation = fits.identified(Reading()).inflation

    def likelihood(joint: int, angle: float) -> float:
        left = own.residuals(bodies, Reading(zero=((joint, angle),)))
        return float(sum(student(left[k], scales[k]) / inflation[k] for k in left if k in scales))

    def errors(joint: int, angle: float) -> dict[int, float]:
        left = own.residuals(bodies, Reading(zero=((joint, angle),)))
        return {k: float(np.sqrt(np.mean(left[k] ** 2))) / scales[k] for k in left if k in scales}

    plain = likelihood(0, 0.0)
    best = (0, 0.0, plain)
    for joint in np.flatnonzero(~fits.signals.prismatic).tolist():
        of_joint = partial(likelihood, joint)
        angle, value = climb(of_joint, 0.0, np.deg2rad(30), np.deg2rad(1))
        best = max(best, (joint, angle, value), key=lambda found: found[2])
    joint, angle, value = best
    before, after = errors(joint, 0.0), errors(joint, angle)
    worst = max(before, key=lambda k: before[k], default=None)
    if worst is None or value - plain < SURE or abs(angle) < LEAST_ZERO:
        return None
    # bodies identified with this recording may explain it without another zero
    elsewhere, everywhere = fits.only(~rows).residuals(bodies, Reading()), fits.bodies()[0]
    here = own.residuals(bodies, Reading(zero=((joint, angle),)))
    known = fits.residuals(everywhere, Reading())
    gain = sum(
        (robust_likelihood(np.r_[elsewhere[k], here[k]]) - robust_likelihood(known[k]))
        / inflation[k]
        for k in known
        if k in elsewhere and k in here
    )
    without, left, _ = left_by_effects(fits, worst, rows)
    if gain < (SURE if after[worst] > BETTER * left else LEAST):
        return None
    share = after[worst] / before[worst]
    return (joint, angle, float(gain)) if share < min(LEFT, BETTER * left / without) else None


def _multiples(seen: Explained) -> list[Multiple]:
    """Multiples of every joint and recording with enough rows."""
    fits, outcome = seen.fits, seen.identified
    # one of few recordings distorts the bodies identified from all of them
    apart = bool(np.any(seen.errors[1] > SPOILED))
    told = []
    runs = np.unique(fits.recording)
    parts = [fits.recording == run for run in runs]
    elsewhere = fits.predicted_without(parts) if apart else repeat({})
    for run, rows, others in zip(runs, parts, elsewhere, strict=False):
        others = {} if _extrapolated(seen, rows, others) else others
        for k in seen.joints:
            y, use = fits.mean_torque(k)
            y = y[use]
            own, scale = rows[use], float(outcome.scale[k])
            predicted = (y - outcome.residual[k])[own]
            if k in others:
                predicted, scale = others[k]
            spoils = scale < outcome.scale[k] / 2
            if seen.stated.scale[k] < max(scale, float(outcome.scale[k])) / 2:
                # torques of joints in other units spoil bodies common to all of them
                predicted, scale = (y - seen.stated.residual[k])[own], float(seen.stated.scale[k])
                spoils = False
            found = _multiple(y[own], predicted, scale) if own.sum() >= FEWEST else None
            if found is not None:
                size, likeness, gain, larger = found
                gain /= outcome.inflation_of(k)
                told.append(Multiple(k, int(run), size, likeness, gain, larger, bool(spoils)))
    return told


def _extrapolated(
    seen: Explained, rows: NDArray[np.bool_], others: dict[int, tuple[Array, float]]
) -> bool:
    """Whether the other recordings say too little of the bodies to predict this one.

    Their prediction is then wrong for most joints, which bodies common to all recordings explain.
    """
    wrong = []
    for k, (predicted, scale) in others.items():
        y, use = seen.fits.mean_torque(k)
        own = rows[use]
        if not own.any():
            continue  # at rest in this recording
        error = float(np.sqrt(np.mean((y[use][own] - predicted) ** 2)))
        common = float(np.sqrt(np.mean(seen.identified.residual[k][own] ** 2)))
        wrong.append(error > max(LARGER * scale, 2 * common))
    return len(wrong) > 2 and float(np.mean(wrong)) > 0.5


def _multiple(y: Array, predicted: Array, scale: float) -> tuple[float, float, float, float] | None:
    """Multiple, correlation, log-likelihood gained by it, and residual of it over the usual."""
    p, t = predicted - predicted.mean(), y - y.mean()
    if float(np.std(p)) < CLEAR * scale or not t @ t > 0:
        return None
    size, likeness = float(p @ t / (p @ p)), float(p @ t / np.sqrt((p @ p) * (t @ t)))
    rest = t - size * p
    own = max(scale, float(np.std(rest)))
    gain = student(rest, own) - student(y - predicted, scale)
    return size, likeness, gain, float(np.sqrt(np.mean((y - predicted) ** 2))) / scale
