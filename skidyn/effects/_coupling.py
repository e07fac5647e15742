# SPDX-License-Identifier: BSD-3-Clause
"""Effects of a transmission that couples two joints: shared gears, cables, hoses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from skidyn._signals import SIGN_BLUR, Signals
from skidyn.effects._base import Array, Coefficient, Effect, Shape

_RATIO = Shape(
    "ratio", "1", (1.0, -1.0), -10.0, 10.0, spacing="linear", scales=False, has_interval=False
)
_GAUTIER = "Janot, Vandanjon, Gautier (2014), IEEE TCST 22(1), 132-145 (TX40 wrist)."


class _PairEffect(Effect):
    """Acts through x = x_i + r x_j: the column on joint i, r times it on joint j."""

    scope = "pair"
    shapes = (_RATIO,)

    def coupled_columns(self, signals: Signals, i: int, j: int, ratio: float) -> Array:
        """Columns as functions of the coupled coordinate, shape (n_samples, n_coefficients)."""
        raise NotImplementedError

    def torque_columns(
        self, signals: Signals, joints: Sequence[int], **shape: Any
    ) -> dict[int, Array]:
        i, j = joints
        ratio = shape["ratio"]
        block = self.coupled_columns(signals, i, j, ratio)
        return {i: block, j: ratio * block}

    def travel(self, signals: Signals, joints: Sequence[int], shape: Mapping[str, Any]) -> float:
        return 1.0

    def not_shown(self, signals: Signals, joint: int) -> str | None:
        if signals.prismatic[joint]:
            return f"joint {joint + 1} slides"
        return super().not_shown(signals, joint)


class CoupledFriction(_PairEffect):
    """Friction of a shaft that turns with the sum of two joint velocities."""

    kind = "coupled_friction"
    drawn_against = "dq"
    title = "Coupled friction"
    formula = r"F_v\,\dot x + F_c\,\mathrm{sign}\,\dot x,\quad \dot x = \dot q_i + r\,\dot q_j"
    coefficients = (Coefficient("Fc", "N m", sign=1), Coefficient("Fv", "N m s/rad", sign=1))
    simplicity = 17
    rivals = ("viscous", "coulomb")
    separating_motion = "the two joints moved together, then against each other"
    reference = _GAUTIER

    def coupled_columns(self, signals: Signals, i: int, j: int, ratio: float) -> Array:
        speed = signals.dq[:, i] + ratio * signals.dq[:, j]
        return np.column_stack([np.tanh(speed / SIGN_BLUR), speed])


class CoupledInertia(_PairEffect):
    """Inertia of a shaft that turns with the sum of two joint velocities."""

    kind = "coupled_inertia"
    drawn_against = "ddq"
    title = "Coupled inertia"
    formula = r"I_a\,(\ddot q_i + r\,\ddot q_j)"
    coefficients = (Coefficient("Ia", "kg m^2", sign=1),)
    simplicity = 18
    rivals = ("rotor_inertia",)
    separating_motion = "the two joints accelerated together, then against each other"
    reference = _GAUTIER

    def coupled_columns(self, signals: Signals, i: int, j: int, ratio: float) -> Array:
        return (signals.ddq[:, i] + ratio * signals.ddq[:, j])[:, None]


class CouplingSpring(_PairEffect):
    """Spring or hose between two joints."""

    kind = "coupling_spring"
    title = "Coupling spring"
    formula = r"k\,(q_i + r\,q_j - x_0)"
    coefficients = (Coefficient("k", "N m/rad"), Coefficient("tau0", "N m", is_zero=True))
    simplicity = 16
    rivals = ("spring",)
    separating_motion = "slow motion of the two joints together, then against each other"
    reference = "Tsai (1999), Robot Analysis, Wiley, chapter 7."

    def coupled_columns(self, signals: Signals, i: int, j: int, ratio: float) -> Array:
        x = signals.q[:, i] + ratio * signals.q[:, j]
        return np.column_stack([x, np.ones_like(x)])
