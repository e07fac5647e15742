# SPDX-License-Identifier: BSD-3-Clause
"""Time and worth of designed excitations, beside the best of 40 random Fourier motions.

python benchmarks/excitation/design.py
"""

from __future__ import annotations

import time

from skidyn.datasets import load_panda, load_srs_arm, load_ur5
from skidyn.excitation import design_excitation


def main() -> None:
    head = f"{'robot':10s}{'criterion':>13s}{'s':>7s}{'condition':>11s}{'log det':>9s}"
    print(head + "   best random: condition, log det")
    for load in (load_ur5, load_panda, load_srs_arm):
        robot = load()
        for criterion in ("determinant", "condition"):
            random = design_excitation(robot, criterion=criterion, iterations=0)
            start = time.perf_counter()
            best = design_excitation(robot, criterion=criterion)
            spent = time.perf_counter() - start
            print(
                f"{robot.name[:9]:10s}{criterion:>13s}{spent:7.1f}{best.condition_number:11.1f}"
                f"{best.log_determinant:9.1f}   {random.condition_number:9.1f}"
                f"{random.log_determinant:9.1f}",
                flush=True,
            )


if __name__ == "__main__":
    main()
