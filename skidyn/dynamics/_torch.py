# SPDX-License-Identifier: BSD-3-Clause
"""Run a tape with torch: differentiable, on any device."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from skidyn.dynamics._recursion import Program
from skidyn.dynamics._tape import operands

if TYPE_CHECKING:
    import torch


def evaluate_torch(program: Program, inputs: dict[str, torch.Tensor]) -> torch.Tensor:
    """Outputs of a program for a batch, shape (N, *program.shape).

    Signals are of shape (N, n); ``"parameter"`` has shape (n,).
    """
    import torch

    columns = {name: tensor.unbind(-1) for name, tensor in inputs.items()}
    reference = inputs["q"]
    values: dict[int, torch.Tensor | float] = {}
    for index in program.tape.live(program.outputs.values()):
        node = program.tape.nodes[index]
        if node[0] == "constant":
            values[index] = node[1]
        elif node[0] == "input":
            values[index] = columns[node[1]][node[2]]
        elif node[0] in _ORDERED and isinstance(values[node[1]], float):
            values[index] = _ORDERED[node[0]](values[node[1]], values[node[2]])
        else:
            # torch's functions take their tensor first; the remaining operations are commutative.
            arguments = [values[i] for i in operands(node)]
            if isinstance(arguments[0], float):
                arguments.reverse()
            function: Any = _maximum if node[0] == "max" else getattr(torch, node[0])
            values[index] = function(*arguments)
    zero = reference.new_zeros(reference.shape[:-1])
    entries = [zero] * math.prod(program.shape)
    for key, scalar in program.outputs.items():
        # constants and parameters fill the batch
        entries[np.ravel_multi_index(key, program.shape)] = zero + values[scalar.index]
    return torch.stack(entries, dim=-1).reshape(*reference.shape[:-1], *program.shape)


#: Operations of a number and a tensor that are not commutative.
_ORDERED: dict[str, Callable[[Any, Any], Any]] = {"sub": operator.sub, "div": operator.truediv}


def _maximum(a: torch.Tensor, b: torch.Tensor | float) -> torch.Tensor:
    return a.clamp_min(b) if isinstance(b, float) else a.maximum(b)
