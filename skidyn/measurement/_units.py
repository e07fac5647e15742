# SPDX-License-Identifier: BSD-3-Clause
"""Checks of units that need no fit: time, position and velocity against each other and limits."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from skidyn.measurement._check import Check
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._suspicion import Suspicion

DEGREE = np.pi / 180
#: Units of time that a clock may be in, by the slope of integrated velocity on position.
CLOCKS = {1e3: "ms", 1e6: "us", 1e9: "ns"}
#: How far the slope may be off a unit's factor, and off 1.
NEAR = 0.1
#: Correlation of integrated velocity with position from which its slope is a unit.
ALIKE = 0.9


class ClockUnit(Check):
    """Time in another unit than seconds."""

    name = "clock_unit"
    suspects = "time in ms, us or ns"

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        slopes = [s for s, r in measurement.velocities if np.isfinite(s) and r > ALIKE and s > 0]
        typical = float(np.median(slopes)) if slopes else np.nan
        for factor, unit in CLOCKS.items():
            if abs(typical / factor - 1) < NEAR:
                yield self.suspicion(
                    f"time looks like {unit}",
                    f"the integrated velocities are {typical:.4g} times the positions they lead to "
                    f"(median over {len(slopes)} joints)",
                    "certain",
                    remedy=_units({"time": unit}),
                )
                return
        if measurement.rate < 2:
            # the unit in which a robot would have been sampled at a usual rate
            usual = [u for factor, u in CLOCKS.items() if 20 <= measurement.rate * factor <= 2e4]
            unit = usual[0] if usual else "ms"
            agrees = np.isfinite(typical) and abs(typical - 1) < NEAR
            yield self.suspicion(
                f"time may be in {unit}",
                f"the median time step is {1 / measurement.rate:.4g} s",
                "noted" if agrees else "suspected",
                remedy=_units({"time": unit}),
            )


class PositionUnit(Check):
    """Positions of turning joints in degrees."""

    name = "position_unit"
    suspects = "positions in degrees"

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        largest = np.abs(measurement.signals.q).max(axis=0)
        robot = measurement.robot
        slopes = [s for s, r in measurement.velocities if np.isfinite(s) and r > ALIKE]
        typical = float(np.median(slopes)) if slopes else 1.0
        if abs(typical / DEGREE - 1) < NEAR:
            yield self.suspicion(
                "positions look like degrees",
                f"velocities are {typical:.4g} times the differentiated positions (median over "
                f"{len(slopes)} joints)",
                "certain",
                remedy=_units({"q": "deg"}),
            )
            return
        both = {"q": "deg", "dq": "deg/s"} if abs(typical - 1) < NEAR else {"q": "deg"}
        if robot is None:
            k = int(np.argmax(largest))
            span = float(np.ptp(measurement.signals.q[:, k]))
            if largest[k] > 4 * np.pi and span > 4 * np.pi:
                yield self.suspicion(
                    "positions may be in degrees",
                    f"q{k + 1} reaches {largest[k]:.4g} rad, {largest[k] / 2 / np.pi:.1f} turns",
                    "suspected" if int(np.sum(largest > 4 * np.pi)) > 1 else "noted",
                    [k],
                    _units(both),
                )
            return
        turning = np.array([kind == "revolute" for kind in robot.joint_types])
        limits = np.abs(np.asarray(robot.position_limits)).max(axis=1)
        known = np.isfinite(limits)
        limits = np.where(known, limits, 2 * np.pi)
        outside = turning & (largest > 1.5 * limits)
        if outside.any() and np.all(largest[turning] * DEGREE <= 1.1 * limits[turning]):
            k = int(np.argmax(np.where(outside, largest / limits, 0)))
            where = f"the limit is {limits[k]:.3g} rad" if known[k] else "a turn has 6.28 rad"
            certain = bool((outside & known).any()) or float(np.median(largest[turning])) > 25
            yield self.suspicion(
                "positions look like degrees",
                f"q{k + 1} ({measurement.joint_names[k]}) reaches {largest[k]:.4g} rad where "
                f"{where}; read as degrees it would be {largest[k] * DEGREE:.3g} rad",
                "certain" if certain else "suspected",
                np.flatnonzero(outside),
                _units(both),
            )


class Velocity(Check):
    """Velocities that are not the derivative of the positions."""

    name = "velocity"
    suspects = "velocities with the other sign, in degrees, or of something else than the positions"

    def look(self, measurement: Measurement) -> Iterable[Suspicion]:
        groups: dict[str, list[int]] = {}
        typical = float(np.median([s for s, _ in measurement.velocities if np.isfinite(s)] or [1]))
        if any(abs(typical / factor - 1) < NEAR for factor in (*CLOCKS, DEGREE)):
            return []  # all of them are: the unit of the clock or of the positions
        for k, (slope, correlation) in enumerate(measurement.velocities):
            if not np.isfinite(slope) or not measurement.excited[k] or abs(slope - 1) < NEAR:
                continue
            cause = "other"
            if abs(slope + 1) < NEAR and correlation < -ALIKE:
                cause = "sign"
            elif abs(slope * DEGREE - 1) < NEAR and correlation > ALIKE:
                cause = "degrees"
            elif abs(slope / DEGREE - 1) < NEAR and correlation > ALIKE:
                cause = "position"
            groups.setdefault(cause, []).append(k)
        return [self._told(measurement, cause, joints) for cause, joints in groups.items()]

    def _told(self, measurement: Measurement, cause: str, joints: list[int]) -> Suspicion:
        names = ", ".join(measurement.joint(k) for k in joints)
        slopes = ", ".join(
            f"{measurement.velocities[k][0]:.4g} (correlation {measurement.velocities[k][1]:.3f})"
            for k in joints
        )
        evidence = f"the velocity is {slopes} times the differentiated position"
        if cause == "sign":
            columns = [f"dq{k + 1}" for k in joints]
            return self.suspicion(
                f"the velocity of {names} has the other sign",
                evidence,
                "certain",
                joints,
                (f"--flip {','.join(columns)}", f"flip={columns}"),
            )
        every = len(joints) == measurement.n_joints
        if cause in ("degrees", "position"):
            quantity, unit = ("dq", "deg/s") if cause == "degrees" else ("q", "deg")
            units = {quantity: unit} if every else {f"{quantity}{k + 1}": unit for k in joints}
            what = "velocities look like deg/s" if cause == "degrees" else "positions look like"
            what += " degrees" if cause == "position" else ""
            return self.suspicion(f"{what} on {names}", evidence, "certain", joints, _units(units))
        return self.suspicion(
            f"the velocity of {names} is not the derivative of the position",
            evidence,
            "suspected",
            joints,
        )


class WrappedPosition(Check):
    """Positions that leap by a turn at the border of a turn."""

    name = "wrapped_position"
    suspects = "positions that leap by a turn"

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        signals = measurement.signals
        for k in np.flatnonzero(~signals.prismatic):
            q = signals.q[:, k]
            for turn, unit in ((2 * np.pi, "rad"), (360.0, "degrees")):
                leaps = [
                    np.abs(np.abs(np.diff(q[rows])) - turn) < 0.05 * turn
                    for rows in signals.segments
                ]
                count = int(sum(leap.sum() for leap in leaps))
                if count and np.ptp(q) < 1.1 * turn:
                    yield self.suspicion(
                        f"the position of {measurement.joint(int(k))} is wrapped",
                        f"it leaps by a turn of {turn:.4g} {unit} {count} time(s)",
                        "certain",
                        [int(k)],
                        ("--unwrap", "unwrap=True"),
                    )
                    break


def _units(units: dict[str, str]) -> tuple[str, str]:
    """The remedy that says units."""
    words = ",".join(f"{name}={unit}" for name, unit in units.items())
    return f"--units {words}", f"units={units}"
