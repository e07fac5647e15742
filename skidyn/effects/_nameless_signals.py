# SPDX-License-Identifier: BSD-3-Clause
"""Unknown functions of signals of any joints, and of sums of positions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, ClassVar, Literal

import numpy as np

from skidyn._signals import Array, Signals
from skidyn.effects._base import Effect
from skidyn.effects._nameless import NamelessEffect, unnamed_coefficients
from skidyn.effects._parameters import Shape
from skidyn.effects._smooth import (
    hats,
    knots_of,
    products,
    range_of,
    splines,
    supported_range,
    supported_ranges,
)

#: Difference between the ratios of torque and of distance above which a coupling is not elastic.
_UNEQUAL = 0.2
#: Number of pairs of joints, nearest first, between which a torque is tried.
_PAIRS = 28


def logged_variables(names: Iterable[str]) -> tuple[str, ...]:
    """Logged signals behind some signals: the time behind that since the start of a recording."""
    return tuple(dict.fromkeys("time" if name == "since_start" else name for name in names))


class FunctionOfSignals(NamelessEffect):
    """A function of the few signals on which the residual was found to depend.

    All products of piecewise linear functions of each signal, as those with which its signals were
    found. They are local, so that no recording decides what the function is where it has not been.
    """

    #: Number of signals, and of knots of the functions of each.
    n_signals: ClassVar[int]
    n_knots: ClassVar[int]
    search: ClassVar[Literal["screened", "given"]] = "screened"
    softness = 3e-3

    def variables(self, joint: int, shape: dict[str, Any]) -> tuple[str, ...]:
        return logged_variables(shape["of"])

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        return []

    def shape_of(self, signals: Signals, names: Sequence[str]) -> dict[str, Any]:
        """Shape of a function of some signals, with its knots.

        Parameters
        ----------
        signals : Signals
        names : sequence of str
            Signals, joints counted from 1, such as ``"q2"``.
        """
        return knots_over(signals, names, self.n_knots)

    def admits(self, names: Sequence[str]) -> bool:
        """Whether it can be a function of some signals.

        Parameters
        ----------
        names : sequence of str
            Signals, joints counted from 1.
        """
        return len(names) == self.n_signals

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        return products_of_hats(signals, shape["of"], shape["knots"])


def knots_over(signals: Signals, names: Sequence[str], count: int) -> dict[str, Any]:
    """Some signals and the knots of functions of them, as entries of a shape.

    Parameters
    ----------
    signals : Signals
    names : sequence of str
        Signals, joints counted from 1, such as ``"q2"``.
    count : int
        Number of knots of each.

    Returns
    -------
    dict
        The names, ``of``, and the ``knots`` of each, in its unit.
    """
    knots = tuple(knots_of(signals, name, count) for name in names)
    return {"of": tuple(names), "knots": knots}


def products_of_hats(
    signals: Signals, names: Sequence[str], knots: Sequence[Sequence[float]]
) -> Array:
    """All products of piecewise linear functions of some signals.

    Parameters
    ----------
    signals : Signals
    names : sequence of str
        Signals, joints counted from 1.
    knots : sequence of sequence of float
        Knots of each.

    Returns
    -------
    ndarray of shape (n_samples, n_products)
    """
    return products(
        [hats(signals.named(name), own) for name, own in zip(names, knots, strict=True)]
    )


class FunctionOfSignal(FunctionOfSignals):
    """A function of one signal of any joint."""

    kind = "function_of_signal"
    title = "Function of one signal"
    formula = r"f(s)"
    n_signals, n_knots = 1, 20
    coefficients = unnamed_coefficients(n_knots)


class LowOrderOfSignal(FunctionOfSignals):
    """A coarse function of one signal of any joint, which few recordings determine.

    It is tried for some recordings only: in all of them, the finer function is better.
    """

    kind = "low_order_of_signal"
    title = "Coarse function of one signal"
    formula = r"f(s)"
    search = "given"
    n_signals, n_knots = 1, 5
    coefficients = unnamed_coefficients(n_knots)


class FunctionOfTwoSignals(FunctionOfSignals):
    """A function of two signals of any joints."""

    kind = "function_of_two_signals"
    title = "Function of two signals"
    formula = r"f(s_1, s_2)"
    n_signals, n_knots = 2, 7
    coefficients = unnamed_coefficients(n_knots**2)


class LowOrderOfTwoSignals(FunctionOfSignals):
    """A coarse function of two signals of any joints, which a short log determines."""

    kind = "low_order_of_two_signals"
    title = "Coarse function of two signals"
    formula = r"f(s_1, s_2)"
    n_signals, n_knots = 2, 4
    coefficients = unnamed_coefficients(n_knots**2)


class FunctionOfThreeSignals(FunctionOfSignals):
    """A function of three signals of any joints."""

    kind = "function_of_three_signals"
    title = "Function of three signals"
    formula = r"f(s_1, s_2, s_3)"
    n_signals, n_knots = 3, 4
    coefficients = unnamed_coefficients(n_knots**3)


class FrictionOverTwoSignals(FunctionOfSignals):
    """Dry friction that depends on two other signals, as on the load in a configuration."""

    kind = "friction_over_two_signals"
    title = "Dry friction over two signals"
    formula = r"\mathrm{sign}\,\dot q\,f(s_1, s_2)"
    n_signals, n_knots = 3, 5
    coefficients = unnamed_coefficients(n_knots**2)

    def admits(self, names: Sequence[str]) -> bool:
        return super().admits(names) and sum(name.startswith("dq") for name in names) == 1

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        knots = dict(zip(shape["of"], shape["knots"], strict=True))
        (speed,) = (name for name in knots if name.startswith("dq"))
        del knots[speed]
        free = products_of_hats(signals, [*knots], [*knots.values()])
        return signals.sign[:, [int(speed[2:]) - 1]] * free


class FunctionOfSum(NamelessEffect):
    """A function of a sum of positions, such as the angle of a link about parallel axes."""

    kind = "function_of_sum"
    title = "Function of a sum of positions"
    formula = r"f(\pm q_i \pm q_k \pm \ldots)"
    coefficients = unnamed_coefficients(16)
    search = "screened"
    softness = 2e-3
    is_of_one_number = True

    def variables(self, joint: int, shape: dict[str, Any]) -> tuple[str, ...]:
        return tuple(sorted(shape["of"]))

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        return []

    def shape_of(
        self, signals: Signals, joints: Sequence[int], weights: Sequence[float]
    ) -> dict[str, Any]:
        """Shape of a function of a weighted sum of positions, over the range that it covers.

        Parameters
        ----------
        signals : Signals
        joints : sequence of int
            Joints, from 0.
        weights : sequence of float
            Factor of the position of each.

        Returns
        -------
        dict
        """
        names = tuple(f"q{k + 1}" for k in joints)
        low, high = supported_range(signals, _weighted_sum(signals, names, weights))
        return {"of": names, "weights": tuple(weights), "low": low, "high": high}

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        total = _weighted_sum(signals, shape["of"], shape["weights"])
        return splines(total, shape["low"], shape["high"], len(self.coefficients))


def _weighted_sum(signals: Signals, names: Sequence[str], weights: Sequence[float]) -> Array:
    return np.asarray(sum(w * signals.named(n) for n, w in zip(names, weights, strict=True)))


class TorqueBetweenTwoJoints(NamelessEffect):
    """A torque between two joints that depends on a sum of their positions.

    The torque on the second joint is that on the first one times ``passed``. If the connection
    stores energy, as a cable that tightens or links that touch each other, this is the ratio, which
    is also used if the shape has none; if the connection loses energy, or is driven, it may differ.
    """

    is_of_one_number = True
    kind = "torque_between_two_joints"
    title = "Torque between two joints"
    formula = r"f(x),\quad x = q_i + r\,q_j"
    coefficients = unnamed_coefficients(10)
    shapes = (
        Shape(
            "ratio",
            "1",
            (-2.0, -1.0, -0.5, 0.5, 1.0, 2.0),
            -np.inf,
            np.inf,
            spacing="linear",
            scales=False,
            has_interval=False,
        ),
        Shape("passed", "1", (), -np.inf, np.inf, spacing="linear", scales=False),
    )
    scope = "pair"
    softness = 2e-3

    def variables(self, joint: int, shape: dict[str, Any]) -> tuple[str, ...]:
        return (f"q{joint + 1}", f"q{int(shape['other']) + 1}")

    def sites(self, signals: Signals) -> list[tuple[int, ...]]:
        near = sorted(super().sites(signals), key=lambda pair: pair[1] - pair[0])
        return sorted(near[:_PAIRS])

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        unit = self.travel(signals, joints, {})
        ranges = [range_of(signals, f"q{j + 1}") for j in joints]
        middle = tuple((low + high) / 2 for low, high in ranges)
        half = tuple((high - low) / 2 for low, high in ranges)
        found = []
        ratios = unit * np.array(self.shapes[0].grid)
        sums = signals.q[:, [joints[0]]] + ratios * signals.q[:, [joints[1]]]
        for ratio, (low, high) in zip(
            ratios.tolist(), supported_ranges(signals, sums), strict=True
        ):
            # The range of the sum, in terms that do not change when the ratio is refined.
            share = (high - low) / 2 / max(half[0] + abs(ratio) * half[1], 1e-300)
            shift = (low + high) / 2 - (middle[0] + ratio * middle[1])
            shape = {"middle": middle, "half": half, "share": share, "shift": shift}
            found.append({"ratio": ratio, "passed": ratio, "other": joints[1]} | shape)
        return found

    def travel(self, signals: Signals, joints: Sequence[int], shape: Mapping[str, Any]) -> float:
        i, j = joints
        return float(signals.unit[i] / signals.unit[j])

    def denies(self, effect: Effect, shape: Mapping[str, Any]) -> bool:
        """A coupling of two joints transmits torque with the same ratio as distance."""
        ratio = shape["ratio"]
        passed = shape.get("passed", ratio)
        return effect.scope == "pair" and abs(passed - ratio) > _UNEQUAL * abs(ratio)

    def torque_columns(
        self, signals: Signals, joints: Sequence[int], **shape: Any
    ) -> dict[int, Array]:
        (i, j), ratio = joints, shape["ratio"]
        middle = shape["middle"][0] + ratio * shape["middle"][1] + shape["shift"]
        half = shape["share"] * (shape["half"][0] + abs(ratio) * shape["half"][1])
        total = signals.q[:, i] + ratio * signals.q[:, j]
        block = splines(total, middle - half, middle + half, len(self.coefficients))
        return {i: block, j: shape.get("passed", ratio) * block}


OF_SIGNALS: tuple[type[NamelessEffect], ...] = (
    FunctionOfSignal,
    FunctionOfTwoSignals,
    LowOrderOfSignal,
    LowOrderOfTwoSignals,
    FunctionOfThreeSignals,
    FrictionOverTwoSignals,
    FunctionOfSum,
    TorqueBetweenTwoJoints,
)
