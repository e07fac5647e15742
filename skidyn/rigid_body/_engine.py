# SPDX-License-Identifier: BSD-3-Clause
"""Batched rigid-body dynamics of one robot: traced once, kept, and run by one of the back ends."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from skidyn.rigid_body._numpy import BoundProgram, chunk_size, evaluate_rows
from skidyn.rigid_body._recursion import (
    Program,
    trace_inverse_dynamics,
    trace_jacobian,
    trace_mass_matrix,
    trace_pose,
    trace_torque_regressor,
)
from skidyn.rigid_body._tree import KinematicTree

if TYPE_CHECKING:
    import torch

#: Samples per chunk. Below about a thousand the cost of a ufunc call shows; far above, the rows of
#: a chunk no longer fit into the second-level cache.
CHUNK = 4096


class Engine:
    """Rigid-body functions of one kinematic tree.

    Programs are traced when they are first asked for. Buffers belong to a thread, so that an engine
    may be used from several threads at once.
    """

    def __init__(self, tree: KinematicTree, parameters: np.ndarray, gravity: np.ndarray) -> None:
        self.tree = tree
        self.parameters = parameters
        self.gravity = gravity
        self._programs: dict[tuple, Program] = {}
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
        if kind == "inverse_dynamics":
            gravity, velocity, acceleration = options
            return trace_inverse_dynamics(
                self.tree, gravity, with_velocity=velocity, with_acceleration=acceleration
            )
        if kind == "torque_regressor":
            return trace_torque_regressor(self.tree, *options)
        if kind == "mass_matrix":
            return trace_mass_matrix(self.tree)
        return {"pose": trace_pose, "jacobian": trace_jacobian}[kind](self.tree, *options)

    def _bound(self, n_samples: int, limit: int, dtype: Any, *key: Any) -> BoundProgram:
        """Program bound to buffers of this thread."""
        cache: dict[tuple, BoundProgram] = self._local.__dict__.setdefault("cache", {})
        chunk = chunk_size(n_samples, limit)
        full = (chunk, np.dtype(dtype), *key)
        if full not in cache:
            cache[full] = BoundProgram(self.program(*key), chunk, np.dtype(dtype))
        return cache[full]

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
        bound = self._bound(n_samples, CHUNK, dtype, *key)
        bound.set_parameters(self.parameters if parameters is None else parameters)
        return evaluate_rows(bound, signals, n_samples, out)

    def iter_chunks(
        self, signals: dict[str, np.ndarray], chunk: int, *key: Any, dtype: Any = np.float64
    ) -> Iterator[tuple[slice, np.ndarray]]:
        """Yield ``(rows, outputs)``; the outputs are a view of a buffer that is used again."""
        n_samples = len(signals["q"])
        bound = BoundProgram(self.program(*key), min(chunk, max(n_samples, 1)), np.dtype(dtype))
        for start in range(0, n_samples, bound.chunk):
            rows = slice(start, min(start + bound.chunk, n_samples))
            size = bound.run(signals, rows)
            yield rows, bound.outputs[..., :size]

    @cached_property
    def _gravity_key(self) -> tuple[float, ...]:
        return tuple(float(g) for g in self.gravity)

    def gravity_key(self, gravity: Any = None) -> tuple[float, ...]:
        """Gravity as a key of the program cache."""
        return self._gravity_key if gravity is None else tuple(float(g) for g in gravity)

    def evaluate_torch(
        self, signals: dict[str, torch.Tensor], *key: Any, parameters: Any = None
    ) -> torch.Tensor:
        """Outputs of a program for a batch of tensors, differentiable."""
        import torch

        from skidyn.rigid_body._torch import evaluate

        reference = signals["q"]
        if parameters is None:
            parameters = torch.tensor(
                self.parameters, dtype=reference.dtype, device=reference.device
            )
        inputs = {**signals, "parameter": parameters.reshape(-1)}
        return evaluate(self.program(*key), inputs)
