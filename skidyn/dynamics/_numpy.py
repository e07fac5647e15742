# SPDX-License-Identifier: BSD-3-Clause
"""Run a tape with NumPy on many samples at once.

A program is bound once to fixed buffers: one contiguous row of ``chunk`` samples per live value,
and a list of ufunc calls that write into them. Rows are reused as soon as their value is dead,
so that a chunk stays in the cache; samples run along the last axis, so that every call is one
contiguous loop.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from skidyn._exceptions import SkidynError
from skidyn.dynamics._recursion import Program
from skidyn.dynamics._tape import Node, operands

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

    ``inputs`` of shape (n, chunk) are to be filled before :meth:`run`; ``"parameter"`` has shape
    (n, 1). ``outputs`` of shape ``program.shape + (chunk,)`` are filled by it; entries that vanish
    for every motion stay zero.
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
        self._final: list[tuple[int, tuple[int, ...]]] = []  # calls that write a final output
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
        angles = _HalfTangents(self._nodes, self._live, self.dtype)
        for index in self._live:
            node = self._nodes[index]
            if index in uniform or node[0] == "input":
                self._values[index] = self._leaf(node)
                continue
            arguments = tuple(self._values[i] for i in operands(node))
            if node[0] in angles.kinds:
                self._calls += angles.prepare(node[1], arguments[0], self._row, free)
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
                row = self._row(free)
            self._values[index] = row
            if node[0] in angles.kinds:
                self._calls.append(angles.finish(node[0], node[1], row, free))
            else:
                self._calls.append((_UFUNCS[node[0]], (*arguments, row)))
        for key, index in copies:
            self._calls.append((np.copyto, (self.outputs[key], self._values[index])))
            self._reread.append(key)

    def _row(self, free: list[np.ndarray]) -> np.ndarray:
        return free.pop() if free else _aligned_zeros((self.chunk,), self.dtype)

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
        """Write the outputs of a full chunk into given memory of their shape, without a copy.

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


class _HalfTangents:
    """Sine and cosine of an angle from one tangent of its half.

    With ``t = tan(x / 2)`` and ``w = 2 / (1 + t^2)`` the sine is ``t w`` and the cosine ``w - 1``,
    both within 4e-16. In float64 NumPy's tangent uses the vector unit of the processor, and its
    sine and cosine do not: the tangent is five times as fast as the two, and not slower without a
    vector unit. float32 has vectorised sines of its own.
    """

    def __init__(self, nodes: Sequence[Node], live: Iterable[int], dtype: np.dtype) -> None:
        self.kinds = ("sin", "cos") if dtype == np.float64 else ()
        used = [nodes[i] for i in live]
        self._left = Counter(node[1] for node in used if node[0] in self.kinds)
        self._rows: dict[int, tuple[np.ndarray, np.ndarray]] = {}
        self._half, self._one, self._two = (np.array(c, dtype) for c in (0.5, 1.0, 2.0))

    def prepare(
        self,
        angle: int,
        values: np.ndarray,
        new_row: Callable[[list[np.ndarray]], np.ndarray],
        free: list[np.ndarray],
    ) -> list[tuple[Callable[..., Any], tuple[Any, ...]]]:
        """Calls that compute t and w of an angle; none if they are available already."""
        if angle in self._rows:
            return []
        t, w = self._rows[angle] = new_row(free), new_row(free)
        return [
            (np.multiply, (values, self._half, t)),
            (np.tan, (t, t)),
            (np.multiply, (t, t, w)),
            (np.add, (w, self._one, w)),
            (np.divide, (self._two, w, w)),
        ]

    def finish(
        self, kind: str, angle: int, row: np.ndarray, free: list[np.ndarray]
    ) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        """The call that computes the sine or cosine; after the last one t and w are free again."""
        t, w = self._rows[angle]
        self._left[angle] -= 1
        if not self._left[angle]:
            free += [t, w]
        return (np.multiply, (t, w, row)) if kind == "sin" else (np.subtract, (w, self._one, row))


def chunk_size(n_samples: int, limit: int) -> int:
    """Size of equal chunks, at most ``limit``, if possible a multiple of 64.

    The chunks are equal because a half-empty chunk costs as much as a full one; small calls get
    small buffers.
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
        result = np.zeros(shape, bound.dtype)  # unwritten zeros cost no memory traffic
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
        # Memory that held a regressor before has its zeros already: reading is cheaper than
        # writing.
        if n_samples and row.view(f"u{dtype.itemsize}").max():
            row[...] = 0.0
