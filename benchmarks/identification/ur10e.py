# SPDX-License-Identifier: BSD-3-Clause
"""UR10e: held-out error of the measured torques without any filter.

    SKIDYN_DATA=FOLDER python benchmarks/identification/ur10e.py

Trained on one run of 30 s, tested on a run of 50 s recorded two days later and on point-to-point
motion. Torque is the published drive gains times current, never filtered. Velocities are the
measured ones, low-passed without delay at 20 Hz, and accelerations their central differences. Of
the two exciting runs, the rows used by the authors are taken; of the last one, rest before and
after the motion is removed. The relative error is the norm of the residual over the norm of the
torque, on all samples and on those where the joint moves by more than 0.03 rad/s.
"""

from __future__ import annotations

import os
import sys
import warnings
from pathlib import Path

import numpy as np
from scipy.signal import butter, filtfilt

from skidyn.identification import RBDRegressor
from skidyn.logs import load_recording
from skidyn.robots import Robot

FOLDER = Path(os.environ.get("SKIDYN_DATA", "no folder given")) / "ur10e"
GAINS = (14.87, 13.26, 11.13, 10.62, 11.03, 11.47)
TORQUES = [f"tau{j}" for j in range(1, 7)]
VELOCITIES = [f"dq{j}" for j in range(1, 7)]
MOVING = 0.03
#: What others' least squares (base parameters, rotor inertia, viscous and dry friction, offset)
#: leaves on the same run of 50 s, raw current.
REFERENCE = (10.5, 4.8, 5.8, 8.7, 13.8, 9.6)

BASE = ("viscous", "coulomb", "offset", "rotor_inertia")
MODELS = {
    "rigid body, friction, rotors": (BASE, None),
    "the same, from positions alone": (BASE, True),
    "+ Dahl": ((*BASE, "dahl"), None),
    "+ Dahl, load-dependent": ((*BASE, "dahl", "load_dependent_friction"), None),
}


def recording(file: str, run: str, rows: slice | None = None):
    """Motion and torque of one run; by default without the rest at both ends."""
    frame = load_recording(FOLDER / file, run=run, drive_gains=GAINS).frame
    moving = np.flatnonzero(np.abs(frame[VELOCITIES].to_numpy()).max(axis=1) > MOVING)
    velocity = filtfilt(*butter(4, 20, fs=100), frame[VELOCITIES].to_numpy(), axis=0)
    frame[VELOCITIES] = velocity
    time = frame["time"].to_numpy()
    frame[[f"ddq{j}" for j in range(1, 7)]] = np.gradient(velocity, time, axis=0)
    rows = slice(moving[0], moving[-1] + 1) if rows is None else rows
    return frame.iloc[rows].reset_index(drop=True)


def main() -> None:
    """Print the table."""
    if not FOLDER.is_dir():
        sys.exit("set SKIDYN_DATA to the folder that holds ur10e/")
    warnings.simplefilter("ignore")
    robot = Robot.from_urdf(FOLDER / "ur10e_min.urdf")
    train = recording("ur10e_excitation.npz", "ur-20_02_10-30sec_12harm", slice(634, 3510))
    tests = {
        "50 s": recording("ur10e_excitation.npz", "ur-20_02_12-50sec_12harm", slice(354, 5090)),
        "point to point": recording("ur10e_validation.npz", "ur-20_01_17-ptp_10_points"),
    }
    print("relative error on held-out runs, torque unfiltered, %, joints 1 to 6")
    print(f"{'':34s}{'all samples':^36s} | {'moving':^36s}")
    fitted = {
        title: RBDRegressor(robot, effects, smooth=smooth).fit(train, train[TORQUES])
        for title, (effects, smooth) in MODELS.items()
    }
    for name, test in tests.items():
        print(name)
        if name == "50 s":
            print(f"  {'others, for comparison':32s}{_cells(np.array(REFERENCE))} |")
        measured = test[TORQUES].to_numpy()
        moving = np.abs(test[VELOCITIES].to_numpy()) > MOVING
        for title, model in fitted.items():
            residual = measured - model.predict(test)
            everywhere = _share(residual, measured)
            there = _share(residual * moving, measured * moving)
            print(f"  {title:32s}{_cells(everywhere)} | {_cells(there)}", flush=True)


def _share(residual: np.ndarray, measured: np.ndarray) -> np.ndarray:
    return 100 * np.linalg.norm(residual, axis=0) / np.linalg.norm(measured, axis=0)


def _cells(values: np.ndarray) -> str:
    return "".join(f"{v:6.1f}" for v in values)


if __name__ == "__main__":
    main()
