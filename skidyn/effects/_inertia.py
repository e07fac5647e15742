# SPDX-License-Identifier: BSD-3-Clause
"""Inertia on the motor side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from skidyn._signals import Array, Signals
from skidyn.effects._base import Effect
from skidyn.effects._parameters import Coefficient


class RotorInertia(Effect):
    """Inertia of the motor's rotor, reflected through the gear.

    The ratio of a linkage, such as a crank or a cylinder beside the joint, changes along the
    travel. With ``varying`` in its shape the inertia is a parabola about the middle of the travel.
    """

    kind = "rotor_inertia"
    drawn_against = "ddq"
    title = "Rotor inertia"
    formula = (
        r"I_a\,\ddot q\ \text{or}\ I(q)\,\ddot q + \tfrac12 I'(q)\,\dot q^2,"
        r"\quad I = I_a + I_1 x + I_2 x^2,\ x = q - q_m"
    )
    coefficients = (Coefficient("Ia", "kg m^2", sign=1),)
    forms = ({"varying": 1.0, "q_middle": 0.0},)
    is_exact = True
    simplicity = 3
    rivals = ("joint_elasticity", "time_delay")
    separating_motion = "accelerations in several poses (of any joint but the first)"
    reference = "Gautier, Khalil (1990), IEEE TRA 6(3), 368-373."

    def _plain_and_forms(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        q = signals.q[:, joints[0]]
        (form,) = self.forms
        return [{}, dict(form) | {"q_middle": float((q.min() + q.max()) / 2)}]

    def coefficients_of(self, shape: Mapping[str, Any]) -> tuple[Coefficient, ...]:
        if "varying" not in shape:
            return self.coefficients
        slope, curvature = Coefficient("I1", "kg m^2/rad"), Coefficient("I2", "kg m^2/rad^2")
        return (*self.coefficients, slope, curvature)

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        ddq = signals.ddq[:, joint]
        if "varying" not in shape:
            return ddq[:, None]
        x, dq = signals.q[:, joint] - shape["q_middle"], signals.dq[:, joint]
        return np.column_stack([ddq, x * ddq + 0.5 * dq**2, x**2 * ddq + x * dq**2])

    def units(self, prismatic: bool = False) -> dict[str, str]:
        inertia, length = ("kg", "m") if prismatic else ("kg m^2", "rad")
        return {
            "Ia": inertia,
            "I1": f"{inertia}/{length}",
            "I2": f"{inertia}/{length}^2",
            "q_middle": length,
        }
