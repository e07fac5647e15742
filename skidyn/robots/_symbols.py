# SPDX-License-Identifier: BSD-3-Clause
"""Symbols in place of numbers: NumPy code run on them is recorded on a tape."""

from __future__ import annotations

from collections.abc import Callable
from functools import reduce
from typing import Any

import numpy as np

from skidyn._signals import Signals
from skidyn.dynamics import Program, Scalar, Tape, operands
from skidyn.robots._robot import Robot


class Symbols(np.ndarray):
    """Array of scalars on a tape.

    NumPy's arithmetic on arrays of objects calls the methods of the objects, ``np.tanh`` the method
    ``tanh`` and so on. Functions that NumPy computes by comparison are recorded on the tape here.
    """

    def __array_ufunc__(
        self, ufunc: np.ufunc, method: str, *inputs: Any, out: Any = None, **options: Any
    ) -> Any:
        arrays = [np.asarray(x) for x in inputs]
        own = _OWN.get(ufunc.__name__)
        if own is not None and method == "reduce":
            values = arrays[0].ravel().tolist()
            return reduce(own, values, options.get("initial", values[0]))
        if own is not None:
            result = np.frompyfunc(own, ufunc.nin, 1)(*arrays)
        else:
            result = getattr(ufunc, method)(*arrays, **options)
        if out is not None:
            np.asarray(out[0])[...] = result
            return out[0]
        return np.asarray(result, dtype=object).view(Symbols)


def _maximum(a: Any, b: Any) -> Any:
    return a.maximum(b) if isinstance(a, Scalar) else b.maximum(a)


def _minimum(a: Any, b: Any) -> Any:
    return -_maximum(-a, -b)


_OWN: dict[str, Callable[..., Any]] = {
    "sign": lambda a: a.sign(),
    "maximum": _maximum,
    "minimum": _minimum,
}


class Instant(Signals):
    """One sample of symbols; access to its past or its time raises an error."""

    @property
    def segments(self) -> Any:
        """Refused."""
        raise TypeError("depends on the motion before")

    @property
    def clock(self) -> Any:
        """Refused."""
        raise TypeError("depends on time")


def symbols(tape: Tape, name: str, n: int) -> Symbols:
    """Inputs of one sample, shape (1, n)."""
    return filled([tape.input(name, i) for i in range(n)], (1, n))


def filled(values: list[Any], shape: tuple[int, ...]) -> Symbols:
    """Array of scalars of a shape."""
    array = np.empty(len(values), dtype=object)
    array[:] = values
    return array.reshape(shape).view(Symbols)


def replay(program: Program, tape: Tape, inputs: dict[str, Any]) -> dict[tuple[int, ...], Scalar]:
    """Record a program again on another tape, with other scalars as its inputs."""
    values: dict[int, Any] = {}
    for index in program.tape.live(program.outputs.values()):
        node = program.tape.nodes[index]
        if node[0] == "constant":
            values[index] = tape.constant(node[1])
        elif node[0] == "input":
            given = inputs[node[1]][node[2]]
            values[index] = given if isinstance(given, Scalar) else tape.constant(given)
        else:
            values[index] = _REPLAYED[node[0]](*(values[i] for i in operands(node)))
    return {key: values[scalar.index] for key, scalar in program.outputs.items()}


_REPLAYED: dict[str, Callable[..., Scalar]] = {
    "add": lambda a, b: a + b,
    "sub": lambda a, b: a - b,
    "mul": lambda a, b: a * b,
    "neg": lambda a: -a,
    "sin": lambda a: a.sin(),
    "cos": lambda a: a.cos(),
}


class SymbolicRobot:
    """Functions of a robot that effects and models need, for one sample of symbols."""

    def __init__(self, robot: Robot, tape: Tape) -> None:
        self._robot = robot
        self._tape = tape

    def __getattr__(self, name: str) -> Any:
        return getattr(self._robot, name)

    def inverse_dynamics(
        self, q: Any, dq: Any, ddq: Any, *, parameters: Any = None, gravity: Any = None
    ) -> Symbols:
        """Torques, shape (1, n_joints)."""
        engine = self._robot._engine
        values = self._robot.inertial_parameters if parameters is None else parameters
        program = engine.fixed_inverse_dynamics(np.asarray(values, dtype=float), gravity)
        return self._run(program, q=q, dq=dq, ddq=ddq)

    def jacobian(self, q: Any, body: int | str = -1) -> Symbols:
        """Jacobian, shape (1, 6, n_joints)."""
        return self._run(self._robot._engine.program("jacobian", *self._robot._frame(body)), q=q)

    def forward_kinematics(self, q: Any, body: int | str = -1) -> tuple[np.ndarray, np.ndarray]:
        """Symbols of the position, shape (1, 3), and rotation, shape (1, 3, 3)."""
        pose = self._run(self._robot._engine.program("pose", *self._robot._frame(body)), q=q)
        return pose[:, :, 3], pose[:, :, :3]

    def _run(self, program: Program, **signals: Any) -> Symbols:
        outputs = replay(program, self._tape, {name: x[0] for name, x in signals.items()})
        result = np.full(program.shape, self._tape.constant(0.0), dtype=object)
        for key, scalar in outputs.items():
            result[key] = scalar
        return result[np.newaxis].view(Symbols)
