# SPDX-License-Identifier: BSD-3-Clause
"""Unknown functions of signals of any joints, and of sums of positions."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, ClassVar, Literal

import numpy as np

from skidyn._signals import Array, Signals
from skidyn.effects._base import Effect
from skidyn.effects._nameless import NamelessEffect, unnamed_coefficients
from skidyn.effects._parameters import Shape
from skidyn.effects._smooth import (
    HIGHEST_ORDER,
    ordered_functions,
    range_of,
    splines,
    supported_range,
    supported_ranges,
)

#: Highest degree of a product of functions of two signals.
HIGHEST_OF_TWO = 5
#: Difference between the ratios of torque and of distance above which a coupling is not elastic.
_UNEQUAL = 0.2
#: Number of pairs of joints, nearest first, between which a torque is tried.
_PAIRS = 28


def logged_variables(names: Iterable[str]) -> tuple[str, ...]:
    """Logged signals behind some signals: the time behind that since the start of a recording."""
    return tuple(dict.fromkeys("time" if name == "since_start" else name for name in names))


class FunctionOfSignals(NamelessEffect):
    """A smooth function of the few signals on which the residual was found to depend.

    Products of Legendre polynomials of positions and accelerations, and of powers of velocities
    with their direction, the lowest orders first.
    """

    n_signals: ClassVar[int] = 1
    search: ClassVar[Literal["screened", "given"]] = "screened"
    drawn = 1e-2

    def variables(self, joint: int, shape: dict[str, Any]) -> tuple[str, ...]:
        return logged_variables(shape["of"])

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        return []

    def shape_of(self, signals: Signals, names: Sequence[str]) -> dict[str, Any]:
        """Shape of a function of some signals, over the range that they cover.

        Parameters
        ----------
        signals : Signals
        names : sequence of str
            Signals, joints counted from 1, such as ``"q2"``.
        """
        return ranges_of(signals, names)

    def admits(self, names: Sequence[str]) -> bool:
        """Whether it can be a function of some signals.

        Parameters
        ----------
        names : sequence of str
            Signals, joints counted from 1.
        """
        return len(names) == self.n_signals

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        ranges = shape["of"], shape["low"], shape["high"]
        return products_of_low_order(signals, *ranges, len(self.coefficients))


def ranges_of(signals: Signals, names: Sequence[str]) -> dict[str, Any]:
    """Some signals and the ranges that they cover, as entries of a shape.

    Parameters
    ----------
    signals : Signals
    names : sequence of str
        Signals, joints counted from 1, such as ``"q2"``.

    Returns
    -------
    dict
        The names, ``of``, and the ends of their ranges, ``low`` and ``high``, in their units.
    """
    low, high = zip(*(range_of(signals, name) for name in names), strict=True)
    return {"of": tuple(names), "low": low, "high": high}


def products_of_low_order(
    signals: Signals,
    names: Sequence[str],
    low: Sequence[float],
    high: Sequence[float],
    count: int,
) -> Array:
    """Products of functions of some signals, those of the lowest orders.

    Parameters
    ----------
    signals : Signals
    names : sequence of str
        Signals, joints counted from 1.
    low, high : sequence of float
        Their ranges.
    count : int
        Number of products.

    Returns
    -------
    ndarray of shape (n_samples, count)
    """
    parts = []
    for name, *bounds in zip(names, low, high, strict=True):
        sign = signals.sign[:, int(name[2:]) - 1] if name.startswith("dq") else None
        parts.append(ordered_functions(signals.named(name), sign, *bounds))
    orders = [range(p.shape[1]) for p in parts]
    chosen = sorted(itertools.product(*orders), key=lambda powers: (sum(powers), powers))
    return np.column_stack(
        [
            np.prod([p[:, k] for p, k in zip(parts, powers, strict=True)], axis=0)
            for powers in chosen[:count]
        ]
    )


class FunctionOfSignal(FunctionOfSignals):
    """A function of one signal of any joint."""

    kind = "function_of_signal"
    title = "Function of one signal"
    formula = r"f(s)"
    coefficients = unnamed_coefficients(HIGHEST_ORDER + 1)
    n_signals = 1


class LowOrderOfSignal(FunctionOfSignal):
    """A function of one signal of any joint in low orders, which few recordings determine.

    It is tried for some recordings only: in all of them, the function of higher orders is better.
    """

    search = "given"
    kind = "low_order_of_signal"
    title = "Function of one signal in low orders"
    coefficients = unnamed_coefficients(4)


class FunctionOfTwoSignals(FunctionOfSignals):
    """A function of two signals of any joints."""

    kind = "function_of_two_signals"
    title = "Function of two signals"
    formula = r"f(s_1, s_2)"
    coefficients = unnamed_coefficients(28)
    n_signals = 2


class LowOrderOfTwoSignals(FunctionOfTwoSignals):
    """A function of two signals of any joints in low orders, which a short log determines."""

    kind = "low_order_of_two_signals"
    title = "Function of two signals in low orders"
    coefficients = unnamed_coefficients(10)


class FunctionOfThreeSignals(FunctionOfSignals):
    """A function of three signals of any joints."""

    kind = "function_of_three_signals"
    title = "Function of three signals"
    formula = r"f(s_1, s_2, s_3)"
    coefficients = unnamed_coefficients(35)
    n_signals = 3


class FrictionOverTwoSignals(FunctionOfSignals):
    """Dry friction that depends on two other signals, as on the load in a configuration."""

    kind = "friction_over_two_signals"
    title = "Dry friction over two signals"
    formula = r"\mathrm{sign}\,\dot q\,f(s_1, s_2)"
    coefficients = unnamed_coefficients(21)
    n_signals = 3

    def admits(self, names: Sequence[str]) -> bool:
        return super().admits(names) and sum(name.startswith("dq") for name in names) == 1

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        (speed,) = (name for name in shape["of"] if name.startswith("dq"))
        ranges = zip(shape["of"], shape["low"], shape["high"], strict=True)
        first, second = (
            ordered_functions(signals.named(name), None, low, high)
            for name, low, high in ranges
            if name != speed
        )
        most = HIGHEST_OF_TWO + 1
        products = [first[:, i] * second[:, k] for i in range(most) for k in range(most - i)]
        return signals.sign[:, [int(speed[2:]) - 1]] * np.column_stack(products)


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
