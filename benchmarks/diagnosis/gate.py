# SPDX-License-Identifier: BSD-3-Clause
"""How often ``skidyn compare --fail-above`` fails on unchanged and on changed robots.

    python benchmarks/diagnosis/gate.py [--runs 50] [--limit 1.5] [--robots planar_arm,ur5]

Each run is one robot with other link parameters, recorded twice on different motions. Unchanged:
the second recording is of the same robot. Changed: it has an effect of the usual size on one joint.
"""

from __future__ import annotations

import argparse
import time

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


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=50)
    parser.add_argument("--limit", type=float, default=1.5)
    parser.add_argument("--robots", default=",".join(ROBOTS))
    options = parser.parse_args()
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
