# SPDX-License-Identifier: BSD-3-Clause
"""Power: share of right answers against the size of an effect and the length of the log.

    python benchmarks/diagnosis/power.py [--jobs 2] [--picture power.png]

The size is the root mean square of the effect's torque over the noise of the torque sensor, on the
joint that has it; of hysteresis, which takes the place of Coulomb friction, its largest torque. An
answer is right if it names the effect (of the hysteresis family, any member) on that joint and
nothing else.
"""

from __future__ import annotations

import argparse
import itertools
import warnings

import numpy as np
from joblib import Parallel, delayed

from skidyn.datasets import load_planar_arm, load_ur5, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.rigid_body import RBDRegressor

ROBOTS = {"planar arm": (load_planar_arm, 2), "ur5": (load_ur5, 3)}
KINDS = (
    "stribeck",
    "load_dependent_friction",
    "dahl",
    "spring",
    "asymmetric_friction",
    "temperature_friction",
)
SIZES = (0.02, 0.05, 0.1, 0.2, 0.5)
LENGTHS = (4, 10)  # trajectories of 10 s
SEEDS = 2
HYSTERESIS = {"dahl", "lugre", "maxwell_slip"}
#: Sizes in units of the noise are gathered in these bins.
BINS = (0.0, 0.03, 0.1, 0.2, 0.4, 0.8, 1.6, 10.0)


def answer(kind: str, size: float, length: int, robot: str, seed: int) -> tuple[float, bool]:
    """Size of the effect in units of the noise, and whether the diagnosis is right."""
    warnings.simplefilter("ignore")
    load, joint = ROBOTS[robot]
    options = {"noise": "high", "n_trajectories": length, "random_state": 300 + seed}
    log = make_hidden_effect_log(load(), kind, joints=[joint], magnitude=size, **options)
    none = make_hidden_effect_log(load(), None, **options)
    own = np.asarray(log.y)[:, joint - 1] - np.asarray(none.y)[:, joint - 1]
    found = [(f.kind, f.joints) for f in diagnose(RBDRegressor(log.robot), log.X, log.y).findings]
    names = HYSTERESIS if kind in HYSTERESIS else {kind}
    right = len(found) == 1 and found[0][0] in names and found[0][1] == (joint,)
    rms = np.ravel(log.parameters["Fc"])[0] if kind in HYSTERESIS else np.sqrt(np.mean(own**2))
    return float(rms / log.noise_std[joint - 1]), right


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--picture")
    options = parser.parse_args()
    cases = list(itertools.product(KINDS, SIZES, LENGTHS, ROBOTS, range(SEEDS)))
    results = Parallel(n_jobs=options.jobs)(delayed(answer)(*case) for case in cases)
    table: dict[tuple[str, int], list[list[bool]]] = {}
    for (kind, _, length, _, _), (size, right) in zip(cases, results, strict=True):
        row = table.setdefault((kind, length), [[] for _ in BINS[1:]])
        row[int(np.searchsorted(BINS, size, side="right")) - 1].append(right)
    heads = [f"{a:g}-{b:g}" for a, b in itertools.pairwise(BINS)]
    print(f"{'effect':26s}{'s':>5s}  " + "".join(f"{h:>11s}" for h in heads))
    for (kind, length), row in table.items():
        cells = [f"{np.mean(c):.2f} ({len(c)})" if c else "" for c in row]
        print(f"{kind:26s}{10 * length:5d}  " + "".join(f"{c:>11s}" for c in cells))
    if options.picture:
        draw(table, options.picture)


def draw(table: dict[tuple[str, int], list[list[bool]]], path: str) -> None:
    """Curves of one panel an effect."""
    import matplotlib.pyplot as plt

    middle = np.sqrt(np.maximum(BINS[:-1], 0.01) * np.array(BINS[1:]))
    figure, axes = plt.subplots(2, 3, figsize=(9, 5), sharex=True, sharey=True)
    for axis, kind in zip(axes.flat, KINDS, strict=True):
        for length, mark in zip(LENGTHS, "os", strict=True):
            share = np.array([np.mean(c) if c else np.nan for c in table[kind, length]])
            seen = np.isfinite(share)
            axis.plot(middle[seen], share[seen], f"-{mark}", label=f"{10 * length} s")
        axis.set_title(kind.replace("_", " "), fontsize=10)
        axis.set_xscale("log")
        axis.grid(alpha=0.3)
    axes[0, 0].legend()
    figure.supxlabel("effect over noise (root mean squares)")
    figure.supylabel("share of right answers")
    figure.tight_layout()
    figure.savefig(path, dpi=120)


if __name__ == "__main__":
    main()
