# SPDX-License-Identifier: BSD-3-Clause
"""Unknown torques that depend on the position of the tool."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
from numpy.polynomial.legendre import legvander

from skidyn._signals import Array, Signals
from skidyn.effects._nameless import NamelessEffect, unnamed_coefficients
from skidyn.effects._parameters import Shape
from skidyn.effects._smooth import splines, supported_range
from skidyn.effects._tool import points_of_tool, tool_jacobian, tool_position

#: Number of places at which a force is tried, and its widths as shares of the extent of the motion.
_PLACES, _WIDTHS = 24, (0.08, 0.16, 0.3)


class _AtTool(NamelessEffect):
    needs = ("robot",)
    follows: ClassVar[tuple[str, ...]] = ("tool position",)

    def variables(self, joint: int, shape: dict[str, Any]) -> tuple[str, ...]:
        return self.follows

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        if signals.robot is None:
            return []
        return [
            shape | point
            for point in points_of_tool(signals)
            for shape in self.tried(signals, tool_position(signals, point))
        ]

    def tried(self, signals: Signals, position: Array) -> list[dict[str, Any]]:
        """Shapes for a motion with these positions of the tool, (n_samples, 3)."""
        raise NotImplementedError


class FunctionOfToolPosition(_AtTool):
    """A torque on one joint that depends on the position of the tool: a hose, a cable, a cover."""

    kind = "function_of_tool_position"
    title = "Function of the position of the tool"
    formula = r"f(p(q))"
    coefficients = unnamed_coefficients(35)
    softness = 2e-3

    def tried(self, signals: Signals, position: Array) -> list[dict[str, Any]]:
        # With up to three joints, it is a function of their positions, which are told apart.
        return [_extent(position)] if signals.n_joints > 3 else []

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        position = tool_position(signals, shape)
        return _polynomials(position, shape["low"], shape["high"], 4)


class _ForceAtTool(_AtTool):
    scope = "robot"


class DragOnTool(_ForceAtTool):
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
        height = tool_position(signals, shape)[:, 2]
        field = splines(height, shape["low"], shape["high"], len(self.coefficients))
        jacobian = tool_jacobian(signals, shape)
        velocity = np.einsum("ian,in->ia", jacobian, signals.dq)
        return {j: np.sum(jacobian[:, :, j] * velocity, axis=1)[:, None] * field for j in joints}


class ForceOverToolPosition(_ForceAtTool):
    """A force on the tool that depends on its position: a field, a hose, a cloth."""

    kind = "force_over_tool_position"
    title = "Force that depends on the position of the tool"
    formula = r"-J_n(q)^\top f(p(q))"
    coefficients = unnamed_coefficients(30)

    def tried(self, signals: Signals, position: Array) -> list[dict[str, Any]]:
        return [_extent(position)]

    def torque_columns(
        self, signals: Signals, joints: Sequence[int], **shape: Any
    ) -> dict[int, Array]:
        field = _polynomials(tool_position(signals, shape), shape["low"], shape["high"], 2)
        jacobian = tool_jacobian(signals, shape)
        return {
            j: np.hstack([-jacobian[:, axis, [j]] * field for axis in range(3)]) for j in joints
        }


class ForceNearPoint(_ForceAtTool):
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
        reach = float(np.max(np.ptp(position, axis=0)))
        return [
            dict(zip("xyz", map(float, place), strict=True)) | {"width": share * reach}
            for place in places
            for share in _WIDTHS
        ]

    def travel(self, signals: Signals, joints: Sequence[int], shape: Mapping[str, Any]) -> float:
        position = tool_position(signals, shape)
        return float(np.max(np.ptp(position, axis=0)))

    def torque_columns(
        self, signals: Signals, joints: Sequence[int], **shape: Any
    ) -> dict[int, Array]:
        place = np.array([shape[axis] for axis in "xyz"])
        away = (tool_position(signals, shape) - place) / max(shape["width"], 1e-9)
        near = np.exp(-0.5 * np.einsum("ia,ia->i", away, away))[:, None]
        jacobian = tool_jacobian(signals, shape)
        radial = np.einsum("iaj,ia->ij", jacobian, away)
        columns = {}
        for j in joints:
            columns[j] = -near * np.column_stack([radial[:, j], jacobian[:, :, j]])
        return columns


def _polynomials(position: Array, low: Sequence[float], high: Sequence[float], order: int) -> Array:
    """Polynomials of a place up to some order."""
    least, most = np.array(low), np.array(high)
    span = np.where(most - least > 1e-6, most - least, np.inf)
    orders = legvander(np.clip((2 * position - least - most) / span, -1.0, 1.0), order)
    return np.column_stack(
        [
            orders[:, 0, a] * orders[:, 1, b] * orders[:, 2, c]
            for a, b, c in itertools.product(range(order + 1), repeat=3)
            if a + b + c <= order
        ]
    )


def _extent(position: Array) -> dict[str, Any]:
    """Shape of a function of a place: the range of the motion without its ends."""
    low, high = np.quantile(position, [0.005, 0.995], axis=0)
    return {"low": tuple(map(float, low)), "high": tuple(map(float, high))}


def _spread_out(points: Array, count: int) -> Array:
    """Some of the points, each as far as possible from those before it."""
    thin = points[:: max(1, len(points) // 2000)]
    chosen = [thin[int(np.argmin(np.sum((thin - thin.mean(0)) ** 2, axis=1)))]]
    distance = np.sum((thin - chosen[0]) ** 2, axis=1)
    while len(chosen) < count:
        chosen.append(thin[int(np.argmax(distance))])
        distance = np.minimum(distance, np.sum((thin - chosen[-1]) ** 2, axis=1))
    return np.array(chosen)


AT_TOOL: tuple[type[NamelessEffect], ...] = (
    FunctionOfToolPosition,
    DragOnTool,
    ForceOverToolPosition,
    ForceNearPoint,
)
