# SPDX-License-Identifier: BSD-3-Clause
"""Typical mistakes of users in the columns of single joints."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
from spoils import Spoil, Spoiled, columns, felt, filtered, in_runs, joints_of, moved, one_factor
from spoils_of_parts import ALSO, rows_of

from skidyn.robots import Robot


def late_motion(*quantities: str) -> Spoil:
    """Position, velocity or both of one joint from another clock."""

    def spoil(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
        k, lag = moved(log, robot, rng) + 1, float(rng.uniform(0.015, 0.04))
        names = [f"{quantity}{k}" for quantity in quantities if f"{quantity}{k}" in log.columns]
        changed = in_runs(log, names, lambda t, x: np.interp(t - lag, t, x))
        check, option = ("velocity_delay", f"--late dq{k}=")
        if "q" in quantities:
            check, option = ("torque_delay", "--late ")
        return Spoiled(changed, robot, (check,), option, (k,))

    return spoil


def motion_exchanged(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
    """Positions and velocities of two joints exchanged; torques are not."""
    a, b = (int(k) + 1 for k in rng.choice(robot.n_joints, 2, replace=False))
    changes = {f"{q}{i}": log[f"{q}{j}"] for q in ("q", "dq") for i, j in ((a, b), (b, a))}
    return Spoiled(log.assign(**changes), robot, ("reading",), "--order")


def other_convention(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled | None:
    """A joint that counts the other way round from a quarter of a turn."""
    k = moved(log, robot, rng, turning=True) + 1
    turned = {f"{q}{k}": -log[f"{q}{k}"] for q in ("dq", "ddq", "tau") if f"{q}{k}" in log}
    changed = log.assign(**{f"q{k}": np.pi / 2 - log[f"q{k}"]}, **turned)
    if not felt(log, robot, robot.gravity_torque(joints_of(changed, "q", robot))):
        return None
    return Spoiled(changed, robot, ("reading",), "--", (k,), ("reading",))


def other_size(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
    """The description of a larger or smaller robot of the same kind; masses grow with volume."""
    size = float(rng.choice([0.75, 1.3]))
    powers = np.array([0, 1, 1, 1, 2, 2, 2, 2, 2, 2]) + 3
    parameters = np.asarray(robot.inertial_parameters) * size**powers
    tree = replace(robot.tree, translations=robot.tree.translations * size)
    claimed = replace(robot, tree=tree, inertial_parameters=parameters)
    told = ("lengths", "bodies", "torque_scale")
    return Spoiled(log, claimed, told, "", None, told)


def one_sample_late(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled | None:
    """Torque of the row before."""
    step = float(np.median(np.diff(log["time"])))
    if step < 0.0045:
        return None  # less than is looked for
    changed = in_runs(log, columns("tau", robot.n_joints), lambda t, x: np.r_[x[0], x[:-1]])
    return Spoiled(changed, robot, ("torque_delay",), "--late tau=0.0")


def saturated(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
    """Drives that reach their current limit."""
    names = columns("tau", robot.n_joints)
    limits = log[names].abs().quantile(0.95)
    return Spoiled(
        log.assign(**{n: log[n].clip(-limits[n], limits[n]) for n in names}),
        robot,
        ("clipped_torque",),
    )


def stuck(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled | None:
    """An encoder that reports its first value in one recording."""
    runs = rows_of(log)
    if len(runs) < 4:
        return None
    k, rows = moved(log, robot, rng) + 1, runs[rng.integers(len(runs))]
    changed = log.copy()
    changed.loc[changed.index[rows], f"q{k}"] = float(log[f"q{k}"].iloc[rows[0]])
    return Spoiled(changed, robot, ("velocity", "odd_recording"), "", (k,), ALSO)


def one_filtered(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
    """Torque of one joint through a low pass of 3 Hz."""
    whole = filtered("tau", 3.0, "torque_delay")(log, robot, rng).frame
    k = moved(log, robot, rng) + 1
    return Spoiled(log.assign(**{f"tau{k}": whole[f"tau{k}"]}), robot, ("torque_delay",), "", (k,))


def wrist_units(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled | None:
    """The last joints in N mm, the first ones in N m."""
    if robot.n_joints < 4:
        return None
    some = [f"tau{k + 1}" for k in range(robot.n_joints - 2, robot.n_joints)]
    return Spoiled(
        log.assign(**{n: 1e3 * log[n] for n in some}),
        robot,
        ("torque_scale",),
        "--gain",
        (robot.n_joints - 1, robot.n_joints),
        ("torque_scale",),
    )


def one_motor_angle(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
    """Position and velocity of one joint before its gear."""
    k = moved(log, robot, rng, turning=True) + 1
    changed = log.assign(**{f"{q}{k}": 100.0 * log[f"{q}{k}"] for q in ("q", "dq")})
    return Spoiled(changed, robot, ("position_unit", "position_scale"), "", (k,))


JOINTS: dict[str, Spoil] = {
    "one_motion_late": late_motion("q", "dq"),
    "one_velocity_late": late_motion("dq"),
    "motion_exchanged": motion_exchanged,
    "other_convention": other_convention,
    "other_size": other_size,
    "one_sample_late": one_sample_late,
    "saturated": saturated,
    "stuck_encoder": stuck,
    "one_filtered": one_filtered,
    "wrist_units": wrist_units,
    "one_motor_angle": one_motor_angle,
    "one_gain_2": one_factor("tau", 2.0, "torque_scale", "--gain #="),
    "one_gain_third": one_factor("tau", 1 / 3, "torque_scale", "--gain #="),
    "one_motor_velocity": one_factor("dq", 100.0, "velocity", "--gain #="),
}
