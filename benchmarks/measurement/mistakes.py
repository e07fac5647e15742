# SPDX-License-Identifier: BSD-3-Clause
"""Rates of detected mistakes in logs and of false suspicions, and results of the remedies.

Usage: python benchmarks/measurement/mistakes.py [--cases FOLDER] [--seed 1] [--logs 5]
       [--sample 5] [--only jitter,order] [--fix] [--verbose]

One mistake is made in each log, half of which have a hidden effect (see ``spoils.py`` and
``spoils_of_*.py``). For every mistake it prints the number of logs in which it was reported on the
right joints with the right remedy, the number of these in which it was certain, and the number of
logs with another suspicion that the log without the mistake does not have, and that remains with
the remedy of the right one. ``--fix`` reads the log again with the remedy and prints in how many
cases this restored the recorded columns; ``--diagnose`` compares the diagnosis of the fixed log
with that of the clean one where it did not. ``--cases`` takes a folder of logs of another simulator
(``*/log.parquet`` and ``robot.urdf``).
"""

from __future__ import annotations

import argparse
import ast
import tempfile
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import pandas as pd
from spoils import SPOILS, NoJointMovesError, Spoiled
from spoils_of_channels import CHANNELS
from spoils_of_clocks import CLOCKS
from spoils_of_joints import JOINTS
from spoils_of_others import OTHERS
from spoils_of_owners import OWNERS
from spoils_of_parts import PARTS

from skidyn.datasets import (
    load_panda,
    load_planar_arm,
    load_scara,
    load_ur5,
    make_hidden_effect_log,
)
from skidyn.logs import check_log, read_log
from skidyn.measurement import Suspicion
from skidyn.robots import Robot

ROBOTS = (load_panda, load_ur5, load_scara, load_planar_arm)
MISTAKES = SPOILS | PARTS | CLOCKS | JOINTS | OWNERS | CHANNELS | OTHERS
Answer: TypeAlias = tuple[str, frozenset[tuple[str, tuple[int, ...]]]]
#: How often a log is read again, and the least share of its rows that a remedy may leave.
ROUNDS, LEFT = 3, 0.15
EFFECTS = (None, "stribeck", None, "payload", "torque_ripple", None, "spring", None)


@dataclass
class Case:
    """A log without a mistake."""

    name: str
    frame: pd.DataFrame
    robot: Robot


def made(seed: int, each: int) -> list[Case]:
    """Logs of the package's own simulator."""
    cases = []
    for k, load in enumerate(ROBOTS):
        for i in range(each):
            effect = EFFECTS[(k + i) % len(EFFECTS)]
            state = seed + 100 * k + i
            log = make_hidden_effect_log(
                load(), effect, n_trajectories=5, duration=6.0, random_state=state
            )
            cases.append(Case(f"{log.robot.name} {effect}", log.frame, log.robot))
    return cases


def stored(folder: Path) -> list[Case]:
    """Logs of another simulator."""
    cases = []
    for path in sorted(folder.glob("*/log.parquet")):
        robot = Robot.from_urdf(path.parent / "robot.urdf")
        frame = read_log(path, robot=robot, check=False)
        moved = [c for c in frame if c.startswith("q") and np.ptp(frame[c]) > 0]
        if not moved:  # a simulation that diverged
            continue
        cases.append(Case(f"{path.parent.name} {robot.name}", frame, robot))
    return cases


def fixed(spoiled: Spoiled, told: list[Suspicion]) -> tuple[pd.DataFrame, Robot]:
    """The spoiled log, read again as it is told, and once more where the check asks for more."""
    frame, robot = spoiled.frame, spoiled.robot
    for _ in range(ROUNDS):
        frame, robot = read_again(frame, robot, told)
        checks = check_log(frame, robot).checks
        told = [c for c in checks if c.remedy and c.certainty != "noted"]
        if not told:
            break
    return frame, robot


def read_again(
    frame: pd.DataFrame, robot: Robot, told: list[Suspicion]
) -> tuple[pd.DataFrame, Robot]:
    """A log and its robot, with the remedies that are told."""
    options: dict[str, Any] = {}
    for suspicion in told:
        if suspicion.remedy is None:
            continue
        name, _, value = suspicion.remedy.code.partition("=")
        if name == "Robot.from_urdf(..., gravity":
            gravity = ast.literal_eval(value.rstrip(")") + ")")
            robot = robot_with(robot, gravity)
        else:
            now = ast.literal_eval(value)
            before = options.get(name)
            if isinstance(now, dict) and before:
                now = {**before, **now}
            elif isinstance(now, list) and before and name == "flip":
                now = before + now
            options[name] = now
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "log.parquet")
        frame.to_parquet(path)
        return read_log(path, robot=robot, check=False, **options), robot


def robot_with(robot: Robot, gravity: tuple[float, float, float]) -> Robot:
    from dataclasses import replace

    return replace(robot, gravity=np.asarray(gravity, dtype=float))


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
    names = [c for c in recorded.columns if c.rstrip("0123456789") in ("time", "q", "tau")]
    return len(frame) == len(recorded) and all(
        float(np.abs(frame[n] - recorded[n]).max()) <= 1e-5 * float(np.abs(recorded[n]).max())
        for n in names
    )


def answer(frame: pd.DataFrame, robot: Robot) -> Answer:
    """The verdict of a diagnosis, and what it names on which joints."""
    from skidyn.diagnosis import diagnose
    from skidyn.identification import RBDRegressor

    n = robot.n_joints
    tau = frame[[f"tau{k + 1}" for k in range(n)]].to_numpy()
    model = RBDRegressor(robot, ("viscous", "coulomb"))
    result = diagnose(model, frame, tau, force=True)
    return result.verdict, frozenset((f.kind, tuple(f.joints)) for f in result.findings)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=Path, help="folder of stored logs")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--logs", type=int, default=5, help="logs of each robot")
    parser.add_argument("--first", type=int, help="only so many logs")
    parser.add_argument("--sample", type=int, help="so many logs of each mistake, in turn")
    parser.add_argument("--only", help="mistakes, separated by commas")
    parser.add_argument("--fix", action="store_true", help="read again with the remedies")
    parser.add_argument("--diagnose", action="store_true", help="compare diagnoses, slow")
    parser.add_argument("--verbose", action="store_true", help="print every log that goes wrong")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    cases = stored(options.cases) if options.cases else made(options.seed, options.logs)
    cases = cases[: options.first]
    known: dict[str, Any] = {}
    own: dict[int, set[tuple[str, tuple[int, ...]]]] = {}
    totals = np.zeros(6, dtype=int)
    print(f"{'mistake':24s} {'named':>9s} {'certain':>9s} {'another':>9s} {'fixed':>9s}")
    for turn, name in enumerate(options.only.split(",") if options.only else MISTAKES):
        counts, n, fixable = np.zeros(4, dtype=int), 0, 0
        taken = options.sample or len(cases)
        for i in sorted({(turn * taken + k) % len(cases) for k in range(taken)}):
            case = cases[i]
            rng = np.random.default_rng([options.seed, i])
            try:
                spoiled = MISTAKES[name](case.frame, case.robot, rng)
            except NoJointMovesError:
                continue
            if spoiled is None:  # a robot that cannot make this mistake
                continue
            n += 1
            checks = check_log(spoiled.frame, spoiled.robot).checks
            right = [c for c in checks if spoiled.is_right(c)]
            told = [c for c in checks if c.certainty != "noted"]
            other = [c for c in told if not spoiled.is_right(c) and not spoiled.follows(c)]
            if other and name != "nothing":
                if i not in own:
                    own[i] = {(c.check, c.joints) for c in check_log(case.frame, case.robot).checks}
                other = [c for c in other if (c.check, c.joints) not in own[i]]
            mended = [c for c in right if c.remedy]
            if other and mended:  # what is gone with the remedy followed from the mistake
                again = check_log(*read_again(spoiled.frame, spoiled.robot, mended)).checks
                left = {(c.check, c.joints) for c in again if c.certainty != "noted"}
                other = [c for c in other if (c.check, c.joints) in left]
            certain = any(c.certainty == "certain" for c in right)
            counts[:3] += [bool(right), certain, bool(other)]
            good = None
            if (options.fix or options.diagnose) and any(c.remedy for c in right):
                fixable += 1
                asked = [c for c in checks if c.remedy and (c in right or c in told)]
                good = fix(case, spoiled, asked, known, options.diagnose)
                counts[3] += good
            if options.verbose and (other or (spoiled.checks and not right) or good is False):
                print("   ", case.name, spoiled.says, good, *map(short, checks), sep=" ; ")
        print(row(name, counts, n, fixable), flush=True)
        if name != "nothing":
            totals += [*counts, n, fixable]
    print(row("all", totals[:4], totals[4], totals[5]))


def row(name: str, counts: np.ndarray, n: int, fixable: int) -> str:
    """A row of the table; what was fixed is counted among what was told with a remedy."""
    of = (n, n, n, fixable)
    return f"{name:24s}" + "".join(f" {c:4d}/{m:<4d}" for c, m in zip(counts, of, strict=True))


def short(told: Suspicion) -> str:
    """A suspicion in one line."""
    option = told.remedy.option if told.remedy else "-"
    return f"{told.check}/{told.certainty}: {told.suspicion[:70]} | {told.evidence[:90]} | {option}"


def fix(
    case: Case, spoiled: Spoiled, told: list[Suspicion], known: dict[str, Any], diagnosed: bool
) -> bool:
    """Whether the remedies give back the recorded columns, or at least the diagnosis of them."""
    frame, robot = fixed(spoiled, told)
    if gives_back(case, frame, robot) or not diagnosed:
        return gives_back(case, frame, robot)
    if case.name not in known:
        known[case.name] = answer(case.frame, case.robot)
    return answer(frame, robot) == known[case.name]


if __name__ == "__main__":
    main()
