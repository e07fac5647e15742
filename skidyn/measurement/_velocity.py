# SPDX-License-Identifier: BSD-3-Clause
"""Check of velocities against positions: sign, scale, unit and order."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from skidyn.measurement._check import Check
from skidyn.measurement._consistency import velocity_consistency
from skidyn.measurement._measurement import ALIKE, Measurement
from skidyn.measurement._measures import step_share
from skidyn.measurement._odd_motion import LEAST_SPEED
from skidyn.measurement._reading import Reading
from skidyn.measurement._suspicion import Suspicion, names_in_option, remedy_of
from skidyn.measurement._tachometer import Fault, find_fault
from skidyn.measurement._units import (
    CLOCKS,
    LEAST,
    NAMES,
    NEAR,
    POSITIONS,
    VELOCITIES,
    gained,
    is_near,
    unnamed_scale,
)
from skidyn.measurement._velocity_delay import common_lag, velocity_lags

#: Range of a position, rad or m, that is that of a joint that moves.
LEAST_MOTION = 0.02
#: Correlation of a velocity with the rate of its position above which it has no fault.
SURE = 0.995
#: How much smaller a coarse velocity may be whose digits were cut, in steps over its spread.
CUT = 0.5


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
            return [self._exchanged(measurement, order)]
        constant = _constant(measurement)
        if constant:
            names = measurement.joints(constant)
            odd = self.suspicion(
                f"the velocity of {names} does not belong to the position: one of them is constant",
                "the other changes in most rows",
                "certain",
                constant,
            )
            return [odd]
        faults, groups = _faults_and_causes(measurement)
        if "other" in groups and set(groups["other"]) <= set(
            common_lag(measurement, velocity_lags(measurement))[1]
        ):
            del groups["other"]  # they are late
        told = [self._faulty(measurement, k, fault) for k, fault in faults.items()]
        if not groups:  # in another unit, the noise of a joint at rest looks like motion
            told += [self._held(measurement, k, runs) for k, runs in measurement.stuck.items()]
        return told + [self._told(measurement, cause, joints) for cause, joints in groups.items()]

    def _exchanged(self, measurement: Measurement, order: list[int]) -> Suspicion:
        moved = [k for k, column in enumerate(order) if column != k]
        numbers = [column + 1 for column in order]
        names = measurement.joints(moved)
        return self.suspicion(
            f"the velocities of {names} are exchanged",
            "each is the derivative of another joint's position",
            "certain",
            moved,
            remedy_of("order", {"dq": numbers}),
        )

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
        columns = names_in_option(quantity, joints, measurement.n_joints)
        remedy = remedy_of("units", dict.fromkeys(columns, unit))
        what = "velocities" if quantity == "dq" else "positions"
        unit = NAMES.get(unit, unit)
        return self.suspicion(
            f"{what} look like {unit} on {names}",
            evidence,
            "certain",
            joints,
            remedy,
        )


def _faults_and_causes(
    measurement: Measurement,
) -> tuple[dict[int, Fault], dict[str, list[int]]]:
    """Velocities with a fault, by joint, and joints whose scale is not 1, by its cause."""
    faults: dict[int, Fault] = {}
    groups: dict[str, list[int]] = {}
    for k, (slope, correlation) in enumerate(measurement.velocities):
        slope /= measurement.clock
        if not np.isfinite(slope) or not measurement.excited[k]:
            continue
        cause = _cause(slope, correlation)
        if k in measurement.stuck and cause == "other":
            continue
        fault = _fault(measurement, k) if correlation < SURE else None
        if fault is not None:
            faults[k] = fault
            continue
        coarse = step_share(measurement.signals.dq[:, k], measurement.velocity_steps[k])
        if abs(slope - 1) < max(NEAR, CUT * coarse):
            continue
        if k in measurement.millimetres:
            continue
        if measurement.clock != 1 and cause in ("scale", "other"):
            continue  # reported when time is in seconds
        groups.setdefault(cause, []).append(k)
    return faults, groups


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
