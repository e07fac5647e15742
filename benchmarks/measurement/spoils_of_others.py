# SPDX-License-Identifier: BSD-3-Clause
"""Mistakes that others made: shares of other channels, commands, parts of the recordings."""

from __future__ import annotations

import numpy as np
import pandas as pd
from scipy.interpolate import CubicSpline
from scipy.ndimage import gaussian_filter1d
from spoils import Spoil, Spoiled, columns, felt, in_runs, joints_of, moved
from spoils_of_parts import ALSO, rows_of

from skidyn.robots import Robot


def crosstalk(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled | None:
    """A share of one torque in that of another joint, larger than a tenth of its spread."""
    tau = joints_of(log, "tau", robot)
    share = float(rng.uniform(0.1, 0.3) * rng.choice([-1.0, 1.0]))
    size = tau.std(axis=0)
    pairs = np.argwhere(abs(share) * size > 0.1 * size[:, None])
    pairs = [(i, j) for i, j in pairs.tolist() if i != j and abs(share) * size[j] < size[i]]
    if not pairs:
        return None
    i, j = pairs[rng.integers(len(pairs))]
    changed = log.assign(**{f"tau{i + 1}": tau[:, i] + share * tau[:, j]})
    return Spoiled(changed, robot, ("crosstalk",), "", (i + 1, j + 1))


def gravity_of_one(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled | None:
    """Torque of one joint from which gravity was removed with the bodies of the description."""
    pull = robot.gravity_torque(joints_of(log, "q", robot))
    spread = pull.std(axis=0) / joints_of(log, "tau", robot).std(axis=0)
    able = np.flatnonzero(spread > 0.4)
    if not len(able) or robot.n_joints < 2:
        return None
    k = int(rng.choice(able))
    changed = log.assign(**{f"tau{k + 1}": log[f"tau{k + 1}"] - pull[:, k]})
    return Spoiled(changed, robot, ("joint_gravity",), "", (k + 1,))


def commanded(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
    """Commanded positions and velocities: without noise, and ahead of the measured ones."""
    lead, step = float(rng.uniform(0.01, 0.03)), float(np.median(np.diff(log["time"])))
    changed = log.copy()
    for rows in rows_of(log):
        t = log["time"].to_numpy()[rows]
        even = np.arange(t[0], t[-1] + step, step)
        for k in range(robot.n_joints):
            q = np.interp(even, t, log[f"q{k + 1}"].to_numpy()[rows])
            path = CubicSpline(even, gaussian_filter1d(q, 0.03 / step))
            changed.loc[changed.index[rows], f"q{k + 1}"] = path(t + lead)
            changed.loc[changed.index[rows], f"dq{k + 1}"] = path(t + lead, 1)
    follows = ("torque_delay", "smoothed_torque", "velocity_delay")
    return Spoiled(changed, robot, ("commanded_motion",), "", None, follows)


def in_part(quantity: str) -> Spoil:
    """The sign, gain or zero of one joint that changes for a third to half of the recordings."""

    def spoil(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled | None:
        runs = rows_of(log)
        if len(runs) < 4:
            return None
        k = moved(log, robot, rng, turning=quantity == "zero")
        count = int(rng.integers(-(-len(runs) // 3), len(runs) // 2 + 1))
        rows = np.concatenate([runs[i] for i in rng.permutation(len(runs))[:count]])
        changed = log.copy()
        name = f"q{k + 1}" if quantity == "zero" else f"tau{k + 1}"
        values = changed[name].to_numpy(dtype=float).copy()
        if quantity == "sign":
            values[rows] *= -1
        elif quantity == "gain":
            values[rows] *= float(rng.choice([0.1, 0.2, 5.0, 10.0]))
        else:
            values[rows] += float(rng.choice([-1.0, 1.0]) * rng.uniform(0.3, 1.0))
        changed = changed.assign(**{name: values})
        if quantity == "zero" and not felt(
            log, robot, robot.gravity_torque(joints_of(changed, "q", robot))
        ):
            return None
        return Spoiled(changed, robot, ("divided_recordings",), "", (k + 1,), ALSO)

    return spoil


def bursts(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
    """Rows lost in bursts; rows that are left are stamped evenly, as by a counter."""
    kept, stamps = [], []
    for rows in rows_of(log):
        lost = np.zeros(len(rows), dtype=bool)
        for start in rng.integers(20, len(rows) - 60, 4):
            lost[start : start + rng.integers(8, 30)] = True
        kept.append(rows[~lost])
        stamps.append(log["time"].to_numpy()[rows[: int((~lost).sum())]])
    changed = log.iloc[np.concatenate(kept)].reset_index(drop=True)
    told = ("lost_rows", "joined")
    return Spoiled(changed.assign(time=np.concatenate(stamps)), robot, told, "", None, told)


def wrist_exchanged(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled | None:
    """Positions and velocities of the last two joints exchanged; torques are not."""
    n = robot.n_joints
    if n < 4:
        return None
    names = [q for q in ("q", "dq", "ddq") if f"{q}{n}" in log.columns]
    changes = {f"{q}{n - d}": log[f"{q}{n - 1 + d}"] for q in names for d in (0, 1)}
    return Spoiled(log.assign(**changes), robot, ("reading",), "--order")


def slower(way: str) -> Spoil:
    """Torque from a slower bus, held or interpolated, and noise that was added afterwards."""

    def spoil(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
        n = int(rng.choice([4, 6, 8]))
        names = columns("tau", robot.n_joints)

        def change(t: np.ndarray, x: np.ndarray) -> np.ndarray:
            few = np.arange(0, len(x), n)
            if way == "cubic":
                return np.asarray(CubicSpline(t[few], x[few])(t))
            held = x[np.arange(len(x)) // n * n]
            held = held if way == "held" else np.interp(t, t[few], x[few])
            return held + 0.02 * float(np.std(np.diff(x[few]))) * rng.normal(size=len(x))

        changed = in_runs(log, names, change)
        follows = ("smooth_torque", "constant_torque", "smoothed_torque")
        return Spoiled(changed, robot, ("slow_torque",), "", None, follows)

    return spoil


OTHERS: dict[str, Spoil] = {
    "crosstalk": crosstalk,
    "gravity_of_one": gravity_of_one,
    "commanded": commanded,
    "part_sign": in_part("sign"),
    "part_gain": in_part("gain"),
    "part_zero": in_part("zero"),
    "bursts": bursts,
    "wrist_exchanged": wrist_exchanged,
    "slow_cubic": slower("cubic"),
    "slow_held_noise": slower("held"),
    "slow_linear_noise": slower("linear"),
}
