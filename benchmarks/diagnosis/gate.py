# SPDX-License-Identifier: BSD-3-Clause
"""How often ``skidyn compare --fail-above`` fails on unchanged and on changed robots.

    python benchmarks/diagnosis/gate.py [--runs 50] [--limit 1.5] [--robots planar_arm,ur5]
    python benchmarks/diagnosis/gate.py --as-a-user

Each run is one robot with other link parameters, recorded twice on different motions. Unchanged:
the second recording is of the same robot. Changed: it has an effect of the usual size on one joint.
``--as-a-user`` writes a healthy recording of a UR5 and two of the next night, one with hysteresis
on joint 2, and runs the command line on them: exit code, failures in the JUnit file, seconds.
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from skidyn.datasets import load_planar_arm, load_ur5, make_hidden_effect_log, wilson_interval
from skidyn.identification import RBDRegressor
from skidyn.metrics import drift

ROBOTS = {"planar_arm": load_planar_arm, "ur5": load_ur5}
CHANGES = ("stribeck", "dahl", "spring", "payload", "offset", "backlash")
BASE = ("viscous", "coulomb")
N = 6


def recordings(robot, change: str | None, seed: int):
    """Signals and torques of ``2 N`` trajectories of one robot."""
    log = make_hidden_effect_log(
        robot,
        change,
        n_trajectories=2 * N,
        duration=5.0,
        noise="high" if seed % 2 else "low",
        random_state=seed,
    )
    return log.X, np.asarray(log.y)


def ratios(robot, change: str | None, seed: int) -> np.ndarray:
    """Ratio of errors of every joint: later trajectories against the first of the healthy robot."""
    X0, y0 = recordings(robot, None, seed)
    X1, y1 = recordings(robot, change, seed) if change else (X0, y0)
    usual, new = (X0["trajectory"] <= N).to_numpy(), (X1["trajectory"] > N).to_numpy()
    speed = np.abs(X0[[f"dq{j + 1}" for j in range(robot.n_joints)]].to_numpy())
    least = 0.05 * np.quantile(speed[usual], 0.95, axis=0)
    own = np.abs(X1[[f"dq{j + 1}" for j in range(robot.n_joints)]].to_numpy())
    moving = (own[new] > least, speed[usual] > least)
    model = RBDRegressor(robot, BASE)
    return drift(model, X1[new], y1[new], X0[usual], y0[usual], moving=moving).ratio


def as_a_user(limit: float) -> None:
    """The gate from the command line, on an unchanged and on a drifted robot."""
    from skidyn.datasets import __file__ as datasets

    urdf = Path(datasets).parent / "robots" / "ur5.urdf"
    nights = {"unchanged": {}, "drifted": {"effect": "dahl", "joints": [2]}}
    with tempfile.TemporaryDirectory() as folder:
        healthy, tonight = Path(folder, "healthy.csv"), Path(folder, "tonight.csv")
        for name, effect in nights.items():
            words = {"effect": None} | effect
            log = make_hidden_effect_log(
                load_ur5(), n_trajectories=2 * N, duration=10.0, random_state=3, **words
            )
            late = log.frame["trajectory"] > N
            if not effect:
                log.frame[~late].to_csv(healthy, index=False)
            log.frame[late].to_csv(tonight, index=False)
            junit, start = Path(folder, "gate.xml"), time.perf_counter()
            files = ["--urdf", urdf, "--against", healthy, "--junit", junit]
            words = [sys.executable, "-m", "skidyn", "compare", tonight, *files]
            before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
            done = subprocess.run([*words, "--fail-above", str(limit)], stdout=subprocess.DEVNULL)
            used = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
            failures = ElementTree.parse(junit).getroot().findall(".//testcase[failure]")
            joints = ", ".join(case.get("name") for case in failures) or "none"
            print(
                f"{name:10s} {late.sum()} rows, exit code {done.returncode}, failed: {joints}; "
                f"{time.perf_counter() - start:.0f} s, {used:.1f} s of the processor"
            )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=50)
    parser.add_argument("--limit", type=float, default=1.5)
    parser.add_argument("--robots", default=",".join(ROBOTS))
    parser.add_argument("--as-a-user", action="store_true", help="only: run the command line")
    options = parser.parse_args()
    if options.as_a_user:
        as_a_user(options.limit)
        return
    print(f"limit {options.limit:g}; share of runs that fail, interval of 95 %; largest ratio")
    for name in options.robots.split(","):
        robot, start = ROBOTS[name](), time.perf_counter()
        largest = [ratios(robot, None, seed).max() for seed in range(options.runs)]
        failed = sum(r > options.limit for r in largest)
        low, high = wilson_interval(failed, options.runs)
        seconds = (time.perf_counter() - start) / options.runs
        print(
            f"{name:12s} unchanged   {failed:3d} of {options.runs} ({low:.2f}, {high:.2f})"
            f"  median {np.median(largest):.2f}, largest {max(largest):.2f}; {seconds:.1f} s a run"
        )
        for change in CHANGES:
            n = max(1, options.runs // 5)
            largest = [ratios(robot, change, seed).max() for seed in range(n)]
            failed = sum(r > options.limit for r in largest)
            print(f"{name:12s} {change:12s}{failed:3d} of {n}  median {np.median(largest):.2f}")


if __name__ == "__main__":
    main()
