# SPDX-License-Identifier: BSD-3-Clause
"""Hidden effects that are found in spite of coarse encoders.

    python benchmarks/diagnosis/coarse_positions.py [--bits 12] [--logs 40] [--first 0] [--jobs 2]

Robot, kind, noise, rate, motion and true parameters change from log to log. Positions are rounded
to 2 to the power of ``--bits`` steps per turn, and those of sliders to a tenth of such a step per
m. Printed are the logs whose effect is named, told by another name, told as unknown, or missed,
and how many further findings there are.
"""

from __future__ import annotations

import argparse
import warnings
from collections import Counter

from joblib import Parallel, delayed
from nothing_hidden import ROBOTS, rounded

from skidyn.datasets import make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor

KINDS = (
    "stribeck",
    "spring",
    "load_dependent_friction",
    "payload",
    "dahl",
    "torque_ripple",
    "gravity_compensator",
    "asymmetric_friction",
    "nonlinear_viscous",
)


def answer(seed: int, bits: int) -> tuple[str, int, str]:
    """How the effect of a log is told, the number of further findings, and a line about both."""
    warnings.simplefilter("ignore")
    robot = ROBOTS[seed % len(ROBOTS)]()
    kind = KINDS[(seed // len(ROBOTS) + seed) % len(KINDS)]
    log = make_hidden_effect_log(
        robot,
        kind,
        noise=("low", "high")[seed // len(ROBOTS) % 2],
        rate=(100.0, 250.0, 500.0)[seed // 10 % 3],
        random_state=5000 + seed,
    )
    found = diagnose(RBDRegressor(robot), rounded(log, bits), log.y).findings
    kinds = [f.kind for f in found]
    told = "named" if kind in kinds else "unknown" if "unknown" in kinds else "another name"
    told = told if kinds else "missed"
    others = sum(f.kind != kind for f in found)
    sentences = "; ".join(f"{f.kind} {f.joints} {f.confidence:.2f}" for f in found)
    return told, others, f"{seed}, {robot.name}, {kind}: {sentences or 'nothing'}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--bits", type=int, default=12, help="resolution of the encoders")
    parser.add_argument("--logs", type=int, default=40)
    parser.add_argument("--first", type=int, default=0, help="seed of the first log")
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    answers = Parallel(n_jobs=options.jobs)(
        delayed(answer)(options.first + k, options.bits) for k in range(options.logs)
    )
    for _, _, line in answers:
        print(line)
    counts = Counter(told for told, _, _ in answers)
    told = ", ".join(f"{counts[name]} {name}" for name in ("named", "another name", "unknown"))
    further = sum(others for told, others, _ in answers if told == "named")
    print(f"{options.logs} logs, {options.bits} bits: {told}, {counts['missed']} missed")
    print(f"{further} further findings beside the named ones")


if __name__ == "__main__":
    main()
