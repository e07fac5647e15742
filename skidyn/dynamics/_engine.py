# SPDX-License-Identifier: BSD-3-Clause
"""Batched rigid-body dynamics of one robot: traced once, cached, run by one of the back ends."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cached_property
from typing import Any

import numpy as np

from skidyn.dynamics._canonical import CanonicalModel, canonicalize
from skidyn.dynamics._compiled import CompiledProgram
from skidyn.dynamics._numbers import Numbers
from skidyn.dynamics._numpy import BoundProgram, chunk_size, clear_vanishing, evaluate_rows
from skidyn.dynamics._recursion import (
    Program,
    inverse_dynamics,
    trace_inverse_dynamics,
    trace_jacobian,
    trace_mass_matrix,
    trace_pose,
    trace_torque_regressor,
)
from skidyn.dynamics._scalar import ScalarFunction
from skidyn.dynamics._tape import Scalar
from skidyn.dynamics._tree import KinematicTree

#: Samples per chunk. Below about a thousand the overhead of ufunc calls dominates; far above, the
#: rows of a chunk no longer fit into the second-level cache.
CHUNK = 6144

#: Most numbers in the outputs of a chunk (64 MiB); a bound for robots of some twenty joints or
#: more.
LARGEST = 2**23

#: Up to this many samples are run one by one.
FEW = 8

#: Sets of buffers that a thread keeps between calls.
KEPT = 6


class Engine:
    """Rigid-body functions of one kinematic tree.

    Programs are traced when they are first needed. Buffers belong to a thread, so that an engine
    may be used from several threads at once.
    """

    def __init__(self, tree: KinematicTree, parameters: np.ndarray, gravity: np.ndarray) -> None:
        self.tree = tree
        self.parameters = parameters
        self.gravity = gravity
        self._programs: dict[tuple[Any, ...], Program] = {}
        self._scalars: dict[tuple[Any, ...], ScalarFunction] = {}
        self._compiled_programs: dict[tuple[Any, ...], CompiledProgram] = {}
        self._local = threading.local()

    def __getstate__(self) -> dict[str, Any]:
        # Programs and buffers are rebuilt on demand: a pickled robot stays small.
        return {"tree": self.tree, "parameters": self.parameters, "gravity": self.gravity}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__init__(**state)  # type: ignore[misc]

    def program(self, kind: str, *options: Any) -> Program:
        """Traced program of a function, from the cache if it was traced before."""
        key = (kind, *options)
        if key not in self._programs:
            self._programs[key] = self._trace(kind, *options)
        return self._programs[key]

    def _trace(self, kind: str, *options: Any) -> Program:
        if kind == "fixed_inverse_dynamics":
            gravity, velocity, acceleration = options
            return self.fixed_inverse_dynamics(
                self.parameters, gravity, with_velocity=velocity, with_acceleration=acceleration
            )
        if kind == "inverse_dynamics":
            gravity, velocity, acceleration, sparse = options
            return trace_inverse_dynamics(
                self.canonical.tree,
                self.canonical.gravity(gravity),
                with_velocity=velocity,
                with_acceleration=acceleration,
                parameters_used=self._own_parameters != 0 if sparse else self._structure,
            )
        if kind == "torque_regressor":
            return trace_torque_regressor(self.tree, *options)
        if kind == "regressor_columns":
            gravity, columns, spare = options
            whole = self.program("torque_regressor", gravity)
            place = {column: i for i, column in enumerate(columns)}
            wanted: dict[tuple[int, ...], Scalar] = {
                (j, place[c]): x for (j, c), x in whole.outputs.items() if c in place
            }
            return Program(whole.tape, wanted, (whole.shape[0], len(columns) + spare))
        if kind == "mass_matrix":
            return trace_mass_matrix(self.canonical.tree, self._structure)
        return {"pose": trace_pose, "jacobian": trace_jacobian}[kind](self.tree, *options)

    def _chunk(self, n_samples: int, limit: int, *key: Any) -> int:
        """Size of chunks whose outputs stay within a bound on memory."""
        fitting = max(512, LARGEST // max(1, len(self.program(*key).outputs)))
        return chunk_size(n_samples, min(limit, fitting))

    @contextmanager
    def _borrowed(self, chunk: int, dtype: Any, *key: Any) -> Iterator[BoundProgram]:
        """Program with buffers that no other thread uses, kept for the next call."""
        free: OrderedDict[tuple[Any, ...], BoundProgram] = self._local.__dict__.setdefault(
            "free", OrderedDict()
        )
        name = (chunk, np.dtype(dtype), *key)
        bound = free.pop(name, None) or BoundProgram(self.program(*key), chunk, np.dtype(dtype))
        try:
            yield bound
        finally:
            free[name] = bound
            while len(free) > KEPT:
                free.popitem(last=False)

    def _is_small(self, signals: dict[str, np.ndarray], dtype: Any) -> bool:
        """Whether straight-line Python is faster than NumPy: few samples, not too many joints."""
        return len(signals["q"]) <= FEW and dtype is np.float64 and self.tree.n_bodies <= 16

    def _scalar(self, *key: Any) -> ScalarFunction:
        if key not in self._scalars:
            self._scalars[key] = ScalarFunction(self.program(*key))
        return self._scalars[key]

    def torque_regressor(
        self,
        signals: dict[str, np.ndarray],
        *,
        dtype: Any,
        out: np.ndarray | None,
        backend: str = "numpy",
    ) -> np.ndarray:
        """Torque per unit of every inertial parameter, samples first."""
        key = "torque_regressor", self.gravity_key()
        if backend == "compiled":
            compiled = self._compiled(*key)
            if out is not None:
                clear_vanishing(out, compiled.vanishing, np.dtype(float), len(signals["q"]))
            return np.moveaxis(compiled(signals, out=out), -1, 0)
        if out is None and self._is_small(signals, dtype):
            return self._scalar(*key)(signals)
        return self.evaluate(signals, *key, dtype=dtype, out=out)

    def evaluate(
        self,
        signals: dict[str, np.ndarray],
        *key: Any,
        parameters: np.ndarray | None = None,
        dtype: Any = np.float64,
        out: np.ndarray | None = None,
    ) -> np.ndarray:
        """Outputs of a program for all samples, samples first (a view of memory samples last)."""
        n_samples = len(signals["q"])
        with self._borrowed(self._chunk(n_samples, CHUNK, *key), dtype, *key) as bound:
            if parameters is not None:
                bound.set_parameters(parameters)
            return evaluate_rows(bound, signals, n_samples, out)

    def iter_chunks(
        self, signals: dict[str, np.ndarray], chunk: int, *key: Any, dtype: Any = np.float64
    ) -> Iterator[tuple[slice, np.ndarray]]:
        """Yield ``(rows, outputs)``; the outputs are a view of a buffer that is used again."""
        n_samples = len(signals["q"])
        with self._borrowed(self._chunk(n_samples, chunk, *key), dtype, *key) as bound:
            for start in range(0, n_samples, bound.chunk):
                rows = slice(start, min(start + bound.chunk, n_samples))
                size = bound.run(signals, rows)
                yield rows, bound.outputs[..., :size]

    def iter_regressor_columns(
        self, signals: dict[str, np.ndarray], columns: tuple[int, ...], spare: int, chunk: int
    ) -> Iterator[tuple[slice, np.ndarray]]:
        """Some columns of the regressor chunk by chunk, followed by ``spare`` rows to be filled.

        With the rows of the caller in the same block of memory as the columns, one matrix product
        is enough for both.
        """
        key = "regressor_columns", self.gravity_key(), columns, spare
        yield from self.iter_chunks(signals, chunk, *key)

    def iter_compiled(
        self, signals: dict[str, np.ndarray], chunk: int, *key: Any
    ) -> Iterator[tuple[slice, np.ndarray]]:
        """The same through the compiler."""
        n_samples, compiled = len(signals["q"]), self._compiled(*key)
        buffer = np.zeros((*compiled.shape, self._chunk(n_samples, chunk, *key)))
        for start in range(0, n_samples, buffer.shape[-1]):
            rows = slice(start, min(start + buffer.shape[-1], n_samples))
            compiled({name: values[rows] for name, values in signals.items()}, out=buffer)
            yield rows, buffer[..., : rows.stop - rows.start]

    def fixed_inverse_dynamics(
        self,
        parameters: np.ndarray,
        gravity: Any = None,
        *,
        with_velocity: bool = True,
        with_acceleration: bool = True,
    ) -> Program:
        """Inverse dynamics with the numbers of the inertial parameters written into it."""
        return trace_inverse_dynamics(
            self.canonical.tree,
            self.canonical.gravity(self.gravity_key(gravity)),
            parameters=_without_dust(np.array(self.canonical.parameters(parameters))),
            with_velocity=with_velocity,
            with_acceleration=with_acceleration,
        )

    @cached_property
    def canonical(self) -> CanonicalModel:
        """The tree in the frames that take the fewest operations."""
        return canonicalize(self.tree)

    @cached_property
    def _structure(self) -> np.ndarray:
        """Canonical parameters that may differ from zero, for some inertial parameters."""
        present: np.ndarray = np.abs(self.canonical.kept).sum(axis=2) > 0
        return present

    @cached_property
    def _own_parameters(self) -> np.ndarray:
        """The robot's parameters in canonical frames, without rounding errors near zero."""
        return _without_dust(np.array(self.canonical.parameters(self.parameters)))

    def inverse_dynamics(
        self,
        signals: dict[str, np.ndarray],
        gravity: Any = None,
        *,
        parameters: np.ndarray | None = None,
        dtype: Any = np.float64,
        backend: str = "numpy",
    ) -> np.ndarray:
        """Joint torques; omitted signals are zero."""
        if backend == "once":
            return self._at_once(signals, gravity, parameters)
        options = self.gravity_key(gravity), "dq" in signals, "ddq" in signals
        if backend == "numpy" and parameters is None and self._is_small(signals, dtype):
            return self._scalar("fixed_inverse_dynamics", *options)(signals)
        key = *options, parameters is None
        own = self._own_parameters
        if parameters is not None:
            own = np.array(self.canonical.parameters(parameters))
        if backend == "compiled":
            return self._compiled("inverse_dynamics", *key)(signals, own).T
        return self.evaluate(signals, "inverse_dynamics", *key, parameters=own, dtype=dtype)

    def _at_once(
        self, signals: dict[str, np.ndarray], gravity: Any, parameters: np.ndarray | None
    ) -> np.ndarray:
        """Joint torques without a program, for a robot that is evaluated only once or twice."""
        numbers = Numbers(signals)
        own = self.parameters if parameters is None else parameters
        torques = inverse_dynamics(
            numbers,
            self.tree,
            self.gravity_key(gravity),
            [[numbers.constant(x) for x in row] for row in np.asarray(own).tolist()],
            with_velocity="dq" in signals,
            with_acceleration="ddq" in signals,
        )
        result = np.empty((len(torques), len(signals["q"])))
        for row, torque in zip(result, torques, strict=True):
            row[:] = torque.value
        return result.T

    def _compiled(self, *key: Any) -> CompiledProgram:
        if key not in self._compiled_programs:
            self._compiled_programs[key] = CompiledProgram(self.program(*key))
        return self._compiled_programs[key]

    def mass_matrix(
        self, signals: dict[str, np.ndarray], parameters: np.ndarray | None = None
    ) -> np.ndarray:
        """Joint-space inertia matrices."""
        own = self._own_parameters
        if parameters is not None:
            own = np.array(self.canonical.parameters(parameters))
        return self.evaluate(signals, "mass_matrix", parameters=own)

    @cached_property
    def _gravity_key(self) -> tuple[float, ...]:
        return tuple(float(g) for g in self.gravity)

    def gravity_key(self, gravity: Any = None) -> tuple[float, ...]:
        """Gravity as a key of the program cache."""
        return self._gravity_key if gravity is None else tuple(float(g) for g in gravity)


def _without_dust(parameters: np.ndarray) -> np.ndarray:
    """Parameters with the remainders of cancelled terms set to zero."""
    scale = np.abs(parameters).max(initial=0.0)
    return np.where(np.abs(parameters) < 1e-16 * scale, 0.0, parameters)
