# SPDX-License-Identifier: BSD-3-Clause
"""Nameless torques that follow history, another joint's load or the place of the tool."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.polynomial.legendre import legvander

from skidyn._signals import Array, Signals
from skidyn.effects._base import Shape
from skidyn.effects._hysteresis import cut_strokes, dahl_state, stop_state
from skidyn.effects._nameless import (
    NamelessEffect,
    splines,
    supported_range,
    unnamed_coefficients,
)
from skidyn.effects._tool import tool_jacobian, tool_position

#: Ways since the last reversal, rad or tenths of m, over which a torque may fade.
_WAYS = (0.01, 0.03, 0.1, 0.3)
#: Plays, as shares of the range of a position, and splines of a function of what lags.
_PLAYS, _LAGGING = (0.03, 0.06, 0.1, 0.15, 0.22), 16
#: Times since the start of a recording over which a torque may fade, as shares of its length.
_FADING = (0.05, 0.15, 0.5)


#: Places at which a force is tried, and its widths as shares of the reach of the motion.
_PLACES, _WIDTHS = 24, (0.08, 0.16, 0.3)


class FunctionOfTimeSinceStart(NamelessEffect):
    """A torque that fades or grows from the start of every recording."""

    kind = "function_of_time_since_start"
    drawn_against = "time"
    title = "Function of the time since the start of a recording"
    formula = r"f(t - t_\mathrm{start})"
    coefficients = unnamed_coefficients(len(_FADING) + 2)
    depends_on = ("time",)
    needs = ("time",)

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        return [{"length": float(np.max(_since_start(signals)))}]

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        share = _since_start(signals) / max(shape["length"], 1e-9)
        fading = [np.exp(-share / s) for s in _FADING]
        return np.column_stack([*fading, share, np.ones_like(share)])


class FrictionSinceReversal(NamelessEffect):
    """Friction that fades or grows with the way since the joint turned back."""

    is_of_one_number = True
    kind = "friction_since_reversal"
    title = "Friction that depends on the way since the last reversal"
    formula = r"f(|q - q_\mathrm{turn}|)\,\mathrm{sign}\,\dot q"
    coefficients = unnamed_coefficients(len(_WAYS))
    depends_on = ("q_own", "dq_own")

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        q, unit = signals.q[:, joint], signals.unit[joint]
        # A Dahl state falls short of its direction by just the exponential of the way since then.
        return np.column_stack(
            [signals.sign[:, joint] - dahl_state(q, signals.segments, way * unit) for way in _WAYS]
        )


class FunctionOfWaySinceReversal(NamelessEffect):
    """A torque that fades or grows with the way since the joint turned back."""

    is_of_one_number = True
    kind = "function_of_way_since_reversal"
    title = "Function of the way since the last reversal"
    formula = r"f(|q - q_\mathrm{turn}|)"
    coefficients = unnamed_coefficients(2 * len(_WAYS))
    depends_on = ("q_own", "dq_own")

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        strokes = cut_strokes(signals.q[:, joint], signals.segments)
        way = np.zeros(signals.n_samples)
        way[strokes.rows] = strokes.way / signals.unit[joint]
        fading = np.column_stack([np.exp(-way / w) for w in _WAYS])
        return np.hstack([fading, fading * signals.sign[:, [joint]]])


class FunctionOfLaggingPosition(NamelessEffect):
    """A torque that snaps over: a function of the position that lags behind by some play.

    Whatever switches at one angle on the way there and at another one on the way back, as a latch,
    a magnet or a hose that flips over, is a function of the output of a play [1]_.

    References
    ----------
    .. [1] A. Visintin (1994), Differential models of hysteresis, Springer, chapter III.
    """

    is_of_one_number = True
    kind = "function_of_lagging_position"
    title = "Function of the position with play"
    formula = r"f(\mathcal{P}_r[q])"
    coefficients = unnamed_coefficients(_LAGGING)
    depends_on = ("q_own",)
    softness = 2e-3

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        low, high = supported_range(signals, signals.q[:, joints[0]])
        return [{"play": share * (high - low), "low": low, "high": high} for share in _PLAYS]

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        q, play = signals.q[:, joint], shape["play"]
        lagging = q - play * stop_state(q, signals.segments, play)
        return splines(lagging, shape["low"], shape["high"], _LAGGING)


class FrictionOverOtherLoad(NamelessEffect):
    """Friction of one joint that grows with the load of another."""

    kind = "friction_over_other_load"
    drawn_against = "dq"
    title = "Friction that follows another joint's load"
    formula = r"f(|\tau_k|)\,\mathrm{sign}\,\dot q_j"
    coefficients = unnamed_coefficients(2)
    needs = ("load",)

    def variables(self, joint: int, shape: dict[str, Any]) -> tuple[str, ...]:
        return (f"load{int(shape['other']) + 1}", f"dq{joint + 1}")

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        if signals.load is None:
            return []
        size = np.sqrt(np.mean(signals.load**2, axis=0))
        return [s | {"size": float(size[s["other"]])} for s in self.others(signals, joints[0])]

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        assert signals.load is not None
        load = np.abs(signals.load[:, int(shape["other"])]) / max(shape["size"], 1e-300)
        sign = signals.sign[:, joint]
        return np.column_stack([load * sign, load**2 * sign])


class ForceOverToolPosition(NamelessEffect):
    """A force on the tool that depends on where the tool is: a field, a hose, a cloth."""

    kind = "force_over_tool_position"
    title = "Force that depends on the position of the tool"
    formula = r"-J_n(q)^\top f(p(q))"
    coefficients = unnamed_coefficients(30)
    scope = "robot"
    needs = ("robot",)

    def variables(self, joint: int, shape: dict[str, Any]) -> tuple[str, ...]:
        return ("tool position",)

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        if signals.robot is None:
            return []
        position = tool_position(signals)
        low, high = np.quantile(position, [0.005, 0.995], axis=0)
        return [{"low": tuple(map(float, low)), "high": tuple(map(float, high))}]

    def torque_columns(
        self, signals: Signals, joints: Sequence[int], **shape: Any
    ) -> dict[int, Array]:
        position = tool_position(signals)
        low, high = np.array(shape["low"]), np.array(shape["high"])
        span = np.where(high - low > 1e-6, high - low, np.inf)
        orders = legvander(np.clip((2 * position - low - high) / span, -1.0, 1.0), 2)
        field = [
            orders[:, 0, a] * orders[:, 1, b] * orders[:, 2, c]
            for a, b, c in itertools.product(range(3), repeat=3)
            if a + b + c <= 2
        ]
        jacobian = tool_jacobian(signals)
        return {
            j: np.column_stack([-jacobian[:, axis, j] * f for axis in range(3) for f in field])
            for j in joints
        }


class ForceNearPoint(NamelessEffect):
    """A force on the tool near one place: an edge, a magnet, a curtain."""

    kind = "force_near_point"
    title = "Force near a point"
    formula = r"-J_n(q)^\top (f + c\,(p - p_0) / w) \exp(-|p - p_0|^2 / 2 w^2)"
    coefficients = unnamed_coefficients(4)
    shapes = (
        *(Shape(axis, "m", (), -np.inf, np.inf, spacing="linear", scales=False) for axis in "xyz"),
        Shape("width", "m", (), 1e-3, 1e2, scales=False),
    )
    scope = "robot"
    needs = ("robot",)

    def variables(self, joint: int, shape: dict[str, Any]) -> tuple[str, ...]:
        return ("tool position",)

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        if signals.robot is None:
            return []
        position = tool_position(signals)
        places = _spread_out(position, _PLACES)
        reach = self.travel(signals, joints, {})
        return [
            dict(zip("xyz", map(float, place), strict=True)) | {"width": share * reach}
            for place in places
            for share in _WIDTHS
        ]

    def travel(self, signals: Signals, joints: Sequence[int], shape: Mapping[str, Any]) -> float:
        return float(np.max(np.ptp(tool_position(signals), axis=0)))

    def torque_columns(
        self, signals: Signals, joints: Sequence[int], **shape: Any
    ) -> dict[int, Array]:
        position = tool_position(signals)
        point = np.array([shape[axis] for axis in "xyz"])
        away = (position - point) / max(shape["width"], 1e-9)
        near = np.exp(-0.5 * np.sum(away**2, axis=1))[:, None]
        jacobian = tool_jacobian(signals)
        columns = {}
        for j in joints:
            radial = np.sum(jacobian[:, :, j] * away, axis=1, keepdims=True)
            columns[j] = -near * np.column_stack([radial, jacobian[:, :, j]])
        return columns


def _spread_out(points: Array, count: int) -> Array:
    """Some of the points, each as far as possible from those before it."""
    thin = points[:: max(1, len(points) // 2000)]
    chosen = [thin[int(np.argmin(np.sum((thin - thin.mean(0)) ** 2, axis=1)))]]
    distance = np.sum((thin - chosen[0]) ** 2, axis=1)
    while len(chosen) < count:
        chosen.append(thin[int(np.argmax(distance))])
        distance = np.minimum(distance, np.sum((thin - chosen[-1]) ** 2, axis=1))
    return np.array(chosen)


def _since_start(signals: Signals) -> Array:
    """Time since the first sample of the trajectory, in s."""
    since = np.zeros(signals.n_samples)
    for name in np.unique(signals.trajectory):
        here = signals.trajectory == name
        since[here] = signals.clock[here] - signals.clock[here].min()
    return since


HISTORY: tuple[type[NamelessEffect], ...] = (
    FunctionOfTimeSinceStart,
    FrictionSinceReversal,
    FunctionOfWaySinceReversal,
    FunctionOfLaggingPosition,
    FrictionOverOtherLoad,
    ForceOverToolPosition,
    ForceNearPoint,
)
