# SPDX-License-Identifier: BSD-3-Clause
"""Run a tape with torch: differentiable, on any device."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from skidyn.rigid_body._recursion import Program
from skidyn.rigid_body._tape import operands

if TYPE_CHECKING:
    import torch


def evaluate(program: Program, inputs: dict[str, torch.Tensor]) -> torch.Tensor:
    """Outputs of a program for a batch.

    Parameters
    ----------
    program : Program
        Of a rigid body; the operations that only effects need are not among its functions.
    inputs : dict of str to Tensor
        Signals of shape (N, n); ``"parameter"`` has shape (n,).

    Returns
    -------
    Tensor of shape (N, *program.shape)
    """
    import torch

    columns = {name: tensor.unbind(-1) for name, tensor in inputs.items()}
    reference = inputs["q"]
    functions: dict[str, Any] = {
        "add": torch.add,
        "sub": torch.sub,
        "mul": torch.mul,
        "neg": torch.neg,
        "sin": torch.sin,
        "cos": torch.cos,
    }
    values: dict[int, torch.Tensor | float] = {}
    for index in program.tape.live(program.outputs.values()):
        node = program.tape.nodes[index]
        if node[0] == "constant":
            values[index] = node[1]
        elif node[0] == "input":
            values[index] = columns[node[1]][node[2]]
        elif node[0] == "sub" and isinstance(values[node[1]], float):
            values[index] = values[node[1]] - values[node[2]]
        else:
            # torch.add and torch.mul want their tensor first; both are commutative.
            arguments = [values[i] for i in operands(node)]
            if isinstance(arguments[0], float):
                arguments.reverse()
            values[index] = functions[node[0]](*arguments)
    flat = [_position(key, program.shape) for key in program.outputs]
    zero = reference.new_zeros(reference.shape[:-1])
    entries = [zero] * _size(program.shape)
    for position, scalar in zip(flat, program.outputs.values(), strict=True):
        value = values[scalar.index]
        entries[position] = zero + value  # a constant or a parameter fills the whole batch
    return torch.stack(entries, dim=-1).reshape(*reference.shape[:-1], *program.shape)


def _position(key: tuple[int, ...], shape: tuple[int, ...]) -> int:
    position = 0
    for index, size in zip(key, shape, strict=True):
        position = position * size + index
    return position


def _size(shape: tuple[int, ...]) -> int:
    size = 1
    for length in shape:
        size *= length
    return size
