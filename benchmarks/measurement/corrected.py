# SPDX-License-Identifier: BSD-3-Clause
"""Logs read again with the remedies that the check reports, and diagnoses of them."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from skidyn.logs import check_log, read_log
from skidyn.measurement import Remedy, Suspicion
from skidyn.robots import Robot

#: How often a log is read again, and the least share of its rows that a remedy may leave.
ROUNDS, LEFT = 3, 0.15
#: Largest difference from the recorded columns, relative to their largest value, that is rounding.
ROUNDED = 1e-5


@dataclass
class Case:
    """A log without a mistake."""

    name: str
    frame: pd.DataFrame
    robot: Robot


def remedies(told: Sequence[Suspicion]) -> list[str]:
    """What suspicions ask for, as arguments of ``read_log``."""
    return [s.remedy.code for s in told if s.remedy is not None]


def correct(
    frame: pd.DataFrame, robot: Robot, codes: list[str], done: Callable[[pd.DataFrame, Robot], bool]
) -> tuple[list[list[str]], bool]:
    """Remedies to apply one after the other, and whether it is done with them.

    They are those that the check asks for, and then asks for in the corrected log.
    """
    rounds: list[list[str]] = []
    while codes and len(rounds) < ROUNDS:
        rounds.append(codes)
        frame, robot = read_again(frame, robot, codes)
        if done(frame, robot):
            return rounds, True
        codes = remedies([c for c in check_log(frame, robot).checks if c.certainty != "noted"])
    return rounds, False


def read_again(
    frame: pd.DataFrame, robot: Robot, codes: Sequence[str]
) -> tuple[pd.DataFrame, Robot]:
    """A log and its robot, with remedies."""
    options: dict[str, Any] = {}
    asked = [item for code in codes for item in Remedy("", code).arguments.items()]
    for name, now in asked:
        if name == "gravity":
            robot = robot.with_gravity(now)
        else:
            before = options.get(name)
            if name == "placeholder" and before:  # a quantity may have several
                now = {k: [*_several(before, k), *_several(now, k)] for k in {**before, **now}}
            elif isinstance(now, dict) and before:
                now = {**before, **now}
            elif isinstance(now, list) and before and name == "flip":
                now = before + now
            options[name] = now
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "log.parquet")
        frame.to_parquet(path)
        return read_log(path, robot=robot, check=False, **options), robot


def _several(values: dict[str, Any], name: str) -> list[Any]:
    """The values of a name, none if it has none."""
    own = values.get(name, [])
    return own if isinstance(own, list) else [own]


def gives_back(case: Case, frame: pd.DataFrame, robot: Robot) -> bool:
    """Whether every column is the recorded one in the rows that are left, and gravity the robot's.

    Rows that only repeat others are left out: what they were to hold was never recorded.
    """
    if not np.allclose(robot.gravity, case.robot.gravity):
        return False
    recorded = case.frame
    if len(frame) < len(recorded):
        keys = ["trajectory", "time"]
        places = pd.Series(np.arange(len(recorded)), index=pd.MultiIndex.from_frame(recorded[keys]))
        found = places.reindex(pd.MultiIndex.from_frame(frame[keys]))
        if found.isna().any() or len(frame) < LEFT * len(recorded):
            return False
        recorded = recorded.iloc[found.astype(int)].reset_index(drop=True)
    if len(frame) != len(recorded):
        return False
    names = [c for c in recorded.columns if c.rstrip("0123456789") in ("q", "tau")]
    pairs = [(frame[n], recorded[n]) for n in names]
    # when a recording began does not matter
    pairs.append((elapsed(frame), elapsed(recorded)))
    return all(float((a - b).abs().max()) <= ROUNDED * float(b.abs().max()) for a, b in pairs)


def elapsed(frame: pd.DataFrame) -> pd.Series:
    """Time since the beginning of the recording of every row."""
    return frame["time"] - frame.groupby("trajectory")["time"].transform("min")


def answer(frame: pd.DataFrame, robot: Robot) -> str:
    """The verdict of a diagnosis, and what it names on which joints."""
    from skidyn.diagnosis import diagnose
    from skidyn.exceptions import LogError
    from skidyn.identification import RBDRegressor

    n = robot.n_joints
    tau = frame[[f"tau{k + 1}" for k in range(n)]].to_numpy()
    model = RBDRegressor(robot, ("viscous", "coulomb"))
    try:
        result = diagnose(model, frame, tau, force=True)
    except LogError as error:
        return f"refused: {error}"
    found = sorted(f"{f.kind} {','.join(map(str, f.joints))}".strip() for f in result.findings)
    return "; ".join([result.verdict, *found])
