# SPDX-License-Identifier: BSD-3-Clause
"""Unknown torques as products of simple functions of signals, or of a function and a size."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from skidyn._signals import Array, Signals
from skidyn.effects._nameless import NamelessEffect, unnamed_coefficients
from skidyn.effects._nameless_signals import knots_over, logged_variables, products_of_hats
from skidyn.effects._parameters import Coefficient

#: Knots of each of two signals of a free function; twice as many of a single one.
_KNOTS = 4


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
        return logged_variables(shape["of"])

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
            product = product * _values(signals, factor)
        return product[:, None]


class ProductWithFunction(NamelessEffect):
    """A simple function of a signal times a free function of one or two others.

    The dry friction of a joint over the position of another, or a force that a joint changes by its
    position. The free function is a coarse one, as of
    :class:`~skidyn.effects.FunctionOfSignals`, which a short log determines.
    """

    kind = "product_with_function"
    title = "Product of a signal and a function of others"
    formula = r"f_1(s_1)\,f(s_2)\ \text{or}\ f_1(s_1)\,f(s_2, s_3)"
    coefficients = unnamed_coefficients(_KNOTS**2)
    search = "screened"
    softness = 3e-3

    def variables(self, joint: int, shape: dict[str, Any]) -> tuple[str, ...]:
        return logged_variables(sorted((shape["by"], *shape["of"])))

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        return []

    def shape_of(self, signals: Signals, factor: Factor, names: Sequence[str]) -> dict[str, Any]:
        """Shape of a product, with the knots of the other signals.

        Parameters
        ----------
        signals : Signals
        factor : Factor
            The simple function.
        names : sequence of str
            One or two other signals, joints counted from 1, such as ``"q2"``.
        """
        by, function, middle = factor
        shape = {"by": by, "function": function, "middle": middle}
        return shape | knots_over(signals, names, _KNOTS if len(names) > 1 else 2 * _KNOTS)

    def coefficients_of(self, shape: Mapping[str, Any]) -> tuple[Coefficient, ...]:
        return (
            self.coefficients[: 2 * _KNOTS] if len(shape.get("of", ())) == 1 else self.coefficients
        )

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        free = products_of_hats(signals, shape["of"], shape["knots"])
        factor = Factor(shape["by"], shape["function"], shape["middle"])
        return _values(signals, factor)[:, None] * free


class ProductWithLoad(NamelessEffect):
    """The load of the joint, or its magnitude, times a simple function of a signal.

    A transmission that loses more while another joint moves, or a supply that sags.
    """

    kind = "product_with_load"
    title = "Product of a signal and the load"
    formula = r"c\,\tau_j\,f(s)\ \text{or}\ c\,|\tau_j|\,f(s)"
    coefficients = unnamed_coefficients(1)
    needs = ("load",)
    search = "screened"
    is_of_one_number = True

    def variables(self, joint: int, shape: dict[str, Any]) -> tuple[str, ...]:
        return (shape["of"], f"tau{joint + 1}")

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        return []

    def shape_of(self, factors: Sequence[Factor]) -> dict[str, Any]:
        """Shape of a product.

        Parameters
        ----------
        factors : sequence of Factor
            Functions of the load and of the signal.
        """
        load, (of, function, middle) = factors
        return {"load": load.function, "of": of, "function": function, "middle": middle}

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        assert signals.load is not None
        load = Factor(f"tau{joint + 1}", shape["load"]).of(signals.load[:, joint])
        factor = Factor(shape["of"], shape["function"], shape["middle"])
        return (load * _values(signals, factor))[:, None]


class SizeByRecording(NamelessEffect):
    """A simple function of a signal with a size of its own in every recording.

    A torque that another wiring, grip or amplifier range changes from one recording to the next,
    even to the opposite sign. It is 0 in recordings that the log does not contain.
    """

    kind = "size_by_recording"
    title = "Function of a signal, of another size in each recording"
    formula = r"c_k\,f(s)"
    coefficients = unnamed_coefficients(1)
    search = "screened"
    is_of_one_number = True

    def words(self, shape: Mapping[str, Any]) -> str:
        return f"Unknown torque that depends on {shape['of']}, of another size in each recording,"

    def variables(self, joint: int, shape: dict[str, Any]) -> tuple[str, ...]:
        return (shape["of"], "trajectory")

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        return []

    def shape_of(self, factor: Factor, recordings: Sequence[int]) -> dict[str, Any]:
        """Shape of a function of a signal in some recordings.

        Parameters
        ----------
        factor : Factor
            The function.
        recordings : sequence of int
            Numbers of the trajectories.
        """
        of, function, middle = factor
        own = tuple(recordings)
        shape = {"of": of, "function": function, "middle": middle, "recordings": own}
        # "trajectories" of a term, which its columns do not see, keep it out of other recordings
        return {**shape, "trajectories": own}

    def coefficients_of(self, shape: Mapping[str, Any]) -> tuple[Coefficient, ...]:
        return unnamed_coefficients(len(shape.get("recordings", (0,))))

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        factor = Factor(shape["of"], shape["function"], shape["middle"])
        here = signals.trajectory[:, None] == np.array(shape["recordings"])
        return np.where(here, _values(signals, factor)[:, None], 0.0)


def _values(signals: Signals, factor: Factor) -> Array:
    """Values of a factor at every sample; the direction of a velocity is that of dry friction."""
    name = factor.signal
    if name.startswith("dq") and factor.function == "side":
        return np.asarray(signals.sign[:, int(name[2:]) - 1])
    return factor.of(signals.named(name))


PRODUCTS: tuple[type[NamelessEffect], ...] = (
    ProductOfSignals,
    ProductWithFunction,
    ProductWithLoad,
    SizeByRecording,
)
