# SPDX-License-Identifier: BSD-3-Clause
"""Run a tape with NumPy on many samples at once.

A program is bound once to fixed buffers: one contiguous row of ``chunk`` samples per live value,
and a list of ufunc calls that write into them. Rows are reused as soon as their value is dead,
so that a chunk stays in the cache; samples run along the last axis, so that every call is one
contiguous loop.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from skidyn._exceptions import SkidynError
from skidyn.rigid_body._recursion import Program
from skidyn.rigid_body._tape import Node, operands

_UFUNCS: dict[str, Callable[..., Any]] = {
    "add": np.add,
    "sub": np.subtract,
    "mul": np.multiply,
    "neg": np.negative,
    "sin": np.sin,
    "cos": np.cos,
    "tanh": np.tanh,
    "exp": np.exp,
    "sqrt": np.sqrt,
    "abs": np.absolute,
    "sign": np.sign,
    "div": np.divide,
    "max": lambda a, b, out: np.maximum(a, b, out=out),
    "pow": np.power,
}


class BoundProgram:
    """A program with its buffers for chunks of a fixed size.

    Attributes
    ----------
    inputs : dict of str to ndarray of shape (n, chunk)
        To be filled before :meth:`run`; ``"parameter"`` has shape (n, 1).
    outputs : ndarray of shape ``program.shape + (chunk,)``
        Filled by :meth:`run`; entries that vanish for every motion stay zero.
    """

    def __init__(self, program: Program, chunk: int, dtype: np.dtype) -> None:
        self.chunk = chunk
        self.dtype = dtype
        self.outputs = _aligned_zeros((*program.shape, chunk), dtype)
        self._nodes = program.tape.nodes
        self._live = program.tape.live(program.outputs.values())
        self.inputs = self._input_buffers()
        self._values: dict[int, np.ndarray] = {}
        self._uniform_calls: list[tuple[Callable[..., Any], tuple[Any, ...]]] = []
        self._calls: list[tuple[Callable[..., Any], tuple[Any, ...]]] = []
        self._final: list[tuple[int, tuple[int, ...]]] = []  # calls that write an output for good
        self._reread: list[tuple[int, ...]] = []  # outputs that other calls read
        self._bind(program)

    def _input_buffers(self) -> dict[str, np.ndarray]:
        sizes: dict[str, int] = {}
        for index in self._live:
            if self._nodes[index][0] == "input":
                _, name, position = self._nodes[index]
                sizes[name] = max(sizes.get(name, 0), position + 1)
        return {
            name: _aligned_zeros((size, 1 if name == "parameter" else self.chunk), self.dtype)
            for name, size in sizes.items()
        }

    def _bind(self, program: Program) -> None:
        """Give every live value a row and list the calls that fill the rows."""
        uniform = self._uniform()
        targets: dict[int, tuple[int, ...]] = {}
        copies: list[tuple[tuple[int, ...], int]] = []
        for key, scalar in program.outputs.items():
            computed = self._nodes[scalar.index][0] not in ("input", "constant")
            if computed and scalar.index not in uniform and scalar.index not in targets:
                targets[scalar.index] = key
            else:
                copies.append((key, scalar.index))
        last_use = {i: index for index in self._live for i in operands(self._nodes[index])}
        copied = {index for _, index in copies}
        free: list[np.ndarray] = []
        for index in self._live:
            node = self._nodes[index]
            if index in uniform or node[0] == "input":
                self._values[index] = self._leaf(node)
                continue
            arguments = tuple(self._values[i] for i in operands(node))
            for i in set(operands(node)):
                if last_use[i] == index and i not in uniform and i not in targets:
                    if self._nodes[i][0] != "input":
                        free.append(self._values[i])
            if index in targets:
                row = self.outputs[targets[index]]
                if index in last_use or index in copied:
                    self._reread.append(targets[index])
                else:
                    self._final.append((len(self._calls), targets[index]))
            else:
                row = free.pop() if free else _aligned_zeros((self.chunk,), self.dtype)
            self._values[index] = row
            self._calls.append(_call(node[0], arguments, row))
        for key, index in copies:
            self._calls.append((np.copyto, (self.outputs[key], self._values[index])))
            self._reread.append(key)

    def _uniform(self) -> set[int]:
        """Values that are the same for every sample: constants and functions of parameters."""
        uniform: set[int] = set()
        for index in self._live:
            node = self._nodes[index]
            if node[0] == "constant" or node[:2] == ("input", "parameter"):
                uniform.add(index)
            elif operands(node) and uniform.issuperset(operands(node)):
                uniform.add(index)
        return uniform

    def _leaf(self, node: Node) -> np.ndarray:
        # Uniform values have no axes: a ufunc stretches an axis of length one at twice the cost.
        if node[0] == "constant":
            return np.array(node[1], self.dtype)
        if node[0] == "input":
            row = self.inputs[node[1]][node[2]]
            return row.reshape(()) if node[1] == "parameter" else row
        value = np.empty((), self.dtype)
        arguments = tuple(self._values[i] for i in operands(node))
        self._uniform_calls.append((_UFUNCS[node[0]], (*arguments, value)))
        return value

    def set_parameters(self, parameters: np.ndarray) -> None:
        """Set the inertial parameters, shape (n_bodies, 10)."""
        buffer = self.inputs.get("parameter")
        if buffer is not None:
            buffer[:, 0] = parameters.ravel()[: len(buffer)]
            for function, arguments in self._uniform_calls:
                function(*arguments)

    @property
    def vanishing(self) -> np.ndarray:
        """Entries of the outputs that are zero for every motion, bool."""
        vanishing = np.ones(self.outputs.shape[:-1], dtype=bool)
        for key in (*self._reread, *(key for _, key in self._final)):
            vanishing[key] = False
        return vanishing

    def run(self, signals: dict[str, np.ndarray], rows: slice) -> int:
        """Evaluate the outputs at some rows of the signals; the number of rows is returned."""
        size = self._fill(signals, rows)
        for function, arguments in self._calls:
            function(*arguments)
        return size

    def run_into(self, out: np.ndarray, signals: dict[str, np.ndarray], rows: slice) -> None:
        """Write the outputs of a full chunk to memory of their shape, without a copy.

        Entries that vanish for every motion are not written.
        """
        self._fill(signals, rows)
        calls = self._calls.copy()
        for position, key in self._final:
            function, arguments = calls[position]
            calls[position] = function, (*arguments[:-1], out[key])
        for function, arguments in calls:
            function(*arguments)
        for key in self._reread:
            out[key] = self.outputs[key]

    def _fill(self, signals: dict[str, np.ndarray], rows: slice) -> int:
        size = 0
        for name, values in signals.items():
            buffer = self.inputs.get(name)
            part = values[rows]
            size = len(part)
            if buffer is not None:
                buffer[:, :size] = part.T[: len(buffer)]
        return size


def _aligned_zeros(shape: tuple[int, ...], dtype: np.dtype) -> np.ndarray:
    """Zeros that start at a cache line: vector loads that straddle lines take nearly double."""
    line = 64
    n_bytes = math.prod(shape) * dtype.itemsize
    memory = np.zeros(n_bytes + line, np.uint8)
    start = -memory.ctypes.data % line
    return memory[start : start + n_bytes].view(dtype).reshape(shape)


def _call(
    operation: str, arguments: tuple[np.ndarray, ...], row: np.ndarray
) -> tuple[Callable[..., Any], tuple[Any, ...]]:
    """A function and its arguments that write the result of an operation into a row."""
    if operation in ("sin", "cos") and row.dtype == np.float64:
        # In float64 torch's sine is three times as fast as NumPy's; in float32 it is the slower.
        import torch

        function = partial(getattr(torch, operation), out=torch.from_numpy(row))
        return function, (torch.from_numpy(arguments[0]),)
    return _UFUNCS[operation], (*arguments, row)


def chunk_size(n_samples: int, limit: int) -> int:
    """Size of equal chunks, at most ``limit``, if possible a multiple of 64.

    Equal, because a chunk that is half empty costs as much as a full one; small calls get small
    buffers.
    """
    n_chunks = max(1, math.ceil(n_samples / limit))
    return min(limit, max(64, 64 * math.ceil(n_samples / n_chunks / 64)))


def evaluate_rows(
    bound: BoundProgram,
    signals: dict[str, np.ndarray],
    n_samples: int,
    out: np.ndarray | None = None,
) -> np.ndarray:
    """All outputs with the samples first, shape ``(n_samples, *program.shape)``.

    The memory keeps the samples last; what is returned is a view.
    """
    shape = (*bound.outputs.shape[:-1], n_samples)
    if out is None:
        result = np.zeros(shape, bound.dtype)  # untouched zeros cost no memory traffic
    else:
        result = out
        clear_vanishing(out, bound.vanishing, bound.dtype, n_samples)
    for start in range(0, n_samples, bound.chunk):
        rows = slice(start, min(start + bound.chunk, n_samples))
        size = rows.stop - rows.start
        if size == bound.chunk:
            bound.run_into(result[..., rows], signals, rows)
        else:
            bound.run(signals, rows)
            result[..., rows] = bound.outputs[..., :size]
    return np.moveaxis(result, -1, 0)


def clear_vanishing(
    out: np.ndarray, vanishing: np.ndarray, dtype: np.dtype, n_samples: int
) -> None:
    """Check memory for outputs, samples last, and write the zeros that no program writes."""
    shape = (*vanishing.shape, n_samples)
    if out.shape != shape or out.dtype != dtype or not out.flags.c_contiguous:
        raise SkidynError(
            f"out has shape {out.shape} and type {out.dtype}; expected {shape} of {dtype}, "
            "C-contiguous."
        )
    for key in np.argwhere(vanishing):
        row = out[tuple(key)]
        # Memory that held a regressor before has its zeros: reading is cheaper than writing.
        if n_samples and row.view(f"u{dtype.itemsize}").max():
            row[...] = 0.0
