# SPDX-License-Identifier: BSD-3-Clause
"""Truth of draws of the shared generator, corrected where it is not that of the simulation.

    python benchmarks/diagnosis/corrected_truth.py DRAW [DRAW ...] --out truth.json [--as-stated]

Every DRAW is a folder with ``cases`` and ``truth``. Three things are corrected. Where viscous or
Coulomb friction is hidden, all joints have it and the base model lacks it on all of them, but the
truth lists the joints that were drawn: it gets all of them. A rotor inertia beside another effect
is no missing effect if the base model, which is fitted, has one. Logs of simulations that diverged,
in which no joint moves by more than 0.01 rad or one moves by more than 1000 rad, are left out.
``--as-stated`` corrects nothing and only joins the draws.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np
import pandas as pd

#: Friction of the simulation by the kind of effect that hides it.
FRICTION = {"viscous": "Fv", "coulomb": "Fc"}
#: Travel, rad or m, that a log must reach and must not exceed.
LEAST, MOST = 1e-2, 1e3


def diverged(log: pd.DataFrame, n_joints: int) -> bool:
    """Whether the joints do not move, or move without bound."""
    q = log[[f"q{j + 1}" for j in range(n_joints)]].to_numpy()
    travel = float(np.ptp(q, axis=0).max())
    return not LEAST < travel < MOST


def corrected(truth: dict) -> dict:
    """Truth with all joints of a friction that the base model lacks, without what it contains."""
    effects = []
    for effect in truth["effects"]:
        if effect["kind"] == "rotor_inertia" and "rotor_inertia" in truth["base_model"]:
            continue
        name = FRICTION.get(effect["kind"])
        if name and effect["kind"] not in truth["base_model"]:
            size = truth["friction"][name]
            joints = [j + 1 for j, value in enumerate(size) if value]
            effect = effect | {
                "joints": joints,
                "parameters": {name: [size[j - 1] for j in joints]},
            }
        effects.append(effect)
    return truth | {"effects": effects}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("draws", nargs="+", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--as-stated", action="store_true", help="correct nothing")
    options = parser.parse_args()
    kept, left_out, changed = [], [], []
    for file in sorted(f for draw in options.draws for f in draw.glob("truth/case_*.json")):
        truth = json.loads(file.read_text())
        if not options.as_stated:
            log = pd.read_parquet(file.parents[1] / "cases" / file.stem / "log.parquet")
            if diverged(log, len(truth["oracle_z"])):
                left_out.append(file.stem)
                continue
            right = corrected(truth)
            changed += [file.stem] if right != truth else []
            truth = right
        kept.append(truth)
    options.out.write_text(json.dumps(kept))
    print(f"{len(kept)} logs; diverged: {left_out}; corrected: {changed}")


if __name__ == "__main__":
    main()
