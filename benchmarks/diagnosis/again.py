# SPDX-License-Identifier: BSD-3-Clause
"""Whether a diagnosis of a completed model finds anything else.

Usage: python benchmarks/diagnosis/again.py [KIND ...]

Every known effect that can be simulated is hidden in a log of the planar arm, found, and added;
then the completed model is diagnosed on the same log. What its formulas leave is no other effect.
"""

from __future__ import annotations

import sys
import warnings

from skidyn.datasets import hidden_effect_kinds, load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor

GIVEN = ("viscous", "coulomb")


def main() -> None:
    warnings.simplefilter("ignore")
    kinds = sys.argv[1:] or [k for k in hidden_effect_kinds() if not k.startswith("unknown")]
    arm, closed, added = load_planar_arm(), 0, 0
    for kind in kinds:
        options = {"n_trajectories": 10, "duration": 6.0, "rate": 200.0, "random_state": 3}
        log = make_hidden_effect_log(arm, kind, noise="low", **options)
        model = RBDRegressor(arm, effects=[k for k in GIVEN if k != kind])
        first = diagnose(model, log.X, log.y, checks=())
        line = f"{kind}: {', '.join(f.kind for f in first.findings) or 'nothing'}"
        if first.findings:
            again = diagnose(first.model, log.X, log.y, checks=())
            added += 1
            closed += again.verdict == "complete" and not again.findings
            line += f"; again {', '.join(f.kind for f in again.findings) or again.verdict}"
        print(line, flush=True)
    print(f"nothing else is found: {closed} of {added}")


if __name__ == "__main__":
    main()
