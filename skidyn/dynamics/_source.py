# SPDX-License-Identifier: BSD-3-Clause
"""Write a tape as straight-line program text, for Python and for C."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Mapping
from types import MappingProxyType

from skidyn.dynamics._recursion import Program
from skidyn.dynamics._tape import operands

#: Text of an operation; one that is not listed is a function of the operation's name.
PYTHON = {
    "neg": "-{0}",
    "add": "{0} + {1}",
    "sub": "{0} - {1}",
    "mul": "{0} * {1}",
    "div": "{0} / {1}",
    "pow": "{0} ** {1}",
    "max": "maximum({0}, {1})",
}
C = PYTHON | {
    "abs": "fabs({0})",
    "sign": "({0} > 0.0) - ({0} < 0.0)",
    "max": "fmax({0}, {1})",
    "pow": "pow({0}, {1})",
}

#: Name of an input in the generated text, for example ``q[3]``.
InputName = Callable[[str, int], str]


def subscript(name: str, position: int) -> str:
    """Input as an element of an array of that name."""
    return f"{name}[{position}]"


def statements(
    program: Program,
    *,
    input_name: InputName = subscript,
    prefix: str = "",
    suffix: str = "",
    language: Mapping[str, str] = MappingProxyType(PYTHON),
    given: Mapping[int, str] = MappingProxyType({}),
    nested: int = 0,
) -> tuple[list[str], dict[tuple[int, ...], str]]:
    """Assignments that compute the outputs, and the expression of every output.

    ``input_name`` gives the text of the input ``(name, position)``; ``prefix`` and ``suffix`` are
    written before and after every assignment, such as ``"double "`` and ``";"``; ``given`` are
    expressions of nodes of the tape that are computed elsewhere. Expressions that are used once are
    written where they are used, up to the depth ``nested``, which is faster to interpret but harder
    to read.
    """
    nodes = program.tape.nodes
    names: dict[int, str] = {}
    lines = []
    live = program.tape.live(program.outputs.values(), given)
    uses = Counter(i for index in live if index not in given for i in operands(nodes[index]))
    uses.update(scalar.index for scalar in program.outputs.values())
    depths: Counter[int] = Counter()
    for index in live:
        node = nodes[index]
        if index in given:
            names[index] = given[index]
            continue
        if node[0] == "constant":
            # Parentheses keep "a - -1.5" readable and legal everywhere.
            names[index] = repr(node[1]) if node[1] >= 0 else f"({node[1]!r})"
            continue
        if node[0] == "input":
            names[index] = input_name(node[1], node[2])
            continue
        terms = [names[i] for i in operands(node)]
        text = language.get(node[0], f"{node[0]}({{0}})").format(*terms)
        depth = 1 + max(depths[i] for i in operands(node))
        if uses[index] == 1 and depth <= nested:
            names[index], depths[index] = f"({text})", depth
            continue
        names[index] = f"v{index}"
        lines.append(f"{prefix}{names[index]} = {text}{suffix}")
    return lines, {key: names[scalar.index] for key, scalar in program.outputs.items()}


def renumber(lines: list[str]) -> list[str]:
    """Number the variables ``v..`` of generated lines from 0, without gaps."""
    numbers: dict[str, str] = {}

    def rename(match: re.Match[str]) -> str:
        return numbers.setdefault(match.group(), f"v{len(numbers)}")

    return [re.sub(r"\bv\d+\b", rename, line) for line in lines]
