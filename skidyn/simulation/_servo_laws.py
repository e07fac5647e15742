# SPDX-License-Identifier: BSD-3-Clause
"""Candidate effects for the motion of a servo, with their parameters and texts."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from skidyn._signals import Array
from skidyn.forward import JointLoop

#: Half the width of a 95 % interval in standard errors.
WIDE = 1.96
#: Initial values of second fits: half of a play, as share of the travel, and compliance.
FARTHER, SOFTER = 0.02, 5e-3


@dataclass(frozen=True)
class Range:
    """Start, limits and size of a parameter, in units of :func:`units_of`."""

    start: float
    low: float
    high: float
    size: float
    unit: str = "one"


FRICTION = {
    "viscous": Range(0.5, -5.0, 20.0, 1.0, "drag"),
    "coulomb": Range(1.0, 0.0, 10.0, 1.0, "friction"),
    "offset": Range(0.0, -5.0, 5.0, 1.0, "friction"),
    "inertia": Range(0.0, -0.6, 1.0, 0.1),
    "weight": Range(0.0, -0.5, 0.5, 0.1),
}
_MOTOR = Range(0.2, 0.02, 0.9, 0.1)
LAWS: dict[str, dict[str, Range]] = {
    "stribeck": {
        "dF": Range(0.5, 0.0, 10.0, 1.0, "friction"),
        "vs": Range(0.08, 0.01, 1.0, 0.1, "speed"),
    },
    "load_dependent_friction": {"mu": Range(0.1, 0.0, 1.0, 0.1)},
    "dahl": {"presliding": Range(100.0, 5.0, 5e3, 100.0, "presliding")},
    "time_delay": {"late": Range(0.01, 0.0, 0.05, 0.01)},
    "asymmetric_friction": {"dFc": Range(0.0, -5.0, 5.0, 1.0, "friction")},
    "nonlinear_viscous": {"square": Range(0.0, -5.0, 5.0, 1.0, "square")},
    "joint_elasticity": {
        "compliance": Range(1.2e-3, 1e-5, 0.2, 4e-4, "compliance"),
        "damping": Range(0.1, 0.0, 1.0, 0.1),
        "motor": _MOTOR,
    },
    "backlash": {
        "gap": Range(0.006, 0.0, 0.1, 0.005, "way"),
        "compliance": Range(5e-4, 1e-5, 1e-2, 3e-4, "compliance"),
        "motor": _MOTOR,
    },
    "servo_deadband": {"deadband": Range(0.3, 0.0, 3.0, 0.1, "error")},
}
#: Effects of one group act in series in a gear; a second one would be equivalent.
GEARS = ("joint_elasticity", "backlash")


def rivals_of(loop: JointLoop, known: tuple[str, ...]) -> list[tuple[str, dict[str, Range]]]:
    """Kinds that may be missing in addition to those that the loop has, some with two starts.

    If a deadband is known, no other is fitted.
    """
    left_out = set(known)
    if left_out & set(GEARS):
        left_out |= set(GEARS)
    if loop.deadband:
        left_out.add("servo_deadband")
    return [(kind, law) for kind in LAWS if kind not in left_out for law in starts_of(kind)]


def starts_of(kind: str) -> list[dict[str, Range]]:
    """Parameters of a kind; several if one start leads only to a local minimum."""
    law = LAWS[kind]
    if kind == "backlash":
        return [law, {**law, "gap": replace(law["gap"], start=FARTHER)}]
    if kind == "joint_elasticity":
        return [law, {**law, "compliance": replace(law["compliance"], start=SOFTER)}]
    return [law]


def units_of(loop: JointLoop) -> dict[str, float]:
    """Units: a part of the joint's torque, its travel, its speed."""
    seen = loop.valid
    torque = 0.05 * float(np.sqrt(np.mean(loop.torque[seen] ** 2))) + 1e-12
    speed = float(np.std(loop.dq[seen])) + 1e-9
    return {
        "one": 1.0,
        "friction": torque,
        "drag": torque / speed,
        "square": torque / speed**2,
        "presliding": torque / (float(np.std(loop.q[seen])) + 1e-9),
        "compliance": 1.0 / loop.size,
        "speed": speed,
        "way": float(np.std(loop.q[seen])) + 1e-9,
        "error": float(np.median(np.abs((loop.command - loop.q)[seen]))) + 1e-9,
    }


def halves_told(
    kind: str, values: dict[str, float], names: list[str], covariance: Array
) -> dict[str, float]:
    """Half the widths of the 95 % intervals of :func:`sizes_told`, to first order.

    The covariance is that of the fitted values with the given names, in this order.
    """
    here = sizes_told(kind, values)
    slopes: dict[str, list[float]] = {name: [] for name in here}
    for name in names:
        step = 1e-6 * max(abs(values[name]), 1e-9)
        there = sizes_told(kind, {**values, name: values[name] + step})
        for told, value in there.items():
            slopes[told].append((value - here[told]) / step)
    return {
        told: WIDE * float(np.sqrt(max(np.array(s) @ covariance @ np.array(s), 0.0)))
        for told, s in slopes.items()
    }


def sizes_told(kind: str, values: dict[str, float]) -> dict[str, float]:
    """Sizes of an effect by their names in the catalogue."""
    if kind == "backlash":
        return {"gap": 2 * values["gap"]}
    if kind == "dahl":  # the name of the distance in the catalogue
        return {"presliding": values["coulomb"] / values["presliding"]}
    if kind == "joint_elasticity":
        return {"K": 1.0 / values["compliance"]}
    if kind == "nonlinear_viscous":
        return {"c": values["square"], "power": 2.0}
    names = {"late": "delay"}
    own = [k for k in LAWS[kind] if k not in ("motor", "damping")]
    return {names.get(k, k): values[k] for k in own}
