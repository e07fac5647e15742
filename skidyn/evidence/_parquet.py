# SPDX-License-Identifier: BSD-3-Clause
"""Trajectories of a Parquet file, one after another, without decoding the whole file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from skidyn._columns import Columns
from skidyn._exceptions import LogError
from skidyn._optional import import_optional
from skidyn._signals import Array, Signals, rates_of, signals_from
from skidyn.robots import Robot

#: Number of rows that are decoded at once.
BATCH_ROWS = 65_536
#: Mapping of signals to columns by the user; see :func:`skidyn.logs.read_log`.
ColumnMap = Mapping[str, str | int | Sequence[str | int]]


@dataclass(frozen=True)
class _Layout:
    """Columns of the file that are read, in the order of ``names``, with their meaning."""

    names: list[str]
    columns: Columns
    trajectory: int | None
    torque: slice


def read_trajectories(
    path: Path, robot: Robot, *, columns: ColumnMap | None = None, max_rows: int
) -> Iterator[tuple[Signals, Array]]:
    """Motion and torque of the trajectories of a file, in the order of its rows.

    Parameters
    ----------
    path : Path
        File.
    robot : Robot
        Robot, whose joints give the order of the columns.
    columns : mapping, optional
        As in :func:`skidyn.logs.read_log`.
    max_rows : int
        Longest trajectory that is read.

    Yields
    ------
    signals : Signals
        Motion, as trajectory 0; velocity and acceleration are placeholders if the file has none.
    torque : ndarray of shape (n_samples, n_joints), N m or N
        Torque.

    Raises
    ------
    LogError
        A missing column, a value that is not finite, a trajectory that is too long, no rows, or
        a file that cannot be decoded.
    """
    parquet = import_optional("pyarrow.parquet", extra="io")
    tables = _decoded(path, parquet, robot, columns)
    layout = next(tables)
    key = layout.trajectory
    parts: list[Array] = []
    for table in tables:
        for piece in _pieces(table, key):
            if parts and key is not None and piece[0, key] != parts[0][0, key]:
                yield _split(parts, layout, robot)
                parts = []
            parts.append(piece)
            if sum(map(len, parts)) > max_rows:
                name = "the file" if key is None else f"trajectory {piece[0, key]:.0f}"
                raise LogError(
                    f"{path}: {name} has more than max_rows = {max_rows} rows. Number its parts "
                    "as trajectories, or raise max_rows."
                )
    if not parts:
        raise LogError(f"{path}: holds no rows")
    yield _split(parts, layout, robot)


def trajectory_lengths(path: Path, robot: Robot, columns: ColumnMap | None = None) -> Array:
    """Rows of every trajectory of a file; only the column of their numbers is decoded.

    Parameters
    ----------
    path : Path
        File.
    robot : Robot
        Its joints.
    columns : mapping, optional
        As in :func:`skidyn.logs.read_log`.

    Returns
    -------
    ndarray of shape (n_trajectories,)
        Whole numbers, in the order of the rows.

    Raises
    ------
    LogError
        A missing column, or a file that cannot be decoded.
    """
    parquet = import_optional("pyarrow.parquet", extra="io")
    with _decoder_errors(path), parquet.ParquetFile(path) as file:
        layout = _layout(file.schema_arrow.names, robot, columns, path)
        if layout.trajectory is None:
            return np.array([file.metadata.num_rows])
        name = layout.names[layout.trajectory]
        lengths: list[int] = []
        last = None
        for batch in file.iter_batches(BATCH_ROWS, columns=[name], use_threads=False):
            for piece in _pieces(_numbers(batch.column(0), name, path)[:, None], 0):
                if piece[0, 0] == last:
                    lengths[-1] += len(piece)
                else:
                    lengths.append(len(piece))
                last = piece[0, 0]
        return np.array(lengths, dtype=np.int64)


@contextmanager
def _decoder_errors(path: Path) -> Iterator[None]:
    """Name the file in which the decoder failed; the decoder may raise any exception."""
    try:
        yield
    except (LogError, GeneratorExit):
        raise
    except Exception as error:
        raise LogError(f"{path}: cannot be read as Parquet: {error}") from error


def _decoded(path: Path, parquet: Any, robot: Robot, columns: ColumnMap | None) -> Iterator[Any]:
    """The layout, then tables of at most ``BATCH_ROWS`` rows."""
    row = 0
    with _decoder_errors(path), parquet.ParquetFile(path) as file:
        layout = _layout(file.schema_arrow.names, robot, columns, path)
        yield layout
        # Threads of the decoder would compete with the other workers of a machine.
        for batch in file.iter_batches(BATCH_ROWS, columns=layout.names, use_threads=False):
            # Channels one after another in memory: they are read, smoothed and sorted by channel.
            table = np.empty((batch.num_rows, len(layout.names)), order="F")
            for k, name in enumerate(layout.names):
                table[:, k] = _numbers(batch.column(name), name, path)
            _refuse_missing(table, layout.names, path, row)
            row += len(table)
            yield table


def _layout(names: Sequence[str], robot: Robot, columns: ColumnMap | None, path: Path) -> _Layout:
    from skidyn._names import match_names

    found = match_names(
        names, robot_joints=robot.joint_names, columns=columns, source=str(path)
    ).columns
    n = robot.n_joints
    of = {s: [f"{s}{j + 1}" for j in range(n)] for s in ("q", "dq", "ddq", "temp", "tau")}
    needed = [*of["q"], *([] if "time" in found else of["dq"]), *of["tau"]]
    lost = [name for name in needed if name not in found]
    if lost:
        raise LogError(
            f"{path}: lacks {', '.join(lost)}; it has {', '.join(names)}. If they have other "
            "names, give them with columns={'q': [...], 'tau': [...]}."
        )
    if "time" not in found and not set(of["ddq"]) <= set(found):
        raise LogError(f"{path}: has neither time nor {of['ddq'][0]}..; one is needed")
    keys = [name for name in ("time", "trajectory") if name in found]
    signals = [s for s in ("q", "dq", "ddq", "temp") if set(of[s]) <= set(found)]
    at = {
        s: tuple(range(len(keys) + n * k, len(keys) + n * (k + 1))) for k, s in enumerate(signals)
    }
    order = [*keys, *(name for s in signals for name in of[s]), *of["tau"]]
    where = Columns(
        q=at["q"],
        # With a clock, velocity and acceleration are derived from the positions.
        dq=at.get("dq", at["q"]),
        ddq=at.get("ddq", at["q"]),
        time=order.index("time") if "time" in keys else None,
        temperature=at.get("temp"),
    )
    key = order.index("trajectory") if "trajectory" in keys else None
    torque = slice(len(order) - n, len(order))
    return _Layout([found[name] for name in order], where, key, torque)


def _numbers(column: Any, name: str, path: Path) -> Any:
    types = import_optional("pyarrow.types", extra="io")
    if not (types.is_floating(column.type) or types.is_integer(column.type)):
        raise LogError(f"{path}: column {name} holds {column.type}, numbers in SI units are needed")
    return column.to_numpy(zero_copy_only=False)  # null becomes NaN


def _refuse_missing(table: Array, names: Sequence[str], path: Path, first: int) -> None:
    bad = ~np.isfinite(table)
    if bad.any():
        rows, columns = np.nonzero(bad)
        raise LogError(
            f"{path}: {len(np.unique(rows))} rows are not finite, the first is row "
            f"{first + rows[0]}, column {names[columns[0]]}. Leave such rows out."
        )


def _pieces(table: Array, key: int | None) -> Iterator[Array]:
    """Runs of rows of one trajectory number."""
    if key is None:
        yield table
        return
    edges = np.r_[0, np.flatnonzero(np.diff(table[:, key])) + 1, len(table)]
    for start, stop in zip(edges[:-1], edges[1:], strict=True):
        if stop > start:
            yield table[start:stop]


def _split(parts: list[Array], layout: _Layout, robot: Robot) -> tuple[Signals, Array]:
    table = parts[0] if len(parts) == 1 else np.vstack(parts)
    signals = signals_from(table, layout.columns, robot)
    if layout.columns.dq == layout.columns.q:  # no velocities recorded
        signals = signals.with_(dq=rates_of(signals.q, signals.clock, signals.segments))
    return signals, table[:, layout.torque]
