# SPDX-License-Identifier: BSD-3-Clause
"""Mistakes of single rows, joints and recordings, and of channels with wrong names."""

from __future__ import annotations

import numpy as np
import pandas as pd
from scipy.spatial.transform import Rotation
from spoils import (
    Spoil,
    Spoiled,
    columns,
    factor,
    felt,
    filtered,
    in_runs,
    joints_of,
    moved,
)

from skidyn.robots import Robot

#: What rows that were shuffled or lost, or odd recordings, make true beside their own name.
ALSO = ("unexplained", "reading", "clock_jitter", "joined", "bodies")


def rows_of(log: pd.DataFrame) -> list[np.ndarray]:
    number = log["trajectory"].to_numpy()
    return [np.flatnonzero(number == run) for run in np.unique(number)]


def signals_of(log: pd.DataFrame) -> list[str]:
    return [c for c in log.columns if c not in ("time", "trajectory")]


def one_late(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
    """Torque of one joint from another clock."""
    name, lag = f"tau{moved(log, robot, rng) + 1}", float(rng.uniform(0.015, 0.04))
    changed = in_runs(log, [name], lambda t, x: np.interp(t - lag, t, x))
    return Spoiled(changed, robot, ("torque_delay",), f"--late {name}=0", (int(name[3:]),))


def shuffled(near: float) -> Spoil:
    """Rows in another order within a recording, but with the clock of the recording."""

    def spoil(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
        changed, names = log.copy(), signals_of(log)
        values = log[names].to_numpy()
        for rows in rows_of(log):
            order = np.argsort(np.arange(len(rows)) + rng.uniform(0, near, len(rows)))
            changed.loc[changed.index[rows], names] = values[rows[order]]
        return Spoiled(changed, robot, ("lost_rows",), "", None, ALSO)

    return spoil


def lost(share: float) -> Spoil:
    """Rows that were lost and stamps that do not say so."""

    def spoil(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
        kept = log[rng.random(len(log)) > share].reset_index(drop=True)
        step = float(np.median(np.diff(log["time"])))
        steps = np.where(np.diff(kept["trajectory"]) != 0, 1.0, step)
        time = np.r_[0.0, np.cumsum(steps)]
        return Spoiled(kept.assign(time=time), robot, ("lost_rows",), "", None, ALSO)

    return spoil


def one_run(names: str, size: float) -> Spoil:
    """Torque of one recording, of all joints or of one, times a factor."""

    def spoil(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled | None:
        runs = rows_of(log)
        if len(runs) < 4:
            return None
        rows = log.index[runs[rng.integers(len(runs))]]
        which = columns("tau", robot.n_joints)
        which = which if names == "all" else [which[moved(log, robot, rng)]]
        changed = log.copy()
        changed.loc[rows, which] *= size
        return Spoiled(changed, robot, ("odd_recording",), "", None, ALSO)

    return spoil


def other_torque(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled | None:
    """Torque of one recording that is that of another."""
    runs = rows_of(log)
    if len(runs) < 4:
        return None
    here, there = (runs[k] for k in rng.choice(len(runs), 2, replace=False))
    names = columns("tau", robot.n_joints)
    changed = log.copy()
    taken = there[np.minimum(np.arange(len(here)), len(there) - 1)]
    changed.loc[changed.index[here], names] = log[names].to_numpy()[taken]
    return Spoiled(changed, robot, ("odd_recording",), "", None, ALSO)


def copied(source: str) -> Spoil:
    """Torque of a joint that is the torque of another, or another channel of the joint."""

    def spoil(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
        k, other = (int(x) + 1 for x in rng.choice(robot.n_joints, 2, replace=False))
        values = log[f"tau{other}"] if source == "tau" else log[f"{source}{k}"]
        joints = tuple(sorted((k, other))) if source == "tau" else (k,)
        return Spoiled(
            *(log.assign(**{f"tau{k}": values}), robot, ("copied_torque",), "", joints), ALSO
        )

    return spoil


def constant(quantity: str) -> Spoil:
    """Position or velocity of a joint that never changes."""

    def spoil(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
        k = moved(log, robot, rng) + 1
        name = f"{quantity}{k}"
        changed = log.assign(**{name: float(log[name].iloc[0])})
        return Spoiled(changed, robot, ("velocity",), "", (k,), (*ALSO, "coarse_position"))

    return spoil


def half_precision(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
    names = [c for c in signals_of(log) if c.rstrip("0123456789") in ("q", "dq", "tau")]
    short = {name: log[name].astype(np.float16).astype(float) for name in names}
    return Spoiled(log.assign(**short), robot, ("coarse_position",))


def one_both_degrees(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
    k = moved(log, robot, rng, turning=True) + 1
    changed = log.assign(**{name: np.rad2deg(log[name]) for name in (f"q{k}", f"dq{k}")})
    return Spoiled(changed, robot, ("position_unit",), f"--units q{k}=deg,dq{k}=deg/s", (k,))


def duplicated(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
    """A recording that is in the log twice."""
    runs = rows_of(log)
    again = log.iloc[runs[rng.integers(len(runs))]]
    again = again.assign(
        trajectory=log["trajectory"].max() + 1,
        time=again["time"] - again["time"].min() + log["time"].max() + 1,
    )
    changed = pd.concat([log, again], ignore_index=True)
    return Spoiled(changed, robot, ("repeated_recordings",))


def two_signs(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled | None:
    if robot.n_joints < 3:
        return None
    a, b = sorted(int(k) + 1 for k in rng.choice(robot.n_joints, 2, replace=False))
    changed = log.assign(**{f"tau{k}": -log[f"tau{k}"] for k in (a, b)})
    return Spoiled(changed, robot, ("reading",), f"--flip tau{a},tau{b}", (a, b))


def sign_and_wall(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled | None:
    """Two mistakes at once: a sign and the direction of gravity."""
    from dataclasses import replace

    k = moved(log, robot, rng) + 1
    turned = Rotation.from_rotvec([np.pi / 2, 0, 0]).apply(np.array(robot.gravity))
    claimed = replace(robot, gravity=turned)
    if not felt(log, robot, claimed.gravity_torque(joints_of(log, "q", robot))):
        return None
    changed = log.assign(**{f"tau{k}": -log[f"tau{k}"]})
    return Spoiled(changed, claimed, ("reading",), "--flip tau", (k,), ("reading",))


PARTS: dict[str, Spoil] = {
    "one_late": one_late,
    "shuffled": shuffled(1e9),
    "shuffled_near": shuffled(6.0),
    "lost_rows": lost(0.05),
    "run_flipped": one_run("all", -1.0),
    "run_joint_flipped": one_run("one", -1.0),
    "run_gain": one_run("all", 0.1),
    "run_newton_millimetres": one_run("all", 1e3),
    "other_torque": other_torque,
    "copied_torque": copied("tau"),
    "torque_is_velocity": copied("dq"),
    "torque_is_position": copied("q"),
    "constant_velocity": constant("dq"),
    "constant_position": constant("q"),
    "half_precision": half_precision,
    "one_both_degrees": one_both_degrees,
    "duplicated": duplicated,
    "two_signs": two_signs,
    "sign_and_wall": sign_and_wall,
    "microseconds": factor("time", 1e6, "clock_unit", "--units time=us"),
    "velocity_filtered": filtered("dq", 4.0, "velocity_delay"),
}
