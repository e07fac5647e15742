# SPDX-License-Identifier: BSD-3-Clause
"""A robot that does not stand as its URDF says."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from skidyn._signals import Signals
from skidyn.effects._base import Array, Coefficient, Effect


class BaseTilt(Effect):
    """Gravity has horizontal components in the base frame."""

    kind = "base_tilt"
    title = "Tilted base"
    formula = r"\tau_g(q;\,g + \delta g) - \tau_g(q;\,g)"
    coefficients = (Coefficient("gx", "m/s^2"), Coefficient("gy", "m/s^2"))
    scope = "robot"
    needs = ("robot",)
    simplicity = 12
    rivals = ("offset", "gravity_compensator")
    separating_motion = "the first joint turned over its whole travel at several arm poses"
    reference = "Khalil, Dombre (2002), Modeling, Identification and Control of Robots, chapter 9."

    def torque_columns(
        self, signals: Signals, joints: Sequence[int], **shape: Any
    ) -> dict[int, Array]:
        robot = signals.robot
        assert robot is not None
        rest = np.zeros_like(signals.q)
        parts = [
            robot.inverse_dynamics(
                signals.q,
                rest,
                rest,
                parameters=signals.inertial_parameters,
                gravity=np.eye(3)[axis],
            )
            for axis in self._horizontal(robot.gravity)
        ]
        return {j: np.column_stack([part[:, j] for part in parts]) for j in joints}

    @staticmethod
    def _horizontal(gravity: Array) -> list[int]:
        """The two base axes across gravity (x and y for a robot that stands upright)."""
        vertical = int(np.argmax(np.abs(gravity)))
        return [axis for axis in range(3) if axis != vertical]

    def parameters(
        self, coefficients: Array, shape: Mapping[str, Any], signals: Signals | None = None
    ) -> dict[str, Any]:
        gx, gy = map(float, coefficients)
        sine = min(1.0, float(np.hypot(gx, gy)) / 9.81)
        return {"gx": gx, "gy": gy, "tilt_deg": float(np.rad2deg(np.arcsin(sine)))}

    def units(self, prismatic: bool = False) -> dict[str, str]:
        return {"gx": "m/s^2", "gy": "m/s^2", "tilt_deg": "deg"}
