# SPDX-License-Identifier: BSD-3-Clause
"""What lies between motor and link: the logged position is the motor's."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
from scipy.signal import bilinear, lfilter, lfilter_zi, savgol_filter

from skidyn._signals import Signals
from skidyn.effects._base import Array, Coefficient, Effect, Shape

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


def _oscillator(load: Array, signals: Signals, resonance: float, damping: float) -> Array:
    """Wind-up of a spring-mass under a load, times the stiffness.

    The link swings on its spring: far below the resonance the wind-up follows the load, near it the
    wind-up is larger and late.

    Parameters
    ----------
    load : ndarray of shape (n_samples,), N m or N
        Torque of the rigid body if nothing gave way.
    signals : Signals
        For its segments and clock.
    resonance : float, Hz
        With the motor held.
    damping : float
        Damping ratio.

    Returns
    -------
    ndarray of shape (n_samples,), N m or N
    """
    omega = 2 * np.pi * resonance
    wind_up = np.zeros_like(load)
    for rows in signals.segments:
        if rows.stop - rows.start < 7:
            continue
        rate = 1.0 / float(np.median(np.diff(signals.clock[rows])))
        # The swing of a link faster than the sampling cannot be seen; it follows at once.
        w = min(omega, rate)
        b, a = bilinear([1.0], [1 / w**2, 2 * damping / w, 1.0], rate)
        start = lfilter_zi(b, a) * load[rows.start]
        wind_up[rows] = lfilter(b, a, load[rows], zi=start)[0]
    return wind_up


class _LinkSideEffect(Effect):
    """The link is displaced from the logged position by ``-c s(load)``.

    To first order the torque of all joints changes by the directional derivative of inverse
    dynamics along that displacement, which is what the columns hold.
    """

    needs = ("robot", "load", "time")
    #: Displacement used for the finite difference, rad or m.
    _step: ClassVar[float] = 1e-3

    def displacement(self, signals: Signals, joint: int, **shape: Any) -> Array:
        """Displacement of the link for a unit coefficient, shape (n_samples,)."""
        raise NotImplementedError

    def torque_columns(
        self, signals: Signals, joints: Sequence[int], **shape: Any
    ) -> dict[int, Array]:
        assert signals.robot is not None
        (joint,) = joints
        derivatives = _smooth_derivatives(self.displacement(signals, joint, **shape), signals)
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
    drawn_against = "load"
    title = "Joint elasticity"
    formula = r"\tau(q - \tau_\mathrm{load}/K) - \tau(q)"
    coefficients = (Coefficient("compliance", "rad/(N m)", sign=1),)
    shapes = (
        Shape("resonance", "Hz", (25.0, 10.0, 6.5, 4.5, 3.2), 1.0, 100.0, scales=False),
        Shape("damping", "1", (0.05,), 0.005, 1.0, scales=False),
    )
    simplicity = 19
    rivals = ("time_delay", "rotor_inertia", "backlash", "base_tilt")
    separating_motion = "fast reversals with a heavy load, near the first resonance"
    reference = "Spong (1987), ASME JDSMC 109(4), 310-319."

    def displacement(self, signals: Signals, joint: int, **shape: Any) -> Array:
        assert signals.load is not None
        return _oscillator(signals.load[:, joint], signals, **shape)

    def parameters(
        self, coefficients: Array, shape: Mapping[str, Any], signals: Signals | None = None
    ) -> dict[str, Any]:
        compliance = float(coefficients[0])
        return {"K": 1.0 / compliance if abs(compliance) > 1e-12 else 1e12, **shape}

    def units(self, prismatic: bool = False) -> dict[str, str]:
        return {"K": "N/m" if prismatic else "N m/rad", "resonance": "Hz", "damping": "1"}


class Backlash(_LinkSideEffect):
    """Play between motor and link: the link lies on the flank that the load presses on."""

    kind = "backlash"
    drawn_against = "load"
    title = "Backlash"
    formula = r"\tau(q - \tfrac{g}{2}\,\mathrm{sign}\,\tau_\mathrm{load}) - \tau(q)"
    coefficients = (Coefficient("gap", "rad", sign=1),)
    simplicity = 23
    rivals = ("joint_elasticity", "dahl")
    separating_motion = "slow motion through poses in which the load changes sign"
    reference = "Nordin, Gutman (2002), Automatica 38(10), 1633-1649."

    def displacement(self, signals: Signals, joint: int, **shape: Any) -> Array:
        assert signals.load is not None
        load = signals.load[:, joint]
        # The flank changes over a finite torque; 12 % of the usual load keeps it differentiable.
        return 0.5 * np.tanh(load / (0.12 * np.sqrt(np.mean(load**2)) + 1e-9))
