# SPDX-License-Identifier: BSD-3-Clause
"""Designed motions compared with random Fourier motions within the same limits.

For each robot: CPU time of the design, condition number of the base regressor, logarithm of the
determinant of the information matrix, and the relative standard error of the base parameters that
a fit to a simulated log of the motion has (root mean square of error over size, for parameters that
are not small; torque noise of 1 % of the effort limits, correlated over 0.1 s). The random motion
is the best of 40 for the criterion.

python benchmarks/excitation/design.py [determinant | condition]
"""

from __future__ import annotations

import sys
import time

import numpy as np
from scipy.signal import lfilter

from skidyn.datasets import load_panda, load_srs_arm, load_ur5
from skidyn.excitation import Excitation, design_excitation
from skidyn.robots import find_base_parameters

RATE, NOISE, CORRELATION, REPEATS = 100.0, 0.01, 0.1, 30


def parameter_error(excitation: Excitation) -> float:
    """Relative error of base parameters identified from simulated logs of the motion."""
    robot = excitation.robot
    base = find_base_parameters(robot)
    _, *states = excitation.sample(RATE)
    n = len(states[0])
    unit = robot.effort_limits[:, None]
    columns = robot.torque_regressor(*states)[:, :, base.index] / unit
    friction = np.concatenate([states[1][:, :, None], np.tanh(states[1] / 0.003)[:, :, None]], 2)
    extra = [np.eye(robot.n_joints) * friction[:, :, [k]] / unit for k in range(2)]
    design = np.concatenate([columns, *extra], axis=2).reshape(n * robot.n_joints, -1)
    truth = base.values(robot.inertial_parameters)
    rng = np.random.default_rng(0)
    keep = np.exp(-1 / (RATE * CORRELATION))
    errors = []
    for _ in range(REPEATS):
        white = rng.normal(size=(n, robot.n_joints))
        noise = lfilter([np.sqrt(1 - keep**2)], [1, -keep], white, axis=0)
        errors.append(np.linalg.lstsq(design, NOISE * noise.ravel())[0][: len(truth)])
    large = np.abs(truth) > 0.05 * np.abs(truth).max()
    return float(np.sqrt(np.mean((np.array(errors)[:, large] / truth[large]) ** 2)))


def main() -> None:
    """Print the table."""
    print(
        f"{'robot':9s}{'criterion':>12s}{'motion':>9s}{'CPU s':>7s} | condition number |"
        "   log determinant | parameter error"
    )
    print(f"{'':37s} | random  designed |   random  designed | random  designed")
    criteria = sys.argv[1:] or ("determinant", "condition")
    for load in (load_srs_arm, load_ur5, load_panda):
        robot = load()
        for criterion in criteria:
            for motion in ("fourier", "quintic"):
                asked = {"criterion": criterion, "motion": motion}
                random = design_excitation(robot, iterations=0, **asked)
                start = time.process_time()
                best = design_excitation(robot, **asked)
                spent = time.process_time() - start
                print(
                    f"{robot.name[:8]:9s}{criterion:>12s}{motion:>9s}{spent:7.0f} |"
                    f"{random.condition_number:7.1f}{best.condition_number:10.1f} |"
                    f"{random.log_determinant:9.1f}{best.log_determinant:10.1f} |"
                    f"{parameter_error(random):7.1%}{parameter_error(best):10.1%}",
                    flush=True,
                )


if __name__ == "__main__":
    main()
