# SPDX-License-Identifier: BSD-3-Clause
"""Recorded logs at their full rate, and the physics that a diagnosis completes on part of one."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd
from _common import PANDA_PERIOD, UR10E_GAIN, Array, ColumnPhysics, data_dir, uniform
from numpy.typing import NDArray
from sklearn.base import BaseEstimator, RegressorMixin, clone
from sklearn.model_selection import PredefinedSplit

from skidyn._signals import Signals
from skidyn.diagnosis import EffectSearchCV
from skidyn.evidence._kinematics import smooth_motion
from skidyn.evidence._problem import term_columns
from skidyn.model_selection import PhaseKFold, TrajectoryKFold
from skidyn.preprocessing import ButterworthFilter, TimeDerivative
from skidyn.rigid_body import RBDRegressor
from skidyn.rigid_body._rbd_regressor import _DRY
from skidyn.robots import Robot

#: Seconds at both ends of a recording that no one is judged on: the filters need them.
END = 0.2


@dataclass(eq=False)
class RecordedLog:
    """Raw columns of a log, the low-passed rows that learners see, and how it is held out.

    Parameters
    ----------
    title : str
        What it is.
    robot : Robot
        The robot.
    effects : tuple
        Effects of the plain physics.
    raw : DataFrame
        ``trajectory`` (recording), ``time``, ``q..``, ``dq..`` on a regular clock.
    raw_torque : ndarray of shape (n_samples, n_joints), N m (N if prismatic)
        As measured.
    rate, cutoff : float, Hz
        Sampling rate; low-pass of the torque that is predicted and of the learners' features.
    keep_every : int
        Learners see every so many rows.
    outer, inner : cross-validator
        What is held out, and the folds of the hybrid's cross-fitting.
    n_blocks : int, default=0
        A single recording is cut into so many blocks, which count as trajectories for the learners
        and for the intervals.
    """

    title: str
    robot: Robot
    effects: tuple
    raw: pd.DataFrame
    raw_torque: Array
    rate: float
    cutoff: float
    keep_every: int
    outer: Any
    inner: Any
    n_blocks: int = 0
    X: pd.DataFrame = field(init=False)
    y: Array = field(init=False)
    kept: NDArray[np.int64] = field(init=False)
    cache: dict[Any, Any] = field(init=False, default_factory=dict)
    kept_alive: list[Any] = field(init=False, default_factory=list)

    def __post_init__(self) -> None:
        smooth = ButterworthFilter(self.cutoff, rate=self.rate).set_output(transform="pandas")
        motion = TimeDerivative().set_output(transform="pandas")
        X = motion.fit_transform(smooth.fit_transform(self.raw))
        y = self.low_pass(self.raw_torque)
        end = int(END * self.rate)
        kept = np.concatenate(
            [rows[end : -end : self.keep_every] for rows in self.raw.groupby("trajectory").indices.values()]
        )
        self.X, self.y, self.kept = X.iloc[kept].reset_index(drop=True), y[kept], kept
        if self.n_blocks:
            block = np.arange(len(kept)) * self.n_blocks // len(kept)
            self.X = self.X.assign(trajectory=block)

    def low_pass(self, torque: Array) -> Array:
        """Torque after the zero-phase low-pass, recording by recording."""
        filtered = np.empty_like(torque)
        for rows in self.raw.groupby("trajectory").indices.values():
            filtered[rows] = ButterworthFilter(self.cutoff, rate=self.rate).fit_transform(torque[rows])
        return filtered

    def raw_rows(self, X: pd.DataFrame) -> NDArray[np.int64]:
        """Rows at full rate that the rows of X stand for."""
        rows = self.kept[X.index.to_numpy()][:, None] + np.arange(self.keep_every)
        return np.minimum(rows.ravel(), len(self.raw) - 1)

    def motion(self, model: RBDRegressor) -> Signals:
        """Smoothed motion of the whole log, as the model sees it."""
        model.columns_ = model._resolve(self.raw.shape[1])
        return smooth_motion(model._read(self.raw.to_numpy())).signals.with_(robot=self.robot)

    def rigid_columns(self) -> Array:
        """Torque per inertial parameter, low-passed, at the rows of X."""
        if "rigid" not in self.cache:
            model = RBDRegressor(self.robot)
            model.robot_, model.feature_names_in_ = self.robot, self.raw.columns.to_numpy()
            s = self.motion(model)
            columns = [
                self.low_pass(np.ascontiguousarray(joint))[self.kept]
                for joint in self.robot.torque_regressor(s.q, s.dq, s.ddq).transpose(1, 0, 2)
            ]
            self.cache["rigid"] = np.stack(columns, axis=1)
        return self.cache["rigid"]

    def effect_columns(self, model: RBDRegressor) -> list[Array]:
        """Low-passed columns of a fitted model's effects for each joint, at the rows of X."""
        s = self.motion(model)
        torque = model.rigid_body_torque(s.q, s.dq, s.ddq)
        load, smooth = torque.copy(), torque.copy()
        own: list[list[Array]] = [[] for _ in range(self.robot.n_joints)]
        for term in model._in_order():  # as RBDRegressor.predict does
            state = s.with_(
                load=load,
                model_torque=torque.copy(),
                smooth_torque=smooth.copy(),
                inertial_parameters=model.inertial_parameters_,
            )
            for j, block in term_columns(state, term).items():
                own[j].append(self.low_pass(block)[self.kept])
                part = block @ model.effect_coefficients_[term]
                torque[:, j] += part
                if term.kind not in _DRY:
                    smooth[:, j] += part
        return [np.concatenate(blocks, axis=1) for blocks in own]

    def units(self) -> NDArray[Any]:
        """What counts as independent: recordings, blocks, or the outer folds of a single path."""
        unit = self.X["trajectory"].to_numpy()
        if len(np.unique(unit)) > 1:
            return unit
        part = np.zeros(len(unit), dtype=int)
        for k, (_, test) in enumerate(self.outer.split(self.X, self.y)):
            part[test] = k
        return part

    def plain(self) -> LowPassedPhysics:
        """Rigid body and the friction that everybody has."""
        return LowPassedPhysics(self, RBDRegressor(self.robot, self.effects))

    def completed(self, train: NDArray[np.int64]) -> tuple[LowPassedPhysics, list[str]]:
        """Physics that the diagnosis completes on training rows alone, and what it added."""
        rows = self.raw_rows(self.X.iloc[train])
        search = EffectSearchCV(RBDRegressor(self.robot, self.effects))
        search.fit(self.raw.iloc[rows], self.raw_torque[rows])
        added = [f"{f.kind} {list(f.joints)}" for f in search.diagnosis_.findings]
        return LowPassedPhysics(self, search.best_estimator_), added


class LowPassedPhysics(RegressorMixin, BaseEstimator):
    """Physics whose columns are low-passed like the torque that it is to explain.

    Friction turns over within a few samples: a torque that was low-passed can only be explained by
    columns that were computed from the raw motion and low-passed as well. The model is identified
    on the raw rows first, which gives the loads that some effects see; its coefficients are then
    fitted again to the low-passed torque. Beyond the rows of X only the motion is read, no torque.

    Parameters
    ----------
    log : RecordedLog
        The rows of X must keep its index.
    physics : RBDRegressor
        Not fitted.
    """

    def __init__(self, log: RecordedLog, physics: RBDRegressor) -> None:
        self.log = log
        self.physics = physics

    def __sklearn_clone__(self) -> LowPassedPhysics:
        return LowPassedPhysics(self.log, self.physics)  # the log is not copied

    def fit(self, X: pd.DataFrame, y: Array) -> LowPassedPhysics:
        log = self.log
        key = (id(self.physics), X.index.to_numpy().tobytes())
        if key not in log.cache:  # every learner meets the same physics again
            rows = log.raw_rows(X)
            identified = clone(self.physics).fit(log.raw.iloc[rows], log.raw_torque[rows])
            columns = ColumnPhysics(log.rigid_columns(), log.effect_columns(identified))
            log.cache[key] = columns.fit(X, y).predict(log.X)
            log.kept_alive.append(self.physics)  # no other object may get its id
        self.torque_ = log.cache[key]
        return self

    def predict(self, X: pd.DataFrame) -> Array:
        return self.torque_[X.index.to_numpy()]


def _table(runs: list[tuple[Array, ...]], rate: float) -> tuple[pd.DataFrame, Array]:
    """Recordings (t, q, dq, tau) on a regular clock, one under the other."""
    frames, torques = [], []
    for number, (t, *signals) in enumerate(runs):
        clock, (q, dq, tau) = uniform(t, *signals, rate=rate)
        names = [f"{s}{j + 1}" for s in ("q", "dq") for j in range(q.shape[1])]
        frame = pd.DataFrame(np.c_[q, dq], columns=names)
        frame.insert(0, "time", clock)
        frame.insert(0, "trajectory", number)
        frames.append(frame)
        torques.append(tau)
    return pd.concat(frames, ignore_index=True), np.concatenate(torques)


PLAIN = ("viscous", "coulomb", "offset", "rotor_inertia")


def ur10e() -> RecordedLog:
    """13 unloaded excitation runs of 8 dates; pairs of dates are held out."""
    folder = data_dir() / "ur10e"
    z = np.load(folder / "ur10e_excitation.npz")
    runs, dates = [], []
    for k, name in enumerate(z["traj_name"]):
        date = str(name)[3:11]
        if '"payload_kg": 0.0' not in str(z["traj_label"][k]) or date < "19_10_02":
            continue
        rows = (z["traj"] == k) & z["valid"]
        runs.append((z["t"][rows], z["q"][rows], z["dq"][rows], z["i"][rows] * UR10E_GAIN))
        dates.append(date)
    raw, torque = _table(runs, 100.0)
    order = {date: i // 2 for i, date in enumerate(sorted(set(dates)))}
    log = RecordedLog(
        "UR10e, pairs of dates held out", Robot.from_urdf(folder / "ur10e_min.urdf"), PLAIN,
        raw, torque, 100.0, 5.0, 4, None, 5,
    )  # fmt: skip
    fold = np.array([order[date] for date in dates])[log.X["trajectory"].to_numpy(int)]
    log.outer = PredefinedSplit(fold)
    return log


def panda() -> RecordedLog:
    """One recording of 1.5 periods of one path; quarters of the path are held out."""
    folder = data_dir() / "panda"
    z = np.load(folder / "panda_gaz.npz")
    raw, torque = _table([(z["t"], z["q"], z["dq"], z["tau"])], 1000.0)
    outer, inner = (PhaseKFold(n, period=PANDA_PERIOD) for n in (4, 5))
    return RecordedLog(
        "Panda, quarters of the path held out", Robot.from_urdf(folder / "panda_min.urdf"), PLAIN,
        raw, torque, 1000.0, 10.0, 10, outer, inner,
    )  # fmt: skip


def emps() -> RecordedLog:
    """One prismatic axis with a ball screw; eight blocks of one recording are held out in turn."""
    z = np.load(data_dir() / "emps" / "emps.npz")
    dq = np.gradient(z["q"][:, 0], z["t"])[:, None]
    raw, torque = _table([(z["t"], z["q"], dq, z["tau"])], 1000.0)
    robot = Robot.from_urdf(
        '<robot name="emps"><link name="base"/><link name="carriage"><inertial><mass value="95"/>'
        '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        '<joint name="slide" type="prismatic"><parent link="base"/><child link="carriage"/>'
        '<axis xyz="1 0 0"/><limit lower="-1" upper="1" effort="200" velocity="2"/></joint></robot>'
    )
    return RecordedLog(
        "EMPS, eight blocks held out", robot, PLAIN[:3], raw, torque, 1000.0, 30.0, 10,
        TrajectoryKFold(8), 7, n_blocks=8,
    )  # fmt: skip


def practice(case: str, title: str) -> RecordedLog:
    """A simulated log; trajectories are held out, five folds."""
    folder = data_dir().parent / "practice" / "cases" / case
    frame = pd.read_parquet(folder / "log.parquet")
    meta = json.loads((folder / "meta.json").read_text())
    runs = []
    for _, run in frame.groupby("trajectory"):
        signals = [run.filter(regex=rf"^{s}\d+$").to_numpy() for s in ("q", "dq", "tau")]
        runs.append((run["time"].to_numpy(), *signals))
    rate = float(meta["nominal_rate_hz"])
    raw, torque = _table(runs, rate)
    effects = tuple(kind for kind in meta["base_model"] if kind != "rigid_body")
    return RecordedLog(
        title, Robot.from_urdf(folder / "robot.urdf"), effects, raw, torque, rate, 10.0, 2,
        TrajectoryKFold(5), 5,
    )  # fmt: skip


def dahl() -> RecordedLog:
    """Simulated arm with Dahl friction."""
    return practice("practice_33", "Simulated, Dahl friction")


def unknown() -> RecordedLog:
    """Simulated arm with an effect that no kind of the catalogue describes."""
    return practice("practice_20", "Simulated, an effect of no known kind")


LOGS = {f.__name__: f for f in (ur10e, panda, emps, dahl, unknown)}
