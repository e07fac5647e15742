# SPDX-License-Identifier: BSD-3-Clause
"""Identification and diagnosis of Parquet tiles: time, processor time and peak memory.

Usage: python benchmarks/scale/out_of_core.py [--rows 1e5 1e6] [--robot planar_arm]
       [--how plain processes dask diagnosis] [--workers 1 2]

``plain``, ``processes`` and ``dask`` identify rigid body, viscous and Coulomb friction;
``diagnosis`` diagnoses a model without Coulomb friction out of core, ``memory`` does the same with
all rows in memory. Ten files of 100,000 rows each are read repeatedly; they are in a temporary
folder that is deleted at the end. Every measurement runs in a separate process. Processor time is
user and system time of this process and its workers, without their start; compare it on a machine
that is shared with others. Peak memory is that of the largest process.
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

import psutil

TILE, TILES = 100_000, 10
#: Dask's profiler is switched off, and the allocator keeps freed memory: by default
#: Dask's workers return every freed array to the operating system and allocate it again.
QUIET = {
    "distributed.worker.profile.enabled": False,
    "distributed.nanny.pre-spawn-environ": {
        "MALLOC_TRIM_THRESHOLD_": f"{2**27}",
        "MALLOC_MMAP_THRESHOLD_": f"{2**27}",
    },
}


def robot():
    from skidyn import datasets

    return getattr(datasets, f"load_{ROBOT}")()


def evidence_of(files):
    from skidyn.evidence import evidence_from_parquet

    return evidence_from_parquet(files, robot())


def answer(how: str, files: list[Path], client=None, workers: int = 1) -> str:
    """Do the work and return a short description of the result."""
    import pandas as pd

    from skidyn.diagnosis import diagnose, diagnose_parquet
    from skidyn.evidence import evidence_from_parquet
    from skidyn.identification import RBDRegressor, regressor_from_evidence

    if how == "diagnosis":
        result = diagnose_parquet(RBDRegressor(robot(), ("viscous",)), files)
        found = [(c.finding.kind, c.finding.joints, c.confirmed) for c in result.confirmations]
        return f"{found}".replace(" ", "")
    if how == "memory":
        frame = pd.concat([pd.read_parquet(f).assign(tile=k) for k, f in enumerate(files)])
        frame["trajectory"] += 1000 * frame.pop("tile")
        tau = frame.filter(regex="^tau").to_numpy()
        diagnosis = diagnose(
            RBDRegressor(robot(), ("viscous",)), frame.drop(columns=frame.filter(regex="^tau")), tau
        )
        return f"{[(f.kind, f.joints) for f in diagnosis.findings]}".replace(" ", "")
    n_jobs = workers if how == "processes" else None
    evidence = evidence_from_parquet(files, robot(), n_jobs=n_jobs, client=client)
    model = regressor_from_evidence(robot(), evidence)
    return f"{model.coef_[-1]:.9f}"


def processor_seconds() -> float:
    """User and system time of this process and its running descendants, s."""
    own = psutil.Process()
    times = [p.cpu_times() for p in [own, *own.children(recursive=True)]]
    return sum(t.user + t.system for t in times)


def peak_mib() -> float:
    own = psutil.Process()
    status = [
        Path(f"/proc/{p.pid}/status").read_text() for p in [own, *own.children(recursive=True)]
    ]
    return max(int(hit[1]) for text in status if (hit := re.search(r"VmHWM:\s+(\d+)", text))) / 1024


def measure(how: str, workers: int, files: list[Path]) -> dict:
    with ExitStack() as stack:
        client = None
        prepare: Callable[[], object] = lambda: evidence_of([files[0]])  # noqa: E731
        if how == "dask":
            import dask
            from distributed import Client, LocalCluster

            dask.config.set(QUIET)
            cluster = LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None)
            client = stack.enter_context(Client(stack.enter_context(cluster)))
        prepare()
        # Every worker has imported and compiled the modules before the clock starts.
        if how == "processes":
            answer(how, files[:1] * workers, workers=workers)
        elif client is not None:
            client.run(evidence_of, [files[0]])
        begin, used = time.perf_counter(), processor_seconds()
        said = answer(how, files, client, workers)
        used, seconds = processor_seconds() - used, time.perf_counter() - begin
        return {"seconds": seconds, "processor": used, "peak": peak_mib(), "answer": said}


def main() -> None:
    global ROBOT
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rows", type=float, nargs="+", default=[1e5, 1e6])
    parser.add_argument("--robot", default="planar_arm")
    parser.add_argument("--how", nargs="+", default=["plain"])
    parser.add_argument("--workers", type=int, nargs="+", default=[1])
    parser.add_argument("--measure", help=argparse.SUPPRESS)
    options = parser.parse_args()
    ROBOT = options.robot
    if options.measure:
        tiles = sorted(Path(options.measure).glob("*.parquet"))
        files = [tiles[k % len(tiles)] for k in range(int(options.rows[0] / TILE))]
        print(json.dumps(measure(options.how[0], options.workers[0], files)))
        return
    from _tiles import write_tile

    with tempfile.TemporaryDirectory() as folder:
        for k in range(TILES):
            write_tile(Path(folder, f"{k}.parquet"), robot(), TILE, seed=k)
        print(f"{ROBOT}: how workers rows wall_s processor_s rows/processor_s peak_MiB answer")
        for how in options.how:
            for workers in options.workers if how in ("processes", "dask") else [1]:
                for rows in options.rows:
                    arguments = ["--measure", folder, "--rows", str(rows), "--robot", ROBOT]
                    arguments += ["--how", how, "--workers", str(workers)]
                    done = subprocess.run(
                        [sys.executable, __file__, *arguments], stdout=subprocess.PIPE, text=True
                    )
                    r = json.loads(done.stdout.splitlines()[-1])
                    print(
                        f"{how} {workers} {rows:.0e} {r['seconds']:.1f} {r['processor']:.1f} "
                        f"{rows / r['processor']:.0f} {r['peak']:.0f} {r['answer']}",
                        flush=True,
                    )


ROBOT = "planar_arm"
if __name__ == "__main__":
    main()
