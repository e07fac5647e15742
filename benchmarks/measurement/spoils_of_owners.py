# SPDX-License-Identifier: BSD-3-Clause
"""Mistakes of exports and descriptions, made between the logger and the check."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
from scipy.ndimage import uniform_filter1d
from scipy.spatial.transform import Rotation
from spoils import Spoil, Spoiled, columns, felt, in_runs, joints_of, moved, shifted
from spoils_of_parts import ALSO, rows_of

from skidyn.robots import Robot


def not_enabled(place: str) -> Spoil:
    """Torque that is zero while the drives are not enabled, in every recording."""

    def spoil(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
        changed, share = log.copy(), float(rng.uniform(0.06, 0.12))
        names = columns("tau", robot.n_joints)
        for rows in rows_of(log):
            count = int(share * len(rows))
            some = rows[:count] if place == "start" else rows[-count:]
            changed.loc[changed.index[some], names] = 0.0
        return Spoiled(changed, robot, ("constant_torque",), "", None, ALSO)

    return spoil


def weightless(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled | None:
    """A description without gravity, as of a simulator in which it was switched off."""
    claimed = replace(robot, gravity=np.zeros(3))
    pull = robot.gravity_torque(joints_of(log, "q", robot))
    if not felt(log, robot, np.zeros_like(pull)):
        return None
    return Spoiled(log, claimed, ("reading",), "--gravity")


def other_velocity(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
    """Velocity of a joint that is that of another."""
    k = moved(log, robot, rng)
    other = (k + 1) % robot.n_joints
    changed = log.assign(**{f"dq{k + 1}": log[f"dq{other + 1}"]})
    return Spoiled(changed, robot, ("velocity",), "", (k + 1,))


def in_rows(log: pd.DataFrame, rows: np.ndarray, values: dict[str, np.ndarray]) -> pd.DataFrame:
    """Columns changed in some rows."""
    changed = log.copy()
    for name, column in values.items():
        changed[name] = changed[name].astype(float)
        changed.loc[changed.index[rows], name] = column
    return changed


def one_recording(change: str, checks: tuple[str, ...]) -> Spoil:
    """A recording by another program than the others."""

    def spoil(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled | None:
        runs = rows_of(log)
        if len(runs) < 4:
            return None
        rows = runs[rng.integers(len(runs))]
        own = log.iloc[rows]
        n, values = robot.n_joints, {}
        if change == "late":
            lag = float(rng.uniform(0.02, 0.05))
            t = own["time"].to_numpy()
            values = {c: np.interp(t - lag, t, own[c]) for c in columns("tau", n)}
        elif change == "torque_order":
            some = np.flatnonzero(able(log, robot))
            if len(some) < 2:
                return None
            a, b = (int(x) for x in rng.choice(some, 2, replace=False))
            values = {f"tau{i + 1}": own[f"tau{j + 1}"].to_numpy() for i, j in ((a, b), (b, a))}
        elif change == "velocity_sign":
            k = moved(log, robot, rng) + 1
            values = {f"dq{k}": -own[f"dq{k}"].to_numpy()}
        elif change == "velocity_degrees":
            if any(kind != "revolute" for kind in robot.joint_types):
                return None
            values = {c: np.rad2deg(own[c].to_numpy()) for c in columns("dq", n)}
        elif change == "degrees":
            if any(kind != "revolute" for kind in robot.joint_types):
                return None
            names = [c for x in ("q", "dq", "ddq") for c in columns(x, n) if c in log.columns]
            values = {c: np.rad2deg(own[c].to_numpy()) for c in names}
        elif change == "milliseconds":
            clock = own["time"].to_numpy()
            last = float(log["time"].max())
            values = {"time": last + 1.0 + 1e3 * (clock - clock[0])}
        elif change == "motion_sign":
            k = moved(log, robot, rng, turning=True) + 1
            flipped = log.assign(**{f"q{k}": -log[f"q{k}"]})
            if not felt(log, robot, robot.gravity_torque(joints_of(flipped, "q", robot))):
                return None
            names = [c for c in (f"q{k}", f"dq{k}", f"ddq{k}") if c in log.columns]
            values = {c: -own[c].to_numpy() for c in names}
        changed = in_rows(log, rows, values)
        if change == "milliseconds":  # that recording last, so that the clock runs on
            order = np.r_[np.setdiff1d(np.arange(len(log)), rows), rows]
            changed = changed.iloc[order].reset_index(drop=True)
        return Spoiled(changed, robot, checks, "", None, ALSO)

    return spoil


def able(log: pd.DataFrame, robot: Robot) -> np.ndarray:
    """Joints that move."""
    return np.array([np.ptp(log[f"q{k + 1}"]) > 0.05 for k in range(robot.n_joints)])


def row_numbers(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled | None:
    """Ticks of the recorder in the place of seconds."""
    steps = np.diff(log["time"])
    step = float(np.median(steps))
    if np.quantile(steps, 0.95) > 1.05 * np.quantile(steps, 0.3):
        return None
    changed = log.assign(time=np.round(log["time"] / step))
    told = "--units time=ms" if abs(step - 1e-3) < 1e-6 else f"--gain time={step:.6g}"
    return Spoiled(changed, robot, ("clock_unit",), told)


def shifted_torques(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled | None:
    """Torque columns that begin one joint too late: those of the base come last."""
    n = robot.n_joints
    if n < 3:
        return None
    changes = {f"tau{k + 1}": log[f"tau{(k + 1) % n + 1}"] for k in range(n)}
    words = ",".join(str((k - 1) % n + 1) for k in range(n))
    return Spoiled(log.assign(**changes), robot, ("reading",), f"--order tau={words}")


def two_zeros(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled | None:
    """Two positions whose zeros are elsewhere."""
    turning = np.array([kind == "revolute" for kind in robot.joint_types]) & able(log, robot)
    if turning.sum() < 2:
        return None
    some = sorted(int(x) for x in rng.choice(np.flatnonzero(turning), 2, replace=False))
    changed = log.copy()
    for k in some:
        offset = rng.choice([-1.0, 1.0]) * np.deg2rad(rng.uniform(40, 140))
        changed = changed.assign(**{f"q{k + 1}": changed[f"q{k + 1}"] + offset})
        alone = log.assign(**{f"q{k + 1}": changed[f"q{k + 1}"]})
        if not felt(log, robot, robot.gravity_torque(joints_of(alone, "q", robot))):
            return None
    told = tuple(k + 1 for k in some)
    return Spoiled(changed, robot, ("reading",), "--zero", told, ("reading",))


def absolute_angles(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled | None:
    """The angle of a link against the base in the place of that against the link before."""
    tree = robot.tree
    turning = [kind == "revolute" for kind in robot.joint_types]
    along = {
        k: float(tree.axes[k - 1] @ tree.rotations[k] @ tree.axes[k])
        for k in range(1, robot.n_joints)
        if turning[k - 1] and turning[k]
    }
    able_joints = [k for k, cosine in along.items() if abs(cosine) > 0.999]
    if not able_joints:
        return None
    k = int(rng.choice(able_joints))
    quantities = [q for q in ("q", "dq", "ddq") if f"{q}{k + 1}" in log.columns]
    changes = {
        f"{q}{k + 1}": log[f"{q}{k + 1}"] + np.round(along[k]) * log[f"{q}{k}"] for q in quantities
    }
    changed = log.assign(**changes)
    if not felt(log, robot, robot.gravity_torque(joints_of(changed, "q", robot))):
        return None
    return Spoiled(changed, robot, ("reading",), f"--summed q{k + 1}=", (k + 1,))


def smoothed(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
    """Torque through a mean over a fifth of a second, without delay."""
    step = float(np.median(np.diff(log["time"])))
    width = max(3, int(0.2 / step) | 1)
    names = columns("tau", robot.n_joints)
    changed = in_runs(log, names, lambda t, x: uniform_filter1d(x, width, mode="nearest"))
    return Spoiled(changed, robot, ("smoothed_torque",), "", None, ("torque_delay",))


def slow_torque(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
    """Torque from a slower recorder, interpolated to the clock of the positions."""
    n = int(rng.choice([4, 6, 8]))
    names = columns("tau", robot.n_joints)
    changed = in_runs(log, names, lambda t, x: np.interp(t, t[::n], x[::n]))
    # after the last of the slower samples the torque does not change any more
    follows = ("smooth_torque", "constant_torque")
    return Spoiled(changed, robot, ("interpolated_rows",), "", None, follows)


def slider_millimetres(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled | None:
    """A sliding joint in millimetres."""
    sliding = [k + 1 for k, kind in enumerate(robot.joint_types) if kind != "revolute"]
    if not sliding:
        return None
    k = sliding[0]
    names = [c for c in (f"q{k}", f"dq{k}", f"ddq{k}") if c in log.columns]
    changed = log.assign(**{c: 1e3 * log[c] for c in names})
    return Spoiled(changed, robot, ("position_unit",), f"--gain q{k}=", (k,))


def position_millimetres(
    log: pd.DataFrame, robot: Robot, rng: np.random.Generator
) -> Spoiled | None:
    """A sliding joint whose position alone is in millimetres."""
    sliding = [k + 1 for k, kind in enumerate(robot.joint_types) if kind != "revolute"]
    if not sliding:
        return None
    changed = log.assign(**{f"q{sliding[0]}": 1e3 * log[f"q{sliding[0]}"]})
    told = ("position_unit", "velocity")
    return Spoiled(changed, robot, told, f"--gain q{sliding[0]}=", (sliding[0],), told)


def differential(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled | None:
    """Torques of the two motors of a differential wrist in the place of those of its joints."""
    n = robot.n_joints
    if n < 4:
        return None
    a, b = f"tau{n - 1}", f"tau{n}"
    changed = log.assign(**{a: (log[a] + log[b]) / 2, b: (log[a] - log[b]) / 2})
    if robot.joint_types[n - 2] == robot.joint_types[n - 1] == "revolute":
        return Spoiled(changed, robot, ("differential",), "--combine", (n - 1, n), ALSO)
    told = ("unexplained", "reading", "torque_scale", "crosstalk")
    return Spoiled(changed, robot, told, "", None, ALSO)


def turned_tool(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled | None:
    """A tool that is mounted a quarter of a turn further than its description says."""
    parameters = np.asarray(robot.inertial_parameters, dtype=float).copy().reshape(-1, 10)
    m, (mx, my, mz) = parameters[-1, 0], parameters[-1, 1:4]
    xx, xy, xz, yy, yz, zz = parameters[-1, 4:]
    turn = Rotation.from_rotvec([0, 0, np.pi / 2]).as_matrix()
    tensor = turn @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ turn.T
    moment = turn @ np.array([mx, my, mz])
    entries = tensor[[0, 0, 0, 1, 1, 2], [0, 1, 2, 1, 2, 2]]
    parameters[-1] = np.r_[m, moment, entries]
    claimed = replace(robot, inertial_parameters=parameters)
    if not felt(log, robot, claimed.gravity_torque(joints_of(log, "q", robot))):
        return None
    return Spoiled(log, claimed, ("reading", "bodies"), "", None, ("reading", "bodies"))


def wrong_rate(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled | None:
    """A rate that is wrong in the clock and, derived with it, in the velocities.

    Without gravity all torques are at another scale alike, which bodies may be, too.
    """
    if not felt(log, robot, np.zeros_like(joints_of(log, "q", robot))):
        return None
    factor = float(rng.choice([0.5, 2.0, 4.0]))
    changes = {"time": log["time"] * factor}
    changes |= {c: log[c] / factor for c in columns("dq", robot.n_joints)}
    changes |= {c: log[c] / factor**2 for c in log.columns if c.startswith("ddq")}
    return Spoiled(log.assign(**changes), robot, ("torque_scale",), "--gain time=")


OWNERS: dict[str, Spoil] = {
    "enabled_late": not_enabled("start"),
    "disabled_early": not_enabled("end"),
    "weightless": weightless,
    "other_velocity": other_velocity,
    "run_late": one_recording("late", ("torque_delay", "odd_recording")),
    "run_torque_order": one_recording("torque_order", ("odd_recording",)),
    "run_velocity_sign": one_recording("velocity_sign", ("odd_motion",)),
    "run_velocity_degrees": one_recording("velocity_degrees", ("odd_motion",)),
    "run_degrees": one_recording("degrees", ("position_unit", "odd_recording")),
    "run_milliseconds": one_recording("milliseconds", ("odd_motion",)),
    "run_motion_sign": one_recording("motion_sign", ("odd_recording",)),
    "position_late": shifted(("q",), 0.015, 0.04, "velocity_delay", "--late q="),
    "row_numbers": row_numbers,
    "shifted_torques": shifted_torques,
    "two_zeros": two_zeros,
    "absolute_angles": absolute_angles,
    "smoothed_torque": smoothed,
    "slow_torque": slow_torque,
    "slider_millimetres": slider_millimetres,
    "position_millimetres": position_millimetres,
    "differential": differential,
    "turned_tool": turned_tool,
    "wrong_rate": wrong_rate,
}
