# SPDX-License-Identifier: BSD-3-Clause
"""Test of the stated limits: an effect as large as its limit should be found in 80 % of the logs.

    python benchmarks/diagnosis/limits.py [--jobs 2]

The limit of every effect is read from the diagnosis of a log without a hidden effect. The torque of
that effect, times a factor, is then added to the log, with the shape that is hardest to detect, and
the log is diagnosed again. The effect counts as found if a finding on this joint is of its kind, or
lists its kind as a rival.
"""

from __future__ import annotations

import argparse
import itertools
import warnings

import numpy as np
from joblib import Parallel, delayed

from skidyn.datasets import load_planar_arm, load_ur5, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.effects import get_effect
from skidyn.identification import RBDRegressor

ROBOTS = {"planar arm": (load_planar_arm, 2), "ur5": (load_ur5, 3)}
KINDS = (
    "asymmetric_friction",
    "load_dependent_friction",
    "nonlinear_viscous",
    "rotor_inertia",
    "spring",
    "stribeck",
)
FACTORS = (0.3, 0.5, 0.7, 1.0, 1.4)
SEEDS = 4


def answers(robot: str, seed: int) -> list[tuple[str, float, bool | None]]:
    """Kind, factor and whether it was found (None where the data cannot show it)."""
    warnings.simplefilter("ignore")
    load, joint = ROBOTS[robot]
    log = make_hidden_effect_log(
        load(), None, noise="high", n_trajectories=6, random_state=900 + seed
    )
    model = RBDRegressor(log.robot)
    nothing = diagnose(model, log.X, log.y)
    limits = {f.kind: f for f in nothing.limits if f.joint == joint}
    results: list[tuple[str, float, bool | None]] = []
    for kind, factor in itertools.product(KINDS, FACTORS):
        limit = limits.get(kind)
        if limit is None or limit.largest_hidden is None:
            results.append((kind, factor, None))
            continue
        effect = get_effect(kind)
        own = [
            c.term
            for c in nothing.result.candidates
            if c.term.kind == kind and c.joints == (joint - 1,)
        ]
        term = own[len(own) // 2]
        column = effect.columns(nothing.problem.signals, joint - 1, **term.shape)[:, 0]
        torque = np.array(log.y)
        torque[:, joint - 1] += factor * limit.largest_hidden * column
        found = diagnose(model, log.X, torque).findings
        named = any(kind in {f.kind, *f.rivals} and joint in f.joints for f in found)
        results.append((kind, factor, named))
    return results


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--jobs", type=int, default=2)
    jobs = parser.parse_args().jobs
    cases = itertools.product(ROBOTS, range(SEEDS))
    every = sum(Parallel(n_jobs=jobs)(delayed(answers)(*case) for case in cases), [])
    print(f"{'size over limit':26s}" + "".join(f"{f:>8g}" for f in FACTORS))
    for kind in (*KINDS, "all"):
        cells = []
        for factor in FACTORS:
            hits = [h for k, f, h in every if kind in (k, "all") and f == factor and h is not None]
            cells.append(f"{np.mean(hits):.2f}" if hits else "-")
        print(f"{kind:26s}" + "".join(f"{c:>8s}" for c in cells))


if __name__ == "__main__":
    main()
