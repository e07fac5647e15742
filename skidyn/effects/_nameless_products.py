# SPDX-License-Identifier: BSD-3-Clause
"""An unknown torque as a product of simple functions of signals of any joints."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from skidyn._signals import Array, Signals
from skidyn.effects._nameless import NamelessEffect, unnamed_coefficients


class Factor(NamedTuple):
    """A simple function of one signal.

    Attributes
    ----------
    signal : str
        Its name, joints counted from 1, such as ``"dq2"``.
    function : {"value", "side", "size", "sin", "cos", "sin2", "cos2"}
        The signal itself, its sign, its magnitude, or a wave of it.
    middle : float
        Value of the signal at which ``value`` is 0 and ``side`` changes, in the signal's unit.
    """

    signal: str
    function: str
    middle: float = 0.0

    def of(self, x: Array) -> Array:
        """Values of the function for values of the signal, (n,) each."""
        away = x - self.middle
        if self.function == "side":
            return np.asarray(np.sign(away))
        if self.function == "size":
            return np.abs(away)
        if self.function.startswith(("sin", "cos")):
            wave = np.sin if self.function.startswith("sin") else np.cos
            return np.asarray(wave(x * float(self.function[3:] or 1)))
        return np.asarray(away)


class ProductOfSignals(NamelessEffect):
    """A product of simple functions of the signals on which the residual was found to depend.

    It has a single coefficient, which a short log determines as well.
    """

    kind = "product_of_signals"
    title = "Product of signals"
    formula = r"c\,f_1(s_1)\,f_2(s_2)\,f_3(s_3)"
    coefficients = unnamed_coefficients(1)
    search = "screened"

    def variables(self, joint: int, shape: dict[str, Any]) -> tuple[str, ...]:
        return tuple(dict.fromkeys(shape["of"]))

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        return []

    def shape_of(self, factors: Sequence[Factor]) -> dict[str, Any]:
        """Shape of a product.

        Parameters
        ----------
        factors : sequence of Factor
            Functions of which it is the product.
        """
        of, functions, middle = zip(*factors, strict=True)
        return {"of": of, "functions": functions, "middle": middle}

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        product = np.ones(signals.n_samples)
        for factor in map(Factor, shape["of"], shape["functions"], shape["middle"]):
            name = factor.signal
            if name.startswith("dq") and factor.function == "side":
                product = product * signals.sign[:, int(name[2:]) - 1]
            else:
                product = product * factor.of(signals.named(name))
        return product[:, None]
