# SPDX-License-Identifier: BSD-3-Clause
"""Rates of detected mistakes in logs and of false suspicions, and results of the remedies.

Usage: python benchmarks/measurement/mistakes.py [--cases FOLDER] [--seed 1] [--logs 5]
       [--sample 5] [--only jitter,order] [--fix] [--diagnose 100] [--store FILE] [--jobs 2]

One mistake is made in each log, half of which have a hidden effect (see ``spoils.py`` and
``spoils_of_*.py``). For every mistake it prints the number of logs in which it was reported on the
right joints with the right remedy, the number of these in which it was certain, and the number of
logs with another suspicion that the log without the mistake does not have, and that remains with
the remedy of the right one. ``--fix`` reads the log again with the remedies and prints in how many
cases this restored the recorded columns. ``--diagnose N`` compares the diagnosis of the corrected
log with that of the clean one in N cases in which it did not, evenly over all of them; where it
did, the diagnoses agree by construction. ``--cases`` takes a folder of logs of another simulator
(``*/log.parquet`` and ``robot.urdf``). ``--store`` appends every result to a file of JSON lines,
from which a count that was interrupted continues.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import warnings
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from corrected import Case, answer, correct, gives_back, read_again, remedies
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
EFFECTS = (None, "stribeck", None, "payload", "torque_ripple", None, "spring", None)
#: Where a mistake is made: its name, and the number of the log.
Place: TypeAlias = tuple[str, int]
Result: TypeAlias = dict[str, Any]
CASES: list[Case] = []
OWN: dict[int, set[tuple[str, tuple[int, ...]]]] = {}


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


def make_mistake(seed: int, place: Place) -> Spoiled | None:
    """The mistake in the log; None where it cannot be made."""
    name, i = place
    try:
        spoiled = MISTAKES[name](CASES[i].frame, CASES[i].robot, np.random.default_rng([seed, i]))
    except NoJointMovesError:
        return None
    return spoiled


def counted(seed: int, fix: bool, place: Place) -> Result | None:
    """What the check reports on a log with a mistake, and the remedies that correct it."""
    (name, i), spoiled = place, make_mistake(seed, place)
    if spoiled is None:
        return None
    checks = check_log(spoiled.frame, spoiled.robot).checks
    right = [c for c in checks if spoiled.is_right(c)]
    told = [c for c in checks if c.certainty != "noted"]
    other = [c for c in told if not spoiled.is_right(c) and not spoiled.follows(c)]
    if other and name != "nothing":
        other = [c for c in other if (c.check, c.joints) not in own_suspicions(i)]
    mended = remedies(right)
    if other and mended:  # what is gone with the remedy followed from the mistake
        again = check_log(*read_again(spoiled.frame, spoiled.robot, mended)).checks
        left = {(c.check, c.joints) for c in again if c.certainty != "noted"}
        other = [c for c in other if (c.check, c.joints) in left]
    result = {
        "named": bool(right),
        "certain": any(c.certainty == "certain" for c in right),
        "other": [c.check for c in other],
        "log": CASES[i].name,
        "expected": spoiled.says,
        "reported": [short(c) for c in checks],
    }
    asked = remedies(told)  # what is only noted is no mistake
    if fix and asked and set(mended) & set(asked):
        done = partial(gives_back, CASES[i])
        result["remedies"], result["exact"] = correct(spoiled.frame, spoiled.robot, asked, done)
    return result


def own_suspicions(i: int) -> set[tuple[str, tuple[int, ...]]]:
    """What the check reports on a log without a mistake."""
    if i not in OWN:
        OWN[i] = {(c.check, c.joints) for c in check_log(CASES[i].frame, CASES[i].robot).checks}
    return OWN[i]


def short(told: Suspicion) -> str:
    """A suspicion in one line."""
    option = told.remedy.option if told.remedy else "-"
    return f"{told.check}/{told.certainty}: {told.suspicion[:70]} | {told.evidence[:90]} | {option}"


def replayed(spoiled: Spoiled, rounds: list[list[str]]) -> tuple[Any, Robot]:
    """A log with a mistake after the remedies."""
    frame, robot = spoiled.frame, spoiled.robot
    for codes in rounds:
        frame, robot = read_again(frame, robot, codes)
    return frame, robot


def diagnosed(seed: int, task: tuple[Place, list[list[str]]]) -> Result:
    """The answer of the diagnosis on a corrected log; on the clean one for ``"nothing"``."""
    place, rounds = task
    if place[0] == "nothing":
        return {"answer": answer(CASES[place[1]].frame, CASES[place[1]].robot)}
    spoiled = make_mistake(seed, place)
    assert spoiled is not None
    return {"answer": answer(*replayed(spoiled, rounds))}


class Store:
    """Results by kind and place, appended to a file as they are found."""

    def __init__(self, path: Path | None, jobs: int) -> None:
        self.path, self.jobs = path, jobs
        self.known: dict[tuple[str, str, int], Result | None] = {}
        if path is not None and path.exists():
            for line in path.read_text().splitlines():
                kind, name, i, result = json.loads(line)
                self.known[kind, name, i] = result

    def find(
        self, kind: str, work: Callable[[Any], Result | None], tasks: dict[Place, Any]
    ) -> Iterator[tuple[Place, Result | None]]:
        """Results in the order of the tasks; those that are known are not computed again."""
        new = {p: task for p, task in tasks.items() if (kind, *p) not in self.known}
        found: Iterable[Result | None] = map(work, new.values())
        if self.jobs > 1 and new:
            pool = multiprocessing.get_context("fork").Pool(self.jobs)
            found = pool.imap(work, new.values())
        results = iter(found)
        for place in tasks:
            if place in new:
                self.known[kind, *place] = next(results)
                if self.path is not None:
                    with self.path.open("a") as file:
                        print(json.dumps([kind, *place, self.known[kind, *place]]), file=file)
            yield place, self.known[kind, *place]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=Path, help="folder of stored logs")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--logs", type=int, default=5, help="logs of each robot")
    parser.add_argument("--first", type=int, help="only so many logs")
    parser.add_argument("--sample", type=int, help="so many logs of each mistake, in turn")
    parser.add_argument("--only", help="mistakes, separated by commas")
    parser.add_argument("--fix", action="store_true", help="read again with the remedies")
    parser.add_argument("--diagnose", type=int, metavar="N", help="compare N diagnoses, slow")
    parser.add_argument("--store", type=Path, help="file of results, to continue from")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument("--verbose", action="store_true", help="print every log that goes wrong")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    cases = stored(options.cases) if options.cases else made(options.seed, options.logs)
    CASES[:] = cases[: options.first]
    names = options.only.split(",") if options.only else list(MISTAKES)
    n, taken = len(CASES), options.sample or len(CASES)
    # a larger sample contains a smaller one, so that a count can be extended
    order = np.random.default_rng(0).permutation(n)
    places = {
        (name, i): (name, i)
        for turn, name in enumerate(names)
        for i in sorted({int(order[(turn + k) % n]) for k in range(taken)})
    }
    store = Store(options.store, options.jobs)
    fix = options.fix or bool(options.diagnose)
    results: dict[Place, Result] = {}
    totals = np.zeros(6, dtype=int)
    print(f"{'mistake':24s} {'named':>9s} {'certain':>9s} {'another':>9s} {'exact':>9s}")
    rows: dict[str, list[Result]] = defaultdict(list)
    last = {name: max(p for p in places if p[0] == name) for name in names}
    for place, result in store.find("check", partial(counted, options.seed, fix), places):
        name = place[0]
        if result is not None:
            results[place] = result
            rows[name].append(result)
            wrong = result["other"] or not result["named"]
            if options.verbose and (result["other"] if name == "nothing" else wrong):
                print("   ", result["log"], result["expected"], *result["reported"], sep=" ; ")
        if place == last[name]:
            counts = summed(rows[name])
            print(row(name, counts), flush=True)
            totals += 0 if name == "nothing" else counts
    print(row("all", totals), flush=True)
    if options.diagnose:
        compare(store, options.seed, results, options.diagnose)


def summed(results: list[Result]) -> np.ndarray:
    """Counts: named, certain, another, exact; of so many, of which so many have a remedy."""
    keys = ("named", "certain", "other", "exact")
    fixable = sum("exact" in r for r in results)
    return np.array([*(sum(bool(r.get(k)) for r in results) for k in keys), len(results), fixable])


def row(name: str, counts: np.ndarray) -> str:
    """A row of the table; what was restored is counted among what was told with a remedy."""
    n, fixable = counts[4:]
    of = (n, n, n, fixable)
    return f"{name:24s}" + "".join(f" {c:4d}/{m:<4d}" for c, m in zip(counts, of, strict=False))


def compare(store: Store, seed: int, results: dict[Place, Result], count: int) -> None:
    """Print in how many corrected logs the diagnosis gives the answer of the clean log."""
    inexact = [p for p, r in results.items() if r.get("exact") is False]
    some = np.unique(np.linspace(0, len(inexact) - 1, min(count, len(inexact))).astype(int))
    picked = [inexact[k] for k in some]
    work = partial(diagnosed, seed)
    clean: dict[Place, Any] = {("nothing", i): (("nothing", i), []) for _, i in picked}
    known = {i: r["answer"] for (_, i), r in store.find("clean", work, clean) if r}
    tasks = {p: (p, results[p]["remedies"]) for p in picked}
    agree: dict[str, list[bool]] = defaultdict(list)
    for (name, i), result in store.find("corrected", work, tasks):
        assert result is not None
        agree[name].append(result["answer"] == known[i])
        if not agree[name][-1]:
            print("   ", name, CASES[i].name, results[name, i]["remedies"], sep=" ; ")
            print("      clean:", known[i], "| corrected:", result["answer"], flush=True)
    for name, same in agree.items():
        print(f"{name:24s} same diagnosis {sum(same):4d}/{len(same):<4d}")
    same = [x for group in agree.values() for x in group]
    print(f"{'all':24s} same diagnosis {sum(same):4d}/{len(same):<4d} of {len(inexact)} inexact")


if __name__ == "__main__":
    main()
