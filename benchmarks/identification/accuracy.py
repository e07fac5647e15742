# SPDX-License-Identifier: BSD-3-Clause
"""Accuracy of Gram matrices and triangular factors, and the automatic choice.

    python benchmarks/identification/accuracy.py

Exact torque of a Panda whose motion is reduced around one pose, so that the columns become
dependent. It prints the range of the motion, the condition number of the columns of unit size and
the largest error of a base parameter relative to the largest parameter.
"""

from __future__ import annotations

import numpy as np
from _common import random_motion

from skidyn.datasets import load_panda
from skidyn.evidence import evidence_from_motion
from skidyn.robots import find_base_parameters

RANGES = (1.0, 0.2, 0.05, 0.02, 0.01, 0.003, 0.001, 0.0003)


def main() -> None:
    """Print the table."""
    robot = load_panda()
    index = find_base_parameters(robot).index
    truth = robot.inertial_parameters * np.random.default_rng(1).uniform(0.7, 1.3, (7, 1))
    expected = find_base_parameters(robot).values(truth - robot.inertial_parameters)
    print(f"{'range':>8s}{'condition':>12s}{'Gram':>10s}{'QR':>10s}{'auto':>10s}  taken")
    for reach in RANGES:
        motion = reach * random_motion(robot, 20_000)
        motion[0] += [0.3, -0.5, 0.2, -1.8, 0.4, 1.5, 0.7]
        torque = robot.inverse_dynamics(*motion, parameters=truth)
        rows = robot.torque_regressor(*motion)[:, :, index] / np.std(torque, axis=0)[:, None]
        rows = rows.reshape(-1, len(index))
        condition = np.linalg.cond(rows / np.linalg.norm(rows, axis=0))
        errors = {}
        for method in ("gram", "qr", "auto"):
            evidence = evidence_from_motion(robot, *motion, torque, (), method=method)
            found = _solution(evidence)
            errors[method] = np.abs(found - expected).max() / np.abs(expected).max()
        taken = "gram" if errors["auto"] == errors["gram"] else "qr"
        print(
            f"{reach:8g}{condition:12.1e}"
            + "".join(f"{errors[m]:10.1e}" for m in ("gram", "qr", "auto"))
            + f"  {taken}"
        )


def _solution(evidence) -> np.ndarray:
    """Least squares without a threshold on the rank: from the factors alone."""
    stacked = np.vstack(list(evidence.factors.values()))
    size = np.linalg.norm(stacked[:, :-1], axis=0)
    return np.linalg.lstsq(stacked[:, :-1] / size, stacked[:, -1], rcond=1e-16)[0] / size


if __name__ == "__main__":
    main()
