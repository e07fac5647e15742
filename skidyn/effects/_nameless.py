# SPDX-License-Identifier: BSD-3-Clause
"""Unknown functions of signals of a joint and another, used if no known effect fits.

They are ordinary terms, so a model with one is fitted, used for prediction and stored as usual.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from skidyn._signals import Array, Signals
from skidyn.effects._base import Effect
from skidyn.effects._parameters import Coefficient
from skidyn.effects._smooth import range_of, splines


def unnamed_coefficients(count: int) -> tuple[Coefficient, ...]:
    return tuple(Coefficient(f"c{i + 1}", "N m") for i in range(count))


class NamelessEffect(Effect):
    """A smooth function of the signals in :attr:`depends_on`."""

    nameless = True
    softness = 1e-5
    #: Whether its signals are combined to one number, such as a sum or the distance since a
    #: reversal, so that none of them can be tested alone.
    is_of_one_number: ClassVar[bool] = False
    #: Signals it depends on: ``own`` joint, the ``other`` joint or time.
    depends_on: ClassVar[tuple[str, ...]] = ()

    def words(self, shape: Mapping[str, Any]) -> str:
        """Title for some shape, if the names of the signals are not sufficient.

        Parameters
        ----------
        shape : mapping
            Shape parameters.
        """
        return ""

    def variables(self, joint: int, shape: dict[str, Any]) -> tuple[str, ...]:
        """Names of the signals, joints counted from 1.

        Parameters
        ----------
        joint : int
            Joint on which it acts, from 0.
        shape : dict
            Shape parameters of the term.
        """
        other = int(shape.get("other", joint))
        names = []
        for name in self.depends_on:
            signal, _, of = name.partition("_")
            names.append(signal if not of else f"{signal}{(joint if of == 'own' else other) + 1}")
        return tuple(dict.fromkeys(names))

    def denies(self, effect: Effect, shape: Mapping[str, Any]) -> bool:
        """Whether a finding with some shape cannot be a known effect.

        Parameters
        ----------
        effect : Effect
            Known effect on the same joints.
        shape : mapping
            Shape parameters of the finding.

        Returns
        -------
        bool
            False by default.
        """
        return False

    def others(self, signals: Signals, joint: int) -> list[dict[str, Any]]:
        """Grid over the other joints."""
        return [{"other": k} for k in range(signals.n_joints) if k != joint]


class _Spline(NamelessEffect):
    softness = 2e-3
    signal: ClassVar[str] = "q"
    n_splines: ClassVar[int] = 10

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        low, high = range_of(signals, f"{self.signal}{joints[0] + 1}")
        return [{"low": low, "high": high}] if high > low else []

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        x = getattr(signals, self.signal)[:, joint]
        return splines(x, shape["low"], shape["high"], self.n_splines)


class FunctionOfPosition(_Spline):
    """A smooth function of the joint's own position."""

    kind = "function_of_position"
    title = "Function of position"
    formula = r"f(q_j)"
    coefficients = unnamed_coefficients(30)
    depends_on = ("q_own",)
    signal, n_splines = "q", 30


class FunctionOfVelocity(_Spline):
    """A smooth function of the joint's own velocity."""

    kind = "function_of_velocity"
    drawn_against = "dq"
    title = "Function of velocity"
    formula = r"f(\dot q_j)"
    coefficients = unnamed_coefficients(24)
    depends_on = ("dq_own",)
    signal, n_splines = "dq", 24


def _sliding(signals: Signals, joint: int, prefix: str = "") -> dict[str, float]:
    """Middle and length in m of the range of a slider; nothing for a joint that turns."""
    if not signals.prismatic[joint]:
        return {}
    low, high = range_of(signals, f"q{joint + 1}")
    return {f"{prefix}middle": (low + high) / 2, f"{prefix}span": high - low} if high > low else {}


def _angle(signals: Signals, joint: int, shape: Mapping[str, Any], prefix: str = "") -> Array:
    """Position in rad, (n_samples,); a slider moves over its range in half a turn.

    Few harmonics represent a smooth function of an angle. In a fixed unit of length, a slider with
    a long way would turn round many times.
    """
    middle, span = shape.get(f"{prefix}middle", 0.0), shape.get(f"{prefix}span")
    unit = float(signals.unit[joint]) if span is None else span / np.pi
    return np.asarray((signals.q[:, joint] - middle) / unit)


class _OverMotion(NamelessEffect):
    """A function of few coefficients of the signals of a joint, or of it and each other joint."""

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        own = _sliding(signals, joints[0]) if "q_own" in self.depends_on else {}
        if not any(signal.endswith("_other") for signal in self.depends_on):
            return [dict(own)]
        shapes = [own | shape for shape in self.others(signals, joints[0])]
        if "q_other" not in self.depends_on:
            return shapes
        return [shape | _sliding(signals, shape["other"], "other_") for shape in shapes]


class FrictionOverPosition(_OverMotion):
    """Friction that varies with the joint's own position."""

    kind = "friction_over_position"
    drawn_against = "q"
    title = "Friction that varies with position"
    formula = r"f(q_j)\,\dot q_j + g(q_j)\,\mathrm{sign}\,\dot q_j"
    coefficients = unnamed_coefficients(6)
    depends_on = ("q_own", "dq_own")

    #: A joint that turns needs no range of its motion.
    has_shape = False

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        x = _angle(signals, joint, shape)
        dq, sign = signals.dq[:, joint], signals.sign[:, joint]
        waves = [np.cos(x), np.sin(x), np.cos(2 * x), np.sin(2 * x)]
        return np.column_stack([*(w * dq for w in waves), *(w * sign for w in waves[:2])])


class FrictionOverAcceleration(NamelessEffect):
    """Friction that grows with the size of the joint's own acceleration, as by loads of inertia."""

    kind = "friction_over_acceleration"
    drawn_against = "dq"
    title = "Friction that follows the acceleration"
    formula = r"f(|\ddot q_j|)\,\mathrm{sign}\,\dot q_j"
    coefficients = unnamed_coefficients(2)
    depends_on = ("dq_own", "ddq_own")

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        size = float(np.sqrt(np.mean(signals.ddq[:, joints[0]] ** 2)))
        return [{"size": size}] if size > 0 else []

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        x = np.abs(signals.ddq[:, joint]) / shape["size"]
        return np.column_stack([x, x**2]) * signals.sign[:, [joint]]


class FunctionOfPositionAndVelocity(_Spline):
    """A torque that depends on the joint's own position and velocity, in low orders.

    Unlike friction, it may act in one direction, as a push that occurs only during motion.
    """

    kind = "function_of_position_and_velocity"
    drawn_against = "dq"
    title = "Function of position and velocity"
    formula = r"f(q_j, \dot q_j)"
    coefficients = unnamed_coefficients(9)
    depends_on = ("q_own", "dq_own")
    softness = 1e-5

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        low, high = shape["low"], shape["high"]
        x = np.clip((2 * signals.q[:, joint] - low - high) / (high - low), -1.0, 1.0)
        orders = np.column_stack([np.ones_like(x), x, x**2])
        dq = signals.dq[:, joint]
        motion = (dq, signals.sign[:, joint], np.abs(dq))
        return np.hstack([orders * m[:, None] for m in motion])


class FunctionOfTwoPositions(_OverMotion):
    """A smooth torque that depends on two positions: a cable, a hose, a closed chain."""

    kind = "function_of_two_positions"
    title = "Function of two positions"
    formula = r"f(q_j, q_k)"
    coefficients = unnamed_coefficients(7)
    depends_on = ("q_own", "q_other")

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        x = _angle(signals, joint, shape)
        y = _angle(signals, int(shape["other"]), shape, "other_")
        return np.column_stack(
            [
                np.cos(x - y),
                np.sin(x - y),
                np.cos(x + y),
                np.sin(x + y),
                np.sin(y),
                np.cos(y),
                np.ones_like(x),
            ]
        )


class FrictionOverOtherPosition(_OverMotion):
    """Friction of one joint that varies with the position of another."""

    kind = "friction_over_other_position"
    drawn_against = "dq"
    title = "Friction that varies with another joint's position"
    formula = r"f(q_k)\,\mathrm{sign}\,\dot q_j + g(q_k)\,\dot q_j"
    coefficients = unnamed_coefficients(4)
    depends_on = ("dq_own", "q_other")

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        y = _angle(signals, int(shape["other"]), shape, "other_")
        motion = (signals.sign[:, joint], signals.dq[:, joint])
        return np.column_stack([wave * m for m in motion for wave in (np.cos(y), np.sin(y))])


class FunctionOfTwoVelocities(_OverMotion):
    """Drag of one joint that depends on the velocity of another."""

    kind = "function_of_two_velocities"
    drawn_against = "dq"
    title = "Function of two velocities"
    formula = r"f(\dot q_j, \dot q_k)"
    coefficients = unnamed_coefficients(7)
    depends_on = ("dq_own", "dq_other")

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        k = int(shape["other"])
        dq, sign = signals.dq[:, joint], signals.sign[:, joint]
        other, other_sign = signals.dq[:, k], signals.sign[:, k]
        return np.column_stack(
            [
                dq * np.abs(other),
                np.abs(dq) * other,
                sign * np.abs(other),
                np.abs(dq) * other_sign,
                other,
                other_sign,
                other * np.abs(other),
            ]
        )


NAMELESS: tuple[type[NamelessEffect], ...] = (
    FunctionOfPosition,
    FunctionOfVelocity,
    FrictionOverPosition,
    FrictionOverAcceleration,
    FunctionOfPositionAndVelocity,
    FunctionOfTwoPositions,
    FrictionOverOtherPosition,
    FunctionOfTwoVelocities,
)
