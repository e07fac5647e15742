# SPDX-License-Identifier: BSD-3-Clause
"""Check for smoothed torque: dry friction then begins to change before its joint reverses.

Dry friction changes its sign when a joint reverses. Presliding comes after the reversal and takes a
distance; a low pass without delay spreads the step over the same time before and after, equally in
all joints. Without this check it would be reported as presliding friction. Friction that depends on
the speed, which falls or rises as the joint comes to rest, changes before the reversal as well, but
with the speed and not with time: it is fitted, too. A torque that contains the fast noise of its
sensor was not smoothed over a longer time.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from skidyn._signals import Array, Signals
from skidyn.effects import get_effect
from skidyn.evidence import column_step
from skidyn.measurement._check import Check
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._measures import channel_step
from skidyn.measurement._robust import student
from skidyn.measurement._rows import running_mean, smoothed
from skidyn.measurement._suspicion import Suspicion
from skidyn.measurement._torque_delay import measured_delay

#: Standard deviations of the smoothing that are tried, s (where the last one is best, the torque
#: may merely be slow), and ways of presliding, rad (a tenth in metres).
WIDTHS = 0.01 * 2.0 ** np.arange(5)
WAYS = np.array([0.001 * 2.0**k for k in range(8)])
#: Speeds, rad/s (a tenth in m/s), below which friction fades or grows, and by how many times.
SPEEDS, TIMES = 0.02 * 2.0 ** np.arange(5), (1.0, 3.0, 10.0)
#: Half of the time around a reversal, s, and degree of the polynomial for other torques: with a
#: lower one, widely smoothed friction follows torque that grows with the speed.
AROUND, DEGREE = 0.4, 5
#: Turns of a joint, at least and at most; samples around each at least.
FEWEST, MOST, SAMPLES = 6, 60, 15
#: Least speed before and after a turn, as a share of the largest.
FAST = 0.03
#: Log-likelihood that smoothing gains on a joint that has a word, and in sum; the share of joints
#: whose friction shows how it turns that must agree on a width, and at least how many; the shortest
#: width that is no matter of samples, s.
WORD, LEAST, AGREEING, JOINTS, SHORTEST = 2.0, 15.0, 0.6, 2, 0.05
#: The same of one joint at the last width: over the time around a reversal, friction is then nearly
#: a line, which any slow torque may be.
SURELY = 40.0
#: Length of a filter over its standard deviation.
LENGTH = 2.5
#: Delay of the torque, s, that smoothing does not make.
LATE = 0.012
#: Samples of a spectrum, lower ends of its bands at half of the highest frequency and below it, as
#: shares of the sampling rate; the ratio of their powers from which noise was not filtered, and its
#: variance, in units of that of rounding, from which it is not rounding.
WINDOW, BANDS, EVEN, ROUNDED = 64, (0.2, 0.4), 0.75, 4.0


@dataclass(frozen=True)
class Turns:
    """Likelihood of different forms of friction around the reversals of a joint.

    Attributes
    ----------
    step : float
        Log-likelihood of friction that changes at once.
    smoothed : ndarray of shape (n_widths,)
        Log-likelihood of smoothed friction.
    other : float
        Log-likelihood of the best other friction: presliding, or one that depends on the speed.
    """

    step: float
    smoothed: Array
    other: float

    @property
    def width(self) -> int:
        """Index of the best width."""
        return int(np.argmax(self.smoothed))

    @property
    def gain(self) -> float:
        """Gain of smoothing over friction alone, and over very weak smoothing."""
        friction = max(self.step, self.other, float(self.smoothed[0]))
        return float(self.smoothed.max()) - friction

    @property
    def tells(self) -> bool:
        """Whether smoothing gains, and at a width that is reported."""
        least = SURELY if self.width == len(WIDTHS) - 1 else WORD
        return bool(WIDTHS[self.width] >= SHORTEST) and self.gain > least


class SmoothedTorque(Check):
    """Torque through a low pass without delay."""

    name = "smoothed_torque"
    of_sensor = True
    suspects = (
        "torque that was smoothed, so that friction seems to reverse before and after the joint"
    )
    stage = 2
    misnames = True

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        if measurement.stale or measurement.lost or measurement.computed:
            return
        delay = measured_delay(measurement)
        if delay is not None and delay.common > LATE:
            return  # a filter with delay is reported by another check
        motion = smoothed(measurement.signals)  # noise would shift reversals
        step = column_step(motion, AROUND, motion.half_width)
        index, few = motion.thinned(step)
        torque = running_mean(measurement.torque, step)[index]
        joints = np.flatnonzero(measurement.excited).tolist()
        joints = [k for k in joints if not _is_noisy(measurement, k)]
        fewest = min(JOINTS, measurement.n_joints)
        tried = [at_turns(few, torque[:, k], k, others=False) for k in joints]
        # beside other friction, smoothing gains less
        if sum(turns is not None and turns.tells for turns in tried) < fewest:
            return
        found = {}
        for k in joints:
            turns = at_turns(few, torque[:, k], k)
            if turns is not None and max(turns.smoothed.max(), turns.other) > turns.step:
                found[k] = turns
        widths = [turns.width for turns in found.values() if turns.gain > WORD]
        common = max(set(widths), key=widths.count) if widths else 0
        alike = [k for k, t in found.items() if t.width == common and t.gain > WORD]
        total = sum(turns.gain for turns in found.values() if turns.width == common)
        if total < LEAST or len(alike) < max(fewest, AGREEING * len(found)):
            return
        if not found[alike[0]].tells:
            return
        widest = common == len(WIDTHS) - 1
        over = 1e3 * LENGTH * WIDTHS[common - widest]
        yield self.suspicion(
            f"the torque was smoothed over about {over:.0f} ms{' or more' * widest}",
            f"friction reverses gradually before and after the joints do, equally on {len(alike)} "
            f"of {len(found)} joints whose friction shows its reversals, which improves the fit "
            f"by {total:.0f} (log-likelihood) over any friction that reverses with the joint; "
            "record the torque as measured",
            "suspected",
            alike,
        )


def _is_noisy(measurement: Measurement, joint: int) -> bool:
    """Whether the torque of a joint contains the fast noise of its sensor.

    Noise is as strong near the highest frequency as at half of it. What a filter left decreases,
    that of a running mean to a half. The rounding of a coarse sensor may come after its filter and
    does not count.
    """
    torque = measurement.torque[:, joint]
    powers = []
    for rows in measurement.signals.segments:
        count = (rows.stop - rows.start) // WINDOW
        if count:
            parts = torque[rows][: count * WINDOW].reshape(count, WINDOW)
            parts = (parts - parts.mean(axis=1, keepdims=True)) * np.hanning(WINDOW)
            powers.append(np.abs(np.fft.rfft(parts, axis=1)) ** 2)
    if not powers:
        return False
    # jumps are as strong at half of it as what a running mean leaves: most windows have none
    power = np.median(np.concatenate(powers), axis=0) / np.sum(np.hanning(WINDOW) ** 2)
    half, highest = (float(power[int(share * WINDOW) :][: WINDOW // 10].mean()) for share in BANDS)
    coarse = channel_step(torque)
    rounding = 0.0 if np.isnan(coarse) else coarse**2 / 12.0
    return highest > max(EVEN * half, ROUNDED * rounding)


def at_turns(signals: Signals, torque: Array, joint: int, *, others: bool = True) -> Turns | None:
    """Fit friction in different forms to the torque around the turns of a joint.

    Parameters
    ----------
    signals : Signals
        Smoothed motion.
    torque : ndarray of shape (n_samples,), N m or N
        Recorded torque of the joint.
    joint : int
        Joint, from 0.
    others : bool, default=True
        Whether to try friction other than that of a step and smoothed ones; without it, likelihoods
        are those of independent samples.

    Returns
    -------
    Turns or None
        None if it reverses too rarely.
    """
    dq = signals.dq[:, joint]
    steps = np.diff(signals.clock)
    step = float(np.median(steps[steps > 0]))
    half = int(AROUND / step)
    if half < SAMPLES / 2:
        return None
    fast = FAST * float(np.abs(dq).max())
    places = []
    for rows in signals.segments:
        sign = np.sign(dq[rows])
        for turn in np.flatnonzero(sign[1:] * sign[:-1] < 0) + rows.start:
            part = slice(turn - half, turn + half + 1)
            if part.start < rows.start or part.stop > rows.stop:
                continue
            before, after = dq[part][: half // 2], dq[part][-(half // 2) :]
            clean = np.all(np.sign(before) == np.sign(before[0])) and np.all(
                np.sign(after) == -np.sign(before[0])
            )
            if clean and min(np.abs(before).mean(), np.abs(after).mean()) > fast:
                places.append(part)
    if len(places) < FEWEST:
        return None
    places = places[:: 1 + len(places) // MOST]
    index = np.array([np.arange(part.start, part.stop) for part in places])
    sign = np.sign(dq)
    forms = [sign[index]]
    forms += [_smoothed(sign, signals, index, _bell(width / step)) for width in WIDTHS]
    forms += [_smoothed(sign, signals, index, _box(width / step)) for width in WIDTHS]
    if others:
        dahl = get_effect("dahl")
        ways = (WAYS * float(signals.unit[joint])).tolist()
        forms += [dahl.columns(signals, joint, presliding=way)[:, 0][index] for way in ways]
        speed, side = dq[index], sign[index]
        for fading in (SPEEDS * float(signals.unit[joint])).tolist():
            forms.append(np.tanh(speed / fading))
            near = np.exp(-((speed / fading) ** 2))
            forms += [side * (1.0 + times * near) for times in TIMES]
    slow, _ = np.linalg.qr(np.vander(np.linspace(-1, 1, index.shape[1]), DEGREE + 1))
    left = _without(torque[index], slow)
    fits = [_likelihood(_without(form, slow), left) for form in forms]
    rest = max(fits, key=lambda fit: fit[0])[1]
    # neighbouring samples are alike, in all forms as in the best one
    alike = float(np.clip(rest[1:] @ rest[:-1] / (rest @ rest + 1e-300), 0.0, 0.95)) * others
    values = np.array([value for value, _ in fits]) * (1 - alike) / (1 + alike)
    step_value, bell, box, other = np.split(values, 1 + len(WIDTHS) * np.arange(3))
    smooth = np.maximum(bell, box)  # of a filter, or of a running mean
    return Turns(float(step_value[0]), smooth, float(other.max(initial=-np.inf)))


def _bell(width: float) -> Array:
    """Kernel of a Gaussian of some standard deviation in samples, to where it ends."""
    reach = int(4 * width + 0.5)
    return np.asarray(np.exp(-0.5 * (np.arange(-reach, reach + 1) / width) ** 2))


def _box(width: float) -> Array:
    """Kernel of a running mean with some standard deviation in samples."""
    return np.ones(2 * max(1, round(np.sqrt(3) * width)) + 1)


def _smoothed(values: Array, signals: Signals, index: NDArray[np.int64], kernel: Array) -> Array:
    """Values through a filter around some samples, those of a row within one recording."""
    reach = len(kernel) // 2
    ends = np.array([(rows.start, rows.stop - 1) for rows in signals.segments])
    own = np.searchsorted(ends[:, 0], index[:, 0], side="right") - 1
    wide = np.arange(-reach, index.shape[1] + reach) + index[:, [0]]
    wide = np.clip(wide, ends[own, :1], ends[own, 1:])
    windows = sliding_window_view(values[wide], len(kernel), axis=1)
    return np.asarray(windows @ (kernel / kernel.sum()))


def _without(values: Array, slow: Array) -> Array:
    """Values around every turn less a slow function of their own, one after the other."""
    return np.asarray(values - (values @ slow) @ slow.T).ravel()


def _likelihood(f: Array, y: Array) -> tuple[float, Array]:
    """Log-likelihood of one size of friction, and its residual."""
    weight = np.ones(len(y))
    scale, rest = 1.0, y
    for _ in range(5):
        weighted = weight * f
        size = max(0.0, float(weighted @ y) / max(float(weighted @ f), 1e-300))
        rest = y - size * f
        square = rest * rest
        scale = float(np.sqrt(weight @ square / len(y))) + 1e-12
        weight = 5.0 / (4.0 + square / scale**2)
    return student(rest, scale), rest
