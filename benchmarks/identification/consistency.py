# SPDX-License-Identifier: BSD-3-Clause
"""Bodies that can exist, whatever the log: random logs with hardly any excitation, or none.

    python benchmarks/identification/consistency.py [n_logs]

Five robots; motions of few samples, of one joint, so small that noise rules, of one pose; torques
that are noise of 1e-3 to 1e5 N m, zero, those of the robot or of negative masses. Every
fit is checked by the eigenvalues of the pseudo-inertias and by the signs of the friction.
"""

from __future__ import annotations

import collections
import sys
import time
import warnings

import numpy as np

from skidyn.datasets import load_panda, load_planar_arm, load_scara, load_srs_arm, load_ur10e
from skidyn.identification import RBDRegressor, pseudo_inertia

ROBOTS = [load() for load in (load_planar_arm, load_scara, load_ur10e, load_srs_arm, load_panda)]
MOTIONS = ("few samples", "one joint", "tiny", "one pose", "slow line", "rich")
TORQUES = ("noise", "zero", "robot", "negative masses")


def make_log(seed: int) -> tuple[object, str, str, np.ndarray, np.ndarray]:
    """Robot, kind of motion, kind of torque, X and y."""
    rng = np.random.default_rng(seed)
    robot = ROBOTS[seed % len(ROBOTS)]
    motion, torque = str(rng.choice(MOTIONS)), str(rng.choice(TORQUES))
    n = robot.n_joints
    n_samples = int(rng.integers(8, 30)) if motion == "few samples" else int(rng.integers(60, 250))
    states = rng.uniform(-2, 2, (3, n_samples, n))
    if motion == "one joint":
        states[:, :, np.arange(n) != rng.integers(n)] = 0.0
    elif motion == "tiny":
        states *= 10.0 ** rng.uniform(-8, -2)
    elif motion == "one pose":
        states[:] = states[:, :1]
    elif motion == "slow line":
        states[0] = np.linspace(-1, 1, n_samples)[:, None] * rng.uniform(-1, 1, n)
        states[1], states[2] = rng.uniform(-1, 1, n) * 0.05, 0.0
    y = np.zeros((n_samples, n))
    if torque == "robot":
        y = robot.inverse_dynamics(*states) + rng.normal(0, 1, y.shape)
    elif torque == "noise":
        y = rng.normal(0, 10.0 ** rng.uniform(-3, 5), y.shape)
    elif torque == "negative masses":
        y = robot.inverse_dynamics(*states, parameters=-robot.inertial_parameters)
    return robot, motion, torque, np.hstack(list(states)), y


def main() -> None:
    """Print the counts."""
    n_logs = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    warnings.simplefilter("ignore")
    counts: collections.Counter[str] = collections.Counter()
    crashes, infeasible, smallest = 0, 0, np.inf
    start = time.process_time()
    for seed in range(n_logs):
        robot, motion, torque, X, y = make_log(seed)
        counts[motion] += 1
        try:
            model = RBDRegressor(robot, consistent=True).fit(X, y)
        except Exception as error:  # whatever it is, it is what is counted here
            crashes += 1
            print(f"log {seed} ({robot.name}, {motion}, {torque}): {error!r}")
            continue
        values = np.linalg.eigvalsh(pseudo_inertia(model.inertial_parameters_))
        smallest = min(smallest, float((values[:, 0] / values[:, -1]).min()))
        signs = all(np.all(c >= 0) for c in model.effect_coefficients_.values())
        finite = np.all(np.isfinite(model.inertial_parameters_))
        if not (np.all(values > 0) and signs and finite):
            infeasible += 1
            print(f"log {seed} ({robot.name}, {motion}, {torque}): infeasible")
    print(f"{n_logs} logs: {', '.join(f'{k} {v}' for k, v in sorted(counts.items()))}")
    print(f"infeasible {infeasible}, crashes {crashes}")
    print(f"smallest eigenvalue of a pseudo-inertia over its largest: {smallest:.1e}")
    print(f"{(time.process_time() - start) / n_logs:.2f} s of CPU per log")


if __name__ == "__main__":
    main()
