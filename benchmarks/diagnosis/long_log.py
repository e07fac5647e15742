# SPDX-License-Identifier: BSD-3-Clause
"""Time and peak memory of ``skidyn diagnose`` on a long log: five minutes of 7 joints at 1 kHz.

python benchmarks/diagnosis/long_log.py
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from skidyn.datasets import load_panda, make_hidden_effect_log


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        log = make_hidden_effect_log(
            load_panda(), "stribeck", joints=[2], n_trajectories=10, duration=30.0, rate=1000.0
        )
        log.frame.to_parquet(folder / "log.parquet")
        urdf = Path(sys.modules["skidyn.datasets"].__file__).parent / "robots" / "panda.urdf"
        command = [sys.executable, "-m", "skidyn", "diagnose", str(folder / "log.parquet")]
        command += ["--urdf", str(urdf), "--out", str(folder / "report.json")]
        start = time.perf_counter()
        subprocess.run([*command, "--html", str(folder / "report.html")], check=True)
        seconds = time.perf_counter() - start
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        report = json.loads((folder / "report.json").read_text())
        said = [(e["kind"], e["joints"]) for e in report["effects"]]
        print(f"{len(log.frame)} rows, 7 joints: {said}")
        print(f"wall {seconds:.1f} s, processor {used.ru_utime + used.ru_stime:.1f} s")
        print(f"peak memory {used.ru_maxrss / 1024**2:.2f} GB")


if __name__ == "__main__":
    main()
