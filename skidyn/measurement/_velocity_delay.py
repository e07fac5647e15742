# SPDX-License-Identifier: BSD-3-Clause
"""Check of the time of velocities: late or early relative to the positions, or filtered."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from skidyn._signals import Array, Signals
from skidyn.measurement._check import Check
from skidyn.measurement._delay import find_delay
from skidyn.measurement._lowpass import TRIED, summit, suspect_lowpass, without_lowpass
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._peak import vertex
from skidyn.measurement._suspicion import Suspicion, remedy_of
from skidyn.measurement._torque import readable_fits

#: Windows over which velocities are compared with positions, at most.
WINDOWS = 3000
#: Lags of the velocity that are tried, s, and how many times as long ones if none of them is best.
LAGS, FARTHER = np.linspace(-0.1, 0.1, 21), 4.0
#: The least lag that is reported, s and in time steps; the share of the difference that it takes
#: away; joints that agree and how nearly, s.
SMALLEST, STEPS, TAKEN, AGREEING, NEARLY = 0.006, 1.2, 0.3, 0.75, 0.01
#: Largest residual of a low pass to be reported, as a share of that of a delay; largest difference
#: of a common time constant between joints.
FILTERED, SAME_FILTER = 0.4, 0.15
#: Largest lag of the torque, as a share of that of the position behind the velocity, of which the
#: latter is the one that is early; number of standard errors that must be less than this lag.
IN_TIME, ERRORS = 0.3, 5.0


class VelocityDelay(Check):
    """Velocities that are late or early relative to the positions, equally in all joints."""

    name = "velocity_delay"
    suspects = (
        "velocities that are late or early relative to the positions: filtered, commanded, or "
        "stamped by another clock"
    )

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        lags = velocity_lags(measurement)
        common, own = common_lag(measurement, lags)
        if own:
            yield self._late(measurement, common, own, sum(map(np.isfinite, lags.values())))
        elif np.isfinite(common):
            yield from self._single(measurement, lags)

    def _single(self, measurement: Measurement, lags: dict[int, float]) -> Iterator[Suspicion]:
        """Single joints with late or early velocity."""
        least = max(SMALLEST, STEPS / measurement.rate)
        odd = [k for k, lag in lags.items() if abs(lag) > least]
        right = sum(abs(lag) < SMALLEST / 2 for lag in lags.values())
        if right < len(lags) / 2 or len(odd) > max(1, len(lags) / 3):
            return
        for k in odd:
            yield self._late(measurement, lags[k], {k: lags[k]})

    def _late(
        self, measurement: Measurement, lag: float, own: dict[int, float], moving: int = 0
    ) -> Suspicion:
        """Late or early velocities: of joints with a common lag among moving ones, or of one."""
        late, early = ("velocity", "position") if lag > 0 else ("position", "velocity")
        value = float(f"{abs(_refined(measurement.signals, own)):.3g}")
        joints: list[int] = [] if moving else list(own)
        if moving:
            number, of, its, alone = "", "", "the", ""
            equally = f", equally in {len(own)} of {moving} moving joints" if moving > 1 else ""
            in_time = "bodies, friction and rotor inertia explain the torque best at the time of"
        else:
            number, of, its = f"{joints[0] + 1}", f" of {measurement.joints(joints)}", "its"
            equally, alone = "", ", but that of other joints is not"
            in_time = "the torque is in time with"
        column = f"{'dq' if late == 'velocity' else 'q'}{number}"
        told = f"by about {1e3 * value:g} ms"
        if late == "position" and _in_time(measurement, value, *joints):
            return self.suspicion(
                f"the velocity{of} is early relative to {its} position {told}, and {its} "
                "torque is not",
                f"at that lag it is the derivative of the position{equally}, but {in_time} the "
                "position: the velocity was commanded or predicted, not measured",
                "suspected",
                joints,
                remedy_of("derive", [f"dq{number}"]),
            )
        if moving and late == "position":
            measurement.late_position = value
        constant = _lowpass(measurement.signals, own)
        if constant is not None:
            evidence = (
                f"after undoing a first-order filter with a time constant of {1e3 * constant:.1f} "
                f"ms it agrees with the {early}, far better than at any delay"
            )
            return suspect_lowpass(self, f"the {late}{of}", column, constant, evidence, joints)
        return self.suspicion(
            f"the {late}{of} is late relative to {its} {early} {told}{alone}",
            f"at that lag it is the derivative of the position{equally}: it was filtered, or "
            "stamped by another clock",
            "suspected",
            joints,
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


def velocity_lags(measurement: Measurement) -> dict[int, float]:
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


def common_lag(
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
