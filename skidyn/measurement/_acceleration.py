# SPDX-License-Identifier: BSD-3-Clause
"""Check of logged accelerations against the velocities."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from skidyn._signals import Signals
from skidyn.measurement._check import Check
from skidyn.measurement._consistency import velocity_consistency
from skidyn.measurement._measurement import ALIKE, Measurement
from skidyn.measurement._suspicion import Suspicion, names_in_option, remedy_of
from skidyn.measurement._units import NEAR

#: Slopes of integrated acceleration on velocity of a filtered or noisy acceleration, and the
#: correlation below which it is another signal.
FILTERED, UNLIKE = (0.5, 2.0), 0.5
#: Correlation from which no lag is looked for; lags that are tried, s; least that is reported, s;
#: largest share of the difference that may be left without it.
LIKE, LAGS, LEAST, LEFT = 0.98, np.linspace(-0.15, 0.15, 61), 0.015, 0.3


class Acceleration(Check):
    """Accelerations that are not the derivative of the velocities."""

    name = "acceleration"
    stage = 2  # it is not that of a motion with wrong units or columns
    suspects = (
        "logged accelerations with the opposite sign, in degrees, of another time, or of a signal "
        "other than the velocities"
    )

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        s = measurement.signals
        if measurement.lost or measurement.stale or measurement.clock != 1 or not s.ddq.any():
            return  # not logged, or to be compared once the clock is right
        if measurement.odd_motion:
            return
        groups: dict[str, list[int]] = {}
        slopes, lags = {}, {}
        for k, (of_velocity, likeness) in enumerate(measurement.velocities):
            right = abs(of_velocity - 1) < NEAR and likeness > ALIKE
            if not measurement.excited[k] or not right:
                continue
            if np.ptp(s.ddq[:, k]) == 0:
                groups.setdefault("constant", []).append(k)
                slopes[k] = 0.0, 0.0
                continue
            slope, alike = velocity_consistency(s.clock, s.dq[:, k], s.ddq[:, k], s.segments)
            cause = _cause(slope, alike)
            if not cause and (lag := _lag(s, k, alike)):
                lags[k] = lag
            if cause:
                groups.setdefault(cause, []).append(k)
                slopes[k] = slope, alike
        for cause, joints in groups.items():
            yield self._told(measurement, cause, joints, [slopes[k] for k in joints])
        for sign in (1, -1):
            if moved := {k: lag for k, lag in lags.items() if sign * lag > 0}:
                yield self._late(measurement, moved)

    def _late(self, measurement: Measurement, lags: dict[int, float]) -> Suspicion:
        """Accelerations of another time."""
        joints, lag = list(lags), float(np.median(list(lags.values())))
        columns = names_in_option("ddq", joints, measurement.n_joints)
        return self.suspicion(
            f"the acceleration of {measurement.joints(joints)} is {'late' if lag > 0 else 'early'} "
            f"by about {1e3 * abs(lag):.0f} ms relative to the velocity",
            "without this lag it follows from the velocity more closely; models that are fitted to "
            "logged accelerations are affected, a diagnosis derives them from the positions",
            "suspected",
            joints,
            remedy_of("late", dict.fromkeys(columns, float(f"{lag:.3g}"))),
        )

    def _told(
        self,
        measurement: Measurement,
        cause: str,
        joints: list[int],
        slopes: list[tuple[float, float]],
    ) -> Suspicion:
        names = measurement.joints(joints)
        numbers = ", ".join(f"{slope:.3g} (correlation {alike:.2f})" for slope, alike in slopes)
        evidence = (
            f"the acceleration is {numbers} times the differentiated velocity; models that are "
            "fitted to logged accelerations are affected, a diagnosis derives them from the "
            "positions"
        )
        what, remedy = f"the acceleration of {names} is not the derivative of the velocity", None
        if cause == "constant":
            what = f"the acceleration of {names} never changes, although the velocity does"
        elif cause == "sign":
            columns = [f"ddq{k + 1}" for k in joints]
            what = f"the acceleration of {names} has the opposite sign"
            remedy = remedy_of("flip", columns)
        elif cause == "degrees":
            what = f"accelerations look like degrees on {names}"
            columns = names_in_option("ddq", joints, measurement.n_joints)
            remedy = remedy_of("units", dict.fromkeys(columns, "deg/s^2"))
        return self.suspicion(what, evidence, "suspected", joints, remedy)


def _cause(slope: float, likeness: float) -> str:
    """What is wrong with an acceleration; empty if nothing is."""
    if not np.isfinite(slope) or (FILTERED[0] < slope < FILTERED[1] and likeness > UNLIKE):
        return ""
    if abs(slope + 1) < NEAR and likeness < -ALIKE:
        return "sign"
    if abs(np.deg2rad(slope) - 1) < NEAR and likeness > ALIKE:
        return "degrees"
    return "other"


def _lag(signals: Signals, joint: int, likeness: float) -> float:
    """Lag of an acceleration behind the velocity, s; zero if another time is hardly better.

    An acceleration from differences of past samples, or through a filter, is late.
    """
    dq, ddq = signals.dq[:, joint], signals.ddq[:, joint]
    step = float(np.median(np.diff(signals.clock)))
    tried = np.unique(np.round(LAGS / step).astype(int))

    def at(samples: int) -> float:
        parts = [
            np.interp(np.arange(r.start, r.stop) + samples, np.arange(r.start, r.stop), ddq[r])
            for r in signals.segments
        ]
        moved = np.concatenate(parts) if parts else ddq
        return velocity_consistency(signals.clock, dq, moved, signals.segments)[1]

    unlike = likeness <= LIKE  # NaN without motion
    if not unlike or sum(r.stop - r.start for r in signals.segments) != len(ddq):
        return 0.0
    found = np.array([at(int(n)) for n in tried])
    best = int(np.argmax(found))
    if best in (0, len(tried) - 1) or 1 - found[best] ** 2 > LEFT * (1 - likeness**2):
        return 0.0
    lag = float(tried[best] * step)
    return lag if abs(lag) > LEAST else 0.0
