# SPDX-License-Identifier: BSD-3-Clause
"""Friction of servos that grows with the torques on both sides of their gears, as in BAM's models.

Unlike :class:`~skidyn.effects._load.LoadDependentFriction`, it depends on the torque of the motor,
which contains the friction itself.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from skidyn._signals import Array, Signals
from skidyn.effects._base import Effect
from skidyn.effects._parameters import Coefficient, Shape

#: Steps of the solution for the motor's torque. One is exact where friction is linear in it.
_STEPS = 3

_STRIBECK = (
    Shape("vs", "rad/s", (0.05, 0.2, 0.8, 2.0), 0.01, 20.0),
    Shape("alpha", "1", (1.5,), 0.4, 10.0, scales=False),
)
_SHARES = (
    Shape("outside", "1", (0.2, 0.5, 0.8), 0.0, 1.0, spacing="linear", scales=False),
    Shape("slow_outside", "1", (0.5,), 0.0, 1.0, spacing="linear", scales=False),
)


class MotorLoadFriction(Effect):
    r"""Friction proportional to the torque between motor and load, as in BAM's model m3.

    The torque :math:`\tau_m` of the motor is that of bodies, rotor and all friction, including this
    one; the external torque :math:`\tau_e` is that of gravity, velocity and loads on the joint,
    which at rest without friction is minus that of the motor. A model is fitted in turn with the
    motor torque of its previous fit, and a prediction solves for it. The motor's torque contains
    viscous, Coulomb and Stribeck friction, but not other effects that depend on the load.
    """

    kind = "motor_load_friction"
    drawn_against = "load"
    title = "Friction of a loaded servo"
    formula = r"K\,|\tau_m - \tau_e|\,\mathrm{sign}(\dot q)"
    coefficients: ClassVar[tuple[Coefficient, ...]] = (Coefficient("K", "1", sign=1, limit=1.0),)
    needs = ("load", "motor_torque", "robot")
    automatic = False
    simplicity = 30
    rivals: ClassVar[tuple[str, ...]] = ("load_dependent_friction", "coulomb", "torque_gain")
    separating_motion = "the same sweeps with loads that drive the joint and loads that it lifts"
    reference = (
        "Duclusaud, Passault, Padois, Ly (2024), Extended friction models for the physics "
        "simulation of servo actuators."
    )

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        assert signals.model_torque is not None
        motor = signals.model_torque[:, joint]
        return self._columns_at(motor, self._external(signals, joint), signals, joint, shape)

    def motor_torque(
        self, signals: Signals, joint: int, coefficients: Array, shape: Mapping[str, Any]
    ) -> Array:
        """Torque of the motor, with the friction that it causes itself.

        Parameters
        ----------
        signals : Signals
            Motion, with the torque of all other parts of the model as its ``model_torque``.
        joint : int
            Place of the joint in arrays.
        coefficients : ndarray of shape (n_coefficients,)
            Coefficients of this effect.
        shape : mapping
            Shape parameters.

        Returns
        -------
        ndarray of shape (n_samples,)
            N m or N.
        """
        assert signals.model_torque is not None
        motor = others = signals.model_torque[:, joint]
        external = self._external(signals, joint)

        def missing(torque: Array) -> Array:
            columns = self._columns_at(torque, external, signals, joint, shape)
            return np.asanyarray(others + columns @ coefficients - torque)

        # Steffensen's method, which needs no comparison and is therefore exported like a formula.
        for _ in range(_STEPS):
            first = missing(motor)
            second = missing(motor + first)
            motor = motor + first**3 / ((first - second) * first + 1e-30)
        return motor

    def _columns_at(
        self, motor: Array, external: Array, signals: Signals, joint: int, shape: Mapping[str, Any]
    ) -> Array:
        """Columns at given torques of the motor and from outside."""
        sign = signals.sign[:, joint]
        sizes = self._sizes(motor, external, signals, joint, shape)
        return np.asanyarray(np.concatenate([(size * sign)[:, None] for size in sizes], axis=1))

    def _sizes(
        self, motor: Array, external: Array, signals: Signals, joint: int, shape: Mapping[str, Any]
    ) -> list[Array]:
        """The columns without the direction of motion."""
        return [np.abs(motor - external)]

    def _external(self, signals: Signals, joint: int) -> Array:
        """External torque: minus that of the load without the inertial torque of the bodies."""
        assert signals.load is not None
        if signals.robot is None:
            return np.asanyarray(-signals.load[:, joint])
        # the symbolic robot of a simulation has no inertial_torque
        inertial = signals.robot.inverse_dynamics(
            signals.q,
            0.0 * signals.dq,
            signals.ddq,
            parameters=signals.inertial_parameters,
            gravity=(0.0, 0.0, 0.0),
        )
        return np.asanyarray(inertial[:, joint] - signals.load[:, joint])

    def travel(self, signals: Signals, joints: Sequence[int], shape: Mapping[str, Any]) -> float:
        return 1.0


class StribeckLoadFriction(MotorLoadFriction):
    r"""The same with a part that fades with the speed, and Stribeck friction, as in BAM's m4.

    The coefficient of the load is :math:`K + \Delta K` at rest and :math:`K` at speed. Stribeck
    friction of the same velocity and exponent is part of it, so that a model needs no separate
    ``stribeck``.
    """

    kind = "stribeck_load_friction"
    title = "Friction of a loaded servo that falls with the speed"
    formula = (
        r"\bigl[(K + e\,\Delta K)\,|\tau_m - \tau_e| + e\,\Delta F\bigr]\mathrm{sign}(\dot q),"
        r"\quad e = e^{-(|\dot q|/v_s)^\alpha}"
    )
    coefficients: ClassVar[tuple[Coefficient, ...]] = (
        Coefficient("dF", "N m", sign=1),
        Coefficient("K", "1", sign=1, limit=1.0),
        Coefficient("dK", "1", sign=1, limit=1.0),
    )
    shapes = _STRIBECK
    simplicity = 31
    rivals = ("motor_load_friction", "load_dependent_friction", "stribeck")

    def _sizes(
        self, motor: Array, external: Array, signals: Signals, joint: int, shape: Mapping[str, Any]
    ) -> list[Array]:
        fade, load = _fade(signals, joint, shape), np.abs(motor - external)
        return [fade, load, fade * load]


class DirectionalLoadFriction(MotorLoadFriction):
    r"""The same with different coefficients of motor and external torque, as in BAM's m5.

    Their sums are the coefficients :math:`K` and :math:`\Delta K`, of which the shape parameters
    ``outside`` :math:`w` and ``slow_outside`` :math:`w_s` are the shares of the external torque.
    """

    kind = "directional_load_friction"
    title = "Friction of a servo by motor and external torque"
    formula = (
        r"\bigl[K\,|(1-w)\tau_m - w\tau_e| + e\,\Delta K\,|(1-w_s)\tau_m - w_s\tau_e|"
        r" + e\,\Delta F\bigr]\mathrm{sign}(\dot q)"
    )
    coefficients: ClassVar[tuple[Coefficient, ...]] = (
        Coefficient("dF", "N m", sign=1),
        Coefficient("K", "1", sign=1, limit=2.0),
        Coefficient("dK", "1", sign=1, limit=2.0),
    )
    shapes = (*_SHARES, *_STRIBECK)
    simplicity = 32
    rivals = ("stribeck_load_friction", "load_dependent_friction", "stribeck")

    def _sizes(
        self, motor: Array, external: Array, signals: Signals, joint: int, shape: Mapping[str, Any]
    ) -> list[Array]:
        fade = _fade(signals, joint, shape)
        load, slow = (
            np.abs((1.0 - shape[share.name]) * motor - shape[share.name] * external)
            for share in _SHARES
        )
        return [fade, load, fade * slow]


class QuadraticLoadFriction(DirectionalLoadFriction):
    r"""The same with a part that is quadratic in the smaller torque, as in BAM's m6.

    It acts where motor and external torque have opposite signs, and fades with the speed:
    :math:`Q_e \tau_e^2` where the motor's torque is the larger one, :math:`Q_m \tau_m^2` elsewhere.
    """

    kind = "quadratic_load_friction"
    title = "Friction of a servo, quadratic in the smaller torque"
    formula = (
        r"\bigl[K\,|(1-w)\tau_m - w\tau_e| + e\,(\Delta K\,|(1-w_s)\tau_m - w_s\tau_e|"
        r" + \Delta F + Q)\bigr]\mathrm{sign}(\dot q),\quad Q = Q_e\tau_e^2\ \text{or}\ Q_m\tau_m^2"
    )
    coefficients: ClassVar[tuple[Coefficient, ...]] = (
        *DirectionalLoadFriction.coefficients,
        Coefficient("Qm", "1/(N m)", sign=1),
        Coefficient("Qe", "1/(N m)", sign=1),
    )
    simplicity = 33
    rivals = ("directional_load_friction", "load_dependent_friction", "stribeck")

    def _sizes(
        self, motor: Array, external: Array, signals: Signals, joint: int, shape: Mapping[str, Any]
    ) -> list[Array]:
        sizes = super()._sizes(motor, external, signals, joint, shape)
        apart = sizes[0] * (1.0 - np.sign(motor) * np.sign(external)) / 2.0
        drives = (1.0 + np.sign(np.abs(motor) - np.abs(external))) / 2.0
        return [*sizes, apart * (1.0 - drives) * motor**2, apart * drives * external**2]


def _fade(signals: Signals, joint: int, shape: Mapping[str, Any]) -> Array:
    speed = np.abs(signals.dq[:, joint]) / shape["vs"]
    return np.asanyarray(np.exp(-(speed ** shape["alpha"])))


MOTOR_LOAD: tuple[type[MotorLoadFriction], ...] = (
    MotorLoadFriction,
    StribeckLoadFriction,
    DirectionalLoadFriction,
    QuadraticLoadFriction,
)
