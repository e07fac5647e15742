# SPDX-License-Identifier: BSD-3-Clause
"""Mistakes of clocks, of single recordings, of geometry, and of signals before the gears."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
from spoils import Spoil, Spoiled, columns, factor, felt, in_runs, joints_of, moved, shifted
from spoils_of_parts import ALSO, rows_of, signals_of

from skidyn.robots import Robot


def reversed_rows(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
    """Signals that run backwards along a clock that runs forwards."""
    changed, names = log.copy(), signals_of(log)
    for rows in rows_of(log):
        changed.loc[changed.index[rows], names] = log[names].to_numpy()[rows[::-1]]
    return Spoiled(changed, robot, ("velocity",), "", None, ALSO)


def reversed_run(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled | None:
    """One recording that was written from its end to its beginning."""
    runs, names = rows_of(log), signals_of(log)
    if len(runs) < 3:
        return None
    rows, changed = runs[rng.integers(len(runs))], log.copy()
    changed.loc[changed.index[rows], names] = log[names].to_numpy()[rows[::-1]]
    return Spoiled(changed, robot, ("lost_rows",), "", None, ALSO)


def batches(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
    """Stamps of arrival: the rows of a batch follow each other within a tenth of a step."""
    size, time = int(rng.integers(12, 60)), log["time"].to_numpy().copy()
    for rows in rows_of(log):
        own, number = time[rows], np.arange(len(rows))
        step = float(np.median(np.diff(own)))
        last = np.minimum(number // size * size + size - 1, len(rows) - 1)
        time[rows] = own[last] + 0.1 * step * (number % size) / size
    return Spoiled(log.assign(time=time), robot, ("false_gaps",), "--clock regular")


def clock_that_was_set(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled | None:
    """A clock that was set ahead while joints moved, twice in a recording."""
    runs = rows_of(log)
    rows = runs[rng.integers(len(runs))]
    speeds = np.abs(joints_of(log, "dq", robot)[rows])
    moving = np.flatnonzero(np.median(speeds / speeds.max(axis=0), axis=1) > 0.3)
    moving = moving[(moving > 20) & (moving < len(rows) - 20)]
    if len(moving) < 50:
        return None
    time = log["time"].to_numpy().copy()
    for share in (0.3, 0.7):
        time[rows[moving[int(share * len(moving))] :]] += rng.uniform(2, 20)
    time[rows[-1] + 1 :] += 100.0
    return Spoiled(log.assign(time=time), robot, ("false_gaps",), "--clock regular")


def drifting_clock(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
    """Torque of a recorder whose clock is fast, set right at the start of every recording."""
    longest = max(np.ptp(log["time"].to_numpy()[rows]) for rows in rows_of(log))
    share = float(rng.uniform(0.02, 0.06)) / longest  # 20 to 60 ms at its end
    names = columns("tau", robot.n_joints)
    changed = in_runs(log, names, lambda t, x: np.interp(t - share * (t - t[0]), t, x))
    return Spoiled(changed, robot, ("torque_delay",), "", None, ALSO)


def zero_of_a_run(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled | None:
    """A joint that was set to zero elsewhere before one of the recordings."""
    runs = rows_of(log)
    if len(runs) < 4:
        return None
    k = moved(log, robot, rng, turning=True)
    offset = rng.choice([-1.0, 1.0]) * np.deg2rad(rng.uniform(20, 60))
    changed = log.copy()
    changed.loc[changed.index[runs[rng.integers(len(runs))]], f"q{k + 1}"] += offset
    if not felt(log, robot, robot.gravity_torque(joints_of(changed, "q", robot))):
        return None
    return Spoiled(changed, robot, ("odd_recording",), "", (k + 1,), ALSO)


def small_zero(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled | None:
    """A zero of 12 degrees, on a joint whose gravity torque feels it by a tenth of its spread."""
    k = moved(log, robot, rng, turning=True)
    offset = rng.choice([-1.0, 1.0]) * np.deg2rad(12.0)
    changed = log.assign(**{f"q{k + 1}": log[f"q{k + 1}"] + offset})
    pulls = [robot.gravity_torque(joints_of(frame, "q", robot)) for frame in (log, changed)]
    spread = joints_of(log, "tau", robot).std(axis=0)
    if not np.any(np.std(pulls[1] - pulls[0], axis=0) > 0.1 * spread):
        return None
    return Spoiled(changed, robot, ("reading",), f"--zero q{k + 1}=", (k + 1,))


def lengths(least: float, most: float) -> Spoil:
    """A description whose links have other lengths; their masses are right."""

    def spoil(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
        size = 1 + rng.choice([-1, 1], robot.n_bodies) * rng.uniform(least, most, robot.n_bodies)
        tree = replace(robot.tree, translations=robot.tree.translations * size[:, None])
        return Spoiled(log, replace(robot, tree=tree), ("bodies", "lengths"), "", None, ALSO)

    return spoil


def other_axis(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled | None:
    """A description in which a joint turns about another axis of its frame."""
    k = moved(log, robot, rng)
    axes = np.array(robot.tree.axes)
    axes[k] = np.roll(axes[k], int(rng.choice([1, 2]))) * rng.choice([-1.0, 1.0])
    claimed = replace(robot, tree=replace(robot.tree, axes=axes))
    if not felt(log, robot, claimed.gravity_torque(joints_of(log, "q", robot))):
        return None
    return Spoiled(log, claimed, ("axes",), "", (k + 1,))


def before_the_gears(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled | None:
    """Motion and torque of the motors: inertia is smaller by the square of the ratio."""
    if any(kind != "revolute" for kind in robot.joint_types):
        return None
    ratio = float(rng.choice([50.0, 80.0, 100.0, 120.0]))
    motion = [c for c in log.columns if c.rstrip("0123456789") in ("q", "dq", "ddq")]
    changes = {name: log[name] * ratio for name in motion}
    changes |= {name: log[name] / ratio for name in columns("tau", robot.n_joints)}
    told = ("position_unit", "position_scale")
    return Spoiled(log.assign(**changes), robot, told, "", None, ("torque_scale",))


CLOCKS: dict[str, Spoil] = {
    "minutes": factor("time", 1 / 60, "clock_unit", "--units time=min"),
    "reversed_rows": reversed_rows,
    "reversed_run": reversed_run,
    "batches": batches,
    "clock_that_was_set": clock_that_was_set,
    "velocity_very_late": shifted(("dq",), 0.12, 0.25, "velocity_delay", "--late dq="),
    "drifting_clock": drifting_clock,
    "zero_of_a_run": zero_of_a_run,
    "small_zero": small_zero,
    "lengths": lengths(0.1, 0.3),
    "other_axis": other_axis,
    "before_the_gears": before_the_gears,
}
