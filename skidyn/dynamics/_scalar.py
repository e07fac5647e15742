# SPDX-License-Identifier: BSD-3-Clause
"""Run a tape for single samples: as a Python function of floats.

Below a handful of samples the calls into NumPy cost more than the arithmetic; straight-line Python
takes some 10 to 20 microseconds a sample for the inverse dynamics of an arm.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from skidyn.dynamics._recursion import Program
from skidyn.dynamics._source import renumber, statements

#: Depth of expressions; Python's compiler fails far above it.
NESTED = 8


_FUNCTIONS: dict[str, Callable[..., Any]] = {
    "abs": abs,
    "cos": math.cos,
    "exp": math.exp,
    "maximum": max,
    "sign": lambda x: (x > 0.0) - (x < 0.0),
    "sin": math.sin,
    "sqrt": math.sqrt,
    "tanh": math.tanh,
}


class ScalarFunction:
    """A program compiled to Python bytecode."""

    def __init__(self, program: Program) -> None:
        text = python_function(program, "evaluate", nested=NESTED)
        namespace = dict(_FUNCTIONS)
        exec(compile(text, "<skidyn program>", "exec"), namespace)  # text is made of numbers only
        self._function = namespace["evaluate"]
        self._shape = program.shape
        self._positions = np.ravel_multi_index(
            tuple(zip(*program.outputs, strict=True)), program.shape
        )

    def __call__(self, signals: dict[str, np.ndarray]) -> np.ndarray:
        """Outputs for the rows of the signals, shape ``(n_samples, *program.shape)``."""
        rows = [signals[name].tolist() if name in signals else None for name in ("q", "dq", "ddq")]
        n_samples = len(signals["q"])
        result = np.zeros((n_samples, math.prod(self._shape)))
        for k in range(n_samples):
            inputs = [row[k] if row is not None else () for row in rows]
            result[k, self._positions] = self._function(*inputs)
        return result.reshape(n_samples, *self._shape)


def python_function(program: Program, name: str, *, nested: int = 0) -> str:
    """Text of ``name(q, dq, ddq)``, which returns the outputs as a tuple.

    Functions ``sin`` and ``cos`` must be in scope. Arguments may be sequences of numbers or of
    arrays.
    """
    lines, outputs = statements(program, nested=nested)
    result = f"return ({', '.join(outputs.values())},)"
    body = renumber([*lines, result])
    return "\n".join([f"def {name}(q, dq, ddq):", *(f"    {line}" for line in body), ""])
