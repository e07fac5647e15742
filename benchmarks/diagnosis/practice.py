# SPDX-License-Identifier: BSD-3-Clause
"""Diagnose a folder of logs with hidden effects through the command line, default options.

    python benchmarks/diagnosis/practice.py CASES --answers OUT [--jobs 2]
    python SCORE.py --truth TRUTH.json --answers OUT

Every case is a folder with log.parquet, robot.urdf and meta.json (``base_model``: what the user's
model has). One process per case, as a user would run it; answers are written one JSON a case.
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


def answer(case: Path) -> dict:
    """The report of one case in the form that the score wants."""
    base = json.loads((case / "meta.json").read_text())["base_model"]
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "report.json"
        command = [sys.executable, "-m", "skidyn", "diagnose", str(case / "log.parquet")]
        command += ["--urdf", str(case / "robot.urdf"), "--model", ",".join(base)]
        start = time.perf_counter()
        run = subprocess.run(
            [*command, "--out", str(out)],
            capture_output=True,
            text=True,
            env=os.environ | {"OMP_NUM_THREADS": "1"},
            check=False,
        )
        if run.returncode != 0:
            print(f"{case.name}: {run.stderr.strip()}", file=sys.stderr)
            return {"case": case.name, "verdict": "complete", "effects": []}
        report = json.loads(out.read_text())
    effects = [
        {
            "kind": effect["kind"],
            "joints": effect["joints"],
            "variables": effect["variables"],
            "parameters": {name: p["value"] for name, p in effect["parameters"].items()},
        }
        for effect in report["effects"]
    ]
    said = ", ".join(f"{e['kind']} {e['joints']}" for e in effects) or "complete"
    print(f"{case.name} {time.perf_counter() - start:5.1f} s  {said}", flush=True)
    kept = ("verdict", "rmse_before", "rmse_after")
    return {"case": case.name, "effects": effects} | {name: report[name] for name in kept}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cases", type=Path)
    parser.add_argument("--answers", type=Path, required=True)
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    options.answers.mkdir(parents=True, exist_ok=True)
    cases = sorted(path for path in options.cases.iterdir() if path.is_dir())
    with ThreadPoolExecutor(options.jobs) as pool:
        for result in pool.map(answer, cases):
            (options.answers / f"{result['case']}.json").write_text(json.dumps(result))


if __name__ == "__main__":
    main()
