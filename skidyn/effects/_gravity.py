# SPDX-License-Identifier: BSD-3-Clause
"""A robot whose base is not mounted as in its URDF."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from skidyn._signals import Array, Signals
from skidyn.effects._base import Effect
from skidyn.effects._parameters import Coefficient

#: Share of the gravity torque of other joints below which the first joint is vertical: descriptions
#: round their angles.
UPRIGHT = 1e-4


class BaseTilt(Effect):
    """Gravity has horizontal components in the base frame.

    A first joint that is vertical in the description is not loaded by gravity, so its first moments
    are not identified; on a tilted base they are identified as two more coefficients.
    """

    kind = "base_tilt"
    title = "Tilted base"
    formula = r"\tau_g(q;\,g + \delta g) - \tau_g(q;\,g)"
    coefficients = (
        Coefficient("gx", "m/s^2"),
        Coefficient("gy", "m/s^2"),
        Coefficient("first_cos", "N m", is_zero=True),
        Coefficient("first_sin", "N m", is_zero=True),
    )
    scope = "robot"
    needs = ("robot",)
    drifts = True
    sizes_by_recording = True
    is_exact = True
    simplicity = 12
    rivals = ("offset", "gravity_compensator")
    separating_motion = "the first joint turned over its whole travel at several arm poses"
    reference = "Khalil, Dombre (2002), Modeling, Identification and Control of Robots, chapter 9."

    def torque_columns(
        self, signals: Signals, joints: Sequence[int], **shape: Any
    ) -> dict[int, Array]:
        robot = signals.robot
        assert robot is not None
        rest = np.zeros_like(signals.q)  # the symbolic robot of a simulation has no gravity_torque

        def pulls(q: Array) -> list[Array]:
            """Torque of 1 m/s^2 along each horizontal axis in some poses, N m or N."""
            still = np.zeros_like(q)
            own = signals.inertial_parameters
            return [
                robot.inverse_dynamics(q, still, still, parameters=own, gravity=np.eye(3)[axis])
                for axis in self._horizontal(robot.gravity)
            ]

        parts = pulls(signals.q)
        pull = np.abs(robot.inverse_dynamics(signals.q, rest, rest))
        upright = pull[:, 0].max(initial=0.0) < UPRIGHT * pull.max(initial=1e-9)
        first = np.zeros((signals.n_samples, 2))
        if not signals.prismatic[0] and upright:
            first = np.column_stack([np.cos(signals.q[:, 0]), np.sin(signals.q[:, 0])])
            # The first moments that turn with the first joint are these coefficients. Those of the
            # model are arbitrary: they may be tons at a lever of a tenth of a millimetre.
            quarter = np.zeros((2, signals.n_joints))
            quarter[1, 0] = np.pi / 2  # cosine and sine of a torque that turns
            for part, fixed in zip(parts, pulls(quarter), strict=True):
                part[:, 0] -= first @ fixed[:, 0]
        columns = {j: np.column_stack([*(p[:, j] for p in parts), 0 * first]) for j in joints}
        if 0 in columns:
            columns[0][:, 2:] = first
        return columns

    @staticmethod
    def _horizontal(gravity: Array) -> list[int]:
        """The two base axes perpendicular to gravity (x and y for an upright robot)."""
        vertical = int(np.argmax(np.abs(gravity)))
        return [axis for axis in range(3) if axis != vertical]

    def parameters(
        self, coefficients: Array, shape: Mapping[str, Any], signals: Signals | None = None
    ) -> dict[str, Any]:
        gx, gy = map(float, coefficients[:2])
        sine = min(1.0, float(np.hypot(gx, gy)) / 9.81)
        return {"gx": gx, "gy": gy, "tilt_deg": float(np.rad2deg(np.arcsin(sine)))}

    def units(self, prismatic: bool = False) -> dict[str, str]:
        return {"gx": "m/s^2", "gy": "m/s^2", "tilt_deg": "deg"}
