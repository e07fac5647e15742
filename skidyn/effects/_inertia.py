# SPDX-License-Identifier: BSD-3-Clause
"""Inertia on the motor side."""

from __future__ import annotations

from typing import Any

from skidyn._signals import Array, Signals
from skidyn.effects._base import Effect
from skidyn.effects._parameters import Coefficient


class RotorInertia(Effect):
    """Inertia of the motor's rotor, reflected through the gear."""

    kind = "rotor_inertia"
    drawn_against = "ddq"
    title = "Rotor inertia"
    formula = r"I_a\,\ddot q"
    coefficients = (Coefficient("Ia", "kg m^2", sign=1),)
    is_exact = True
    simplicity = 3
    rivals = ("joint_elasticity", "time_delay")
    separating_motion = "accelerations in several poses (of any joint but the first)"
    reference = "Gautier, Khalil (1990), IEEE TRA 6(3), 368-373."

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        return signals.ddq[:, [joint]]
