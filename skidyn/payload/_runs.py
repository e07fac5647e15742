# SPDX-License-Identifier: BSD-3-Clause
"""Runs with and without a load as one regression problem."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student_t

from skidyn._columns import column_names, resolve_columns
from skidyn._exceptions import SkidynError
from skidyn._order import order_in_time
from skidyn._signals import Array, Signals, refuse_other_gravity, signals_from
from skidyn.effects import Term
from skidyn.evidence import Problem, make_problem
from skidyn.identification import from_pseudo_inertia, pseudo_inertia
from skidyn.robots import Robot

#: Parameters of a body, as in :attr:`skidyn.robots.Robot.inertial_parameters`.
SYMBOLS = ("m", "mcx", "mcy", "mcz", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz")
#: Effects in addition to the rigid body that nearly every geared robot has.
FRICTION = ("viscous", "coulomb", "offset", "rotor_inertia")
#: Number of blocks of time for a single recording with, or without, the load.
BLOCKS = 10
#: Share of a column that must remain after elimination of all others.
LEAST_SHARE = 1e-6


@dataclass(frozen=True)
class Runs:
    """Averaged rows of all runs.

    Attributes
    ----------
    problem : Problem
        Rows, folds and the columns of the robot without a load.
    body : list of ndarray of shape (n_rows_j, 10)
        Per joint, torque per unit of every parameter of a body at the link; zero without load.
    rest : list of ndarray of shape (n_rows_j, n_rest)
        Per joint, the columns of rigid body and effects.
    target : list of ndarray of shape (n_rows_j,)
        Per joint, the torque to be explained.
    carries : ndarray of shape (n_samples,) of bool
        Samples with the load.
    fold : list of ndarray of shape (n_rows_j,) of int
        Per joint, the fold of every row: recordings, or blocks of time of few of them.
    n_folds : int
        Number of folds.
    """

    problem: Problem
    body: list[Array]
    rest: list[Array]
    target: list[Array]
    carries: NDArray[np.bool_]
    fold: list[NDArray[np.int64]]
    n_folds: int


def read_runs(
    robot: Robot, loaded: Any, unloaded: Any, smooth: bool | None
) -> tuple[Signals, Array, NDArray[np.bool_], bool]:
    """Signals and torque of all runs, a mask of samples with the load, and whether to smooth.

    A SkidynError is raised without a run, or if one has no torque columns, no rows, or rows that
    are not in the order of time.
    """
    frames = [(frame, True) for frame in _frames(loaded, "loaded")]
    frames += [(frame, False) for frame in _frames(unloaded, "unloaded")]
    if not any(is_loaded for _, is_loaded in frames):
        raise SkidynError("no run with the load was given")
    parts = [
        _read(robot, frame, "a loaded run" if is_loaded else "an unloaded run")
        for frame, is_loaded in frames
    ]
    given = all(part[2] for part in parts)
    first, signals = 0, []
    for part, _, _ in parts:
        names, number = np.unique(part.trajectory, return_inverse=True)
        signals.append(part.with_(trajectory=number + first))
        first += len(names)
    carries = [
        np.full(len(torque), flag) for (_, torque, _), (_, flag) in zip(parts, frames, strict=True)
    ]
    smooths = not given if smooth is None else smooth
    if not smooths and not given:
        raise SkidynError("smooth=False needs accelerations (ddq1 ..) in every run")
    torque = np.concatenate([part[1] for part in parts])
    return _joined(signals, robot), torque, np.concatenate(carries), smooths


def make_runs(
    signals: Signals,
    torque: Array,
    carries: NDArray[np.bool_],
    *,
    robot: Robot,
    link: str | None,
    terms: Iterable[Term],
    smooth: bool,
    rigid_body: bool = True,
) -> Runs:
    """Averaged rows of the runs; the torque is used unchanged."""
    terms = tuple(terms)
    problem = make_problem(
        signals,
        torque,
        robot=robot,
        rigid_body=rigid_body,
        terms=terms,
        smooth=smooth,
        subtract_urdf=False,
    )
    body = _body_rows(problem, robot, link, carries)
    rest = problem.design([problem.term_rows(term) for term in terms])
    return Runs(problem, body, rest, problem.target, carries, *_folds(problem, carries))


def in_body(robot: Robot, link: str | None) -> tuple[int, Array]:
    """The body that carries a link, and its parameters per unit of those in the link's frame.

    A SkidynError is raised if the link does not exist or does not move.
    """
    if link is None:
        return robot.n_bodies - 1, np.eye(10)
    if link not in robot.links:
        raise SkidynError(f"the robot {robot.name!r} has no link {link!r}")
    placement = robot.links[link]
    if placement.body < 0:
        raise SkidynError(f"link {link!r} does not move: no torque depends on its load")
    frame = np.eye(4)
    frame[:3, :3], frame[:3, 3] = placement.rotation, placement.translation
    units = pseudo_inertia(np.eye(10))
    return placement.body, from_pseudo_inertia(frame @ units @ frame.T).T


def interval_factor(n_folds: int) -> float:
    """Half width of a 95 % interval in standard errors for a number of folds."""
    return float(student_t.ppf(0.975, max(1, n_folds - 1)))


def triangle(rows: Array) -> Array:
    """Triangular factor of rows."""
    return np.asarray(np.linalg.qr(rows, mode="r"))


def open_columns(design: Array, columns: Sequence[int]) -> NDArray[np.bool_]:
    """Columns that are nearly combinations of all others of a design or triangular factor."""
    size = np.linalg.norm(design, axis=0)
    used = size > 0
    is_open: NDArray[np.bool_] = ~used
    _, values, directions = np.linalg.svd(design[:, used] / size[used], full_matrices=True)
    null = np.ones(used.sum(), dtype=bool)
    null[: len(values)] = values < LEAST_SHARE * values[0]
    is_open[used] = np.abs(directions[null]).max(axis=0, initial=0.0) > 1e-3
    return is_open[list(columns)]


def _folds(problem: Problem, carries: NDArray[np.bool_]) -> tuple[list[NDArray[np.int64]], int]:
    """Folds of the problem; a single recording with or without the load is split into blocks.

    Without it, load and robot could not be separated.
    """
    fold, n_folds = [f.copy() for f in problem.fold], problem.n_folds
    names = problem.signals.trajectory
    for side in (names[carries], names[~carries]):
        if not problem.whole_trajectories or len(np.unique(side)) != 1:
            continue
        for j, own in enumerate(problem.rows.trajectory):
            mine = np.flatnonzero(own == side[0])
            mine = mine[np.argsort(problem.rows.time[j][mine], kind="stable")]
            fold[j][mine] = n_folds + np.arange(len(mine)) * BLOCKS // max(1, len(mine))
        n_folds += BLOCKS
    used = np.unique(np.concatenate(fold))
    return [np.searchsorted(used, f) for f in fold], len(used)


def _frames(runs: Any, name: str) -> list[Any]:
    if runs is None:
        return []
    frames = [runs] if column_names(runs) is not None else list(runs)
    for frame in frames:
        if column_names(frame) is None:
            raise SkidynError(
                f"{name} holds a {type(frame).__name__}; expected tables with the columns time, "
                "q1.., dq1.., tau1.., such as skidyn.logs.read_log gives"
            )
    return frames


def _read(robot: Robot, frame: Any, what: str) -> tuple[Signals, Array, bool]:
    refuse_other_gravity(frame, robot)
    names = column_names(frame)
    assert names is not None
    wanted = [f"tau{j + 1}" for j in range(robot.n_joints)]
    if not set(wanted) & set(names):
        wanted = [f"tau_{joint}" for joint in robot.joint_names]
    lost = [name for name in wanted if name not in names]
    if lost:
        raise SkidynError(f"{what} lacks the torque column(s) {', '.join(lost)}")
    if len(frame) == 0:
        raise SkidynError(f"{what} has no rows; check the selection of its rows, or leave it out")
    columns = resolve_columns(names, len(names), robot.joint_names, require_acceleration=False)
    given = columns.ddq is not None
    if columns.time is None:
        raise SkidynError(f"{what} has no column time, which is needed for smoothing and averaging")
    columns = replace(columns, temperature=None)
    table = np.zeros((len(frame), len(names)))
    for k in columns.used():
        table[:, k] = np.asarray(frame[names[k]], dtype=np.float64)
    torque = np.column_stack([np.asarray(frame[name], dtype=np.float64) for name in wanted])
    if not (np.isfinite(table).all() and np.isfinite(torque).all()):
        raise SkidynError(f"{what} holds values that are not finite; leave such rows out")
    signals = signals_from(table, columns, robot, to_derive=True)
    if order_in_time(signals.trajectory, signals.time) is not None:
        raise SkidynError(
            f"the rows of {what} are not in the order of time, which averaging needs; sort them: "
            "table.sort_values(['trajectory', 'time'])"
        )
    return signals, torque, given


def _joined(parts: Sequence[Signals], robot: Robot) -> Signals:
    names = ("q", "dq", "ddq", "trajectory", "time")
    whole: dict[str, Any] = {n: np.concatenate([getattr(p, n) for p in parts]) for n in names}
    return Signals(**whole, prismatic=parts[0].prismatic, robot=robot)


def _body_rows(
    problem: Problem, robot: Robot, link: str | None, carries: NDArray[np.bool_]
) -> list[Array]:
    """Averaged columns of a body fixed to a link, on the samples with the load."""
    body, frame = in_body(robot, link)
    columns = slice(10 * body, 10 * body + 10)
    s = problem.signals
    rows = [np.zeros((count, 10)) for count in problem.rows.counts]
    weights = [w.tocsc() for w in problem.rows.weights]  # for slicing by chunks of samples
    for chunk, regressor in robot.iter_torque_regressor(s.q, s.dq, s.ddq):
        for j, block in enumerate(rows):
            there = regressor[j, columns].T * carries[chunk, None]
            block += weights[j][:, chunk] @ there
    return [block @ frame for block in rows]
