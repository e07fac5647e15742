# SPDX-License-Identifier: BSD-3-Clause
"""Panda and UR10e: error of the simulated motion with and without each finding of the diagnosis.

Models are driven by the measured torque of recordings, or intervals of a single one, that were left
out of their fit, and are reset to the log every second. The error is that of the position of each
joint relative to a model without forces, mean over the joints; each finding is added to previous
ones that do not worsen the motion.

    python benchmarks/identification/findings_simulated.py FOLDER [--robots panda ur10e]
"""

import argparse
import warnings
from pathlib import Path

import numpy as np

from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor
from skidyn.logs import load_recording
from skidyn.robots import Robot

#: Runs of the UR10e of about 20 s, and its drive gains, N m/A.
UR10E_RUNS = ["ur-20_02_05-20sec_12harm", "ur-20_02_06-20sec_10harm", "ur-20_02_10-20sec_7harm"]
UR10E_GAINS = 0.91 * np.array([14.87, 13.26, 11.13, 10.62, 11.03, 11.47])
EFFECTS = ("viscous", "coulomb", "offset", "rotor_inertia")


def read(folder, name):
    """Robot and table of its recordings."""
    if name == "panda":
        log = load_recording(folder / "panda" / "panda_unisa.npz")
    else:
        file = folder / "ur10e" / "ur10e_excitation.npz"
        log = load_recording(file, run=UR10E_RUNS, drive_gains=UR10E_GAINS)
    return Robot.from_urdf(folder / name / f"{name}_min.urdf"), log.frame


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--robots", nargs="*", default=["panda", "ur10e"])
    options = parser.parse_args()
    warnings.filterwarnings("ignore")  # remarks on the data
    print(f"{'robot':6s} {'finding':50s} {'without':>8s} {'with':>8s}  verdict")
    for name in options.robots:
        robot, frame = read(options.folder, name)
        names = range(1, robot.n_joints + 1)
        torque = frame[[f"tau{j}" for j in names]]
        columns = ["time", "trajectory", *(f"{s}{j}" for s in ("q", "dq") for j in names)]
        model = RBDRegressor(robot, EFFECTS, consistent=True)
        diagnosis = diagnose(model, frame[columns], torque)
        if not diagnosis.findings:
            print(f"{name:6s} nothing is found", flush=True)
        for finding, verdict in zip(
            diagnosis.findings, diagnosis.judge_by_simulation(), strict=True
        ):
            title = f"{finding.title}, joint {', '.join(map(str, finding.joints))}"
            if verdict is None:
                print(f"{name:6s} {title:50s} {'':17s}  simulation says nothing", flush=True)
                continue
            before, after = verdict.before.score, verdict.after.score
            print(f"{name:6s} {title:50s} {before:8.3f} {after:8.3f}  {verdict}", flush=True)


if __name__ == "__main__":
    main()
