# SPDX-License-Identifier: BSD-3-Clause
"""How many mistakes in logs are named, and how many are named that are none.

Usage: python benchmarks/measurement/mistakes.py [--seed 1] [--logs 5] [--only jitter,order]

Logs of four robots, half of them with a hidden effect, are spoiled in one way each. Printed are, by
mistake, how many were named on the right joints, how many of these are certain, and in how many
logs something else was suspected.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd

from skidyn.datasets import (
    load_panda,
    load_planar_arm,
    load_scara,
    load_ur5,
    make_hidden_effect_log,
)
from skidyn.logs import check_log
from skidyn.robots import Robot

ROBOTS = (load_panda, load_ur5, load_scara, load_planar_arm)
EFFECTS = (None, "stribeck", None, "payload", "torque_ripple", None, "spring", None)
Spoiled = tuple[pd.DataFrame, str, str]
Spoil = Callable[[pd.DataFrame, Robot, np.random.Generator], Spoiled]


def columns(quantity: str, n: int) -> list[str]:
    return [f"{quantity}{k + 1}" for k in range(n)]


def signs(*quantities: str) -> Spoil:
    def spoil(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
        k = int(rng.integers(robot.n_joints)) + 1
        names = [f"{quantity}{k}" for quantity in quantities]
        told = [f"{name}" for name in names if not (name.startswith("dq") and len(names) > 1)]
        check = "velocity" if quantities == ("dq",) else "reading"
        return log.assign(**{name: -log[name] for name in names}), check, f"--flip {','.join(told)}"

    return spoil


def exchanged(*quantities: str) -> Spoil:
    def spoil(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
        order = np.arange(robot.n_joints)
        a, b = rng.choice(robot.n_joints, 2, replace=False)
        order[[a, b]] = order[[b, a]]
        changes = {
            f"{q}{j + 1}": log[f"{q}{k + 1}"] for q in quantities for j, k in enumerate(order)
        }
        words = ",".join(str(k + 1) for k in order)
        option = words if len(quantities) > 1 else f"tau={words}"
        return log.assign(**changes), "reading", f"--order {option}"

    return spoil


def gravity(*direction: float) -> Spoil:
    """Torque of the stated bodies under another gravity in place of the robot's own."""

    def spoil(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
        q = log[columns("q", robot.n_joints)].to_numpy()
        change = robot.gravity_torque(q, gravity=direction) - robot.gravity_torque(q)
        names = columns("tau", robot.n_joints)
        return (
            log.assign(**dict(zip(names, (log[names] + change).to_numpy().T, strict=True))),
            ("reading"),
            "--gravity",
        )

    return spoil


def factor(quantity: str, size: float, check: str, option: str) -> Spoil:
    def spoil(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
        names = [n for n in log.columns if n.rstrip("0123456789") == quantity]
        return log.assign(**{name: size * log[name] for name in names}), check, option

    return spoil


def currents(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
    gains = rng.uniform(5, 60, robot.n_joints)
    names = columns("tau", robot.n_joints)
    return (
        log.assign(**{n: log[n] / g for n, g in zip(names, gains, strict=True)}),
        ("torque_scale"),
        "--gain",
    )


def unsigned(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
    names = columns("tau", robot.n_joints)
    return log.assign(**{n: log[n].abs() for n in names}), "unsigned_torque", "--torque-sign"


def zero(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
    k = int(rng.integers(robot.n_joints)) + 1
    return log.assign(**{f"q{k}": log[f"q{k}"] + np.pi / 2}), "reading", f"--zero q{k}="


def late(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
    spoiled, lag = log.copy(), float(rng.uniform(0.008, 0.03))
    for _, run in log.groupby("trajectory"):
        for name in columns("tau", robot.n_joints):
            spoiled.loc[run.index, name] = np.interp(run["time"] - lag, run["time"], run[name])
    return spoiled, "torque_delay", "--late tau="


def jitter(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
    size = rng.choice([1e-4, 3e-4, 1e-3])
    return (
        log.assign(time=log["time"] + rng.uniform(-size, size, len(log))),
        ("clock_jitter"),
        "--clock regular",
    )


def short_floats(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
    stamps = np.float32(log["time"] + 2000.0).astype(float)
    return log.assign(time=stamps), "clock_jitter", "--clock regular"


def repeated(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
    rows = np.arange(len(log))
    again = (rng.random(len(log)) < 0.25) & (log["trajectory"].diff() == 0).to_numpy()
    stale = log.iloc[rows - again].reset_index(drop=True)
    return stale.assign(time=log["time"]), "repeated_rows", "--drop-repeated"


def nothing(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
    return log, "", ""


MISTAKES: dict[str, Spoil] = {
    "nothing": nothing,
    "torque_sign": signs("tau"),
    "motion_sign": signs("q", "dq"),
    "velocity_sign": signs("dq"),
    "order": exchanged("q", "dq", "tau"),
    "torque_order": exchanged("tau"),
    "wall": gravity(0.0, -9.81, 0.0),
    "ceiling": gravity(0.0, 0.0, 9.81),
    "compensated": gravity(0.0, 0.0, 0.0),
    "zero": zero,
    "unsigned": unsigned,
    "currents": currents,
    "newton_millimetres": factor("tau", 1e3, "torque_scale", "--units tau=Nmm"),
    "milliseconds": factor("time", 1e3, "clock_unit", "--units time=ms"),
    "degrees": factor("q", 180 / np.pi, "position_unit", "--units q=deg"),
    "degrees_per_second": factor("dq", 180 / np.pi, "velocity", "--units dq=deg/s"),
    "late": late,
    "jitter": jitter,
    "float32_clock": short_floats,
    "repeated_rows": repeated,
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--logs", type=int, default=5, help="logs of each robot")
    parser.add_argument("--only", help="mistakes, separated by commas")
    parser.add_argument("--verbose", action="store_true", help="print every log that goes wrong")
    options = parser.parse_args()
    logs = [
        make_hidden_effect_log(
            load(),
            EFFECTS[(k + i) % len(EFFECTS)],
            n_trajectories=5,
            duration=6.0,
            random_state=options.seed + 100 * k + i,
        )
        for k, load in enumerate(ROBOTS)
        for i in range(options.logs)
    ]
    totals = np.zeros(3, dtype=int)
    print(f"{'mistake':20s} {'named':>9s} {'certain':>9s} {'another':>9s}")
    for name in options.only.split(",") if options.only else MISTAKES:
        counts = np.zeros(3, dtype=int)
        for i, log in enumerate(logs):
            rng = np.random.default_rng(options.seed + i)
            spoiled, check, option = MISTAKES[name](log.frame, log.robot, rng)
            told = [c for c in check_log(spoiled, log.robot).checks if c.certainty != "noted"]
            right = [c for c in told if is_right(c, check, option)]
            other = [c for c in told if c not in right]
            certain = any(c.certainty == "certain" for c in right)
            counts += [bool(right), certain, bool(other)]
            if options.verbose and (other or (check and not right)):
                print("   ", log.robot.name, option, [str(c)[:90] for c in told])
        print(f"{name:20s}" + "".join(f" {c:4d}/{len(logs):<4d}" for c in counts), flush=True)
        totals += counts
    print(f"{'all':20s}" + "".join(f" {c:9d}" for c in totals))


def is_right(told: Any, check: str, option: str) -> bool:
    """Whether the right check has the right remedy."""
    remedy = told.remedy.option if told.remedy else ""
    return bool(check) and told.check == check and remedy.startswith(option)


if __name__ == "__main__":
    main()
