# SPDX-License-Identifier: BSD-3-Clause
"""Run a recursion on arrays directly, without recording it on a tape.

A tape is worth its cost if it is run often. For a robot that is evaluated once, such as one of many
variants of a description, recording and binding a tape takes several times as long as running it.
:class:`Numbers` takes the place of a :class:`~skidyn.dynamics._tape.Tape`: its scalars are floats,
or arrays of one number a sample, and every operation is carried out at once. Products with 0 and 1
are still omitted.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np


class Number:
    """A float, or an array with one number per sample, that omits needless arithmetic."""

    __slots__ = ("value",)

    def __init__(self, value: float | np.ndarray) -> None:
        self.value = value

    def __neg__(self) -> Number:
        return Number(-self.value)

    def __add__(self, other: Number | float) -> Number:
        a, b = self.value, other.value if isinstance(other, Number) else other
        if isinstance(a, float) and a == 0.0:
            return Number(b)
        if isinstance(b, float) and b == 0.0:
            return self
        return Number(a + b)

    __radd__ = __add__

    def __sub__(self, other: Number | float) -> Number:
        a, b = self.value, other.value if isinstance(other, Number) else other
        if isinstance(b, float) and b == 0.0:
            return self
        if isinstance(a, float) and a == 0.0:
            return Number(-b)
        return Number(a - b)

    def __mul__(self, other: Number | float) -> Number:
        a, b = self.value, other.value if isinstance(other, Number) else other
        if isinstance(b, float):
            a, b = b, a
        if isinstance(a, float):
            if a == 0.0:
                return Number(0.0)
            if a == 1.0:
                return Number(b)
        return Number(a * b)

    __rmul__ = __mul__

    def sin(self) -> Number:
        """Sine of an angle in rad."""
        return Number(np.sin(self.value))

    def cos(self) -> Number:
        """Cosine of an angle in rad."""
        return Number(np.cos(self.value))


class Numbers:
    """Source of the numbers of a motion, in place of a tape, which is a source of symbols."""

    def __init__(self, signals: Mapping[str, np.ndarray]) -> None:
        self._signals = {name: np.ascontiguousarray(x.T) for name, x in signals.items()}

    def input(self, name: str, index: int = 0) -> Number:
        """One signal of a joint at all samples."""
        return Number(self._signals[name][index])

    def constant(self, value: float) -> Number:
        """A number that is the same at all samples."""
        return Number(float(value))
