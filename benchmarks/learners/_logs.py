# SPDX-License-Identifier: BSD-3-Clause
"""Recordings and simulated logs for regressors: a table, a torque and folds."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from skidyn.datasets import (
    load_panda as load_panda_arm,
    load_planar_arm,
    load_scara,
    load_srs_arm,
    load_ur5,
    load_ur10e,
    make_hidden_effect_log,
)
from skidyn.preprocessing import ButterworthFilter, TimeDerivative
from skidyn.robots import Robot

Array = NDArray[np.float64]
Run = tuple[Array, Array, Array, Array]

#: Published current gains of the UR10e, N m/A (De Luca's set; see the data's README).
UR10E_GAIN = np.array([14.87, 13.26, 11.13, 10.62, 11.03, 11.47])
#: Effects of the physics beside the rigid body.
PLAIN = ("viscous", "coulomb", "offset", "rotor_inertia")


@dataclass(eq=False)
class Log:
    """One log and how it is held out.

    Parameters
    ----------
    title : str
        What it is and what is held out.
    robot : Robot or None
        None where no serial robot describes the mechanism.
    X : DataFrame
        ``trajectory``, ``time`` in s, ``q..``, ``dq..``, ``ddq..``.
    y : ndarray of shape (n_samples, n_joints), N m (N if prismatic)
        Torque.
    fold : ndarray of int of shape (n_samples,)
        In which fold a row is held out.
    effects : tuple of str, default=PLAIN
        Effects of the physics.
    """

    title: str
    robot: Robot | None
    X: pd.DataFrame
    y: Array
    fold: NDArray[np.int64]
    effects: tuple[str, ...] = PLAIN

    def splits(self) -> Iterable[tuple[NDArray[np.intp], NDArray[np.intp]]]:
        """Training and test rows of every fold."""
        for k in np.unique(self.fold):
            yield np.flatnonzero(self.fold != k), np.flatnonzero(self.fold == k)


def recordings(*path: str) -> dict[str, Array]:
    """Arrays of a file of recordings; ends the program with a message where there is none."""
    named = os.environ.get("SKIDYN_DATA")
    folder = Path(named) if named else Path(__file__).resolve().parents[3] / "shared" / "data"
    if not folder.is_dir():
        sys.exit("recordings not found; set SKIDYN_DATA to their folder")
    return dict(np.load(folder.joinpath(*path)))


def urdf(*path: str) -> Robot:
    """Robot of the recordings."""
    named = os.environ.get("SKIDYN_DATA")
    folder = Path(named) if named else Path(__file__).resolve().parents[3] / "shared" / "data"
    return Robot.from_urdf(folder.joinpath(*path))


def table(
    runs: list[Run], rate: float, cutoff: float, keep_every: int
) -> tuple[pd.DataFrame, Array]:
    """Runs (t, q, dq, tau) on a regular clock, low-passed, differentiated, thinned."""
    frames, torques = [], []
    for number, (t, q, dq, tau) in enumerate(runs):
        t, first = np.unique(t, return_index=True)
        clock = np.arange(t[0], t[-1], 1.0 / rate)
        frame = pd.DataFrame({"trajectory": number, "time": clock})
        for name, signal in (("q", q), ("dq", dq), ("tau", tau)):
            for j, column in enumerate(signal[first].T):
                frame[f"{name}{j + 1}"] = np.interp(clock, t, column)
        smooth = ButterworthFilter(cutoff).set_output(transform="pandas").fit_transform(frame)
        torque = smooth.filter(regex=r"^tau\d+$")
        motion = smooth.drop(columns=torque.columns)
        motion = TimeDerivative().set_output(transform="pandas").fit_transform(motion)
        inside = slice(int(0.2 * rate), -int(0.2 * rate), keep_every)  # ends of the filter
        frames.append(motion[inside])
        torques.append(torque[inside].to_numpy())
    return pd.concat(frames, ignore_index=True), np.concatenate(torques)


def runs_of(z: dict[str, Array], torque: str = "tau") -> list[Run]:
    """Every run of a file."""
    found = []
    for k in np.unique(z["traj"]):
        rows = np.flatnonzero(z["traj"] == k)
        t, q = z["t"][rows], z["q"][rows]
        dq = z["dq"][rows] if "dq" in z else np.gradient(q, t, axis=0)
        found.append((t, q, dq, z[torque][rows]))
    return found


def moving(run: Run) -> Run:
    """From the first to the last motion: how long a robot rested says nothing of a model."""
    t, q, dq, tau = run
    speed = np.abs(dq).max(axis=1)
    rows = slice(*(np.flatnonzero(speed > 0.02)[[0, -1]] + [0, 1]))
    return t[rows], q[rows], dq[rows], tau[rows]


def blocks(X: pd.DataFrame, n_blocks: int, n_folds: int) -> tuple[pd.DataFrame, NDArray[np.int64]]:
    """One recording cut into blocks, which take turns in being held out."""
    block = np.arange(len(X)) * n_blocks // len(X)
    return X.assign(trajectory=block), block % n_folds


def ur10e() -> Log:
    """13 unloaded excitation runs of 8 dates, which are held out in three groups."""
    z = recordings("ur10e", "ur10e_excitation.npz")
    runs, dates = [], []
    for k, name in enumerate(z["traj_name"]):
        date = str(name)[3:11]
        if '"payload_kg": 0.0' in str(z["traj_label"][k]) and date >= "19_10_02":
            rows = np.flatnonzero((z["traj"] == k) & z["valid"])
            signals = z["t"][rows], z["q"][rows], z["dq"][rows], z["i"][rows] * UR10E_GAIN
            runs.append(moving(signals))
            dates.append(date)
    X, y = table(runs, 100.0, 5.0, 8)
    order = {date: i * 3 // 8 for i, date in enumerate(sorted(set(dates)))}
    fold = np.array([order[date] for date in dates])[X["trajectory"].to_numpy(int)]
    robot = urdf("ur10e", "ur10e_min.urdf")
    return Log("UR10e, dates", robot, X, y, fold)


def panda() -> Log:
    """One recording of 1.5 periods of a path; 12 blocks take turns in three folds."""
    X, y = table(runs_of(recordings("panda", "panda_gaz.npz")), 1000.0, 10.0, 20)
    X, fold = blocks(X, 12, 3)
    return Log("Panda, blocks of a path", urdf("panda", "panda_min.urdf"), X, y, fold)


def emps() -> Log:
    """One prismatic axis with a ball screw; 12 blocks of one recording in three folds."""
    z = recordings("emps", "emps.npz")
    dq = np.gradient(z["q"], z["t"], axis=0)
    X, y = table([(z["t"], z["q"], dq, z["tau"])], 1000.0, 30.0, 10)
    X, fold = blocks(X, 12, 3)
    robot = Robot.from_urdf(
        '<robot name="emps"><link name="base"/><link name="carriage"><inertial><mass value="95"/>'
        '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        '<joint name="slide" type="prismatic"><parent link="base"/><child link="carriage"/>'
        '<axis xyz="1 0 0"/><limit lower="-1" upper="1" effort="200" velocity="2"/></joint></robot>'
    )
    return Log("EMPS, blocks", robot, X, y, fold, PLAIN[:3])


def simulated(robot: Robot, effect: str | None, title: str, seed: int) -> Log:
    """A simulated arm that hides an effect; 12 trajectories in three folds."""
    log = make_hidden_effect_log(robot, effect, n_trajectories=12, rate=30.0, random_state=seed)
    fold = log.X["trajectory"].to_numpy(int) % 3
    return Log(title, log.robot, log.X, log.y, fold, ("viscous", "coulomb"))


def ur5_dahl() -> Log:
    """A simulated UR5 with pre-sliding friction."""
    return simulated(load_ur5(), "dahl", "simulated UR5, Dahl friction", 1)


def scara_ripple() -> Log:
    """A simulated SCARA with torque ripple."""
    return simulated(load_scara(), "torque_ripple", "simulated SCARA, torque ripple", 2)


def panda_unknown() -> Log:
    """A simulated Panda with a cable whose torque no effect of the catalogue describes."""
    return simulated(load_panda_arm(), "unknown_cable", "simulated Panda, cable", 3)


def ur10e_elastic() -> Log:
    """A simulated UR10e with elastic joints."""
    return simulated(load_ur10e(), "joint_elasticity", "simulated UR10e, elastic joints", 4)


def lwr4() -> Log:
    """A KUKA LWR4+: a motion recorded twice, which is one fold, and a faster one."""
    X, y = table(runs_of(recordings("kuka_lwr4", "kuka_lwr4.npz")), 200.0, 8.0, 8)
    fast = (X["trajectory"] == 2).to_numpy(int)
    quarters = X.assign(trajectory=np.arange(len(X)) * 12 // len(X))
    robot = urdf("kuka_lwr4", "kuka_lwr4_min.urdf")
    return Log("KUKA LWR4+, motions", robot, quarters, y, fast)


def lwr4_repeated() -> Log:
    """The same with blocks held out that another run repeats: how well is it learned by heart."""
    log = lwr4()
    block = log.X["trajectory"].to_numpy(int)
    return Log("KUKA LWR4+, blocks that are repeated", log.robot, log.X, log.y, block % 3)


def iiwa() -> Log:
    """A KUKA iiwa: ten runs at 100 Hz, held out in three groups."""
    z = recordings("polydoros", "kuka_iiwa.npz")
    X, y = table(runs_of(z), 100.0, 5.0, 4)
    return Log("KUKA iiwa, runs", load_srs_arm(), X, y, X["trajectory"].to_numpy(int) % 3)


def tx40() -> Log:
    """A Staubli TX40: one recording of 9 s; 12 blocks in three folds."""
    X, y = table(runs_of(recordings("tx40", "staubli_tx40.npz")), 1000.0, 20.0, 10)
    X, fold = blocks(X, 12, 3)
    return Log("TX40, blocks", urdf("tx40", "tx40_min.urdf"), X, y, fold)


def mtm() -> Log:
    """A da Vinci master arm: five runs, held out in three groups; no serial robot describes it."""
    X, y = table(runs_of(recordings("dvrk", "dvrk_mtm.npz")), 200.0, 5.0, 8)
    return Log("dVRK MTM, runs", None, X, y, X["trajectory"].to_numpy(int) % 3)


def fresh(robot: Callable[[], Robot], effect: str | None, seed: int) -> Callable[[], Log]:
    """A simulated log that was made when everything had been settled."""
    return lambda: simulated(robot(), effect, f"simulated, {effect}, seed {seed}", seed)


FRESH: dict[str, Callable[[], Log]] = {
    f"fresh_{seed}": fresh(robot, effect, seed)
    for robot, effect, seed in (
        (load_panda_arm, "stribeck", 11),
        (load_ur10e, "lugre", 12),
        (load_srs_arm, "load_dependent_friction", 13),
        (load_planar_arm, None, 14),
        (load_ur5, "backlash", 15),
        (load_scara, "spring", 16),
    )
}

#: Logs of the table; defaults were settled on the first group. The second had no part in those of
#: the learners, but was in sight when RBDRegressor's choice of rows was settled.
LOGS: dict[str, Callable[[], Log]] = {
    f.__name__: f for f in (ur10e, panda, emps, ur5_dahl, scara_ripple)
}
UNSEEN: dict[str, Callable[[], Log]] = {
    f.__name__: f for f in (lwr4, lwr4_repeated, iiwa, tx40, mtm, panda_unknown, ur10e_elastic)
}
