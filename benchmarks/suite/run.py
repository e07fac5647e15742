# SPDX-License-Identifier: BSD-3-Clause
"""Make the suite, let every peer answer the same logs, print who is right.

    python benchmarks/suite/run.py FOLDER [--seed 2026] [--logs 60] [--peers skidyn_diagnose,lasso]
    python benchmarks/suite/run.py --table benchmarks/suite/results.json

A peer is a file of ``benchmarks/peers`` with ``PACKAGE`` and ``answer(log, robot) -> dict``; add
your own. It runs in a process of its own, ``--seconds`` a log at most, by ``--python`` of an
environment that has its package (peers need no skidyn, but for its own). FOLDER receives ``cases``
(what a tool may see), ``truth``, ``prepared`` and ``answers/PEER``; what is there is not made
again, so that an interrupted run goes on. Answers of a tool that is no Python: one JSON per case
into ``FOLDER/answers/NAME``, then ``--peers NAME``. ``--keep`` writes the scores, and ``--table``
prints what was kept.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np

from skidyn._writing import write_json
from skidyn.datasets import SuiteCase, hidden_effect_suite, score_answers, wilson_interval

HERE = Path(__file__).parent
PEERS = HERE.parent / "peers"


def make(folder: Path, case: SuiteCase) -> dict:
    """Truth of the case; simulated and prepared for peers unless it is there."""
    from _prepare import prepare

    file = folder / "truth" / f"{case.name}.json"
    if not file.exists():
        case.write(folder)
    prepare(folder / "cases" / case.name)
    return json.loads(file.read_text())


def ask(folder: Path, peer: str, cases: list[str], python: str, seconds: float) -> list[dict]:
    """The peer's answers; what the folder lacks of them is made in a process of its own."""
    files = {case: folder / "answers" / peer / f"{case}.json" for case in cases}
    missing = [folder / "cases" / case for case, file in files.items() if not _whole(file)]
    source = PEERS / f"{peer}.py"
    if missing and source.exists():
        threads = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        words = [python, HERE / "_ask.py", source, str(seconds), *missing]
        if subprocess.run(words, env=os.environ | threads, stdout=subprocess.DEVNULL).returncode:
            print(f"{peer} did not answer every case", file=sys.stderr)
    return [json.loads(file.read_text()) for file in files.values() if file.exists()]


def _whole(file: Path) -> bool:
    """Whether nothing is missing of an answer, its error on held-out trajectories included."""
    return file.exists() and json.loads(file.read_text()).get("error_held_out", 0) is not None


def score(truths: list[dict], answers: list[dict]) -> dict:
    """What is kept of a peer: its score on every case, times, errors, version."""
    judged = score_answers(truths, answers)
    given = {a["case"]: a for a in answers}
    keys = ("case", "content", "tier", "counts", "solved", "false_claims", "clean")
    cases = []
    for c in judged.cases:
        said = given.get(c["case"], {})
        extra = {k: said[k] for k in ("seconds", "error_held_out", "fault") if k in said}
        cases.append({k: c[k] for k in (*keys, "parameter_error")} | extra)
    versions = {a["version"] for a in answers if "version" in a}
    return {"version": ", ".join(sorted(versions)), "cases": cases}


def print_table(peers: dict[str, dict]) -> None:
    """Every peer a line, skidyn's first, and who solves what; nothing is rerun."""
    peers = dict(sorted(peers.items(), key=lambda item: not item[0].startswith("skidyn")))
    first = next(iter(peers.values()))["cases"]
    print(f"{len(first)} logs; solved with its Wilson interval of 95 %\n")
    heads = ("solved", "clean", "false", "silent", "value", "error", "s")
    print(f"{'':20s}" + "".join(f"{h:>{20 if h == 'solved' else 8}s}" for h in heads))
    for name, peer in peers.items():
        cases = peer["cases"]
        counted = [c for c in cases if c["counts"]]
        solved = sum(c["solved"] for c in counted)
        low, high = wilson_interval(solved, len(counted))
        quiet = [c["solved"] for c in cases if c["content"] == "nothing"]
        values = [c["parameter_error"] for c in cases if c["parameter_error"] is not None]
        errors = [c["error_held_out"] for c in cases if c.get("error_held_out")]
        seconds = [c["seconds"] for c in cases if "seconds" in c]
        cells = [
            _mean([c["clean"] for c in counted]),
            _mean([c["false_claims"] for c in cases]),
            _mean(quiet),
            f"{np.median(values):.3f}" if values else "",
            f"{math.exp(np.mean(np.log(errors))):.2f}" if errors else "",
            f"{np.median(seconds):.1f}" if seconds else "",
        ]
        share = f"{solved / len(counted):.2f} ({low:.2f}, {high:.2f})"
        print(f"{name:20s}{share:>20s}" + "".join(f"{c:>8s}" for c in cells))
        faults = [c for c in cases if c.get("fault")]
        if faults:
            print(f"{'':22s}failed on {len(faults)}, first: {faults[0]['fault'][:90]}")
    _print_groups(peers)
    versions = sorted({p["version"] for p in peers.values() if p["version"]})
    print("versions: " + ", ".join(versions))


def _print_groups(peers: dict[str, dict]) -> None:
    names = list(peers)
    groups: dict[str, list[int]] = {}
    for k, case in enumerate(peers[names[0]]["cases"]):
        if case["counts"]:
            for group in (case["content"], f"tier {case['tier']}", "all"):
                groups.setdefault(group, []).append(k)
    print("\nsolved, by what is hidden and by tier (logs that count)")
    print(f"{'':16s}" + "".join(f"{n[:14]:>16s}" for n in ("", *names))[12:])
    best = 0
    for group in sorted(groups, key=lambda g: (g == "all", g)):
        rows = groups[group]
        shares = [np.mean([peers[n]["cases"][k]["solved"] for k in rows]) for n in names]
        print(f"{group:16s}{len(rows):4d}" + "".join(f"{s:16.2f}" for s in shares))
        best += shares[0] >= max(shares)
    print(f"\n{names[0]} is best or tied in {best} of {len(groups)} rows")


def _mean(values: list[float]) -> str:
    return f"{np.mean(values):.2f}" if values else ""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, nargs="?")
    parser.add_argument("--seed", type=int, default=2026)
    parser.add_argument("--logs", type=int, default=60)
    parser.add_argument("--peers", default="", help="all by default, skidyn's first")
    parser.add_argument("--python", default=sys.executable, help="of the peers but skidyn's")
    parser.add_argument(
        "--seconds", type=float, default=180.0, help="of the processor, limit of a peer on a log"
    )
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
    suite = hidden_effect_suite(options.seed, options.logs)
    truths = [make(options.folder, case) for case in suite]
    answers = {}
    for peer in peers:
        python = sys.executable if peer.startswith("skidyn") else options.python
        words = options.folder, peer, [case.name for case in suite], python, options.seconds
        answers[peer] = ask(*words)
    scores = {peer: score(truths, said) for peer, said in answers.items()}
    if options.keep:
        old = json.loads(options.keep.read_text())["peers"] if options.keep.exists() else {}
        write_json(options.keep, {"seed": options.seed, "peers": old | scores})
    print(f"seed {options.seed}, ", end="")
    print_table(scores)


if __name__ == "__main__":
    main()
