# SPDX-License-Identifier: BSD-3-Clause
"""Evidence of Parquet tiles: rows per second and peak memory, alone, with processes, with Dask.

Usage: python benchmarks/scale/out_of_core.py [--rows 100000 1000000] [--robot planar_arm]
       [--how plain processes dask] [--workers 1 2]

The tiles (100,000 rows each, ten of them, read again and again) lie in a temporary folder that is
deleted. Every measurement runs in a process of its own, whose peak memory is that of the
operating system, of the process that measures; workers of a pool have their own.
"""

from __future__ import annotations

import argparse
import json
import operator
import resource
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from functools import reduce
from pathlib import Path

TILE, TILES = 100_000, 10


def evidence_of(files):
    from skidyn import datasets
    from skidyn.evidence import evidence_from_parquet

    robot = getattr(datasets, f"load_{ROBOT}")()
    return evidence_from_parquet(files, robot)


def measure(how: str, workers: int, files: list[Path]) -> dict:
    from skidyn import datasets
    from skidyn.evidence import evidence_from_parquet
    from skidyn.rigid_body import regressor_from_evidence

    robot = getattr(datasets, f"load_{ROBOT}")()
    evidence_from_parquet(files[0], robot)  # compiled and imported before the clock starts
    if how == "plain":
        start = time.perf_counter()
        evidence = evidence_from_parquet(files, robot)
    elif how == "processes":
        with ProcessPoolExecutor(workers) as pool:
            list(pool.map(evidence_of, [[files[0]]] * workers))
            start = time.perf_counter()
            evidence = reduce(operator.add, pool.map(evidence_of, [[f] for f in files]))
    else:
        from distributed import Client, LocalCluster

        with (
            LocalCluster(workers, threads_per_worker=1, dashboard_address=None) as cluster,
            Client(cluster) as client,
        ):
            client.run(evidence_of, [files[0]])
            start = time.perf_counter()
            evidence = evidence_from_parquet(files, robot, client=client)
    seconds = time.perf_counter() - start
    begin = time.perf_counter()
    regressor_from_evidence(robot, evidence)
    solved = time.perf_counter() - begin
    own = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return {"seconds": seconds, "solve": solved, "peak_mib": own, "workers": workers}


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
        n = int(options.rows[0] / TILE)
        files = [tiles[k % len(tiles)] for k in range(n)]
        print(json.dumps(measure(options.how[0], options.workers[0], files)))
        return
    from _tiles import write_tile

    from skidyn import datasets

    with tempfile.TemporaryDirectory() as folder:
        for k in range(TILES):
            robot = getattr(datasets, f"load_{ROBOT}")()
            write_tile(Path(folder, f"{k}.parquet"), robot, TILE, seed=k)
        print(f"{ROBOT}: how workers rows seconds rows/s solve_s peak_MiB")
        for how in options.how:
            for workers in options.workers if how != "plain" else [1]:
                for rows in options.rows:
                    arguments = ["--measure", folder, "--rows", str(rows), "--robot", ROBOT]
                    arguments += ["--how", how, "--workers", str(workers)]
                    done = subprocess.run(
                        [sys.executable, __file__, *arguments],
                        capture_output=True, text=True, check=True,
                    )  # fmt: skip
                    r = json.loads(done.stdout.splitlines()[-1])
                    print(
                        f"{how} {workers} {rows:.0e} {r['seconds']:.1f} "
                        f"{rows / r['seconds']:.0f} {r['solve']:.3f} {r['peak_mib']:.0f}",
                        flush=True,
                    )


ROBOT = "planar_arm"
if __name__ == "__main__":
    main()
