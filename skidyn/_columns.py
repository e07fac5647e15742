# SPDX-License-Identifier: BSD-3-Clause
"""Meaning of the columns of X: the only implementation of skidyn's X contract.

A row of ``X`` is one sample. With column names the order is free and other columns are ignored:
``q_<joint>``, ``dq_<joint>``, ``ddq_<joint>`` (or ``q1 .. qn``, ``dq1 .. dqn``, ``ddq1 .. ddqn``),
and optionally ``trajectory``, ``time`` and ``temp_<joint>`` (or ``temp1 .. tempn``).
Without names the columns other than key columns are exactly ``3 n``: all positions, all velocities,
all accelerations, in the joint order of the robot.
"""

from __future__ import annotations

import numbers
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from skidyn._exceptions import ColumnError
from skidyn._text import counted, suggest

#: Key column of an estimator: by position, by name, found automatically, or absent.
ColumnSpec = int | str | None


@dataclass(frozen=True)
class Columns:
    """Positions of the signals among the columns of X.

    Attributes
    ----------
    q, dq : tuple of int, length n_joints
        Joint positions (rad or m) and velocities (rad/s or m/s).
    ddq : tuple of int or None
        Joint accelerations (rad/s^2 or m/s^2); None if X has none.
    trajectory, time : int or None
        Trajectory number; time in s.
    temperature : tuple of int or None
        Joint temperatures in degrees Celsius.
    """

    q: tuple[int, ...]
    dq: tuple[int, ...]
    ddq: tuple[int, ...] | None
    trajectory: int | None = None
    time: int | None = None
    temperature: tuple[int, ...] | None = None

    @property
    def n_joints(self) -> int:
        """Number of joints."""
        return len(self.q)

    def state(self) -> list[int]:
        """Positions of q, dq and ddq, in this order, for learners that need only the state."""
        return [*self.q, *self.dq, *(self.ddq or ())]

    def used(self) -> list[int]:
        """Positions of all columns with a meaning, the key columns last."""
        keys = (self.trajectory, self.time)
        return [*self.state(), *(self.temperature or ()), *(k for k in keys if k is not None)]


def resolve_columns(
    names: Sequence[str] | None,
    n_features: int,
    joint_names: Sequence[str],
    *,
    trajectory: ColumnSpec = "auto",
    time: ColumnSpec = "auto",
    require_acceleration: bool = True,
) -> Columns:
    """Find the signals of the X contract among the columns of X; names are None for an array.

    ``"auto"`` takes the key column of that name if X has names and such a column. Without names,
    accelerations are always required. A ColumnError is raised if a column is missing or given
    twice, or the number of columns does not fit.

    >>> resolve_columns(None, 7, ["a", "b"], trajectory=0).dq
    (3, 4)
    """
    if names is not None:
        names = [str(name) for name in names]
        if twice := sorted({name for name in names if names.count(name) > 1}):
            listed = ", ".join(twice)
            raise ColumnError(f"X has the column(s) {listed} more than once; keep one each.")
    key_trajectory, key_time = key_columns(names, n_features, trajectory, time)
    if names is not None and _looks_named(names):
        q, dq = (_by_name(names, prefix, joint_names, True) for prefix in ("q", "dq"))
        ddq = _by_name(names, "ddq", joint_names, require_acceleration)
        temperature = _by_name(names, "temp", joint_names, False)
        assert q is not None and dq is not None
        return Columns(q, dq, ddq, key_trajectory, key_time, temperature)
    n = len(joint_names)
    rest = [i for i in range(n_features) if i not in (key_trajectory, key_time)]
    if len(rest) != 3 * n:
        keys = n_features - len(rest)
        raise ColumnError(
            f"X has {n_features} columns; a robot with {counted(n, 'joint')} needs {3 * n} by "
            f"position (q, dq, ddq of {', '.join(joint_names)}) and {keys} key column(s) are "
            "declared. Pass a DataFrame with the columns q1.., dq1.., ddq1.. (a Pipeline passes "
            "one on after set_output(transform='pandas')), or declare key columns by position, "
            "for example trajectory=0."
        )
    return Columns(
        tuple(rest[:n]), tuple(rest[n : 2 * n]), tuple(rest[2 * n :]), key_trajectory, key_time
    )


def _looks_named(names: Sequence[str]) -> bool:
    """Whether the names follow the contract (a DataFrame with the columns 0, 1, .. does not)."""
    return any(name == "q1" or name.startswith(("q_", "dq_")) for name in names)


def key_columns(
    names: Sequence[str] | None, n_features: int, trajectory: ColumnSpec, time: ColumnSpec
) -> tuple[int | None, int | None]:
    """Positions of the trajectory number and of the time, None if there is no such column.

    A ColumnError is raised if a column does not exist or both are the same.
    """
    found = (
        _key_column("trajectory", trajectory, names, n_features),
        _key_column("time", time, names, n_features),
    )
    if found[0] is not None and found[0] == found[1]:
        which = found[0] if names is None else repr(names[found[0]])
        raise ColumnError(
            f"trajectory={trajectory!r} and time={time!r} are both the column {which} of X. A "
            "trajectory is one recording, numbered 0, 1, ..; give a different column for each, "
            "or None for one that X does not have."
        )
    return found


def _key_column(
    what: str, spec: ColumnSpec, names: Sequence[str] | None, n_features: int
) -> int | None:
    if spec is None:
        return None
    if isinstance(spec, numbers.Integral):
        if not -n_features <= spec < n_features:
            raise ColumnError(f"{what}={spec} is out of range: X has {n_features} columns.")
        return int(spec) % n_features
    if spec == "auto":
        return names.index(what) if names is not None and what in names else None
    if names is None:
        raise ColumnError(
            f"{what}={spec!r} names a column, but X has no column names; give its position."
        )
    if spec not in names:
        raise ColumnError(f"{what} column {spec!r} is not in X{suggest(str(spec), names)}.")
    return names.index(str(spec))


def _by_name(
    names: Sequence[str], prefix: str, joint_names: Sequence[str], required: bool
) -> tuple[int, ...] | None:
    """Positions of ``prefix_<joint>`` or else ``prefix1 ..`` for all joints, in joint order."""
    styles = (
        [f"{prefix}_{joint}" for joint in joint_names],
        [f"{prefix}{k + 1}" for k in range(len(joint_names))],
    )
    for wanted in styles:
        if all(name in names for name in wanted):
            return tuple(names.index(name) for name in wanted)
    found = [name for wanted in styles for name in wanted if name in names]
    if not required and not found:
        return None
    style = max(styles, key=lambda wanted: sum(name in names for name in wanted))
    missing = [name for name in style if name not in names]
    hint = suggest(missing[0], names)
    raise ColumnError(
        f"X lacks the column(s) {', '.join(missing)}{hint}. The robot has {len(joint_names)} "
        f"joints: {', '.join(joint_names)}."
    )


def column_names(X: Any) -> list[str] | None:
    """Column names of a pandas or polars table, None for anything else."""
    columns = getattr(X, "columns", None)
    return None if columns is None or callable(columns) else [str(name) for name in columns]


def names_of_table(X: Any, columns: str = "time, q1.., dq1..") -> list[str]:
    """Column names of a table; the ColumnError for one without states the expected ``columns``."""
    names = column_names(X)
    if names is None:
        raise ColumnError(f"X is not a table; give a DataFrame with the columns {columns}")
    return names


def command_columns(names: Sequence[str], joint_names: Sequence[str]) -> list[str]:
    """Names of the columns with the commanded positions, one for each joint.

    A ColumnError is raised if a joint has none.

    >>> command_columns(["time", "q1", "cmd1"], ["elbow"])
    ['cmd1']
    """
    numbers = range(1, len(joint_names) + 1)
    schemes = (
        [f"q_ref{j}" for j in numbers],
        [f"q_ref_{name}" for name in joint_names],
        [f"cmd{j}" for j in numbers],
    )
    for wanted in schemes:
        if set(wanted) <= set(names):
            return wanted
    lost = ", ".join(name for name in schemes[0] if name not in names)
    raise ColumnError(
        f"the log lacks the column(s) {lost}: the commanded positions, which skidyn.logs.read_log "
        "names cmd1.."
    )


def with_columns(X: Any, columns: dict[str, np.ndarray]) -> Any:
    """Copy of a pandas or polars table with some columns replaced or added."""
    if hasattr(X, "assign"):
        return X.assign(**columns)
    frame = type(X)(columns)
    return X.with_columns([frame[name] for name in columns])


def trajectory_numbers(X: np.ndarray, columns: Columns) -> np.ndarray:
    """Trajectory number of every row (zeros if X has no such column)."""
    if columns.trajectory is None:
        return np.zeros(len(X), dtype=np.int64)
    return np.asarray(X[:, columns.trajectory])
