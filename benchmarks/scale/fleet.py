# SPDX-License-Identifier: BSD-3-Clause
"""Find the worn robots, and when the wear began, in a simulated fleet of 1,000 SCARA robots.

Every robot has 10 trajectories.

Usage: python benchmarks/scale/fleet.py [--robots 1000]
"""

from __future__ import annotations

import argparse
import time

import numpy as np
from _tiles import motion, torque

from skidyn._signals import Signals
from skidyn.datasets import load_scara
from skidyn.evidence import evidence_of_signals, linear_terms
from skidyn.fleet import compare_fleet, monitor_drift

TRAJECTORIES, WORN_SHARE, WEAR, SPREAD, NATURE = 10, 0.02, 1.4, 0.05, 3.0


def evidence(robot, friction, rng, n):
    """Evidence of ``n`` trajectories; ``friction(k)`` is the friction of the k-th."""
    terms = linear_terms(("viscous", "coulomb"), robot.n_joints)
    total = None
    for k in range(n):
        clock, q, dq, ddq = motion(robot, rng)
        signals = Signals(
            q, dq, ddq, np.full(len(clock), k), clock,
            prismatic=np.array([kind == "prismatic" for kind in robot.joint_types]),
        )  # fmt: skip
        one = evidence_of_signals(
            signals, torque(robot, q, dq, ddq, friction(k), rng), robot, terms
        )
        total = one if total is None else total + one
    return total


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robots", type=int, default=1000)
    n = parser.parse_args().robots
    robot, rng = load_scara(), np.random.default_rng(0)
    # Friction differs between healthy robots by 5 %; worn ones have 1.4 times as much in a joint.
    friction = NATURE * (1 + SPREAD * rng.normal(size=(n, 2, robot.n_joints)))
    worn = rng.choice(n, max(1, int(WORN_SHARE * n)), replace=False)
    joints = rng.integers(robot.n_joints, size=len(worn))
    friction[worn, 1, joints] *= WEAR
    start = time.process_time()
    fleet = {
        f"{k}": evidence(robot, lambda _, k=k: friction[k], rng, TRAJECTORIES) for k in range(n)
    }
    built = time.process_time() - start
    start = time.process_time()
    table = compare_fleet(fleet).table()
    compared = time.process_time() - start
    true = {(f"{r}", f"coulomb.Fc[{j + 1}]") for r, j in zip(worn, joints, strict=True)}
    found = {(row["robot"], row["column"]) for row in table}
    rows = sum(max(part.counts.values()) for part in fleet.values())
    print(f"{n} robots x {TRAJECTORIES} trajectories, {n * TRAJECTORIES * 1000} rows ({rows} kept)")
    print(f"evidence {built:.0f} s of CPU ({n * TRAJECTORIES * 1000 / built:.0f} rows/s)")
    print(f"comparison {compared:.1f} s of CPU")
    print(f"worn {len(true)}, found {len(found & true)}, false {len(found - true)}")

    def drifting(k):
        level = friction[0].copy()
        level[1, 2] *= 1.0 if k < 40 else 1.3
        return level

    report = monitor_drift(evidence(robot, drifting, rng, 80))
    print("drift of joint 3 from trajectory 40 on:", *report.messages(), sep="\n  ")
    steady = sum(
        bool(monitor_drift(evidence(robot, lambda _: friction[0], rng, 60)).alarms())
        for _ in range(10)
    )
    print(f"steady robots with an alarm: {steady} of 10 (60 trajectories each)")


if __name__ == "__main__":
    main()
