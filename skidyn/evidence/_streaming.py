# SPDX-License-Identifier: BSD-3-Clause
"""Evidence of data sets larger than memory: one trajectory at a time, on one machine or many."""

from __future__ import annotations

import operator
import os
from collections.abc import Iterable, Iterator, Sequence
from functools import reduce
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from skidyn._columns import resolve_columns
from skidyn._exceptions import LogError, SkidynError
from skidyn._optional import import_optional
from skidyn._signals import Array, Signals, signals_from
from skidyn.effects import Term, get_effect, make_terms
from skidyn.evidence._evidence import Evidence
from skidyn.evidence._kinematics import as_given, smooth_motion
from skidyn.evidence._problem import MARGIN, Problem, _regressor_rows
from skidyn.evidence._rows import every_sample, sliding_samples, window_rows
from skidyn.rigid_body._base_parameters import base_parameter_index
from skidyn.robots import Robot

if TYPE_CHECKING:
    import pandas as pd

PathLike = str | os.PathLike[str]
#: Rows that are decoded at once.
BATCH_ROWS = 65_536


def evidence_from_parquet(
    paths: PathLike | Iterable[PathLike],
    robot: Robot,
    effects: Iterable[Any] = ("viscous", "coulomb"),
    *,
    groups: int | None = 20,
    max_rows: int = 2_000_000,
    client: Any = None,
) -> Evidence:
    """Evidence of Parquet files, without ever holding more than one trajectory in memory.

    Parameters
    ----------
    paths : path or iterable of path
        Files, or a folder of ``*.parquet``, with the columns ``q1..qn``, ``dq1..dqn``,
        ``tau1..taun`` and, where they are known, ``time`` (s), ``trajectory`` and ``ddq1..ddqn``,
        in SI units. Consecutive rows of one trajectory number are one trajectory; none reaches
        over the end of a file.
    robot : Robot
        Robot.
    effects : iterable of str, (str, joints) or Term, default=("viscous", "coulomb")
        Effects beside the rigid body. Their shape parameters must be given.
    groups : int or None, default=20
        The factor of trajectory ``k`` is merged into that of group ``k % groups``, so that memory
        does not grow with the number of trajectories; None keeps one factor for each.
    max_rows : int, default=2_000_000
        Longest trajectory that is read; protects memory from damaged or hostile files.
    client : distributed.Client, optional
        Cluster that does the work: one task for each file, and a tree that merges them. Files must
        be readable by the workers. A worker that dies loses its tasks, not the result.

    Returns
    -------
    Evidence
        Of the base parameters' corrections to the URDF, then of the effects.

    Raises
    ------
    LogError
        No file, a missing column, a value that is not finite, or a trajectory that is too long.
    SkidynError
        An effect that needs a fit of the model first.

    References
    ----------
    J. Demmel, L. Grigori, M. Hoemmen, J. Langou (2012), Communication-optimal parallel and
    sequential QR and LU factorizations, SIAM J. Scientific Computing 34(1), A206-A239.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from skidyn.datasets import load_planar_arm, make_hidden_effect_log
    >>> from skidyn.evidence import evidence_from_parquet
    >>> log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=3, duration=4.0)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     log.frame.to_parquet(pathlib.Path(folder, "log.parquet"))
    ...     evidence = evidence_from_parquet(folder, log.robot)
    >>> evidence.trajectories
    [0, 1, 2]
    """
    files = _files(paths)
    terms = tuple(linear_terms(effects, robot.n_joints))
    if client is None:
        return reduce(operator.add, (_of_file(f, robot, terms, groups, max_rows) for f in files))
    parts = [client.submit(_of_file, f, robot, terms, groups, max_rows, pure=False) for f in files]
    while len(parts) > 1:
        pairs = zip(parts[::2], parts[1::2], strict=False)
        merged = [client.submit(operator.add, a, b, pure=False) for a, b in pairs]
        parts = merged + (parts[-1:] if len(parts) % 2 else [])
    evidence: Evidence = parts[0].result()
    return evidence


def evidence_of_signals(
    signals: Signals, torque: Array, robot: Robot, terms: Iterable[Term]
) -> Evidence:
    """Evidence of signals in memory, with the base parameters of the robot as columns.

    Parameters
    ----------
    signals : Signals
        Motion.
    torque : ndarray of shape (n_samples, n_joints), N m or N
        Measured torque.
    robot : Robot
        Robot.
    terms : iterable of Term
        Effects with their shape parameters.

    Returns
    -------
    Evidence
        By trajectory and joint.
    """
    if signals.time is None:
        motion = as_given(signals)
        rows = every_sample(signals)
    else:
        motion = smooth_motion(signals)
        margin = max(1, round(MARGIN * motion.half_width))
        use = sliding_samples(motion.signals, motion.valid, margin)
        rows = window_rows(motion.signals, use, motion.rate)
    s = motion.signals
    problem = Problem(
        robot=robot,
        motion=motion,
        signals=s.with_(robot=robot),
        torque=torque - robot.inverse_dynamics(s.q, s.dq, s.ddq),
        terms=tuple(terms),
        rows=rows,
        fold=[np.zeros(n, dtype=np.int64) for n in rows.counts],
        n_folds=1,
        whole_trajectories=True,
        rigid_body=True,
    )
    # All trajectories must have the same columns, also those that move few joints.
    problem.rigid_index = base_parameter_index(robot)
    problem.rigid_rows = [block[:, problem.rigid_index] for block in _regressor_rows(problem)]
    return Evidence.from_problem(problem, problem.terms)


def linear_terms(effects: Iterable[Any], n_joints: int) -> list[Term]:
    """Terms whose columns are known before any fit.

    Raises
    ------
    SkidynError
        An effect with open shape parameters, or one that sees the torque of the model.
    """
    terms = make_terms(effects, n_joints)
    for term in terms:
        effect = get_effect(term.kind)
        if {"load", "model_torque"} & set(effect.needs):
            raise SkidynError(
                f"the columns of {term.kind!r} need a fit of the model first, so no evidence can "
                "be had in one pass; leave it out, or fit an RBDRegressor on data in memory"
            )
        if effect.shapes and not term.shape:
            names = ", ".join(shape.name for shape in effect.shapes)
            raise SkidynError(
                f"{term.kind!r} has open shape parameters ({names}); give them with Term(...), for "
                "example those found on a part of the data"
            )
    return terms


def _files(paths: PathLike | Iterable[PathLike]) -> list[Path]:
    if isinstance(paths, (str, os.PathLike)):
        folder = Path(paths)
        files = sorted(folder.glob("*.parquet")) if folder.is_dir() else [folder]
    else:
        files = [Path(path) for path in paths]
    missing = [str(file) for file in files if not file.is_file()]
    if missing or not files:
        raise LogError(f"{missing[0] if missing else paths}: no such Parquet file")
    return files


def _of_file(
    path: Path, robot: Robot, terms: Sequence[Term], groups: int | None, max_rows: int
) -> Evidence:
    evidence = None
    for table in _trajectories(path, robot.n_joints, max_rows):
        names = [name for name in table.columns if not name.startswith("tau")]
        x = table[names].to_numpy(dtype=float)
        columns = resolve_columns(names, len(names), robot.joint_names, require_acceleration=False)
        if columns.ddq is None:
            # Placeholders: velocity and acceleration are derived from the positions.
            columns = type(columns)(
                columns.q, columns.dq, columns.dq, columns.trajectory, columns.time, None
            )
        torque = table[[f"tau{j + 1}" for j in range(robot.n_joints)]].to_numpy(dtype=float)
        part = evidence_of_signals(signals_from(x, columns, robot), torque, robot, terms)
        part = _grouped(part, groups)
        evidence = part if evidence is None else evidence + part
    if evidence is None:
        raise LogError(f"{path}: holds no rows")
    return evidence


def _grouped(evidence: Evidence, groups: int | None) -> Evidence:
    """The same factors under the number of their group; one trajectory at a time."""
    if groups is None:
        return evidence
    factors = {(key[0] % groups, key[1]): factor for key, factor in evidence.factors.items()}
    counts = {(key[0] % groups, key[1]): count for key, count in evidence.counts.items()}
    return Evidence(evidence.columns, factors, counts)


def _trajectories(path: Path, n_joints: int, max_rows: int) -> Iterator[pd.DataFrame]:
    """Tables of the trajectories of a file, one after the other."""
    parquet = import_optional("pyarrow.parquet", extra="io")
    pd = import_optional("pandas", extra="io")
    try:
        with parquet.ParquetFile(path) as file:
            wanted = _wanted(file.schema_arrow.names, n_joints, path)
            parts: list[Any] = []
            length, row = 0, 0
            for batch in file.iter_batches(BATCH_ROWS, columns=wanted):
                table = batch.to_pandas()
                _refuse_missing(table, path, row)
                row += len(table)
                for piece in _pieces(table):
                    if parts and _number(piece) != _number(parts[0]):
                        yield pd.concat(parts, ignore_index=True)
                        parts, length = [], 0
                    parts.append(piece)
                    length += len(piece)
                    if length > max_rows:
                        raise LogError(
                            f"{path}: trajectory {_number(piece)} has more than max_rows = "
                            f"{max_rows} rows. Number its parts as trajectories, or raise max_rows."
                        )
            if parts:
                yield pd.concat(parts, ignore_index=True)
    except (LogError, GeneratorExit):
        raise
    except Exception as error:  # the decoder raises whatever the bytes lead it to
        raise LogError(f"{path}: cannot be read as Parquet: {error}") from error


def _wanted(names: Sequence[str], n_joints: int, path: Path) -> list[str]:
    needed = [f"{s}{j + 1}" for s in ("q", "dq", "tau") for j in range(n_joints)]
    lost = [name for name in needed if name not in names]
    if lost:
        raise LogError(f"{path}: lacks {', '.join(lost)}; it has {', '.join(names)}")
    accelerations = [f"ddq{j + 1}" for j in range(n_joints)]
    if "time" not in names and not set(accelerations) <= set(names):
        raise LogError(f"{path}: has neither time nor {accelerations[0]}..; one is needed")
    keys = [name for name in ("time", "trajectory") if name in names]
    more = accelerations if set(accelerations) <= set(names) else []
    return keys + needed + more


def _refuse_missing(table: pd.DataFrame, path: Path, first: int) -> None:
    bad = ~np.isfinite(table.to_numpy(dtype=float))
    if bad.any():
        rows, columns = np.nonzero(bad)
        raise LogError(
            f"{path}: {len(np.unique(rows))} rows are not finite, the first is row "
            f"{first + rows[0]}, column {table.columns[columns[0]]}. Leave such rows out."
        )


def _pieces(table: pd.DataFrame) -> Iterator[pd.DataFrame]:
    if "trajectory" not in table:
        yield table
        return
    number = table["trajectory"].to_numpy()
    edges = np.r_[0, np.flatnonzero(np.diff(number)) + 1, len(number)]
    for start, stop in zip(edges[:-1], edges[1:], strict=True):
        if stop > start:
            yield table.iloc[start:stop]


def _number(table: pd.DataFrame) -> int:
    return int(table["trajectory"].iloc[0]) if "trajectory" in table else 0
