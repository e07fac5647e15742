# SPDX-License-Identifier: BSD-3-Clause
"""Mistakes of channels between sensor and file: coarse stamps, dead bands, dropouts, overflow."""

from __future__ import annotations

import numpy as np
import pandas as pd
from spoils import Spoil, Spoiled, columns, felt, in_runs, joints_of, moved
from spoils_of_parts import ALSO, rows_of

from skidyn.robots import Robot


def rounded_clock(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled | None:
    """Stamps that are rounded down to a part of a step of the samples, or to more than one."""
    steps = np.diff(log["time"])
    step = float(np.median(steps))
    if np.quantile(steps, 0.95) > 1.05 * np.quantile(steps, 0.3):
        return None
    unit = step * float(rng.choice([0.3, 0.7, 0.9, 1.25, 1.6, 2.5]))
    stamps = np.round(np.floor((log["time"] + 1e-4) / unit) * unit, 9)
    return Spoiled(log.assign(time=stamps), robot, ("clock_jitter",), "--clock regular")


def slow_motion(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
    """Positions and velocities that are reported less often than the torque."""
    every = int(rng.choice([2, 3, 4]))
    names = [*columns("q", robot.n_joints), *columns("dq", robot.n_joints)]
    changed = in_runs(log, names, lambda t, x: x[np.arange(len(x)) // every * every])
    return Spoiled(changed, robot, ("repeated_rows",), "--drop-repeated")


def dead_band(width: float, kept: bool) -> Spoil:
    """Torque that is zero below a share of its size; less by it above where it is not kept."""

    def spoil(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
        changes = {}
        for name in columns("tau", robot.n_joints):
            tau = log[name].to_numpy()
            least = width * float(np.quantile(np.abs(tau), 0.95))
            beyond = np.sign(tau) * np.maximum(np.abs(tau) - least, 0.0)
            changes[name] = np.where(np.abs(tau) < least, 0.0, tau) if kept else beyond
        return Spoiled(log.assign(**changes), robot, ("dead_band",), "", None, ALSO)

    return spoil


def tared(whole: bool) -> Spoil:
    """Torque that was set to zero at the start of every recording, or whose mean was taken off."""

    def spoil(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled | None:
        pull = robot.gravity_torque(joints_of(log, "q", robot))
        if not felt(log, robot, np.zeros_like(pull)) or len(rows_of(log)) < 3:
            return None
        names = columns("tau", robot.n_joints)
        changed = in_runs(log, names, lambda t, x: x - (x if whole else x[:5]).mean())
        return Spoiled(changed, robot, ("tared_torque",), "", None, ALSO)

    return spoil


def dropouts(quantity: str, share: float) -> Spoil:
    """Single samples that are zero, as of lost packets."""

    def spoil(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
        changed = log.copy()
        rows = rng.random(len(log)) < share
        changed.loc[rows, columns(quantity, robot.n_joints)] = 0.0
        return Spoiled(changed, robot, ("failed_reads", "missing_torque"))

    return spoil


def failed_reads(value: float, quantities: tuple[str, ...], whole: bool) -> Spoil:
    """A value in the place of failed reads of one joint, or of the whole bus, in up to 5 %."""

    def spoil(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
        joint = moved(log, robot, rng)
        joints = range(robot.n_joints) if whole else [joint]
        names = [f"{quantity}{k + 1}" for quantity in quantities for k in joints]
        most = int(rng.integers(1, 4))
        count = max(int(float(rng.choice([0.005, 0.01, 0.03, 0.05])) * len(log) / most), 5)
        begins = rng.choice(len(log) - most, count, replace=False)
        rows = np.unique((begins[:, None] + np.arange(most)).ravel())
        changed = log.astype(dict.fromkeys(names, float))
        changed.loc[rows, names] = value
        told = [*quantities] if whole else names
        told = ["all"] if whole and len(quantities) == 3 else told
        option = "--placeholder " + ",".join(f"{name}={value:g}" for name in told)
        own = tuple(k + 1 for k in joints)
        return Spoiled(changed, robot, ("failed_reads",), option, own)

    return spoil


def overflow(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
    """Torque of a counter that continues at the other end of its range."""
    name = f"tau{moved(log, robot, rng) + 1}"
    end = float(np.quantile(log[name].abs(), 0.95))
    changed = log.assign(**{name: (log[name] + end) % (2 * end) - end})
    return Spoiled(changed, robot, ("overflowed_torque",), "", (int(name[3:]),))


def accelerations(size: float, option: str) -> Spoil:
    """Logged accelerations, those of one joint with a wrong sign or unit."""

    def spoil(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
        k = moved(log, robot, rng) + 1
        speeds = columns("dq", robot.n_joints)
        slopes = in_runs(log, speeds, lambda t, x: np.gradient(x, t))
        changed = log.assign(**{f"d{name}": slopes[name] for name in speeds})
        changed[f"ddq{k}"] *= size
        told = option.replace("#", f"ddq{k}")
        return Spoiled(changed, robot, ("acceleration",), told, (k,))

    return spoil


CHANNELS: dict[str, Spoil] = {
    "rounded_clock": rounded_clock,
    "slow_motion": slow_motion,
    "dead_band": dead_band(0.15, True),
    "dead_zone": dead_band(0.1, False),
    "tared": tared(False),
    "mean_taken_off": tared(True),
    "position_dropouts": dropouts("q", 0.003),
    "torque_dropouts": dropouts("tau", 0.005),
    "failed_reads_of_the_bus": failed_reads(9999.0, ("q", "dq", "tau"), True),
    "failed_reads_as_minus_one": failed_reads(-1.0, ("q",), True),
    "failed_reads_as_zero": failed_reads(0.0, ("tau",), True),
    "failed_reads_of_a_joint": failed_reads(65535.0, ("q", "dq"), False),
    "failed_reads_of_a_velocity": failed_reads(0.0, ("dq",), False),
    "overflow": overflow,
    "acceleration_sign": accelerations(-1.0, "--flip #"),
    "acceleration_degrees": accelerations(180 / np.pi, "--units #=deg/s^2"),
}
