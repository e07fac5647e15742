# SPDX-License-Identifier: BSD-3-Clause
"""Generate the suite, run every peer on the same logs, and print the scores.

    python benchmarks/suite/run.py FOLDER [--seed 2026] [--logs 60] [--errors 16] [--peers NAMES]
                                   [--contents once]
    python benchmarks/suite/run.py --table benchmarks/suite/results.json

A peer is a file of ``benchmarks/peers`` with ``PACKAGE`` and ``answer(log, robot) -> dict``; add
your own. It runs in processes of its own, of one thread each and ``--jobs`` at a time, with
``--seconds`` of the processor a log at most, by ``--python`` of an environment that has its package
(peers need no skidyn, but for its own). FOLDER receives ``cases`` (what a tool may see), ``truth``,
``prepared``, ``answers/PEER``, ``models/PEER`` and ``simulated``; what is there is not made again,
so that an interrupted run goes on. Errors on held-out trajectories and of the motion, which take a
second fit of every peer, are computed for the first ``--errors`` logs. ``--contents`` draws only
such logs (another draw than these logs of the whole suite, for a FOLDER of its own). Answers of a
tool that is no Python: one JSON per case into ``FOLDER/answers/NAME``, then ``--peers NAME``.
``--keep`` writes the scores, and ``--table`` prints what was kept.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import resource
import subprocess
import sys
import time
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.stats import binomtest

from skidyn._writing import write_json
from skidyn.datasets import SuiteCase, hidden_effect_suite, score_answers, wilson_interval

HERE = Path(__file__).parent
PEERS = HERE.parent / "peers"
CONTENTS = ("nothing", "one", "two", "nameless", "once")


#: Cases that one process takes, one after the other.
CHUNK = 6


def in_processes(tasks: Iterable[list], jobs: int) -> None:
    """Run commands, ``jobs`` at a time, each on one thread; a failure is told and ends nothing."""
    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")

    def run(words: list) -> None:
        done = subprocess.run(words, env=os.environ | threads, stdout=subprocess.DEVNULL)
        if done.returncode:
            print(f"failed: {' '.join(map(str, words[1:5]))} ...", file=sys.stderr)

    with ThreadPoolExecutor(jobs) as pool:
        list(pool.map(run, tasks))


def chunks(cases: list[Path]) -> list[list[Path]]:
    """Cases in portions for one process each."""
    return [cases[k : k + CHUNK] for k in range(0, len(cases), CHUNK)]


def make(folder: Path, suite: list[SuiteCase], contents: str, jobs: int) -> list[dict]:
    """Truths of the cases, which are simulated and prepared for peers unless they are there."""
    missing = [
        str(case.entropy[1])
        for case in suite
        if not (folder / "prepared" / f"{case.name}.npz").exists()
        or not (folder / "truth" / f"{case.name}.json").exists()
    ]
    words = [sys.executable, HERE / "_make.py", folder, str(suite[0].entropy[0]), contents]
    in_processes([[*words, *some] for some in chunks(missing)], jobs)
    return [json.loads((folder / "truth" / f"{case.name}.json").read_text()) for case in suite]


def ask(
    folder: Path,
    peers: dict[str, str],
    cases: list[str],
    judged: list[str],
    seconds: float,
    jobs: int,
) -> dict[str, list[dict]]:
    """Answers of every peer, by the Python of each; what the folder lacks of them is made.

    For the cases in ``judged``, with the error on held-out trajectories.
    """
    files = {peer: [folder / "answers" / peer / f"{case}.json" for case in cases] for peer in peers}
    for stage, asked, lacks in (("answers", cases, _unanswered), ("errors", judged, _unjudged)):
        tasks = []
        for peer, python in peers.items():
            source = PEERS / f"{peer}.py"
            missing = [
                folder / "cases" / file.stem
                for file in files[peer]
                if file.stem in asked and lacks(file)
            ]
            if source.exists():  # the others were answered by a tool elsewhere
                words = [python, HERE / "_ask.py", source, stage, str(seconds)]
                tasks += [[*words, *some] for some in chunks(missing)]
        in_processes(tasks, jobs)
    return {
        peer: [json.loads(file.read_text()) for file in own if file.exists()]
        for peer, own in files.items()
    }


def simulate(folder: Path, cases: list[str], jobs: int) -> dict[str, dict]:
    """Errors of the motion of every peer's model that can be run, case by case."""
    if not (folder / "models").exists():
        return {}
    every = {
        case: {f.parent.name for f in (folder / "models").glob(f"*/{case}.*")} for case in cases
    }
    files = {case: folder / "simulated" / f"{case}.json" for case in cases if every[case]}
    old = [
        case
        for case, file in files.items()
        if not file.exists() or set(json.loads(file.read_text())) != every[case]
    ]
    words = [sys.executable, HERE / "_simulated.py", folder]
    in_processes([[*words, *some] for some in chunks(old)], jobs)
    return {case: json.loads(f.read_text()) for case, f in files.items() if f.exists()}


def _unanswered(file: Path) -> bool:
    return not file.exists()


def _unjudged(file: Path) -> bool:
    """Whether an answer that predicts lacks its error on held-out trajectories."""
    return file.exists() and json.loads(file.read_text()).get("error_held_out", 0) is None


def score(peer: str, truths: list[dict], answers: list[dict], motions: dict[str, dict]) -> dict:
    """What is kept of a peer: its score on every case, times, errors, version."""
    judged = score_answers(truths, answers)
    given = {a["case"]: a for a in answers}
    keys = ("case", "content", "tier", "counts", "solved", "false_claims", "clean")
    cases = []
    for c in judged.cases:
        said = given.get(c["case"], {})
        keys_said = ("seconds", "seconds_again", "error_held_out", "fault")
        extra = {k: said[k] for k in keys_said if k in said}
        motion = motions.get(c["case"], {}).get(peer)
        if motion is not None:
            extra["error_motion" if isinstance(motion, float) else "not_simulated"] = motion
        cases.append({k: c[k] for k in (*keys, "parameter_error")} | extra)
    versions = {a["version"] for a in answers if "version" in a}
    return {"version": ", ".join(sorted(versions)), "cases": cases}


@dataclass(frozen=True)
class Figure:
    """A column of the table: of every log a share or a number, None where there is none."""

    title: str
    of: Callable[[dict], float | None]
    share: bool = False
    middle: Callable[[list[float]], float] = np.mean
    digits: int = 2

    def values(self, cases: list[dict]) -> dict[str, float]:
        """By log, where there is a value."""
        every = {c["case"]: self.of(c) for c in cases}
        return {case: value for case, value in every.items() if value is not None}

    def number(self, values: list[float]) -> float:
        """The figure of some logs as it is printed; less is better."""
        number = round(float(self.middle(values)), self.digits)
        return -number if self.share else number


def _solved(*contents: str, tier: str = "", key: str = "solved") -> Callable[[dict], float | None]:
    return lambda c: (
        c[key]
        if c["counts"] and c["content"] in (contents or CONTENTS) and tier in ("", c["tier"])
        else None
    )


def _kept(name: str) -> Callable[[dict], float | None]:
    return lambda c: c.get(name)


def _geometric(values: list[float]) -> float:
    return math.exp(np.mean(np.log(values)))


FIGURES = (
    Figure("solved", _solved(), share=True),
    Figure("named", _solved("one", "two", "once"), share=True),
    Figure("unknown told", _solved("nameless"), share=True),
    Figure("silent", _solved("nothing"), share=True),
    Figure("clean", _solved(key="clean"), share=True),
    Figure("false", _kept("false_claims")),
    Figure("value", _kept("parameter_error"), middle=np.median, digits=3),
    Figure("error", _kept("error_held_out"), middle=_geometric),
    Figure("motion", _kept("error_motion"), middle=_geometric),
    Figure("s", _kept("seconds"), middle=np.median, digits=1),
)
_SECONDS = ("seconds", "seconds_again")
#: Says nothing, ever: it is printed, but nobody is compared with it.
YARDSTICK = "silence"
#: Probability of a difference by chance, from which on two peers are tied.
CHANCE = 0.05


def print_table(peers: dict[str, dict]) -> None:
    """Every peer a line, skidyn's first, and who solves what; nothing is rerun."""
    peers = dict(sorted(peers.items(), key=lambda item: not item[0].startswith("skidyn")))
    common = {key: _judged_by_all(peers, key) for key in ("error_held_out", "error_motion")}
    first = next(iter(peers.values()))["cases"]
    counted = [c for c in first if c["counts"]]
    cases = {
        name: [
            c | {key: None for key, logs in common.items() if c["case"] not in logs}
            for c in peer["cases"]
        ]
        for name, peer in peers.items()
    }
    print(f"{len(first)} logs, {len(counted)} count; shares with Wilson intervals of 95 %")
    print(f"error: on the {len(common['error_held_out'])} logs where all that predict have it")
    print(f"motion: on the {len(common['error_motion'])} logs where all that run have it\n")
    print(f"{'':18s}" + "".join(f"{f.title:>{17 if f.share else 8}s}" for f in FIGURES))
    for name, peer in peers.items():
        told = [_cell(f, list(f.values(cases[name]).values())) for f in FIGURES]
        print(f"{name:18s}" + "".join(told))
        faults = [c for c in peer["cases"] if c.get("fault")]
        if faults:
            print(f"{'':20s}failed on {len(faults)}, first: {faults[0]['fault'][:90]}")
    _print_best((*FIGURES, *_print_groups(cases)), cases)
    versions = sorted({p["version"] for p in peers.values() if p["version"]})
    print("versions: " + ", ".join(versions))
    every = [c.get(k, 0.0) for p in peers.values() for c in p["cases"] for k in _SECONDS]
    print(f"processor time of all answers, with those for the errors: {sum(every):.0f} s")


def _judged_by_all(peers: dict[str, dict], key: str) -> set[str]:
    """Logs on which every peer that has such an error at all has it."""
    judged = [{c["case"] for c in peer["cases"] if c.get(key)} for peer in peers.values()]
    return set.intersection(*(logs for logs in judged if logs)) if any(judged) else set()


def _cell(figure: Figure, values: list[float]) -> str:
    if not values:
        return " " * (17 if figure.share else 8)
    told = f"{figure.middle(values):.{figure.digits}f}"
    if not figure.share:
        return f"{told:>8s}"
    low, high = wilson_interval(sum(values), len(values))
    return f"{f'{told} ({low:.2f} {high:.2f})':>17s}"


def _print_groups(cases: dict[str, list[dict]]) -> list[Figure]:
    """Share solved by what is hidden and by tier; those that the first table does not have."""
    counted = [c for c in next(iter(cases.values())) if c["counts"]]
    groups = [Figure(c, _solved(c), share=True) for c in sorted({c["content"] for c in counted})]
    groups += [
        Figure(f"tier {tier}", _solved(tier=tier), share=True)
        for tier in sorted({c["tier"] for c in counted})
    ]
    print("\nsolved, by what is hidden and by tier (logs that count)")
    print(f"{'':20s}" + "".join(f"{n[:13]:>14s}" for n in cases))
    for group in groups:
        values = [list(group.values(own).values()) for own in cases.values()]
        shares = "".join(f"{np.mean(v):14.2f}" for v in values)
        print(f"{group.title:16s}{len(values[0]):4d}{shares}")
    return [group for group in groups if group.title not in ("nothing", "nameless")]


def _print_best(figures: Iterable[Figure], cases: dict[str, list[dict]]) -> None:
    """In how many cells, of those in which another has a figure, the first peer is best or tied.

    Two peers are compared on the logs on which both have a value. They are tied if the better of
    them is so on no more of these logs than a coin would be (sign test).
    """
    name, *others = cases
    lines, best, tied, met = [], 0, 0, 0
    for figure in figures:
        own = figure.values(cases[name])
        better, lost, known = [], False, False
        for other in others:
            theirs = figure.values(cases[other])
            if other == YARDSTICK or not (both := sorted(own.keys() & theirs.keys())):
                continue
            known = True
            a, b = [own[c] for c in both], [theirs[c] for c in both]
            if figure.number(a) > figure.number(b):
                chance = _chance(np.subtract(a, b))
                lost |= chance < CHANCE
                told = [f"{abs(figure.number(x)):g}" for x in (a, b)]
                better.append(
                    (figure.number(b), f"{told[0]} against {told[1]} of {other}", len(a), chance)
                )
        met += known
        best += known and not better
        tied += bool(better) and not lost
        if better:
            _, told, n, chance = min(better)
            word = "lost" if lost else "tied"
            lines.append(f"  {word}: {figure.title}, {told} on {n} logs (p = {chance:.2g})")
    print(f"\n{name} is best in {best} of {met} cells and tied in {tied}")
    print("\n".join(lines))


def _chance(differences: np.ndarray) -> float:
    """Probability that signs of differences are as uneven by chance."""
    signs = np.sign(differences)
    n = int(np.count_nonzero(signs))
    return float(binomtest(int(np.sum(signs > 0)), n).pvalue) if n else 1.0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, nargs="?")
    parser.add_argument("--seed", type=int, default=2026)
    parser.add_argument("--logs", type=int, default=60)
    parser.add_argument("--contents", default=",".join(CONTENTS), help="all by default")
    parser.add_argument("--errors", type=int, default=16, help="number of logs with errors")
    parser.add_argument("--peers", default="", help="all by default, skidyn's first")
    parser.add_argument("--python", default=sys.executable, help="of the peers but skidyn's")
    parser.add_argument(
        "--seconds", type=float, default=60.0, help="of the processor, limit of a peer on a log"
    )
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="processes at a time")
    parser.add_argument("--keep", type=Path, metavar="JSON", help="add the scores to this file")
    parser.add_argument("--table", type=Path, metavar="JSON", help="print kept scores, run nothing")
    options = parser.parse_args()
    if options.table:
        print_table(json.loads(options.table.read_text())["peers"])
        return
    if options.folder is None:
        parser.error("FOLDER is missing: where the logs and answers go")
    every = sorted((p.stem for p in PEERS.glob("*.py")), key=lambda n: (n[:6] != "skidyn", n))
    peers = options.peers.split(",") if options.peers else every
    contents = options.contents.split(",")
    suite = hidden_effect_suite(options.seed, options.logs, contents=contents)
    start = time.time()
    truths = make(options.folder, suite, options.contents, options.jobs)
    made = _processor()
    pythons = {p: sys.executable if p.startswith("skidyn") else options.python for p in peers}
    names = [case.name for case in suite]
    judged = names[: options.errors]
    answers = ask(options.folder, pythons, names, judged, options.seconds, options.jobs)
    motions = simulate(options.folder, judged, options.jobs)
    scores = {peer: score(peer, truths, said, motions) for peer, said in answers.items()}
    if options.keep:
        old = json.loads(options.keep.read_text())["peers"] if options.keep.exists() else {}
        write_json(options.keep, {"seed": options.seed, "peers": old | scores})
    print(f"seed {options.seed}, ", end="")
    print_table(scores)
    print(
        f"this run: {(time.time() - start) / 60:.0f} min on {options.jobs} cores; "
        f"{_processor():.0f} s of the processor, {made:.0f} of them for the logs"
    )


def _processor() -> float:
    """Processor time of all processes that have ended, s."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


if __name__ == "__main__":
    main()
