# SPDX-License-Identifier: BSD-3-Clause
"""Unknown torques that depend on history or on the position of the tool."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
from numpy.polynomial.legendre import legvander

from skidyn._signals import Array, Signals
from skidyn.effects._base import Shape
from skidyn.effects._hysteresis import dahl_state, stop_along, strokes_of
from skidyn.effects._moments import moments
from skidyn.effects._nameless import (
    NamelessEffect,
    splines,
    supported_range,
    unnamed_coefficients,
)
from skidyn.effects._tool import tool_jacobian, tool_position

#: Distances since the last reversal, rad or tenths of m, over which a torque may fade.
_WAYS = (0.01, 0.03, 0.1, 0.3)
#: Widths of play, as shares of the range of a position, and number of splines of the function.
_PLAYS, _LAGGING = (0.03, 0.06, 0.1, 0.15, 0.22, 0.33, 0.5), 16
#: Times in s over which a torque may relax.
_RELAXATION = (0.1, 0.3, 1.0, 3.0)
#: Least number of recordings for a torque that drifts.
_DRIFTING = 5
#: Number of moments that are tried.
_MOMENTS = 32
#: Times since the start of a recording over which a torque may fade, as shares of its length.
_FADING = (0.05, 0.15, 0.5)


#: Number of places at which a force is tried, and its widths as shares of the extent of the motion.
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


class FunctionOfTime(NamelessEffect):
    """A torque that drifts slowly over the whole log, as the zero of a sensor does."""

    kind = "function_of_time"
    drawn_against = "time"
    title = "Slow drift over the log"
    formula = r"f(t)"
    coefficients = unnamed_coefficients(4)
    depends_on = ("time",)
    needs = ("time",)

    def not_shown(self, signals: Signals, joint: int) -> str | None:
        if len(signals.segments) < _DRIFTING:
            return "too few recordings to separate a drift from differences between them"
        return super().not_shown(signals, joint)

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        start, end = float(np.min(signals.clock)), float(np.max(signals.clock))
        return [{"low": start, "high": end}] if end > start else []

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        # Beyond the log the drift is unknown: the torque stays constant.
        share = np.clip((signals.clock - shape["low"]) / (shape["high"] - shape["low"]), 0.0, 1.0)
        return legvander(2 * share - 1, len(self.coefficients) - 1)


class SuddenOffset(NamelessEffect):
    """A torque that sets in at some moment and stays, as after a collision or a slip."""

    kind = "sudden_offset"
    drawn_against = "time"
    title = "Torque with an onset in time"
    formula = r"\tau_0\,[t \geq t_0]"
    coefficients = unnamed_coefficients(1)
    shapes = (Shape("moment", "s", (), -np.inf, np.inf, spacing="samples", scales=False),)
    depends_on = ("time",)
    needs = ("time",)

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        return [{"moment": moment} for moment in moments(signals, _MOMENTS)]

    def admissible(self, signals: Signals, joints: Sequence[int], shape: Mapping[str, Any]) -> bool:
        since = float(np.mean(signals.clock >= shape["moment"]))
        least = 1 / (_MOMENTS + 2)
        return least < since < 1 - least

    def words(self, shape: Mapping[str, Any]) -> str:
        return f"Torque with an onset at {shape['moment']:.6g} s"

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        return np.asarray(signals.clock >= shape["moment"], dtype=float)[:, None]


class FrictionSinceReversal(NamelessEffect):
    """Friction that fades or grows with the distance since the last reversal of the joint."""

    is_of_one_number = True
    kind = "friction_since_reversal"
    title = "Friction that depends on the distance since the last reversal"
    formula = r"f(|q - q_\mathrm{turn}|)\,\mathrm{sign}\,\dot q"
    coefficients = unnamed_coefficients(len(_WAYS))
    depends_on = ("q_own", "dq_own")

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        q, unit = signals.q[:, joint], signals.unit[joint]
        # The difference of a Dahl state from its direction is the exponential of that distance.
        return np.column_stack(
            [signals.sign[:, joint] - dahl_state(q, signals.segments, way * unit) for way in _WAYS]
        )


class FunctionOfWaySinceReversal(NamelessEffect):
    """A torque that fades or grows with the distance since the last reversal of the joint."""

    is_of_one_number = True
    kind = "function_of_way_since_reversal"
    title = "Function of the distance since the last reversal"
    formula = r"f(|q - q_\mathrm{turn}|)"
    coefficients = unnamed_coefficients(2 * len(_WAYS))
    depends_on = ("q_own", "dq_own")

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        strokes = strokes_of(signals, joint)
        way = np.zeros(signals.n_samples)
        way[strokes.rows] = strokes.way / signals.unit[joint]
        fading = np.column_stack([np.exp(-way / w) for w in _WAYS])
        return np.hstack([fading, fading * signals.sign[:, [joint]]])


class FunctionOfLaggingPosition(NamelessEffect):
    """A torque with play: a function of a position that lags behind by some play.

    A torque that switches at different angles in the two directions, as by a latch, a magnet or a
    hose that flips over, is a function of the output of a play operator [1]_.

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
    #: The signal that lags, and the widths of play as shares of its range.
    signal: ClassVar[str] = "q"
    plays: ClassVar[tuple[float, ...]] = _PLAYS

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        low, high = supported_range(signals, getattr(signals, self.signal)[:, joints[0]])
        return [{"play": share * (high - low), "low": low, "high": high} for share in self.plays]

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        x, play = getattr(signals, self.signal)[:, joint], shape["play"]
        strokes = strokes_of(signals, joint, self.signal)
        lagging = x - play * stop_along(strokes, len(x), play)
        return splines(lagging, shape["low"], shape["high"], _LAGGING)


class FunctionOfLaggingVelocity(FunctionOfLaggingPosition):
    """A torque that switches at one speed while it increases and at another while it decreases."""

    kind = "function_of_lagging_velocity"
    drawn_against = "dq"
    title = "Function of the velocity with play"
    formula = r"f(\mathcal{P}_r[\dot q])"
    depends_on = ("dq_own",)
    signal, plays = "dq", _PLAYS[2:5]


class RelaxingSpring(NamelessEffect):
    """A torque that depends on the position and relaxes at rest: rubber, hoses, grease [1]_.

    References
    ----------
    .. [1] J. D. Ferry (1980), Viscoelastic properties of polymers, 3rd ed., Wiley, chapter 1
       (Maxwell elements).
    """

    kind = "relaxing_spring"
    title = "Torque that relaxes"
    formula = r"\sum_i k_i\,(q - q_i),\quad T_i\,\dot q_i = q - q_i"
    coefficients = unnamed_coefficients(len(_RELAXATION))
    depends_on = ("q_own", "dq_own")
    needs = ("time",)
    is_of_one_number = True

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        q = signals.q[:, joint]
        return np.column_stack([q - _followed(q, signals, time) for time in _RELAXATION])


def _followed(x: Array, signals: Signals, time_constant: float) -> Array:
    """First-order lag of a signal, from its value at the start of each segment."""
    from scipy.signal import lfilter  # not needed to check a log

    y = np.array(x)
    for rows, step in zip(signals.segments, signals.steps, strict=True):
        if rows.stop - rows.start < 2:
            continue
        fade = np.exp(-step / time_constant)
        # y[i] = fade y[i-1] + (1 - fade) (x[i] + x[i-1]) / 2
        own = x[rows]
        weights = [(1 - fade) / 2, (1 - fade) / 2]
        y[rows.start + 1 : rows.stop] = lfilter(
            weights, [1.0, -fade], own[1:], zi=[fade * own[0] + weights[1] * own[0]]
        )[0]
    return y


class _AtTool(NamelessEffect):
    scope = "robot"
    needs = ("robot",)
    follows: ClassVar[tuple[str, ...]] = ("tool position",)

    def variables(self, joint: int, shape: dict[str, Any]) -> tuple[str, ...]:
        return self.follows

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        return [] if signals.robot is None else self.tried(signals, tool_position(signals))

    def tried(self, signals: Signals, position: Array) -> list[dict[str, Any]]:
        """Shapes for a motion with these positions of the tool, (n_samples, 3)."""
        raise NotImplementedError


class DragOnTool(_AtTool):
    """A drag on the tool that depends on its height: a bath, air, brushes."""

    kind = "drag_on_tool"
    drawn_against = "dq"
    title = "Drag on the tool"
    formula = r"J_n(q)^\top c(z(q))\,v"
    coefficients = unnamed_coefficients(10)
    softness = 2e-3
    follows = ("tool position", "tool velocity")

    def tried(self, signals: Signals, position: Array) -> list[dict[str, Any]]:
        low, high = supported_range(signals, position[:, 2])
        return [{"low": low, "high": high}] if high > low else []

    def torque_columns(
        self, signals: Signals, joints: Sequence[int], **shape: Any
    ) -> dict[int, Array]:
        height = tool_position(signals)[:, 2]
        field = splines(height, shape["low"], shape["high"], len(self.coefficients))
        jacobian = tool_jacobian(signals)
        velocity = np.einsum("ian,in->ia", jacobian, signals.dq)
        return {j: np.sum(jacobian[:, :, j] * velocity, axis=1)[:, None] * field for j in joints}


class ForceOverToolPosition(_AtTool):
    """A force on the tool that depends on its position: a field, a hose, a cloth."""

    kind = "force_over_tool_position"
    title = "Force that depends on the position of the tool"
    formula = r"-J_n(q)^\top f(p(q))"
    coefficients = unnamed_coefficients(30)

    def tried(self, signals: Signals, position: Array) -> list[dict[str, Any]]:
        low, high = np.quantile(position, [0.005, 0.995], axis=0)
        return [{"low": tuple(map(float, low)), "high": tuple(map(float, high))}]

    def torque_columns(
        self, signals: Signals, joints: Sequence[int], **shape: Any
    ) -> dict[int, Array]:
        field = _quadratics(tool_position(signals), shape["low"], shape["high"])
        jacobian = tool_jacobian(signals)
        return {
            j: np.hstack([-jacobian[:, axis, [j]] * field for axis in range(3)]) for j in joints
        }


class ForceNearPoint(_AtTool):
    """A force on the tool near one place: an edge, a magnet, a curtain."""

    kind = "force_near_point"
    title = "Force near a point"
    formula = r"-J_n(q)^\top (f + c\,(p - p_0) / w) \exp(-|p - p_0|^2 / 2 w^2)"
    coefficients = unnamed_coefficients(4)
    shapes = (
        *(Shape(axis, "m", (), -np.inf, np.inf, spacing="linear", scales=False) for axis in "xyz"),
        Shape("width", "m", (), 1e-3, 1e2, scales=False),
    )

    def tried(self, signals: Signals, position: Array) -> list[dict[str, Any]]:
        places = _spread_out(position, _PLACES)
        reach = self.travel(signals, (), {})
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
        near = np.exp(-0.5 * np.einsum("ia,ia->i", away, away))[:, None]
        jacobian = tool_jacobian(signals)
        radial = np.einsum("iaj,ia->ij", jacobian, away)
        columns = {}
        for j in joints:
            columns[j] = -near * np.column_stack([radial[:, j], jacobian[:, :, j]])
        return columns


def _quadratics(position: Array, low: Sequence[float], high: Sequence[float]) -> Array:
    """Polynomials of a place up to order two, (n_samples, 10)."""
    least, most = np.array(low), np.array(high)
    span = np.where(most - least > 1e-6, most - least, np.inf)
    orders = legvander(np.clip((2 * position - least - most) / span, -1.0, 1.0), 2)
    return np.column_stack(
        [
            orders[:, 0, a] * orders[:, 1, b] * orders[:, 2, c]
            for a, b, c in itertools.product(range(3), repeat=3)
            if a + b + c <= 2
        ]
    )


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
    FunctionOfTime,
    SuddenOffset,
    FunctionOfTimeSinceStart,
    FrictionSinceReversal,
    FunctionOfWaySinceReversal,
    FunctionOfLaggingPosition,
    FunctionOfLaggingVelocity,
    RelaxingSpring,
    DragOnTool,
    ForceOverToolPosition,
    ForceNearPoint,
)
