# SPDX-License-Identifier: BSD-3-Clause
"""False-alarm rate: simulated logs without a hidden effect must be called complete.

    python benchmarks/diagnosis/nothing_hidden.py [--logs 200] [--first 0] [--bits 13] [--jobs 2]
        [--trajectories 1 --duration 3]

Robots, noise, rate, motion and true parameters change from log to log. ``--bits`` rounds the
positions to as many steps per turn, and those of sliders to a tenth of such a step per m. A log is
complete if nothing is found and nothing is left unexplained; logs that are refused as too short are
counted apart.
"""

from __future__ import annotations

import argparse
import warnings

import numpy as np
import pandas as pd
from joblib import Parallel, delayed
from sklearn.utils import Bunch

from skidyn.datasets import (
    load_panda,
    load_planar_arm,
    load_scara,
    load_srs_arm,
    load_ur5,
    make_hidden_effect_log,
)
from skidyn.diagnosis import diagnose
from skidyn.exceptions import LogError
from skidyn.identification import RBDRegressor

ROBOTS = (load_planar_arm, load_ur5, load_scara, load_srs_arm, load_panda)


def rounded(log: Bunch, bits: int) -> pd.DataFrame:
    """Motion with positions as encoders of so many bits show them; of sliders, a tenth per m."""
    X = log.X.copy()
    for j, kind in enumerate(log.robot.joint_types):
        step = 2 * np.pi / 2**bits * (0.1 if kind == "prismatic" else 1.0)
        X[f"q{j + 1}"] = np.round(X[f"q{j + 1}"] / step) * step
    return X


def alarm(seed: int, bits: int | None = None, **length: float) -> list[str] | None:
    """Sentences of what was found, or left, where nothing is; None of a log that is refused."""
    warnings.simplefilter("ignore")
    robot = ROBOTS[seed % len(ROBOTS)]()
    noise = ("low", "high")[seed // len(ROBOTS) % 2]
    rate = (100.0, 250.0, 500.0)[seed // 10 % 3]  # the last two are looked at in short windows, too
    log = make_hidden_effect_log(
        robot, None, noise=noise, rate=rate, random_state=1000 + seed, **length
    )
    X = rounded(log, bits) if bits else log.X
    try:
        diagnosis = diagnose(RBDRegressor(robot), X, log.y)
    except LogError:
        return None
    told = [finding.sentence for finding in diagnosis.findings]
    if diagnosis.verdict != "complete" and not told:
        told = [f"unexplained on joints {diagnosis.unexplained['joints']}"]
    return [f"{robot.name}, {noise} noise, {rate:g} Hz, seed {seed}: {text}" for text in told]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--logs", type=int, default=200)
    parser.add_argument("--first", type=int, default=0, help="seed of the first log")
    parser.add_argument("--bits", type=int, help="resolution of the encoders")
    parser.add_argument("--trajectories", type=int, help="number of recordings")
    parser.add_argument("--duration", type=float, help="length of a recording in s")
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    length = {"n_trajectories": options.trajectories, "duration": options.duration}
    length = {name: value for name, value in length.items() if value is not None}
    seeds = range(options.first, options.first + options.logs)
    results = Parallel(n_jobs=options.jobs)(
        delayed(alarm)(seed, options.bits, **length) for seed in seeds
    )
    answered = [found for found in results if found is not None]
    for sentence in (s for found in answered for s in found):
        print(sentence)
    complete = sum(not found for found in answered)
    print(f"complete: {complete} of {len(answered)} ({complete / max(len(answered), 1):.1%})")
    if len(answered) < len(results):
        print(f"refused: {len(results) - len(answered)} of {len(results)}")


if __name__ == "__main__":
    main()
