# SPDX-License-Identifier: BSD-3-Clause
"""Friction that depends on the joint's own velocity."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from skidyn._signals import Array, Signals
from skidyn.effects._base import Effect
from skidyn.effects._parameters import Coefficient, Shape

_ARMSTRONG = "Armstrong-Helouvry, Dupont, Canudas de Wit (1994), Automatica 30(7), 1083-1138."


class Viscous(Effect):
    """Friction proportional to velocity."""

    kind = "viscous"
    by_recording = True
    drawn_against = "dq"
    title = "Viscous friction"
    formula = r"F_v\,\dot q"
    coefficients = (Coefficient("Fv", "N m s/rad", sign=1),)
    is_exact = True
    simplicity = 1
    rivals = ("nonlinear_viscous", "asymmetric_friction", "coulomb")
    separating_motion = "sweeps at several constant speeds in both directions"
    reference = _ARMSTRONG

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        return signals.dq[:, [joint]]


class Coulomb(Effect):
    """Dry friction of constant size against the motion.

    With ``rounding`` in its shape, in rad/s or m/s, it does not change sign at once, but as the
    hyperbolic tangent of the velocity divided by this value; with ``arctangent``, as its arctangent
    divided by a right angle, which approaches the full size more slowly.
    """

    kind = "coulomb"
    by_recording = True
    drawn_against = "dq"
    title = "Coulomb friction"
    formula = r"F_c\,\mathrm{sign}(\dot q)"
    coefficients = (Coefficient("Fc", "N m", sign=1),)
    shapes = (Shape("rounding", "rad/s", (), 1e-3, 1.0, has_interval=False),)
    forms = ({"rounding": 0.05}, {"rounding": 0.05, "arctangent": 1.0})
    is_exact = True
    simplicity = 2
    rivals = ("stribeck", "dahl", "nonlinear_viscous")
    separating_motion = "slow sweeps with reversals, below 0.1 rad/s"
    reference = _ARMSTRONG

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        if "rounding" in shape:
            speed = signals.dq[:, [joint]] / shape["rounding"]
            return np.asarray(
                np.arctan(speed) / (np.pi / 2) if "arctangent" in shape else np.tanh(speed)
            )
        return signals.sign[:, [joint]]


#: Largest Stribeck velocity, as a share of the speeds of the log: a wider hump may be any function
#: of the speed, beside viscous and dry friction.
LOW_SPEED = 0.3


def of_low_speed(
    shapes: Sequence[dict[str, Any]], signals: Signals, joint: int
) -> list[dict[str, Any]]:
    """Shapes with a Stribeck velocity ``vs`` that is low for a joint, or the first one."""
    slow = [shape for shape in shapes if is_of_low_speed(shape["vs"], signals, joint)]
    return slow or list(shapes[:1])


def is_of_low_speed(speed: float, signals: Signals, joint: int) -> bool:
    """Whether a velocity, rad/s or m/s, is small compared with those of a joint."""
    return speed <= LOW_SPEED * highest_speed(signals, joint)


def highest_speed(signals: Signals, joint: int) -> float:
    """Speed of a joint that is rarely exceeded, rad/s or m/s."""
    found: float = signals.once(
        ("highest speed", joint), lambda: float(np.quantile(np.abs(signals.dq[:, joint]), 0.99))
    )
    return found


class Stribeck(Effect):
    """Extra dry friction at low speed that fades as the lubricant film builds up.

    It fades exponentially, or with ``lorentzian`` in its shape as
    ``1 / (1 + (|dq| / vs)^delta)``.
    """

    kind = "stribeck"
    drawn_against = "dq"
    title = "Stribeck friction"
    formula = r"\Delta F\,e^{-(|\dot q|/v_s)^\delta}\,\mathrm{sign}(\dot q)"
    coefficients = (Coefficient("dF", "N m", sign=1),)
    shapes = (
        Shape("vs", "rad/s", (0.03, 0.05, 0.075, 0.11, 0.16, 0.25), 0.01, 1.0),
        Shape("delta", "1", (2.0,), 0.4, 4.0, scales=False),
    )
    forms = ({"lorentzian": 1.0},)
    simplicity = 8
    rivals = ("coulomb", "nonlinear_viscous", "lugre", "dahl")
    separating_motion = "constant-speed sweeps from 0.01 to 0.5 rad/s in both directions"
    reference = _ARMSTRONG

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        return of_low_speed(super().grid(signals, joints), signals, joints[0])

    def admissible(self, signals: Signals, joints: Sequence[int], shape: Mapping[str, Any]) -> bool:
        return is_of_low_speed(shape["vs"], signals, joints[0])

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        speed = np.abs(signals.dq[:, joint]) / shape["vs"]
        grown = speed ** shape["delta"]
        fading = 1 / (1 + grown) if "lorentzian" in shape else np.exp(-grown)
        friction: Array = fading * signals.sign[:, joint]
        return friction[:, None]


#: Range of the speed at which friction saturates, in units of the joint.
SATURATING = (0.02, 3.0)
#: Share of the highest speed beyond which friction is not seen to grow.
SEEN_BEYOND = 0.7
#: Distance from one of a power of the speed that is called viscous friction.
NEARLY_VISCOUS = 0.1


def saturated(speed: Array, at: float | None) -> Array:
    """A speed that grows up to a limit only, in the same unit; as it is without a limit.

    Parameters
    ----------
    speed : ndarray of shape (n_samples,), rad/s or m/s
        Not negative.
    at : float or None, rad/s or m/s
        Its limit.
    """
    return speed if at is None else at * -np.expm1(-speed / at)


class AsymmetricFriction(Effect):
    """The part of friction that differs between the directions of motion.

    It grows with the speed, or with another ``power`` of it (1 if the shape has none); speeds are
    in units of 1 rad/s or 1 m/s, so that the unit of the coefficient is the same. Or it grows up to
    a speed, ``saturating``, as ``v (1 - exp(-|dq| / v))``. With a ``side`` (1 or -1) it acts only
    in one direction of motion.
    """

    kind = "asymmetric_friction"
    drawn_against = "dq"
    title = "Direction-dependent friction"
    formula = r"\Delta F_v\,|\dot q|^p + \Delta F_c"
    coefficients = (
        Coefficient("dFv", "N m s/rad"),
        Coefficient("dFc", "N m", limit_kind="offset"),
    )
    shapes = (
        Shape("power", "1", (), 0.3, 3.0, scales=False),
        Shape("saturating", "rad/s", (), *SATURATING),
    )
    forms = (
        {"power": 2.0},
        {"power": 0.5},
        {"power": 2.0, "side": 1.0},
        {"power": 2.0, "side": -1.0},
        {"saturating": 0.3},
        {"saturating": 0.3, "side": 1.0},
        {"saturating": 0.3, "side": -1.0},
    )
    simplicity = 11
    rivals = ("offset", "viscous")
    separating_motion = "equal sweeps in both directions at two speeds or more"
    reference = "Janot, Gautier, Brunot (2019), Nonlinear System Identification Benchmarks (EMPS)."

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        dq, side = signals.dq[:, joint], shape.get("side")
        speed = np.abs(dq) if side is None else np.maximum(0.0, side * dq)
        speed = saturated(speed, shape.get("saturating"))
        return np.column_stack([speed ** shape.get("power", 1.0), np.ones(signals.n_samples)])


class NonlinearViscous(Effect):
    """Friction that grows with a power of velocity other than one.

    Or it grows up to a speed, ``saturating``, as ``v (1 - exp(-|dq| / v))`` and powers of it, like
    an arctangent or a hyperbolic tangent. It does not fall with the speed then, which would be
    Stribeck friction. Oil that a gear churns from a speed on is a power of the speed ``beyond`` it.
    """

    kind = "nonlinear_viscous"
    drawn_against = "dq"
    title = "Nonlinear viscous friction"
    formula = r"c\,|\dot q|^p\,\mathrm{sign}(\dot q)"
    coefficients = (Coefficient("c", "N m (s/rad)^p"),)
    shapes = (
        Shape("power", "1", (0.5, 2.0, 3.0), 0.1, 4.5, scales=False, limit_kind="coulomb"),
        Shape("saturating", "rad/s", (), *SATURATING, limit_kind="coulomb"),
        Shape("beyond", "rad/s", (), *SATURATING),
    )
    forms = ({"saturating": 0.2}, {"saturating": 0.6}, {"beyond": 0.3})
    simplicity = 9
    rivals = ("viscous", "stribeck", "coulomb")
    separating_motion = "sweeps that reach the highest speed the joint allows"
    reference = "Waiboer, Aarts, Jonker (2005), Multibody Dynamics, ECCOMAS."

    def coefficients_of(self, shape: Mapping[str, Any]) -> tuple[Coefficient, ...]:
        (plain,) = self.coefficients
        grows_only = not {"saturating", "beyond"}.isdisjoint(shape)
        return (replace(plain, sign=1),) if grows_only else (plain,)

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        tried = super().grid(signals, joints)
        from_a_speed_on = {"power": 2.0, "beyond": 0.3 * highest_speed(signals, joints[0])}
        tried = [s for s in tried if "beyond" not in s]
        tried = [s for s in tried if "saturating" not in s or s["power"] < 1.0]
        return [*tried, from_a_speed_on] if from_a_speed_on["beyond"] > 0 else tried

    def admissible(self, signals: Signals, joints: Sequence[int], shape: Mapping[str, Any]) -> bool:
        if "beyond" in shape:
            return bool(shape["beyond"] < SEEN_BEYOND * highest_speed(signals, joints[0]))
        viscous = "saturating" not in shape and abs(shape["power"] - 1.0) < NEARLY_VISCOUS
        return not viscous and super().admissible(signals, joints, shape)

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        speed = saturated(np.abs(signals.dq[:, joint]), shape.get("saturating"))
        speed = np.maximum(0.0, speed - shape.get("beyond", 0.0))
        friction: Array = speed ** shape["power"] * signals.sign[:, joint]
        return friction[:, None]
