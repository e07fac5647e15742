# SPDX-License-Identifier: BSD-3-Clause
"""The mass of a payload from one log by two methods: ``identify_payload`` and ``diagnose``.

    python benchmarks/identification/payload_twice.py --seed 1 --logs 8

Simulated UR5 and Panda, low and high noise; some trajectories of a log carry a payload.
``identify_payload`` is given these trajectories, ``diagnose`` finds them. The script prints both
masses with their 95 % intervals, and how often each interval contains the truth and both agree.
"""

from __future__ import annotations

import argparse
import warnings

from skidyn.datasets import load_panda, load_ur5, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor
from skidyn.payload import identify_payload


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--logs", type=int, default=8)
    options = parser.parse_args()
    warnings.filterwarnings("ignore")  # remarks on the data
    held, found, told, agree = 0, 0, 0, 0
    print(f"{'robot':8s}{'noise':6s}{'true':>7s}{'payload':>26s}{'diagnose':>26s}  kg")
    for k in range(options.logs):
        robot, noise = (load_ur5, load_panda)[k % 2](), ("low", "high")[k // 2 % 2]
        log = make_hidden_effect_log(robot, "payload", noise=noise, random_state=options.seed + k)
        carries = log.frame["trajectory"].isin(log.parameters["trajectories"])
        one = identify_payload(robot, log.frame[carries], log.frame[~carries])
        diagnosis = diagnose(RBDRegressor(robot, ("viscous", "coulomb")), log.X, log.y)
        true, (low, high) = log.parameters["mass"], one.mass_interval
        held += low <= true <= high
        mass = next((f.parameters["mass"] for f in diagnosis.findings if f.kind == "payload"), None)
        text = "-"
        if mass is not None:
            told += 1
            found += mass["low"] <= true <= mass["high"]
            agree += mass["low"] <= high and low <= mass["high"]
            text = f"{mass['value']:.3f} ({mass['low']:.3f} .. {mass['high']:.3f})"
        first = f"{one.mass:.3f} ({low:.3f} .. {high:.3f})"
        print(f"{robot.name:8s}{noise:6s}{true:7.3f}{first:>26s}{text:>26s}", flush=True)
    print(f"\nidentify_payload holds the truth in {held} of {options.logs} logs; diagnose finds a")
    print(f"payload in {told}, holds the truth in {found} and agrees in {agree} of these")


if __name__ == "__main__":
    main()
