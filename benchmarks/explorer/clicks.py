# SPDX-License-Identifier: BSD-3-Clause
"""Response time of the explorer to a click, on recordings of a real UR10e.

On every joint each of the best effects is added and removed. Processor time is the time on a free
core; the rest of the wall time is due to other processes.

    SKIDYN_DATA=recordings python benchmarks/explorer/clicks.py [--runs 24]
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
import warnings
from collections import defaultdict
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from skidyn.explorer import Session
from skidyn.explorer._server import Explorer
from skidyn.identification import RBDRegressor
from skidyn.logs import load_recording
from skidyn.robots import Robot

GAINS = (14.87, 13.26, 11.13, 10.62, 11.03, 11.47)
BEST = 5


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=3, help="recordings, of 24")
    options = parser.parse_args()
    folder = Path(os.environ["SKIDYN_DATA"], "ur10e")
    robot = Robot.from_urdf(folder / "ur10e_min.urdf")
    warnings.simplefilter("ignore")
    runs = list(range(24))[-options.runs :]
    log = load_recording(folder / "ur10e_excitation.npz", run=runs, drive_gains=GAINS).frame
    tau = log[[f"tau{j}" for j in range(1, 7)]].to_numpy()
    columns = ["time", "trajectory", *(f"{s}{j}" for s in ("q", "dq") for j in range(1, 7))]
    model = RBDRegressor(robot, ("viscous", "coulomb", "offset", "rotor_inertia"))
    spent: dict[str, list[tuple[float, float]]] = defaultdict(list)
    with threadpool_limits(1), tempfile.TemporaryDirectory() as results:
        explorer = timed(
            spent, "prepare", lambda: Explorer(Session(model, log[columns], tau), results)
        )
        session = explorer.session
        place = {"trajectory": session.trajectories[0]}
        for joint in range(1, 7):
            for effect in session.ranked(joint)[:BEST]:
                here = {"joint": joint, **place}
                ask = {"kind": effect.kind, **here}
                timed(spent, "tick: curves and bars", lambda a=ask: explorer.answer("add", a))
                timed(
                    spent, "then: ranking", lambda j=joint: explorer.answer("ranked", {"joint": j})
                )
                if session.refinable:
                    name = "then: shapes searched"
                    timed(spent, name, lambda a=here: explorer.answer("refine", a))
                timed(spent, "undo", lambda a=here: explorer.answer("undo", a))
    print(f"{len(log)} samples, {len(runs)} recordings, {len(session._pool)} candidates")
    print(f"{'milliseconds':24s}{'median':>8s}{'most':>8s}{'most, wall':>12s}")
    for name, times in spent.items():
        processor, wall = 1e3 * np.array(times).T
        print(f"{name:24s}{np.median(processor):8.0f}{processor.max():8.0f}{wall.max():12.0f}")


def timed(spent, name, work):
    """Result of some work, whose processor and wall time are noted."""
    processor, wall = time.process_time(), time.perf_counter()
    result = work()
    spent[name].append((time.process_time() - processor, time.perf_counter() - wall))
    return result


if __name__ == "__main__":
    main()
