# SPDX-License-Identifier: BSD-3-Clause
"""Friction that grows with the torque the transmission carries."""

from __future__ import annotations

from typing import Any

import numpy as np

from skidyn._signals import Signals
from skidyn.effects._base import Array, Coefficient, Effect


class LoadDependentFriction(Effect):
    """Gear friction proportional to the transmitted torque."""

    kind = "load_dependent_friction"
    drawn_against = "load"
    title = "Load-dependent friction"
    formula = r"\mu\,|\tau_\mathrm{load}|\,\mathrm{sign}(\dot q)"
    coefficients = (Coefficient("mu", "1", sign=1),)
    needs = ("load",)
    simplicity = 7
    rivals = ("coulomb", "position_dependent_friction", "torque_gain")
    separating_motion = "the same sweep with and without a known payload"
    reference = (
        "Hamon, Gautier, Garrec (2010), IROS, 6187-6193; "
        "Duclusaud et al. (2024), Extended friction models for servo actuators."
    )

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        assert signals.load is not None
        return (np.abs(signals.load[:, joint]) * signals.sign[:, joint])[:, None]
