# SPDX-License-Identifier: BSD-3-Clause
"""Friction and offsets that depend on a temperature, or on time if none is logged."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from skidyn._signals import Array, Signals
from skidyn.effects._base import Effect
from skidyn.effects._moments import moments, starts
from skidyn.effects._parameters import Coefficient, Shape

#: Temperature at which the derivatives are stated, in degrees Celsius.
REFERENCE_TEMPERATURE = 30.0
_BITTENCOURT = "Bittencourt, Wernholt, Sander-Tavallaey, Brogardh (2010), IROS, 4548-4554."
#: Number of moments, spread over a log, from which friction may have changed.
_CHANGES = 16
#: Share of the recording before the last one in which a change that lasts is to be seen.
_SHOWN = 0.02
#: Least share of a log on either side of a temperature at which a slope changes.
_LEAST_SIDE = 0.05
#: Ratio of the two time constants of a warm-up.
_FASTER = 4.0


def _warmth(signals: Signals, joint: int, shape: Mapping[str, Any]) -> Array:
    """Temperature above the reference in K; a saturating function has its slope there."""
    assert signals.temperature is not None
    warm: Array = signals.temperature[:, joint] - REFERENCE_TEMPERATURE
    if "levels_over" not in shape:
        return warm
    over = shape["levels_over"]
    return np.asarray(-over * np.expm1(-warm / over))


def _lasts(signals: Signals, since: float) -> bool:
    """Whether two recordings or more show a change, after one that shows the state before it.

    A single one may differ for many reasons.
    """
    clock, begun = signals.clock, starts(signals)
    if not len(begun):
        return False
    last = clock[clock < begun[-1]].max()
    length = last - max(begun[-2:-1], default=clock.min())
    return bool(clock.min() < since < last - _SHOWN * length)


def _risen(times: Array) -> Array:
    """Share of a warm-up after some time constants; before its start it goes on as it began."""
    return np.where(times > 0, -np.expm1(-np.maximum(times, 0.0)), times)


class _OverTemperature(Effect):
    """An effect that changes with a logged temperature.

    It changes linearly, with ``curved`` in its shape quadratically, or it levels off exponentially.
    """

    drawn_against = "temperature"
    needs = ("temperature",)
    shapes: ClassVar[tuple[Shape, ...]] = (
        Shape("levels_over", "K", (), 1.5, 60.0, scales=False, has_interval=False),
    )
    forms: ClassVar[tuple[Mapping[str, float], ...]] = (
        {"levels_over": 6.0},
        {"levels_over": 15.0},
        {"curved": 1.0},
    )
    reference = _BITTENCOURT

    def coefficients_of(self, shape: Mapping[str, Any]) -> tuple[Coefficient, ...]:
        # A parabola is undetermined beyond the temperatures of the data, a line is not.
        curved = "curved" in shape
        return tuple(c for c in self.coefficients if curved or not c.name.startswith("d2"))

    def not_shown(self, signals: Signals, joint: int) -> str | None:
        constant = None
        if signals.temperature is not None and np.ptp(signals.temperature[:, joint]) < 0.5:
            constant = f"the temperature of joint {joint + 1} changes by less than 0.5 degrees"
        return super().not_shown(signals, joint) or constant


class TemperatureFriction(_OverTemperature):
    """Viscous and Coulomb friction that change with a logged temperature.

    As with grease, it may level off exponentially over a range ``levels_over`` in K (Bittencourt,
    Axelsson 2014, IEEE/ASME TMECH 19(5)).
    """

    kind = "temperature_friction"
    title = "Temperature-dependent friction"
    formula = r"\left(\tfrac{dF_v}{dT}\dot q + \tfrac{dF_c}{dT}\mathrm{sign}\,\dot q\right)(T-T_0)"
    coefficients = (
        Coefficient("dFv_dT", "N m s/(rad K)"),
        Coefficient("dFc_dT", "N m/K"),
        Coefficient("d2Fv_dT2", "N m s/(rad K^2)"),
    )
    simplicity = 14
    rivals = ("friction_drift", "temperature_offset")
    separating_motion = "the same sweep on the cold and on the warm robot"

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        warm, dq = _warmth(signals, joint, shape), signals.dq[:, joint]
        further = [warm**2 * dq] if "curved" in shape else []
        return np.column_stack([warm * dq, warm * signals.sign[:, joint], *further])


class TemperatureOffset(_OverTemperature):
    """Torque offset that changes with a logged temperature, and may level off exponentially.

    With ``knee`` in its shape, it has another slope from that temperature on, in degrees Celsius,
    or even turns back, as of a strain gauge with imperfect compensation.
    """

    kind = "temperature_offset"
    title = "Temperature-dependent offset"
    formula = r"\tfrac{d\tau}{dT}\,(T - T_0) + \tau_0"
    coefficients = (
        Coefficient("dtau_dT", "N m/K"),
        Coefficient("d2tau_dT2", "N m/K^2"),
        Coefficient("dtau_dT_change", "N m/K"),
        Coefficient("tau0", "N m", is_zero=True),
    )
    shapes = (
        *_OverTemperature.shapes,
        Shape("knee", "K", (), -np.inf, np.inf, spacing="linear", scales=False),
    )
    forms = (*_OverTemperature.forms, *({"knee": share} for share in (0.25, 0.5, 0.75)))
    simplicity = 13
    rivals = ("offset", "temperature_friction")
    separating_motion = "one pose held or one sweep repeated while the robot warms up"

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        warm = _warmth(signals, joint, shape)
        further = [warm**2] if "curved" in shape else []
        if "knee" in shape:
            further = [np.maximum(warm + REFERENCE_TEMPERATURE - shape["knee"], 0.0)]
        return np.column_stack([warm, *further, np.ones(signals.n_samples)])

    def coefficients_of(self, shape: Mapping[str, Any]) -> tuple[Coefficient, ...]:
        own = super().coefficients_of(shape)
        return tuple(c for c in own if "knee" in shape or c.name != "dtau_dT_change")

    def _plain_and_forms(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        forms = super()._plain_and_forms(signals, joints)
        if signals.temperature is None:
            return forms
        own = signals.temperature[:, joints[0]]
        low, span = float(own.min()), float(np.ptp(own))
        return [f | {"knee": low + span * f["knee"]} if "knee" in f else f for f in forms]

    def admissible(self, signals: Signals, joints: Sequence[int], shape: Mapping[str, Any]) -> bool:
        if "knee" not in shape or signals.temperature is None:
            return super().admissible(signals, joints, shape)
        above = float(np.mean(signals.temperature[:, joints[0]] > shape["knee"]))
        return _LEAST_SIDE < above < 1 - _LEAST_SIDE


class FrictionDrift(Effect):
    """Friction that changes slowly over the log if no temperature is logged.

    A gear warms up quickly at first and then ever more slowly: a warm-up approaches its end with a
    time constant, and with ``two_rates`` in its shape also four times as fast, as if the inside of
    the gear were warm before its housing. The first two coefficients are the change from the start
    of the log to its end. Friction that changed at once, as after a repair or when a seal slips,
    has in its shape the time ``since`` which it has changed, or ``level`` if it has another level
    in some recordings.
    """

    kind = "friction_drift"
    drawn_against = "time"
    title = "Friction drift"
    formula = (
        r"(a\,\dot q + b\,\mathrm{sign}\,\dot q)\,x"
        r" + (c\,\dot q + d\,\mathrm{sign}\,\dot q)\,(y-x),"
        r"\quad x = \frac{1-e^{-(t-t_0)/T}}{1-e^{-s/T}},"
        r"\ y = \frac{1-e^{-4(t-t_0)/T}}{1-e^{-4s/T}}"
    )
    coefficients = (
        Coefficient("dFv", "N m s/rad"),
        Coefficient("dFc", "N m"),
        Coefficient("d2Fv", "N m s/rad"),
        Coefficient("d2Fc", "N m"),
    )
    shapes = (
        Shape("time_constant", "s", (0.2, 0.6, 3.0), 1.0, 1e6, scales=False, has_interval=False),
        Shape(
            "since", "s", (), -np.inf, np.inf, spacing="samples", scales=False, has_interval=False
        ),
    )
    forms = ({"since": 0.0}, {"two_rates": 1.0})
    needs = ("time",)
    simplicity = 31
    rivals = ("temperature_friction",)
    separating_motion = "the same sweep at the start and at the end of the session"
    reference = _BITTENCOURT

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        # The start and the span belong to the log; they are kept with the term so that another log
        # is predicted on the same time axis.
        clock = signals.clock
        span = max(float(np.ptp(clock)), 1e-9)
        shape = self.shapes[0]  # its grid: shares of the span
        constants = np.clip(span * np.array(shape.grid), shape.low, shape.high)
        start = float(clock.min())
        gradual = [{"time_constant": float(c), "t0": start, "span": span} for c in constants]
        gradual += [{**warm_up, "two_rates": 1.0} for warm_up in gradual]
        return gradual + [{"since": t} for t in moments(signals, _CHANGES) if _lasts(signals, t)]

    def admissible(self, signals: Signals, joints: Sequence[int], shape: Mapping[str, Any]) -> bool:
        return "since" not in shape or _lasts(signals, shape["since"])

    def simplicity_of(self, shape: Mapping[str, Any]) -> int:
        # Another level of the friction that the model has: no other formula in some recordings is
        # simpler.
        return 0 if "level" in shape else self.simplicity

    def coefficients_of(self, shape: Mapping[str, Any]) -> tuple[Coefficient, ...]:
        return self.coefficients if "two_rates" in shape else self.coefficients[:2]

    def meaning(self, parameters: Mapping[str, Mapping[str, Any]]) -> str:
        if "since" not in parameters:
            return ""
        return f"The friction changed at once, at {parameters['since']['value']:.6g} s."

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        dq = signals.dq[:, joint]
        sign = signals.sign[:, joint]
        if "level" in shape:
            return np.column_stack([dq, sign])
        if "since" in shape:
            later = (signals.clock >= shape["since"]).astype(float)
            return np.column_stack([later * dq, later * sign])
        since, span, slow = signals.clock - shape["t0"], shape["span"], shape["time_constant"]
        x, y = (_risen(since / t) / _risen(span / t) for t in (slow, slow / _FASTER))
        further = [(y - x) * dq, (y - x) * sign] if "two_rates" in shape else []
        return np.column_stack([x * dq, x * sign, *further])

    def not_shown(self, signals: Signals, joint: int) -> str | None:
        if signals.temperature is not None:
            return "a temperature is logged, which predicts friction better than time"
        return super().not_shown(signals, joint)
