# SPDX-License-Identifier: BSD-3-Clause
"""Torque that depends on the joint's own position, or on nothing at all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from skidyn._signals import Signals
from skidyn.effects._base import Array, Coefficient, Effect, Shape


class Offset(Effect):
    """Constant torque: a sensor or current zero, an unbalanced drive."""

    kind = "offset"
    by_recording = True
    title = "Torque offset"
    formula = r"\tau_0"
    coefficients = (Coefficient("tau0", "N m"),)
    is_exact = True
    simplicity = 0
    rivals = ("asymmetric_friction", "spring", "temperature_offset")
    separating_motion = "poses in which gravity acts with both signs; the sensor zeroed anew"
    reference = "Gautier, Khalil (1988), ICRA."

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        return np.ones((signals.n_samples, 1))


class Spring(Effect):
    """Linear spring between the joint's two links."""

    kind = "spring"
    by_recording = True
    title = "Spring"
    formula = r"k\,(q - q_0)"
    coefficients = (Coefficient("k", "N m/rad", sign=1), Coefficient("tau0", "N m", is_zero=True))
    is_exact = True
    simplicity = 4
    rivals = ("nonlinear_spring", "gravity_compensator", "offset", "end_stop")
    separating_motion = "slow motion over the whole travel"
    reference = "Siciliano, Sciavicco, Villani, Oriolo (2009), Robotics, Springer."

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        return np.column_stack([signals.q[:, joint], np.ones(signals.n_samples)])

    def parameters(
        self, coefficients: Array, shape: Mapping[str, Any], signals: Signals | None = None
    ) -> dict[str, Any]:
        k, tau0 = map(float, coefficients)
        return {"k": k, "q0": -tau0 / k if k else 0.0}

    def units(self, prismatic: bool = False) -> dict[str, str]:
        return {"k": "N/m", "q0": "m"} if prismatic else {"k": "N m/rad", "q0": "rad"}


class NonlinearSpring(Effect):
    """Spring that stiffens or softens: a cubic in position."""

    kind = "nonlinear_spring"
    title = "Nonlinear spring"
    formula = r"k_1 x + k_2 x^2 + k_3 x^3 + \tau_0,\quad x = q - q_m"
    coefficients = (
        Coefficient("k1", "N m/rad"),
        Coefficient("k2", "N m/rad^2"),
        Coefficient("k3", "N m/rad^3"),
        Coefficient("tau0", "N m", is_zero=True),
    )
    simplicity = 29
    rivals = ("spring", "gravity_compensator", "end_stop")
    separating_motion = "slow motion over the whole travel"
    reference = "Madsen, Bargsten, Brixius (2020), Nonlinear joint stiffness identification."

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        # Powers of the distance from the middle of the travel keep the columns well conditioned.
        q = signals.q[:, joints[0]]
        return [{"q_middle": float((q.min() + q.max()) / 2)}]

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        x = signals.q[:, joint] - shape["q_middle"]
        return np.column_stack([x, x**2, x**3, np.ones_like(x)])


class GravityCompensator(Effect):
    """Coil spring with a lever, or a counterweight: trigonometric in the joint's own position."""

    kind = "gravity_compensator"
    title = "Gravity compensator"
    formula = r"a_1\sin q + b_1\cos q + a_2\sin 2q + b_2\cos 2q + \tau_0"
    coefficients = (
        Coefficient("a1", "N m"),
        Coefficient("b1", "N m"),
        Coefficient("a2", "N m"),
        Coefficient("b2", "N m"),
        Coefficient("tau0", "N m", is_zero=True),
    )
    simplicity = 30
    rivals = ("nonlinear_spring", "spring")
    separating_motion = "slow motion over the whole travel"
    reference = "Jubien, Gautier (2013), IFAC; Dietz et al. (2018), coil spring balancers."

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        q = signals.q[:, joint]
        return np.column_stack(
            [np.sin(q), np.cos(q), np.sin(2 * q), np.cos(2 * q), np.ones_like(q)]
        )

    def not_shown(self, signals: Signals, joint: int) -> str | None:
        if signals.prismatic[joint]:
            return f"joint {joint + 1} slides"
        return super().not_shown(signals, joint)


#: Shares of the samples between which a contact is one: with more it is a spring.
FEWEST_TOUCHING, MOST_TOUCHING = 0.001, 0.6


class EndStop(Effect):
    """One-sided elastic contact beyond a position: bumper, hose, cable pulled tight.

    A soft bumper stiffens: then the torque grows with the second ``power`` of the way (1 where the
    shape has none), in units of 1 rad or 1 m, so that the unit of the stiffness stays.
    """

    kind = "end_stop"
    title = "End stop"
    formula = r"s\,k\,\max(0,\ s\,(q - q_\mathrm{lim}))^p,\quad s = \pm 1"
    coefficients = (Coefficient("k", "N m/rad", sign=1),)
    shapes = (Shape("q_lim", "rad", (), -np.inf, np.inf, spacing="linear", scales=False),)
    forms = ({"power": 2.0},)
    simplicity = 10
    rivals = ("spring", "nonlinear_spring")
    separating_motion = "slow approach to both ends of the travel"
    reference = "Siciliano, Sciavicco, Villani, Oriolo (2009), Robotics, Springer."

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        q = signals.q[:, joints[0]]
        shares = (0.80, 0.84, 0.88, 0.92, 0.95)
        return [
            {"q_lim": float(side * np.quantile(side * q, share)), "side": side} | stiffening
            for stiffening in ({}, *map(dict, self.forms))
            for share in shares
            for side in (1.0, -1.0)
        ]

    def admissible(self, signals: Signals, joints: Sequence[int], shape: Mapping[str, Any]) -> bool:
        beyond = shape["side"] * (signals.q[:, joints[0]] - shape["q_lim"]) > 0
        return bool(FEWEST_TOUCHING < beyond.mean() < MOST_TOUCHING)

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        beyond = shape["side"] * (signals.q[:, joint] - shape["q_lim"])
        depth: Array = shape["side"] * np.maximum(0.0, beyond) ** shape.get("power", 1.0)
        return depth[:, None]
