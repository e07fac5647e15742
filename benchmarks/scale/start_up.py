# SPDX-License-Identifier: BSD-3-Clause
"""Time of imports, of the first robot, and to the first line of ``skidyn check``.

Usage: python benchmarks/scale/start_up.py [--old CHECKOUT] [--repeats 5]

Every case runs in new processes. The least CPU time of the repeats is printed, including the start
of Python, with modules compiled before, as after an installation. ``--old`` is the root of another
version (a checkout by ``git worktree add``) that is run alternately with this one for the ratio.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

from skidyn.datasets import load_panda, make_hidden_effect_log

HERE = Path(__file__).resolve().parents[2]
PANDA = "skidyn/datasets/robots/panda.urdf"
CASES = {
    "python alone": "pass",
    "import skidyn": "import skidyn",
    "first robot": f"import skidyn; skidyn.robots.Robot.from_urdf({PANDA!r})",
    "first torque": (
        f"import numpy, skidyn; robot = skidyn.robots.Robot.from_urdf({PANDA!r}); "
        "robot.inverse_dynamics(*numpy.ones((3, 100, 7)))"
    ),
    "skidyn check, 10,000 rows": (
        f"from skidyn.cli import main; main(['check', {{log!r}}, '--urdf', {PANDA!r}])"
    ),
}


def cpu_seconds(code: str, root: Path) -> float:
    """User and system time of a new interpreter, s."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    environment = os.environ | {
        "PYTHONPATH": str(root),
        "OMP_NUM_THREADS": "1",
        "PYTHONDONTWRITEBYTECODE": "",
    }
    subprocess.run(
        [sys.executable, "-c", code], cwd=root, env=environment, check=True, capture_output=True
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--old", type=Path, default=None, help="root of another version")
    parser.add_argument("--repeats", type=int, default=5)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        log = str(Path(folder, "log.csv"))
        make_hidden_effect_log(load_panda(), "dahl").frame.to_csv(log, index=False)
        print(f"{'CPU s':<28}{'now':>8}" + (f"{'old':>8}{'ratio':>8}" if options.old else ""))
        for name, code in CASES.items():
            code = code.replace("{log!r}", repr(log))
            now, old = [], []
            for _ in range(options.repeats + 1):  # the first run compiles the modules
                now.append(cpu_seconds(code, HERE))
                if options.old:
                    old.append(cpu_seconds(code, options.old.resolve()))
            line = f"{name:<28}{min(now):8.2f}"
            if old:
                line += f"{min(old):8.2f}{min(old) / min(now):8.1f}"
            print(line, flush=True)


if __name__ == "__main__":
    main()
