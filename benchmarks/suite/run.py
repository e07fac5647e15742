# SPDX-License-Identifier: BSD-3-Clause
"""Make the suite, let every method answer the same logs, print who is right.

    python -m pip install pysindy
    python benchmarks/suite/run.py FOLDER [--seed 2026] [--logs 60] [--methods skidyn,LassoCV]

FOLDER receives ``cases`` (what a tool may see), ``truth``, and ``answers/METHOD``. What is there is
not made again, so that an interrupted run goes on. Your own tool: write one JSON per case into
``FOLDER/answers/NAME`` (see ``skidyn.datasets.score_answers``) and call with ``--methods NAME``.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import os
import time
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

from _methods import METHODS, answer, package
from joblib import Parallel, delayed

from skidyn.datasets import SuiteCase, hidden_effect_suite, score_answers, wilson_interval


def make(folder: Path, case: SuiteCase) -> dict:
    """Truth of the case; simulated unless it is there."""
    file = folder / "truth" / f"{case.name}.json"
    if not file.exists():
        case.write(folder)
    return json.loads(file.read_text())


def ask(folder: Path, method: str, case: str) -> dict:
    """The method's answer with its seconds; taken from the folder if it is there."""
    file = folder / "answers" / method / f"{case}.json"
    if file.exists() or method not in METHODS:
        return json.loads(file.read_text()) if file.exists() else {}
    start = time.perf_counter()
    quiet = io.StringIO()
    with contextlib.redirect_stdout(quiet), contextlib.redirect_stderr(quiet):
        said = answer(method, folder / "cases" / case)
    said = {"seconds": time.perf_counter() - start} | said | {"case": case}
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(json.dumps(said, indent=1))
    return said


def ask_all(folder: Path, methods: list[str], case: str) -> list[dict]:
    """Answers of all methods to one case, which may share what they read."""
    return [ask(folder, method, case) for method in methods]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seed", type=int, default=2026)
    parser.add_argument("--logs", type=int, default=60)
    parser.add_argument("--methods", default=",".join(METHODS))
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    suite = hidden_effect_suite(options.seed, options.logs)
    pool = Parallel(n_jobs=options.jobs)
    truths = pool(delayed(make)(options.folder, case) for case in suite)
    methods = options.methods.split(",")
    print(f"seed {options.seed}, {len(suite)} logs; solved with its Wilson interval of 95 %\n")
    print(f"{'':20s}{'solved':>20s}{'clean':>7s}{'false':>7s}{'silent':>8s}{'error':>7s}{'s':>7s}")
    tables = {}
    said = pool(delayed(ask_all)(options.folder, methods, case.name) for case in suite)
    for k, method in enumerate(methods):
        answers = [row[k] for row in said if row[k]]
        score = score_answers(truths, answers)
        tables[method] = score.table
        row = score.table[-1]
        quiet = [c for c in score.cases if c["content"] == "nothing"]
        kept = sum(c["solved"] for c in quiet) / max(len(quiet), 1)
        error = "" if score.parameter_error is None else f"{100 * score.parameter_error:.1f} %"
        seconds = sorted(a.get("seconds", 0.0) for a in answers)
        print(
            f"{method:20s}{row['solved']:8.2f} ({row['low']:.2f}, {row['high']:.2f})"
            f"{row['clean']:7.2f}{row['false_claims']:7.2f}{kept:8.2f}{error:>7s}"
            f"{seconds[len(seconds) // 2] if seconds else 0:7.1f}"
        )
        faults = [a for a in answers if a.get("error")]
        if faults:
            print(f"{'':20s}failed on {len(faults)} logs, first: {faults[0]['error'][:100]}")
    groups = [row["group"] for row in tables[methods[0]]]
    print(f"\nsolved, by group (logs that count)\n{'':20s}", end="")
    print("".join(f"{m[:18]:>20s}" for m in methods))
    best = 0
    for i, group in enumerate(groups):
        rows = [tables[m][i] for m in methods]
        line = "".join(f"{r['solved']:20.2f}" for r in rows)
        print(f"{group:16s}{rows[0]['n']:4d}{line}")
        best += rows[0]["solved"] >= max(r["solved"] for r in rows)
    print(f"\n{methods[0]} is best or tied in {best} of {len(groups)} rows")
    n_nothing = sum(c.content == "nothing" for c in suite)
    low, high = wilson_interval(n_nothing, n_nothing)
    print(f"silent: share of {n_nothing} logs without an effect (1.00 is {low:.2f} to {high:.2f})")
    print("versions: " + ", ".join(sorted({package(m) for m in methods if m in METHODS})))


if __name__ == "__main__":
    main()
