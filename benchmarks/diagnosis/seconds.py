# SPDX-License-Identifier: BSD-3-Clause
"""Times of commands: diagnosis of short and long logs, of more joints, and later commands.

Usage: python benchmarks/diagnosis/seconds.py [--old CHECKOUT] [--only NAME ...] [--rows 300000]

Every case runs in a fresh process: CPU seconds including the start of Python (modules were compiled
before, as after an installation), wall seconds to the first output and to the end, and peak memory.
``--old`` is the root of another version (made by ``git worktree add``), which is run alternately
with this one, for the ratio of CPU seconds. On a shared machine, only CPU seconds and ratios of one
run can be compared.
"""

from __future__ import annotations

import argparse
import compileall
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from skidyn.datasets import load_panda, make_hidden_effect_log
from skidyn.robots import Robot

HERE = Path(__file__).resolve().parents[2]
#: One that the search weighs in this version and in older ones.
RIVAL = ("--rival", "nonlinear_viscous")
AXES = ("0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0", "1 0 0", "0 0 1")


def chain(n: int) -> str:
    """URDF of a serial arm whose links become lighter and shorter."""
    parts = ['<robot name="chain"><link name="base"/>']
    length = 0.1
    for k in range(n):
        mass, parent, below = 8.0 * 0.93**k, "base" if k == 0 else f"l{k}", length
        length = max(0.06, 0.35 * 0.95**k)
        inertia = mass * length**2 / 12
        parts.append(
            f'<link name="l{k + 1}"><inertial><origin xyz="0.01 0.005 {length / 2}"/>'
            f'<mass value="{mass}"/><inertia ixx="{inertia}" iyy="{inertia}" izz="{inertia / 4}" '
            f'ixy="0" ixz="0" iyz="0"/></inertial></link><joint name="joint{k + 1}" '
            f'type="revolute"><parent link="{parent}"/><child link="l{k + 1}"/>'
            f'<origin xyz="0 0 {below}"/><axis xyz="{AXES[k % 7]}"/>'
            '<limit lower="-2.5" upper="2.5" velocity="2.5" effort="300"/></joint>'
        )
    return "".join([*parts, "</robot>"])


def prepare(folder: Path, rows: int) -> dict[str, list[str]]:
    """Logs of all cases; the commands."""
    panda = str(HERE / "skidyn/datasets/robots/panda.urdf")
    logs = {name: (load_panda(), 100.0) for name in ("7", "many")}
    logs["long"] = (load_panda(), rows / 300.0)
    for n in (14, 30):
        (folder / f"chain{n}.urdf").write_text(chain(n))
        logs[f"{n}"] = (Robot.from_urdf(folder / f"chain{n}.urdf"), 100.0)
    for name, (robot, rate) in logs.items():
        log = make_hidden_effect_log(
            robot,
            "stribeck",
            joints=[2],
            n_trajectories=40 if name == "many" else 10,
            duration=30.0 if name == "long" else 10.0,
            rate=rate,
        )
        log.frame.to_parquet(folder / f"{name}.parquet")

    def diagnose(log: str, urdf: str, out: str) -> list[str]:
        return ["diagnose", f"{folder}/{log}.parquet", "--urdf", urdf, "--out", f"{folder}/{out}"]

    report = f"{folder}/a.json"
    return {
        "check, 10,000 x 7": ["check", f"{folder}/7.parquet", "--urdf", panda],
        "diagnose, 10,000 x 7": diagnose("7", panda, "a.json"),
        f"diagnose, {rows} x 7, page": [
            *diagnose("long", panda, "long.json"),
            "--html",
            f"{folder}/long.html",
        ],
        f"again, {rows} x 7, page": [
            *diagnose("long", panda, "long.json"),
            "--html",
            f"{folder}/long.html",
        ],
        "diagnose, 40,000 x 7": diagnose("many", panda, "many.json"),
        "diagnose, 10,000 x 14": diagnose("14", f"{folder}/chain14.urdf", "14.json"),
        "diagnose, 10,000 x 30": diagnose("30", f"{folder}/chain30.urdf", "30.json"),
        "add": ["add", "--from", report, "--effect", "stribeck", "--joints", "2"],
        "compare two reports": ["compare", report, report, "--html", f"{folder}/ab.html"],
        "separate": ["separate", "--from", report, "--out", f"{folder}/m.csv", *RIVAL],
    }


def measure(command: list[str], root: Path) -> tuple[float, float, float, float, int]:
    """CPU seconds, wall seconds to the first output and to the end, peak GB and exit code."""
    environment = os.environ | {
        "PYTHONPATH": str(root),
        "OMP_NUM_THREADS": "1",
        "PYTHONDONTWRITEBYTECODE": "",
    }
    start = time.perf_counter()
    process = subprocess.Popen(
        [sys.executable, "-m", "skidyn", *command],
        cwd=root,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
    )
    assert process.stdout is not None
    process.stdout.read(1)
    first = time.perf_counter() - start
    process.stdout.read()
    _, status, used = os.wait4(process.pid, 0)
    wall = time.perf_counter() - start
    cpu = used.ru_utime + used.ru_stime
    return cpu, first, wall, used.ru_maxrss / 1024**2, os.waitstatus_to_exitcode(status)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--old", type=Path, help="root of another version")
    parser.add_argument("--only", nargs="+", help="cases whose names begin so")
    parser.add_argument("--rows", type=int, default=300_000, help="of the long log")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        cases = prepare(Path(name), options.rows)
        roots = [HERE, *([options.old.resolve()] if options.old else [])]
        for root in roots:
            compileall.compile_dir(root / "skidyn", quiet=2)
        print(
            f"{'':<28}{'CPU s':>8}{'first s':>9}{'wall s':>8}{'GB':>7}"
            + "  old CPU s  ratio" * bool(options.old)
        )
        for case, command in cases.items():
            if options.only and not case.startswith(tuple(options.only)):
                continue
            cpu, first, wall, peak, code = measure(command, HERE)
            line = f"{case:<28}{cpu:8.2f}{first:9.2f}{wall:8.1f}{peak:7.2f}"
            if options.old:
                # each version reads its own reports
                own = [word.replace("/a.json", "/old.json") for word in command]
                old = measure(own, options.old.resolve())[0]
                line += f"{old:11.2f}{old / cpu:7.1f}"
            print(line + ("" if code == 0 else f"  exit {code}"), flush=True)


if __name__ == "__main__":
    main()
