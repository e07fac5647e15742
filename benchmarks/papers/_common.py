# SPDX-License-Identifier: BSD-3-Clause
"""Recordings, folds and physics that the benchmarks of this folder share.

The recordings are no part of the project. Set ``SKIDYN_DATA`` to their folder.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from sklearn.base import BaseEstimator, RegressorMixin
from sklearn.utils.validation import check_is_fitted

from skidyn._columns import resolve_columns
from skidyn._signals import Signals, signals_from
from skidyn.effects import get_effect
from skidyn.preprocessing import ButterworthFilter, TimeDerivative
from skidyn.robots import Robot

Array = NDArray[np.float64]

#: Published current gains of the UR10e, N m/A (De Luca's set; see the data's README).
UR10E_GAIN = np.array([14.87, 13.26, 11.13, 10.62, 11.03, 11.47])
#: Slower joints count as resting, rad/s (m/s if prismatic).
REST = 0.02
#: Period of the trajectory in the Panda recording, s.
PANDA_PERIOD = 13.333


def data_dir() -> Path:
    """Folder of the recordings; ends the program with a message where there is none."""
    named = os.environ.get("SKIDYN_DATA")
    folder = Path(named) if named else Path(__file__).resolve().parents[3] / "shared" / "data"
    if not folder.is_dir():
        sys.exit("recordings not found; set SKIDYN_DATA to their folder")
    return folder


def uniform(t: Array, *signals: Array, rate: float) -> tuple[Array, list[Array]]:
    """Signals on a regular clock."""
    t, first = np.unique(t, return_index=True)
    clock = np.arange(t[0], t[-1], 1.0 / rate)
    return clock, [
        np.stack([np.interp(clock, t, column) for column in signal[first].T], axis=1)
        for signal in signals
    ]


def make_log(
    runs: Sequence[tuple[Array, Array, Array, Array]],
    *,
    rate: float,
    cutoff: float,
    torque_cutoff: float | None,
    keep_every: int = 1,
) -> tuple[pd.DataFrame, Array]:
    """X and torque of several runs: regular clock, low-pass, central differences, decimation."""
    frames, torques = [], []
    for number, (t, q, dq, tau) in enumerate(runs):
        clock, (q, dq, tau) = uniform(t, q, dq, tau, rate=rate)
        n = q.shape[1]
        names = [f"{s}{j + 1}" for s in ("q", "dq") for j in range(n)]
        frame = pd.DataFrame(np.c_[q, dq], columns=names)
        frame.insert(0, "time", clock)
        frame.insert(0, "trajectory", number)
        smooth = ButterworthFilter(cutoff).set_output(transform="pandas").fit_transform(frame)
        frame = TimeDerivative().set_output(transform="pandas").fit_transform(smooth)
        if torque_cutoff is not None:
            tau = ButterworthFilter(torque_cutoff, rate=rate).fit_transform(tau)
        inside = slice(int(0.2 * rate), -int(0.2 * rate), keep_every)  # ends of the filters
        frames.append(frame[inside])
        torques.append(tau[inside])
    return pd.concat(frames, ignore_index=True), np.concatenate(torques)


def load_panda(
    cutoff: float = 10.0, torque_cutoff: float | None = 10.0, rate: float = 100.0
) -> tuple[Robot, pd.DataFrame, Array]:
    """The one recording of the Panda exciting trajectory."""
    folder = data_dir() / "panda"
    z = np.load(folder / "panda_gaz.npz")
    run = (z["t"], z["q"], z["dq"], z["tau"])
    X, y = make_log(
        [run], rate=1000.0, cutoff=cutoff, torque_cutoff=torque_cutoff, keep_every=int(1000 / rate)
    )
    return Robot.from_urdf(folder / "panda_min.urdf"), X, y


def moving_rows(dq: Array) -> slice:
    """Rows from the first to the last motion of a recording.

    How long a robot rested before and after says nothing of a model, but weighs in its error: a
    sixth of the time of the UR10e's runs.
    """
    moving = np.flatnonzero(np.abs(dq).max(axis=1) > REST)
    return slice(moving[0], moving[-1] + 1)


def ur10e_runs() -> tuple[list[tuple[Array, ...]], list[str]]:
    """Recordings (t, q, dq, tau) of the 13 unloaded excitation runs of 8 dates, and their dates."""
    z = np.load(data_dir() / "ur10e" / "ur10e_excitation.npz")
    runs, dates = [], []
    for k, name in enumerate(z["traj_name"]):
        date = str(name)[3:11]
        unloaded = '"payload_kg": 0.0' in str(z["traj_label"][k])
        if not unloaded or date < "19_10_02":
            continue
        rows = np.flatnonzero((z["traj"] == k) & z["valid"])
        rows = rows[moving_rows(z["dq"][rows])]
        runs.append((z["t"][rows], z["q"][rows], z["dq"][rows], z["i"][rows] * UR10E_GAIN))
        dates.append(date)
    return runs, dates


def load_ur10e(
    cutoff: float = 5.0, keep_every: int = 2
) -> tuple[Robot, pd.DataFrame, Array, NDArray[np.int64]]:
    """Excitation runs; the last value is the fold of every row (a pair of dates)."""
    runs, dates = ur10e_runs()
    X, y = make_log(runs, rate=100.0, cutoff=cutoff, torque_cutoff=cutoff, keep_every=keep_every)
    order = {date: i // 2 for i, date in enumerate(sorted(set(dates)))}
    fold = np.array([order[date] for date in dates])[X["trajectory"].to_numpy(int)]
    return Robot.from_urdf(data_dir() / "ur10e" / "ur10e_min.urdf"), X, y, fold


def load_ur10e_point_to_point(
    cutoff: float = 5.0, keep_every: int = 2
) -> tuple[pd.DataFrame, Array]:
    """A run of another kind: ten points, with rests between them."""
    z = np.load(data_dir() / "ur10e" / "ur10e_validation.npz")
    number = [k for k, name in enumerate(z["traj_name"]) if "ptp" in str(name)][0]
    rows = np.flatnonzero((z["traj"] == number) & z["valid"])
    rows = rows[moving_rows(z["dq"][rows])]
    run = (z["t"][rows], z["q"][rows], z["dq"][rows], z["i"][rows] * UR10E_GAIN)
    return make_log([run], rate=100.0, cutoff=cutoff, torque_cutoff=cutoff, keep_every=keep_every)


def load_emps(keep_every: int = 10) -> tuple[Robot, pd.DataFrame, Array]:
    """One prismatic axis; its only recording is cut into 8 contiguous trajectories."""
    z = np.load(data_dir() / "emps" / "emps.npz")
    q, t = z["q"], z["t"]
    dq = np.gradient(q[:, 0], t)[:, None]
    X, y = make_log(
        [(t, q, dq, z["tau"])], rate=1000.0, cutoff=30.0, torque_cutoff=30.0, keep_every=keep_every
    )
    X["trajectory"] = np.minimum(np.arange(len(X)) * 8 // len(X), 7)
    robot = Robot.from_urdf(
        '<robot name="emps"><link name="base"/><link name="carriage"><inertial><mass value="95"/>'
        '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        '<joint name="slide" type="prismatic"><parent link="base"/><child link="carriage"/>'
        '<axis xyz="1 0 0"/><limit lower="-1" upper="1" effort="200" velocity="2"/></joint></robot>'
    )
    return robot, X, y


class LinearPhysics(RegressorMixin, BaseEstimator):
    """Rigid body and effects with given shape parameters, weighted least squares.

    Parameters
    ----------
    robot : Robot
        Geometry and prior inertial parameters.
    effects : tuple of (kind, shapes)
        For every joint; ``shapes`` are the values of the shape parameters.
    """

    def __init__(self, robot: Robot, effects: tuple = ()) -> None:
        self.robot = robot
        self.effects = effects

    def _signals(self, X: pd.DataFrame) -> Signals:
        columns = resolve_columns(list(X.columns), X.shape[1], self.robot.joint_names)
        return signals_from(X.to_numpy(float), columns, self.robot)

    def _effect_columns(self, signals: Signals, joint: int) -> Array:
        blocks = [
            get_effect(kind).columns(signals, joint, **dict(shape)) for kind, shape in self.effects
        ]
        return np.concatenate([np.empty((signals.n_samples, 0)), *blocks], axis=1)

    def _design(self, signals: Signals) -> tuple[Array, list[Array]]:
        regressor = self.robot.torque_regressor(signals.q, signals.dq, signals.ddq)
        if any(kind == "load_dependent_friction" for kind, _ in self.effects):
            # the load is the rigid body with the robot's own parameters
            load = self.robot.inverse_dynamics(signals.q, signals.dq, signals.ddq)
            signals = signals.with_(load=load)
        return regressor, [self._effect_columns(signals, j) for j in range(signals.n_joints)]

    def fit(self, X: pd.DataFrame, y: Array) -> LinearPhysics:
        signals = self._signals(X)
        y = np.asarray(y).reshape(len(X), -1)
        regressor, own = self._design(signals)
        used = self._used(signals, y.shape)
        n, p = y.shape[1], regressor.shape[2]
        widths = [block.shape[1] for block in own]
        starts = p + np.cumsum([0, *widths])
        sigma = y.std(axis=0)
        for _ in range(3):
            gram, cross = np.zeros((starts[-1],) * 2), np.zeros(starts[-1])
            for j in range(n):
                columns = np.r_[np.arange(p), np.arange(starts[j], starts[j + 1])]
                rows = used[:, j]
                block = np.c_[regressor[rows, j], own[j][rows]] / sigma[j]
                gram[np.ix_(columns, columns)] += block.T @ block
                cross[columns] += block.T @ (y[rows, j] / sigma[j])
            scale = np.sqrt(np.diag(gram)) + 1e-12
            values, vectors = np.linalg.eigh(gram / np.outer(scale, scale))
            kept = values > 1e-9 * values[-1]
            inverse = vectors[:, kept] / values[kept]
            solution = inverse @ (vectors[:, kept].T @ (cross / scale)) / scale
            self.inertial_parameters_ = solution[:p]
            self.effect_coefficients_ = [
                solution[a:b] for a, b in zip(starts[:-1], starts[1:], strict=True)
            ]
            sigma = (y - self._torque(regressor, own)).std(axis=0, where=used)
        return self

    def _used(self, signals: Any, shape: tuple[int, ...]) -> NDArray[np.bool_]:
        """Rows that every joint is fitted to."""
        return np.ones(shape, dtype=bool)

    def _torque(self, regressor: Array, own: list[Array]) -> Array:
        torque = regressor @ self.inertial_parameters_
        for j, coefficients in enumerate(self.effect_coefficients_):
            torque[:, j] += own[j] @ coefficients
        return torque

    def predict(self, X: pd.DataFrame) -> Array:
        check_is_fitted(self, "inertial_parameters_")
        return self._torque(*self._design(self._signals(X)))


class ColumnPhysics(LinearPhysics):
    """The same least squares with columns that were computed for a whole log.

    Parameters
    ----------
    regressor : ndarray of shape (n_samples, n_joints, n_parameters)
        Of the rigid body.
    own : list of ndarray of shape (n_samples, n_columns)
        Effects of each joint. X must keep the log's row numbers as its index.
    used : ndarray of shape (n_samples, n_joints) of bool or None, default=None
        Rows that every joint is fitted to; all if None.
    """

    def __init__(
        self, regressor: Array, own: list[Array], used: NDArray[np.bool_] | None = None
    ) -> None:
        self.regressor = regressor
        self.own = own
        self.used = used

    def __sklearn_clone__(self) -> ColumnPhysics:
        return ColumnPhysics(self.regressor, self.own, self.used)  # the columns are not copied

    def _used(self, rows: NDArray[np.int64], shape: tuple[int, ...]) -> NDArray[np.bool_]:
        return super()._used(rows, shape) if self.used is None else self.used[rows]

    def _signals(self, X: pd.DataFrame) -> NDArray[np.int64]:
        return X.index.to_numpy()

    def _design(self, rows: NDArray[np.int64]) -> tuple[Array, list[Array]]:
        return self.regressor[rows], [block[rows] for block in self.own]


def filtered_physics(
    robot: Robot, X: pd.DataFrame, effects: tuple, cutoff: float, rate: float, keep_every: int
) -> ColumnPhysics:
    """Physics whose columns pass the low-pass of the torque before every k-th row is taken.

    Friction turns over within a few samples; a torque that was low-passed can only be explained by
    columns that were low-passed as well.
    """
    regressor, own = LinearPhysics(robot, effects)._design(LinearPhysics(robot)._signals(X))
    widths = np.cumsum([regressor[0].size, *(block.shape[1] for block in own)])
    columns = np.concatenate([regressor.reshape(len(X), -1), *own], axis=1)
    for rows in X.groupby("trajectory").indices.values():
        columns[rows] = ButterworthFilter(cutoff, rate=rate).fit_transform(columns[rows])
    parts = np.split(columns[::keep_every], widths[:-1], axis=1)
    return ColumnPhysics(parts[0].reshape(-1, *regressor.shape[1:]), parts[1:])


#: Rigid body, viscous and Coulomb friction, offset, rotor inertia.
BASE = (("viscous", ()), ("coulomb", ()), ("offset", ()), ("rotor_inertia", ()))
#: Pre-sliding friction of three widths in place of one that is fitted.
DAHL = tuple(("dahl", (("presliding", width),)) for width in (0.003, 0.01, 0.05))
#: What the diagnosis adds on collaborative arms.
COMPLETE = (*BASE, *DAHL, ("load_dependent_friction", ()), ("nonlinear_viscous", (("power", 2.0),)))


def print_table(title: str, rows: dict[str, Sequence[float]], heads: Sequence[str]) -> None:
    """Print numbers as a Markdown table."""
    print(f"\n**{title}**\n")
    print("| | " + " | ".join(heads) + " |")
    print("|---|" + "---|" * len(heads))
    for name, values in rows.items():
        print(f"| {name} | " + " | ".join(f"{value:.3f}" for value in values) + " |")
