# SPDX-License-Identifier: BSD-3-Clause
"""Evidence of data sets larger than memory: few trajectories at a time, on one machine or many."""

from __future__ import annotations

import os
import pickle
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial, reduce
from pathlib import Path
from typing import Any

import numpy as np

from skidyn._exceptions import LogError, SkidynError
from skidyn._signals import Array, Signals, joined
from skidyn.effects import Term, TermSum, make_terms
from skidyn.evidence._evidence import Evidence, column_names, rows_of_problem
from skidyn.evidence._motion_rows import motion_rows, read_motion
from skidyn.evidence._parquet import ColumnMap, read_trajectories
from skidyn.evidence._problem import Problem, hysteresis_joints, with_rigid_columns
from skidyn.evidence._rigid_rows import CHUNK
from skidyn.robots import Robot, base_parameter_index

PathLike = str | os.PathLike[str]
#: More tasks balance the load and lose less work with a worker; fewer have less overhead.
TASKS_PER_THREAD = 8


#: Motion and torque of a trajectory.
Recording = tuple[Signals, Array]
#: A file, and the trajectories in it, counted from 0, that are left out.
Source = tuple[Path, frozenset[int]]


@dataclass(frozen=True)
class Options:
    """How files are read; see :func:`evidence_from_parquet`."""

    columns: ColumnMap | None
    groups: int | None
    max_rows: int


@dataclass(frozen=True)
class _Part:
    """Evidence of some files and its number of trajectories."""

    evidence: Evidence
    trajectories: int


def evidence_from_parquet(
    paths: PathLike | Iterable[PathLike],
    robot: Robot,
    effects: Iterable[Any] = ("viscous", "coulomb"),
    *,
    columns: ColumnMap | None = None,
    groups: int | None = 20,
    max_rows: int = 2_000_000,
    n_jobs: int | None = None,
    client: Any = None,
) -> Evidence:
    """Evidence of Parquet files, with one trajectory in memory, or some short ones.

    Parameters
    ----------
    paths : path or iterable of path
        Files, or a folder of ``*.parquet``, with position and torque of every joint and, if known,
        ``time`` (s), ``trajectory``, velocity, acceleration and temperature, in SI units, under any
        of the names that :func:`skidyn.logs.read_log` accepts. Consecutive rows with one trajectory
        number are one trajectory; a trajectory ends with its file.
    robot : Robot
        Robot.
    effects : iterable of str, (str, joints) or Term, default=("viscous", "coulomb")
        Effects beside the rigid body. Their shape parameters must be given.
    columns : mapping, optional
        Columns of signals with other names, as in :func:`skidyn.logs.read_log`: ``{"tau":
        "load_{joint}"}``.
    groups : int or None, default=20
        Trajectories are numbered in the order of files and rows, regardless of their numbers in the
        files. The factor of trajectory ``k`` is merged into that of group ``k % groups``, so that
        memory does not grow with the number of trajectories; with None there is one factor for
        each.
    max_rows : int, default=2_000_000
        Longest trajectory that is read, in rows; protects memory from damaged or malicious files.
    n_jobs : int, optional
        Processes that share the files, as in scikit-learn; one by default, -1 for all cores.
    client : distributed.Client, optional
        Cluster on which to compute: a few tasks for each of its threads, and a tree that merges
        them. Files must be readable by the workers. If a worker fails, its tasks are computed
        again.

    Returns
    -------
    Evidence
        Of the base parameters' corrections to the URDF, then of the effects.

    Raises
    ------
    LogError
        There is no file, a column is missing, a value is not finite, or a trajectory is too long.
    SkidynError
        An effect needs a fit of the model first.

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
    files = parquet_files(paths)
    terms = tuple(linear_terms(effects, robot.n_joints))
    options = Options(columns, groups, max_rows)
    return evidence_of_sources(
        [(f, frozenset()) for f in files], robot, terms, options, n_jobs, client
    )


def evidence_of_sources(
    sources: Sequence[Source],
    robot: Robot,
    terms: Sequence[Term],
    options: Options,
    n_jobs: int | None = None,
    client: Any = None,
) -> Evidence:
    """Evidence of all trajectories of files but some.

    Parameters
    ----------
    sources : sequence of (Path, frozenset of int)
        Files, and their trajectories, from 0, that are left out and not numbered.
    robot : Robot
        Robot.
    terms : sequence of Term
        Effects with their shape parameters.
    options : Options
        How files are read.
    n_jobs, client
        See :func:`evidence_from_parquet`.

    Returns
    -------
    Evidence
        By trajectory or group, and joint.
    """
    if client is not None:
        return _on_cluster(client, sources, robot, terms, options).evidence
    from joblib import Parallel, delayed, effective_n_jobs

    parts = Parallel(n_jobs=n_jobs)(
        delayed(_of_files)(chunk, robot, terms, options)
        for chunk in _chunks(sources, effective_n_jobs(n_jobs))
    )
    whole: _Part = reduce(partial(_joined, groups=options.groups), parts)
    return whole.evidence


def evidence_of_signals(
    signals: Signals,
    torque: Array,
    robot: Robot,
    terms: Iterable[Term],
    *,
    rigid_body: bool = True,
    smooth: bool = True,
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
    rigid_body : bool, default=True
        Whether base parameters are among the columns.
    smooth : bool, default=True
        Derive velocity and acceleration from the positions; False takes the given ones.

    Returns
    -------
    Evidence
        By trajectory and joint.
    """
    terms = tuple(terms)
    (problem,) = _problems([(signals, torque)], robot, terms, rigid_body, smooth)
    return Evidence.from_problem(problem, terms)


def _problems(
    recordings: Sequence[Recording],
    robot: Robot,
    terms: Sequence[Term],
    rigid_body: bool = True,
    smooth: bool = True,
) -> list[Problem]:
    """Averaged rows of recordings, and if wanted the columns of all base parameters.

    The programs of the rigid body take less time for many samples than for few at a time.
    """
    motions = [read_motion(signals, smooth, torque) for signals, torque in recordings]
    together = (joined([getattr(motion, k) for motion in motions]) for k in ("q", "dq", "ddq"))
    ends = np.cumsum([motion.n_samples for motion in motions])[:-1]
    models = np.split(robot.inverse_dynamics(*together), ends)
    problems = []
    for motion, (_, torque), model in zip(motions, recordings, models, strict=True):
        rows = motion_rows(motion, hysteresis_joints(terms))
        problem = Problem(
            robot=robot,
            signals=motion.with_(robot=robot),
            torque=torque - model,
            terms=TermSum(terms),
            rows=rows,
            fold=[np.zeros(n, dtype=np.int64) for n in rows.counts],
            n_folds=1,
            whole_trajectories=True,
            rigid_body=rigid_body,
            rigid_rows=[np.zeros((n, 0)) for n in rows.counts],
        )
        problems.append(problem)
    # All trajectories have the same columns, also those in which few joints move.
    return with_rigid_columns(problems, base_parameter_index(robot)) if rigid_body else problems


def linear_terms(effects: Iterable[Any], n_joints: int) -> list[Term]:
    """Terms whose columns can be computed before any fit.

    Raises
    ------
    SkidynError
        An effect has open shape parameters, or depends on the torque of the model.
    """
    terms = make_terms(effects, n_joints)
    for term in terms:
        if term.effect.needs_fit:
            raise SkidynError(
                f"the columns of {term.kind!r} require a fit of the model first, so one pass is "
                "not enough; leave it out, or fit an RBDRegressor on data in memory"
            )
        if term.is_open:
            names = ", ".join(shape.name for shape in term.effect.shapes) or "found from the log"
            raise SkidynError(
                f"{term.kind!r} has unspecified shape parameters ({names}); give them with "
                "Term(...), for example as found on a part of the data"
            )
    return terms


def parquet_files(paths: PathLike | Iterable[PathLike]) -> list[Path]:
    """Files given by the user; those of a folder in the order of their names.

    Raises
    ------
    LogError
        There are no files, or a file does not exist.
    """
    if isinstance(paths, (str, os.PathLike)):
        folder = Path(paths)
        files = sorted(folder.glob("*.parquet")) if folder.is_dir() else [folder]
    else:
        files = [Path(path) for path in paths]
    missing = [str(file) for file in files if not file.is_file()]
    if missing or not files:
        raise LogError(f"{missing[0] if missing else paths}: no such Parquet file")
    return files


def _of_files(
    sources: Sequence[Source], robot: Robot, terms: Sequence[Term], options: Options
) -> _Part:
    """Evidence of files, their trajectories numbered from 0."""
    evidence = Evidence(column_names(robot, base_parameter_index(robot), terms), {}, {})
    n = 0
    for together in _together(_recordings(sources, robot, options)):
        for problem in _problems(together, robot, terms):
            name = n if options.groups is None else n % options.groups
            rows = rows_of_problem(problem, terms).items()
            evidence = evidence.with_rows({(name, joint): block for (_, joint), block in rows})
            n += 1
    return _Part(evidence, n)


def _recordings(sources: Sequence[Source], robot: Robot, options: Options) -> Iterator[Recording]:
    """Trajectories of files that are not left out, in their order."""
    for path, left_out in sources:
        found = read_trajectories(path, robot, columns=options.columns, max_rows=options.max_rows)
        yield from (recording for k, recording in enumerate(found) if k not in left_out)


def _together(recordings: Iterable[Recording]) -> Iterator[list[Recording]]:
    """Neighbouring recordings, as many as share a chunk of the regressor, but at least one."""
    found: list[Recording] = []
    for recording in recordings:
        found.append(recording)
        # The next one is as long, in most files; to look at it would take memory.
        lengths = [signals.n_samples for signals, _ in found]
        if sum(lengths) + lengths[-1] > CHUNK:
            yield found
            found = []
    if found:
        yield found


def _joined(one: _Part, other: _Part, groups: int | None) -> _Part:
    """Two parts, the trajectories of the second numbered after those of the first."""
    return _Part(
        one.evidence + other.evidence.shifted(one.trajectories, groups),
        one.trajectories + other.trajectories,
    )


def _chunks(files: Sequence[Source], n: int) -> list[list[Source]]:
    """At most n lists of neighbouring files; their lengths differ by at most one."""
    edges = np.linspace(0, len(files), min(n, len(files)) + 1).round().astype(int)
    return [list(files[a:b]) for a, b in zip(edges[:-1], edges[1:], strict=True)]


def _on_cluster(
    client: Any, files: Sequence[Source], robot: Robot, terms: Sequence[Term], options: Options
) -> _Part:
    threads = sum(client.nthreads().values())
    chunks = _chunks(files, TASKS_PER_THREAD * threads if threads else len(files))
    # Bytes, so that a worker unpacks the robot and compiles its equations only once. A result on
    # the cluster would serve as well, but is lost if its worker fails.
    known = pickle.dumps((robot, terms, options))
    parts = [client.submit(_task, chunk, known, pure=False) for chunk in chunks]
    join = partial(_joined, groups=options.groups)
    while len(parts) > 1:
        pairs = zip(parts[::2], parts[1::2], strict=False)
        merged = [client.submit(join, a, b, pure=False) for a, b in pairs]
        parts = merged + (parts[-1:] if len(parts) % 2 else [])
    result: _Part = parts[0].result()
    return result


def _task(sources: list[Source], known: bytes) -> _Part:
    return _of_files(sources, *_unpacked(known))


@lru_cache(maxsize=4)
def _unpacked(known: bytes) -> tuple[Robot, Sequence[Term], Options]:
    result: tuple[Robot, Sequence[Term], Options] = pickle.loads(known)
    return result
