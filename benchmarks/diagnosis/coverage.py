# SPDX-License-Identifier: BSD-3-Clause
"""Coverage of the 95 % intervals of findings, on simulated logs with partly coloured noise.

    python benchmarks/diagnosis/coverage.py [--seeds 12] [--jobs 2]

The linear coefficients of correctly identified effects are counted. Kinds for which the simulator
uses another formula than the fitted one are left out.
"""

from __future__ import annotations

import argparse
import itertools
import warnings

import numpy as np
from joblib import Parallel, delayed

from skidyn.datasets import load_planar_arm, load_srs_arm, load_ur5, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor

ROBOTS = {"planar arm": (load_planar_arm, 2), "ur5": (load_ur5, 3), "srs arm": (load_srs_arm, 4)}
#: Kind, what the user's model has, and the coefficient that is checked.
KINDS = {
    "viscous": (("coulomb",), "Fv"),
    "coulomb": (("viscous",), "Fc"),
    "load_dependent_friction": (("viscous", "coulomb"), "mu"),
    "asymmetric_friction": (("viscous", "coulomb"), "dFv"),
    "spring": (("viscous", "coulomb"), "k"),
    "stribeck": (("viscous", "coulomb"), "dF"),
    "offset": (("viscous", "coulomb"), "tau0"),
}


def inside(kind: str, robot: str, seed: int) -> list[bool]:
    """Whether the true values lie inside the intervals; empty where nothing right was found."""
    warnings.simplefilter("ignore")
    base, name = KINDS[kind]
    load, joint = ROBOTS[robot]
    log = make_hidden_effect_log(
        load(), kind, joints=[joint], base=base, noise="high", random_state=500 + seed
    )
    for finding in diagnose(RBDRegressor(log.robot, base), log.X, log.y).findings:
        if finding.kind == kind and finding.joints == (joint,):
            row, truth = finding.parameters[name], log.parameters[name]
            true = truth[0] if isinstance(truth, list | tuple | np.ndarray) else truth
            return [bool(row["low"] <= true <= row["high"])]
    return []


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=12)
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    cases = list(itertools.product(KINDS, ROBOTS, range(options.seeds)))
    results = Parallel(n_jobs=options.jobs)(delayed(inside)(*case) for case in cases)
    everything = []
    for kind in KINDS:
        own = [x for case, r in zip(cases, results, strict=True) if case[0] == kind for x in r]
        everything += own
        if own:
            print(f"{kind:26s} {sum(own):4d} of {len(own):4d}  {np.mean(own):.3f}")
    print(f"{'all':26s} {sum(everything):4d} of {len(everything):4d}  {np.mean(everything):.3f}")


if __name__ == "__main__":
    main()
