# SPDX-License-Identifier: BSD-3-Clause
"""Diagnose a folder of logs with hidden effects through the command line, default options.

    python benchmarks/diagnosis/practice.py CASES --answers OUT [--jobs 2]
    python SCORE.py --truth TRUTH.json --answers OUT

Every case is a folder with log.parquet, robot.urdf and meta.json (``base_model``: what the user's
model has). Each case runs in one process, as for a user; answers are written to one JSON file per
case.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path


def merged(effects: list[dict]) -> list[dict]:
    """One entry a kind: the score asks for all joints of an effect at once, a finding has one.

    Parameters of several findings become lists in the order of their joints. Nameless findings are
    one entry where they follow the same variables.
    """
    together: dict[tuple, list[dict]] = {}
    for effect in effects:
        key = (effect["kind"], tuple(effect["variables"]) if effect["kind"] == "unknown" else ())
        together.setdefault(key, []).append(effect)
    result = []
    for (kind, _), group in together.items():
        first = group[0]
        one_each = len(group) > 1 and all(len(e["joints"]) == 1 for e in group)
        parameters = dict(first["parameters"])
        if one_each:
            group = sorted(group, key=lambda e: e["joints"])
            parameters = {
                name: [e["parameters"].get(name) for e in group] for name in first["parameters"]
            }
        force = [parameters.pop(f"force_{axis}", None) for axis in "xyz"]
        if None not in force:
            parameters["force"] = force
        joints = sorted({j for e in group for j in e["joints"]})
        variables = list(dict.fromkeys(v for e in group for v in e["variables"]))
        result.append(
            {"kind": kind, "joints": joints, "variables": variables, "parameters": parameters}
        )
    return result


def answer(case: Path, keep: Path | None = None) -> dict:
    """The report of one case in the form that the score wants."""
    base = json.loads((case / "meta.json").read_text())["base_model"]
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "report.json"
        command = [sys.executable, "-m", "skidyn", "diagnose", str(case / "log.parquet")]
        command += ["--urdf", str(case / "robot.urdf"), "--model", ",".join(base)]
        start = time.perf_counter()
        run = subprocess.run(
            [*command, "--no-cache", "--out", str(out)],
            capture_output=True,
            text=True,
            env=os.environ | {"OMP_NUM_THREADS": "1"},
            check=False,
        )
        if run.returncode != 0:
            print(f"{case.name}: {run.stderr.strip()}", file=sys.stderr)
            return {"case": case.name, "verdict": "complete", "effects": []}
        report = json.loads(out.read_text())
        if keep is not None:
            (keep / f"{case.name}.json").write_text(out.read_text())
    effects = [
        {
            "kind": effect["kind"],
            "joints": effect["joints"],
            "variables": effect["variables"],
            "parameters": {name: p["value"] for name, p in effect["parameters"].items()},
        }
        for effect in report["effects"]
    ]
    effects = merged(effects)
    left = report["unexplained"]
    if left is not None and not effects:
        # What is left, and nothing that was logged predicts, is no finding; but it is told.
        nameless = {"kind": "unknown", "joints": left["joints"], "variables": left["variables"]}
        effects.append(nameless | {"parameters": {}})
    said = ", ".join(f"{e['kind']} {e['joints']}" for e in effects) or report["verdict"]
    print(f"{case.name} {time.perf_counter() - start:5.1f} s  {said}", flush=True)
    kept = ("verdict", "rmse_before", "rmse_after")
    return {"case": case.name, "effects": effects} | {name: report[name] for name in kept}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cases", type=Path)
    parser.add_argument("--answers", type=Path, required=True)
    parser.add_argument("--reports", type=Path, help="folder that keeps the whole reports")
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    for folder in filter(None, (options.answers, options.reports)):
        folder.mkdir(parents=True, exist_ok=True)
    cases = sorted(path for path in options.cases.iterdir() if path.is_dir())

    def work(case: Path) -> None:
        (options.answers / f"{case.name}.json").write_text(
            json.dumps(answer(case, options.reports))
        )

    with ThreadPoolExecutor(options.jobs) as pool:
        list(pool.map(work, cases))


if __name__ == "__main__":
    main()
