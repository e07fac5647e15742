# SPDX-License-Identifier: BSD-3-Clause
"""Processor time of the columns of every effect on its grid, against another version.

Usage: python benchmarks/diagnosis/columns.py [--rows 100000] [--old CHECKOUT]

``--old`` is the root of another version (made by ``git worktree add``). Both are run alternately;
the last column is the difference of their columns, relative to the largest entry.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parents[2]
KINDS = (
    "joint_elasticity", "backlash", "dahl", "lugre", "maxwell_slip", "time_delay", "stribeck",
    "load_dependent_friction", "position_dependent_friction", "coupled_inertia", "base_tilt",
)  # fmt: skip


def run(n_rows: int, folder: Path) -> None:
    """Columns of this process' version, their times printed as JSON."""
    from skidyn._signals import Signals
    from skidyn.datasets import load_panda
    from skidyn.effects import get_effect

    robot, rng = load_panda(), np.random.default_rng(0)
    n = robot.n_joints
    clock = np.arange(n_rows // 20) / 250.0
    q, dq, ddq = (np.zeros((20, len(clock), n)) for _ in range(3))
    for _ in range(5):
        w, p, a = rng.uniform((0.5, 0, 0.1), (6.0, 6.28, 0.5), (20, n, 3)).transpose(2, 0, 1)
        angle = w[:, None] * clock[:, None] + p[:, None]
        q += a[:, None] * np.sin(angle)
        dq += (a * w)[:, None] * np.cos(angle)
        ddq -= (a * w**2)[:, None] * np.sin(angle)
    q, dq, ddq = (x.reshape(-1, n) for x in (q, dq, ddq))
    load = robot.inverse_dynamics(q, dq, ddq)
    torque = load + 2.0 * dq
    trajectory = np.repeat(np.arange(20), len(clock))
    signals = Signals(
        q=q, dq=dq, ddq=ddq, trajectory=trajectory, time=np.tile(clock, 20), robot=robot,
        load=load, model_torque=torque, smooth_torque=torque,
        inertial_parameters=robot.inertial_parameters,
    )  # fmt: skip
    seconds = {}
    for kind in KINDS:
        effect, kept = get_effect(kind), []
        start = time.process_time()
        for joints in effect.sites(signals):
            for shape in effect.grid(signals, joints):
                for block in effect.torque_columns(signals, joints, **shape).values():
                    kept.append(block[:: max(1, n_rows // 500)])
        seconds[kind] = time.process_time() - start
        np.save(folder / f"{kind}.npy", np.concatenate(kept, axis=1) if kept else np.zeros((1, 1)))
    print(json.dumps(seconds))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rows", type=int, default=100_000)
    parser.add_argument("--old", type=Path, default=None, help="root of another version")
    parser.add_argument("--into", type=Path, default=None, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.into:
        run(options.rows, options.into)
        return
    roots = {"now": HERE} | ({"old": options.old.resolve()} if options.old else {})
    seconds, folders = {}, {}
    with tempfile.TemporaryDirectory() as name:
        for version, root in roots.items():
            folders[version] = Path(name, version)
            folders[version].mkdir()
            command = [sys.executable, str(Path(__file__).resolve()), "--rows", str(options.rows)]
            done = subprocess.run(
                [*command, "--into", str(folders[version])],
                env=os.environ | {"PYTHONPATH": str(root), "OMP_NUM_THREADS": "1"},
                check=True, capture_output=True, text=True,
            )  # fmt: skip
            seconds[version] = json.loads(done.stdout)
        print(f"{options.rows} rows, 7 joints; CPU s" + " " * 8 + "".join(f"{v:>9}" for v in roots))
        for kind in KINDS:
            line = f"{kind:<31}" + "".join(f"{seconds[v][kind]:9.2f}" for v in roots)
            if "old" in roots:
                now, old = (np.load(folders[v] / f"{kind}.npy") for v in ("now", "old"))
                difference = np.abs(now - old).max() / max(np.abs(old).max(), 1e-300)
                ratio = seconds["old"][kind] / max(seconds["now"][kind], 1e-9)
                line += f"{ratio:8.1f} x   differ by {difference:.0e}"
            print(line)


if __name__ == "__main__":
    main()
