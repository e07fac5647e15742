# SPDX-License-Identifier: BSD-3-Clause
"""A torque given as a formula of the signals, as the diagnosis proposes for unknown effects."""

from __future__ import annotations

import ast
import operator
import re
from collections.abc import Callable
from typing import Any

import numpy as np

from skidyn._exceptions import EffectError
from skidyn._signals import Array, Signals
from skidyn._text import joints_of
from skidyn.effects._base import Effect
from skidyn.effects._parameters import Coefficient
from skidyn.effects._term import Term

#: Longest formula and largest exponent; formulas of friction or springs are far below both.
LONGEST, LARGEST_POWER = 200, 9

_FUNCTIONS: dict[str, Callable[[Any], Any]] = {
    "abs": np.abs,
    "cos": np.cos,
    "exp": np.exp,
    "sign": np.sign,
    "sin": np.sin,
    "sqrt": np.sqrt,
    "tanh": np.tanh,
}
_OPERATORS: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}
_SIGNAL = re.compile(r"(q|dq|ddq)([1-9]\d{0,4})\Z")
_GRAMMAR = (
    "numbers, q1.., dq1.., ddq1.., t, + - * / **, and the functions "
    f"{', '.join(_FUNCTIONS)} of one argument"
)


def formula(expression: str, joint: int) -> Term:
    """A term whose torque is a coefficient times a formula of the signals.

    Parameters
    ----------
    expression : str
        In ``q1``, ``dq1``, ``ddq1``, ... (joints counted from 1, rad or m and s) and ``t`` (s),
        with numbers, ``+ - * / **`` and ``abs cos exp sign sin sqrt tanh``. Nothing else is
        evaluated.
    joint : int
        Joint on which the torque acts, counted from 1.

    Returns
    -------
    Term
        Term for the effects of a model; its coefficient is fitted.

    Raises
    ------
    EffectError
        The expression contains anything else.

    Examples
    --------
    >>> print(formula("sin(q1 - q3)", joint=3))
    formula(joint 3, expression=sin(q1 - q3))
    """
    _parse(expression)
    return Term("formula", (joint,), {"expression": expression})


class Formula(Effect):
    """A formula of the signals, given by the user or proposed by the diagnosis."""

    kind = "formula"
    title = "Formula"
    formula = r"c\,f(q, \dot q, \ddot q, t)"
    coefficients = (Coefficient("c", "N m"),)
    nameless = True
    search = "given"

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        expression = shape["expression"]
        with np.errstate(all="ignore"):
            value = _value(_parse(expression), signals, expression)
        column = np.broadcast_to(np.asarray(value, dtype=float), signals.n_samples)
        if not np.all(np.isfinite(column)):
            row = int(np.flatnonzero(~np.isfinite(column))[0])
            raise EffectError(f"formula {expression!r} is not finite in row {row}")
        return np.array(column)[:, None]


def _parse(expression: str) -> ast.expr:
    """Syntax tree of a formula that contains only elements of the grammar."""
    if not isinstance(expression, str) or len(expression) > LONGEST:
        raise EffectError(f"a formula is a text of at most {LONGEST} characters")
    try:
        tree = ast.parse(expression, mode="eval").body
        _check(tree, expression)
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        if isinstance(error, EffectError):
            raise
        raise EffectError(f"formula {expression!r} cannot be read: {error}") from None
    return tree


def _check(node: ast.expr, text: str) -> None:
    if isinstance(node, ast.BinOp) and type(node.op) in _OPERATORS:
        if isinstance(node.op, ast.Pow):
            _check_power(node.right, text)
        _check(node.left, text)
        _check(node.right, text)
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.UAdd):
        _check(node.operand, text)
    elif isinstance(node, ast.Call):
        known = isinstance(node.func, ast.Name) and node.func.id in _FUNCTIONS
        if not known or len(node.args) != 1 or node.keywords:
            raise _refusal(node, text)
        _check(node.args[0], text)
    elif isinstance(node, ast.Constant):
        if type(node.value) not in (int, float):
            raise _refusal(node, text)
    elif isinstance(node, ast.Name):
        if node.id != "t" and not _SIGNAL.match(node.id):
            raise _refusal(node, text)
    else:
        raise _refusal(node, text)


def _check_power(node: ast.expr, text: str) -> None:
    """Exponents are small numbers, so that no formula takes very long or overflows."""
    number = node.operand if isinstance(node, ast.UnaryOp) else node
    fine = isinstance(number, ast.Constant) and type(number.value) in (int, float)
    if not fine or abs(number.value) > LARGEST_POWER:  # type: ignore[attr-defined]
        raise EffectError(
            f"formula {text!r}: an exponent must be a number of at most {LARGEST_POWER}"
        )


def _refusal(node: ast.expr, text: str) -> EffectError:
    part = ast.get_source_segment(text, node) or text
    return EffectError(f"formula {text!r}: {part!r} is not allowed; a formula holds {_GRAMMAR}")


def _value(node: ast.expr, signals: Signals, text: str) -> Any:
    if isinstance(node, ast.BinOp):
        left, right = _value(node.left, signals, text), _value(node.right, signals, text)
        return _OPERATORS[type(node.op)](np.float64(left), np.float64(right))
    if isinstance(node, ast.UnaryOp):
        value = _value(node.operand, signals, text)
        return -value if isinstance(node.op, ast.USub) else value
    if isinstance(node, ast.Call):
        assert isinstance(node.func, ast.Name)
        (argument,) = node.args
        if node.func.id == "sign" and isinstance(argument, ast.Name):
            name = _SIGNAL.match(argument.id)
            if name and name[1] == "dq":  # the direction of dry friction is smooth near rest
                return signals.sign[:, _joint(name[2], signals, text)]
        return _FUNCTIONS[node.func.id](_value(argument, signals, text))
    if isinstance(node, ast.Constant):
        return np.float64(node.value)  # type: ignore[arg-type]
    assert isinstance(node, ast.Name)
    if node.id == "t":
        return signals.clock
    name = _SIGNAL.match(node.id)
    assert name is not None
    return getattr(signals, name[1])[:, _joint(name[2], signals, text)]


def _joint(number: str, signals: Signals, text: str) -> int:
    joint = int(number) - 1
    if joint >= signals.n_joints:
        raise EffectError(
            f"formula {text!r}: no joint {number}; the robot has {joints_of(signals.n_joints)}"
        )
    return joint
