# SPDX-License-Identifier: BSD-3-Clause
"""What lies between motor and link: the logged position is the motor's."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
from scipy.signal import savgol_filter

from skidyn._signals import Signals
from skidyn.effects._base import Array, Coefficient, Effect

#: Width over which the load is smoothed before it is differentiated twice, in s.
_SMOOTHING = 0.08


def _smooth_derivatives(values: Array, signals: Signals) -> tuple[Array, Array, Array]:
    """A signal smoothed by local quartic polynomials, with its first two time derivatives."""
    result = tuple(np.zeros_like(values) for _ in range(3))
    for rows in signals.segments:
        y = values[rows]
        if len(y) < 7:
            continue
        step = float(np.median(np.diff(signals.clock[rows])))
        half = max(3, int(_SMOOTHING / 2 / step))
        width = min(2 * half + 1, (len(y) - 1) // 2 * 2 + 1)
        for order, out in enumerate(result):
            out[rows] = savgol_filter(y, width, min(4, width - 1), deriv=order, delta=step)
    return result  # type: ignore[return-value]


class _LinkSideEffect(Effect):
    """The link is displaced from the logged position by ``-c s(load)``.

    To first order the torque of all joints changes by the directional derivative of inverse
    dynamics along that displacement, which is what the columns hold.
    """

    needs = ("robot", "load", "time")
    #: Displacement used for the finite difference, rad or m.
    _step: ClassVar[float] = 1e-3

    def displacement(self, signals: Signals, joint: int) -> Array:
        """Displacement of the link for a unit coefficient, shape (n_samples,)."""
        raise NotImplementedError

    def torque_columns(
        self, signals: Signals, joints: Sequence[int], **shape: Any
    ) -> dict[int, Array]:
        assert signals.robot is not None
        (joint,) = joints
        derivatives = _smooth_derivatives(self.displacement(signals, joint), signals)
        scale = self._step * signals.unit[joint] / (np.abs(derivatives[0]).max() + 1e-300)
        moved = [signals.q.copy(), signals.dq.copy(), signals.ddq.copy()]
        for values, change in zip(moved, derivatives, strict=True):
            values[:, joint] -= scale * change
        parameters = signals.inertial_parameters
        torque = signals.robot.inverse_dynamics
        change = torque(*moved, parameters=parameters) - torque(
            signals.q, signals.dq, signals.ddq, parameters=parameters
        )
        return {j: change[:, [j]] / scale for j in range(signals.n_joints)}


class JointElasticity(_LinkSideEffect):
    """A gear that winds up under load, with the encoder on the motor side."""

    kind = "joint_elasticity"
    title = "Joint elasticity"
    formula = r"\tau(q - \tau_\mathrm{load}/K) - \tau(q)"
    coefficients = (Coefficient("compliance", "rad/(N m)", sign=1),)
    simplicity = 19
    rivals = ("time_delay", "rotor_inertia", "backlash", "base_tilt")
    separating_motion = "fast reversals with a heavy load, near the first resonance"
    reference = "Spong (1987), ASME JDSMC 109(4), 310-319."

    def displacement(self, signals: Signals, joint: int) -> Array:
        assert signals.load is not None
        return signals.load[:, joint]

    def parameters(
        self, coefficients: Array, shape: Mapping[str, Any], signals: Signals | None = None
    ) -> dict[str, Any]:
        compliance = float(coefficients[0])
        return {"K": 1.0 / compliance if abs(compliance) > 1e-12 else 1e12}

    def units(self, prismatic: bool = False) -> dict[str, str]:
        return {"K": "N/m" if prismatic else "N m/rad"}


class Backlash(_LinkSideEffect):
    """Play between motor and link: the link lies on the flank that the load presses on."""

    kind = "backlash"
    title = "Backlash"
    formula = r"\tau(q - \tfrac{g}{2}\,\mathrm{sign}\,\tau_\mathrm{load}) - \tau(q)"
    coefficients = (Coefficient("gap", "rad", sign=1),)
    simplicity = 23
    rivals = ("joint_elasticity", "dahl")
    separating_motion = "slow motion through poses in which the load changes sign"
    reference = "Nordin, Gutman (2002), Automatica 38(10), 1633-1649."

    def displacement(self, signals: Signals, joint: int) -> Array:
        assert signals.load is not None
        load = signals.load[:, joint]
        # The flank changes over a finite torque; 12 % of the usual load keeps it differentiable.
        return 0.5 * np.tanh(load / (0.12 * np.sqrt(np.mean(load**2)) + 1e-9))
