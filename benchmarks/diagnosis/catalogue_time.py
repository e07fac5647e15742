# SPDX-License-Identifier: BSD-3-Clause
"""Time of the search over the full catalogue, apart from the evidence pass.

    python benchmarks/diagnosis/catalogue_time.py

The evidence pass smooths 100,000 rows of 7 joints, evaluates the torque regressor and averages it;
the search tries every kind on every joint and includes the second search at the reversals.
"""

from __future__ import annotations

import time
import warnings

from threadpoolctl import threadpool_limits

from skidyn.datasets import load_panda, make_hidden_effect_log
from skidyn.diagnosis import Settings, read_signals
from skidyn.diagnosis._reversals import look_at_reversals
from skidyn.diagnosis._search import search
from skidyn.effects import make_terms, searched_kinds
from skidyn.evidence import make_problem


def main() -> None:
    warnings.simplefilter("ignore")
    for effect in (None, "stribeck", "dahl"):
        log = make_hidden_effect_log(
            load_panda(), effect, n_trajectories=10, duration=20.0, rate=500.0
        )
        with threadpool_limits(1):
            start = time.perf_counter()
            signals, torque = read_signals(log.X, log.y, log.robot)
            terms = make_terms(("viscous", "coulomb"), 7)
            problem = make_problem(signals, torque, robot=log.robot, rigid_body=True, terms=terms)
            middle = time.perf_counter()
            result = search(problem, searched_kinds(), Settings())
            _, result = look_at_reversals(problem, result, searched_kinds(), Settings())
            end = time.perf_counter()
        found = [h.kind for h in result.findings]
        print(
            f"{len(torque)} rows x 7 joints, hidden {effect}: evidence {middle - start:.1f} s, "
            f"catalogue {end - middle:.1f} s, found {found}",
            flush=True,
        )


if __name__ == "__main__":
    main()
