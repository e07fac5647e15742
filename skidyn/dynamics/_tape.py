# SPDX-License-Identifier: BSD-3-Clause
"""Symbolic scalars that record arithmetic on a tape and simplify it at the same time.

A rigid-body recursion is written once, in ordinary Python arithmetic, and run on these scalars.
The tape then holds the recursion of one particular robot: products with 0 and 1 are removed, no
expression is computed twice, and operations that do not reach an output are dropped when the tape
is read (:meth:`Tape.live`). The back ends (NumPy, torch, Python text, C text) only read tapes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Container, Hashable, Iterable
from typing import Any

#: One entry of a tape: the operation and its operands. Operands are indices of earlier entries,
#: except for ``("input", name, index)`` and ``("constant", value)``.
Node = tuple[Any, ...]

#: Rigid bodies need the first line of each; effects need the others when a whole model is exported.
UNARY = frozenset({"neg", "sin", "cos", "tanh", "exp", "sqrt", "abs", "sign"})
BINARY = frozenset({"add", "sub", "mul", "div", "max", "pow"})

_CONSTANT: dict[str, Callable[[float], float]] = {
    "sin": math.sin,
    "cos": math.cos,
    "tanh": math.tanh,
    "exp": math.exp,
    "sqrt": math.sqrt,
    "abs": abs,
    "sign": lambda x: float((x > 0) - (x < 0)),
}


class Tape:
    """A growing list of operations without repetitions.

    Examples
    --------
    >>> tape = Tape()
    >>> x = tape.input("x")
    >>> y = 0.0 * x + (x + 1.0) * (1.0 + x)
    >>> [tape.nodes[i][0] for i in tape.live([y])]
    ['input', 'constant', 'add', 'mul']
    """

    def __init__(self) -> None:
        self.nodes: list[Node] = []
        self._index: dict[Node, int] = {}

    def record(self, *node: Hashable) -> Scalar:
        """Scalar of a node; an existing node is reused (common subexpressions)."""
        index = self._index.get(node)
        if index is None:
            index = self._index[node] = len(self.nodes)
            self.nodes.append(node)
        return Scalar(self, index)

    def input(self, name: str, index: int = 0) -> Scalar:
        """Scalar whose value a back end provides, such as ``("q", 3)``."""
        return self.record("input", name, index)

    def constant(self, value: float) -> Scalar:
        """Scalar with a fixed value."""
        return self.record("constant", float(value) + 0.0)  # -0.0 and 0.0 are one node

    def live(self, outputs: Iterable[Scalar], given: Container[int] = ()) -> list[int]:
        """Indices of all nodes that the outputs need, operands before their users.

        Nodes that are ``given`` by other means are listed, but not their operands.
        """
        needed: set[int] = set()
        stack = [output.index for output in outputs]
        while stack:
            index = stack.pop()
            if index not in needed:
                needed.add(index)
                if index not in given:
                    stack.extend(operands(self.nodes[index]))
        return sorted(needed)


def operands(node: Node) -> tuple[int, ...]:
    """Indices of the nodes that a node is computed from."""
    return node[1:] if node[0] in BINARY or node[0] in UNARY else ()


class Scalar:
    """A number on a tape; arithmetic with it records operations."""

    __slots__ = ("index", "tape")

    def __init__(self, tape: Tape, index: int) -> None:
        self.tape = tape
        self.index = index

    @property
    def node(self) -> Node:
        """The entry of the tape."""
        return self.tape.nodes[self.index]

    @property
    def value(self) -> float | None:
        """The value of a constant, None for anything else."""
        node = self.node
        return node[1] if node[0] == "constant" else None

    def is_zero(self) -> bool:
        """Whether the scalar is the constant zero."""
        return self.value == 0.0

    def _other(self, other: Scalar | float) -> Scalar:
        return other if isinstance(other, Scalar) else self.tape.constant(other)

    def _operand(self) -> Scalar:
        """The operand of a negation."""
        return Scalar(self.tape, self.node[1])

    def __neg__(self) -> Scalar:
        if self.value is not None:
            return self.tape.constant(-self.value)
        if self.node[0] == "neg":
            return self._operand()
        if self.node[0] == "sub":
            return Scalar(self.tape, self.node[2]) - Scalar(self.tape, self.node[1])
        return self.tape.record("neg", self.index)

    def __add__(self, other: Scalar | float) -> Scalar:
        other = self._other(other)
        if self.value is not None and other.value is not None:
            return self.tape.constant(self.value + other.value)
        if self.is_zero():
            return other
        if other.is_zero():
            return self
        if other.node[0] == "neg":
            return self - other._operand()
        if self.node[0] == "neg":
            return other - self._operand()
        return self.tape.record("add", *sorted((self.index, other.index)))

    __radd__ = __add__

    def __sub__(self, other: Scalar | float) -> Scalar:
        other = self._other(other)
        if self.value is not None and other.value is not None:
            return self.tape.constant(self.value - other.value)
        if other.is_zero():
            return self
        if self.is_zero():
            return -other
        if self.index == other.index:
            return self.tape.constant(0.0)
        if other.node[0] == "neg":
            return self + other._operand()
        if self.node[0] == "neg":
            return -(self._operand() + other)
        return self.tape.record("sub", self.index, other.index)

    def __rsub__(self, other: float) -> Scalar:
        return self._other(other) - self

    def __mul__(self, other: Scalar | float) -> Scalar:
        other = self._other(other)
        if self.value is not None and other.value is not None:
            return self.tape.constant(self.value * other.value)
        for factor, rest in ((self, other), (other, self)):
            if factor.value == 0.0:
                return factor
            if factor.value == 1.0:
                return rest
            if factor.value == -1.0:
                return -rest
            if factor.node[0] == "neg":
                return -(factor._operand() * rest)
        return self.tape.record("mul", *sorted((self.index, other.index)))

    __rmul__ = __mul__

    def __truediv__(self, other: Scalar | float) -> Scalar:
        other = self._other(other)
        if other.value is not None:
            return self * (1.0 / other.value)
        return self.tape.record("div", self.index, other.index)

    def __rtruediv__(self, other: float) -> Scalar:
        return self._other(other) / self

    def __pow__(self, exponent: float) -> Scalar:
        exponent = float(exponent)
        if self.value is not None:
            return self.tape.constant(self.value**exponent)
        if exponent in (1.0, 2.0):
            return self if exponent == 1.0 else self * self
        return self.tape.record("pow", self.index, self.tape.constant(exponent).index)

    def __lt__(self, other: Scalar | float) -> bool:
        values = self.value, self._other(other).value
        if values[0] is None or values[1] is None:
            raise TypeError("a branch that depends on the motion cannot be written down")
        return values[0] < values[1]

    def maximum(self, other: Scalar | float) -> Scalar:
        """The larger of two numbers."""
        other = self._other(other)
        if self.value is not None and other.value is not None:
            return self.tape.constant(max(self.value, other.value))
        return self.tape.record("max", *sorted((self.index, other.index)))

    def _function(self, name: str) -> Scalar:
        if self.value is not None:
            return self.tape.constant(_CONSTANT[name](self.value))
        return self.tape.record(name, self.index)

    def __abs__(self) -> Scalar:
        return self._function("abs")

    def sign(self) -> Scalar:
        """-1, 0 or 1."""
        return self._function("sign")

    def sin(self) -> Scalar:
        """Sine of an angle in rad."""
        return self._function("sin")

    def cos(self) -> Scalar:
        """Cosine of an angle in rad."""
        return self._function("cos")

    def tanh(self) -> Scalar:
        """Hyperbolic tangent."""
        return self._function("tanh")

    def exp(self) -> Scalar:
        """Exponential function."""
        return self._function("exp")

    def sqrt(self) -> Scalar:
        """Square root."""
        return self._function("sqrt")
