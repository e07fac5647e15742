# SPDX-License-Identifier: BSD-3-Clause
"""Panda and UR10e: error of the simulated motion with and without each finding of the diagnosis.

Models are driven by the measured torque of recordings, or intervals of a single one, that were left
out of their fit, and are reset to the log every second. The error is that of the position of each
joint relative to a model without forces: root mean square over the pieces, mean over the joints,
and of the median piece; in mrad, mean over the joints of the finding; and the number of pieces
whose motion grows without bound. Each finding is added to previous ones that do not worsen the
motion.

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
    head = f"{'mean':>7s}{'median':>7s}{'mrad':>8s}{'lost':>8s}"
    print(f"{'':67s} {'without':30s}  with")
    print(f"{'robot':6s} {'finding':60s} {head} |{head}  verdict")
    for name in options.robots:
        robot, frame = read(options.folder, name)
        names = range(1, robot.n_joints + 1)
        torque = frame[[f"tau{j}" for j in names]]
        columns = ["time", "trajectory", *(f"{s}{j}" for s in ("q", "dq") for j in names)]
        model = RBDRegressor(robot, EFFECTS, consistent=True)
        diagnosis = diagnose(model, frame[columns], torque)
        if not diagnosis.findings:
            print(f"{name:6s} nothing is found", flush=True)
        verdicts = diagnosis.judge_by_simulation()
        compared = diagnosis.in_turn.compared
        for finding, verdict, both in zip(diagnosis.findings, verdicts, compared, strict=True):
            joints = ", ".join(map(str, finding.joints))
            title = f"{finding.title}, joint {joints}"
            if both is None:
                print(f"{name:6s} {title:60s} {'':26s}  cannot be simulated", flush=True)
                continue
            rows = []
            for errors in (both.before, both.after):
                size = 1e3 * float(np.mean([errors.position[j - 1] for j in finding.joints]))
                share = errors.pieces / np.maximum(errors.resting, 1e-12)
                median = float(np.median(np.sqrt(np.mean(share**2, axis=1))))
                lost = f"{errors.n_lost}/{len(errors.pieces)}"
                rows.append(f"{errors.score:7.3f}{median:7.3f}{size:8.2f}{lost:>8s}")
            scores = " |".join(rows)
            told = "no evidence: further off than without forces" if verdict is None else verdict
            print(f"{name:6s} {title:60s} {scores}  {told}", flush=True)


if __name__ == "__main__":
    main()
