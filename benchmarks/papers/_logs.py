# SPDX-License-Identifier: BSD-3-Clause
"""Recorded logs at their full rate, and the physics that a diagnosis completes on part of one."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd
from _common import PANDA_PERIOD, Array, ColumnPhysics, data_dir, uniform, ur10e_runs
from numpy.typing import NDArray
from sklearn.base import BaseEstimator, RegressorMixin, clone
from sklearn.model_selection import PredefinedSplit

from skidyn._columns import resolve_columns
from skidyn._signals import Signals, signals_from
from skidyn.diagnosis import EffectSearchCV
from skidyn.evidence import hysteresis_joints, sliding_samples
from skidyn.identification import RBDRegressor
from skidyn.model_selection import PhaseKFold, TrajectoryKFold, held_out_folds
from skidyn.preprocessing import ButterworthFilter, TimeDerivative
from skidyn.robots import Robot

#: Seconds at both ends of a recording that no one is judged on: the filters need them.
END = 0.2
#: Seconds around rest and reversals that joints without hysteresis are not fitted to.
SLIDING_MARGIN = 0.1


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

    def __post_init__(self) -> None:
        smooth = ButterworthFilter(self.cutoff, rate=self.rate).set_output(transform="pandas")
        motion = TimeDerivative().set_output(transform="pandas")
        X = motion.fit_transform(smooth.fit_transform(self.raw))
        y = self.low_pass(self.raw_torque)
        end = int(END * self.rate)
        kept = np.concatenate([rows[end : -end : self.keep_every] for rows in self.recordings()])
        self.X, self.y, self.kept = X.iloc[kept].reset_index(drop=True), y[kept], kept
        if self.n_blocks:
            block = np.arange(len(kept)) * self.n_blocks // len(kept)
            self.X = self.X.assign(trajectory=block)

    def recordings(self) -> list[NDArray[np.int64]]:
        """Raw rows of every recording."""
        return list(self.raw.groupby("trajectory").indices.values())

    def low_pass(self, torque: Array) -> Array:
        """Torque after the zero-phase low-pass, recording by recording."""
        filtered = np.empty_like(torque)
        smooth = ButterworthFilter(self.cutoff, rate=self.rate)
        for rows in self.recordings():
            filtered[rows] = smooth.fit_transform(torque[rows])
        return filtered

    def raw_rows(self, X: pd.DataFrame) -> NDArray[np.int64]:
        """Rows at full rate that the rows of X stand for."""
        rows = self.kept[X.index.to_numpy()][:, None] + np.arange(self.keep_every)
        return np.minimum(rows.ravel(), len(self.raw) - 1)

    def motion(self, cutoff: float) -> Signals:
        """Motion of the whole log below a frequency."""
        if ("motion", cutoff) not in self.cache:
            smooth = ButterworthFilter(cutoff, rate=self.rate).set_output(transform="pandas")
            derive = TimeDerivative().set_output(transform="pandas")
            table = derive.fit_transform(smooth.fit_transform(self.raw))
            columns = resolve_columns(list(table), table.shape[1], self.robot.joint_names)
            self.cache["motion", cutoff] = signals_from(table.to_numpy(), columns, self.robot)
        return self.cache["motion", cutoff]

    def columns(self, model: RBDRegressor, cutoff: float, rest: bool) -> ColumnPhysics:
        """Columns of an identified model, low-passed as the torque, at the rows of X."""
        s = self.motion(cutoff)
        if ("rigid", cutoff) not in self.cache:
            regressor = self.robot.torque_regressor(s.q, s.dq, s.ddq).transpose(1, 0, 2)
            rigid = [self.low_pass(np.ascontiguousarray(joint))[self.kept] for joint in regressor]
            self.cache["rigid", cutoff] = np.stack(rigid, axis=1)
        own: list[list[Array]] = [[] for _ in range(self.robot.n_joints)]
        torque = model.rigid_body_torque(s.q, s.dq, s.ddq)
        for _, block in model._effects(s.with_(robot=model.robot_), torque):
            for joint, values in block.items():
                own[joint].append(self.low_pass(values)[self.kept])
        effects = [np.concatenate(blocks, axis=1) for blocks in own]
        used = None if rest else self.sliding(model, cutoff)
        return ColumnPhysics(self.cache["rigid", cutoff], effects, used)

    def sliding(self, model: RBDRegressor, cutoff: float) -> NDArray[np.bool_]:
        """Rows of X where every joint slides, or all where the model knows its hysteresis."""
        if ("sliding", cutoff) not in self.cache:
            s = self.motion(cutoff)
            margin = round(SLIDING_MARGIN * self.rate)
            sliding = sliding_samples(s, np.ones(s.q.shape, dtype=bool), margin)
            self.cache["sliding", cutoff] = sliding[self.kept]
        used: NDArray[np.bool_] = self.cache["sliding", cutoff].copy()
        used[:, hysteresis_joints(model.effect_terms_)] = True
        return used

    def inner_folds(self, train: NDArray[np.int64]) -> list[Any]:
        """Folds within training rows, as row numbers of X."""
        X = self.X.iloc[train]
        if hasattr(self.inner, "split"):
            folds = list(self.inner.split(X))
        else:
            folds = held_out_folds(X["trajectory"].to_numpy(), self.inner)
        return [(train[a], train[b]) for a, b in folds]

    def inner_errors(
        self, model: RBDRegressor, train: NDArray[np.int64], cutoff: float, rest: bool
    ) -> Array:
        """Log of the squared error on every inner fold, mean over the joints."""
        physics, errors = self.columns(model, cutoff, rest), []
        for a, b in self.inner_folds(train):
            physics.fit(self.X.iloc[a], self.y[a])
            squares = (self.y[b] - physics.predict(self.X.iloc[b])) ** 2
            errors.append(np.log(squares.mean(axis=0)).mean())
        return np.array(errors)

    def choose(
        self, unfitted: RBDRegressor, train: NDArray[np.int64], cutoffs: Sequence[float]
    ) -> tuple[float, bool]:
        """Cut-off of the motion, Hz, and whether rest is fitted: what predicts inner folds best.

        At rest dry friction takes any value up to that of sliding. A stiff model comes closer to
        all rows if it saw all; a flexible one reads more into rest than there is. Rest is left out
        only if that is better by two standard errors.
        """
        rows = self.raw_rows(self.X.iloc[train])
        model = clone(unfitted).fit(self.raw.iloc[rows], self.raw_torque[rows])
        errors = {cutoff: self.inner_errors(model, train, cutoff, True) for cutoff in cutoffs}
        best = min(cutoffs, key=lambda cutoff: errors[cutoff].mean())
        gain = errors[best] - self.inner_errors(model, train, best, False)
        return best, bool(gain.mean() <= 2 * gain.std(ddof=1) / np.sqrt(len(gain)))

    def units(self) -> NDArray[Any]:
        """What counts as independent: recordings, blocks, or the outer folds of a single path."""
        unit = self.X["trajectory"].to_numpy()
        if len(np.unique(unit)) > 1:
            return unit
        part = np.zeros(len(unit), dtype=int)
        for k, (_, test) in enumerate(self.outer.split(self.X, self.y)):
            part[test] = k
        return part

    def physics(
        self, train: NDArray[np.int64]
    ) -> tuple[LowPassedPhysics, LowPassedPhysics, list[str]]:
        """Plain physics, physics that the diagnosis completes, and what it added.

        Cut-off of the motion, effects and their shapes are found on training rows alone.
        """
        fastest = min(3 * self.cutoff, 30.0, 0.4 * self.rate)
        plain = RBDRegressor(self.robot, self.effects)
        cutoff, rest = self.choose(plain, train, (self.cutoff, fastest))
        rows = self.raw_rows(self.X.iloc[train])
        search = EffectSearchCV(plain).fit(self.raw.iloc[rows], self.raw_torque[rows])
        added = [f"motion below {cutoff:.3g} Hz"]
        added += [f"{f.kind} {list(f.joints)}" for f in search.diagnosis_.findings]
        completed = search.best_estimator_
        _, rest_too = self.choose(completed, train, (cutoff,))
        return (
            LowPassedPhysics(self, plain, cutoff, rest),
            LowPassedPhysics(self, completed, cutoff, rest_too),
            added,
        )


class LowPassedPhysics(RegressorMixin, BaseEstimator):
    """Physics whose columns are low-passed like the torque that it is to explain.

    Friction turns over within a few samples: a torque that was low-passed can only be explained by
    columns that were computed from faster motion and low-passed as well. The model is identified
    on the raw rows first, which gives the loads that some effects see; its coefficients are then
    fitted again to the low-passed torque. Beyond the rows of X only the motion is read, no torque.

    Parameters
    ----------
    log : RecordedLog
        The rows of X must keep its index.
    model : RBDRegressor
        Not fitted.
    cutoff : float, Hz
        Low-pass of the motion that the columns see.
    rest : bool
        Fit joints without hysteresis to rest and reversals as well.
    """

    def __init__(self, log: RecordedLog, model: RBDRegressor, cutoff: float, rest: bool) -> None:
        self.log = log
        self.model = model
        self.cutoff = cutoff
        self.rest = rest

    def __sklearn_clone__(self) -> LowPassedPhysics:
        return LowPassedPhysics(self.log, self.model, self.cutoff, self.rest)  # no copy of the log

    def fit(self, X: pd.DataFrame, y: Array) -> LowPassedPhysics:
        log = self.log
        key = (id(self.model), self.cutoff, self.rest, X.index.to_numpy().tobytes())
        if key not in log.cache:  # every learner meets the same physics again
            rows = log.raw_rows(X)
            identified = clone(self.model).fit(log.raw.iloc[rows], log.raw_torque[rows])
            physics = log.columns(identified, self.cutoff, self.rest)
            torque = physics.fit(X, y).predict(log.X)
            log.cache[key] = torque, self.model  # no other model may get its id
        self.torque_ = log.cache[key][0]
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
    runs, dates = ur10e_runs()
    raw, torque = _table(runs, 100.0)
    order = {date: i // 2 for i, date in enumerate(sorted(set(dates)))}
    robot = Robot.from_urdf(data_dir() / "ur10e" / "ur10e_min.urdf")
    log = RecordedLog(
        "UR10e, pairs of dates held out", robot, PLAIN, raw, torque, 100.0, 5.0, 4, None, 5,
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
