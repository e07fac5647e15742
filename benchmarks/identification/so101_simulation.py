# SPDX-License-Identifier: BSD-3-Clause
"""SO-101, a servo arm without torque: error of the simulated motion, each motion held out.

Ten motions of the SAGE project (github.com/isaac-sim2real/sage, Apache-2.0) are read from a folder
with one folder each (``state_motor.csv.gz``, ``control.csv.gz``) and ``so101.urdf``. Gain and delay
of the servos, and friction, are fitted to nine motions; the tenth is simulated in closed loop from
its commands and reset to the log every second. Before: bodies of the URDF and the servo; after:
with viscous and dry friction, rotor inertia and offset.

    python benchmarks/identification/so101_simulation.py FOLDER

``--gains`` prints only the gain and the delay fitted to each motion alone, and the settings of the
servos that a diagnosis finds to differ from these.
"""

import argparse
import ast
import warnings
from pathlib import Path

import numpy as np
import pandas as pd

from skidyn.diagnosis import diagnose
from skidyn.exceptions import SkidynError
from skidyn.identification import RBDRegressor
from skidyn.robots import Robot
from skidyn.simulation import fit_servo, servo_torque, simulation_errors

EFFECTS = ("viscous", "coulomb", "rotor_inertia", "offset")
SETTINGS = ("servo_gain", "servo_current", "servo_voltage")


def read(folder, number):
    """Motion and commands of one recording."""
    state, control = (pd.read_csv(folder / f"{name}.csv.gz") for name in ("state_motor", "control"))
    n = min(len(state), len(control))
    q, wanted = (
        np.array([ast.literal_eval(row) for row in table["positions"][:n]])
        for table in (state, control)
    )
    time = state["timestamp"].to_numpy()[:n] * 1e-6
    table = {"time": time, "trajectory": np.full(n, number)}
    for name, values in (("q", q), ("dq", np.gradient(q, time, axis=0)), ("q_ref", wanted)):
        table |= {f"{name}{j + 1}": values[:, j] for j in range(q.shape[1])}
    return pd.DataFrame(table)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--gains", action="store_true", help="gain and delay by motion")
    options = parser.parse_args()
    warnings.filterwarnings("ignore")  # remarks on the data
    folder = options.folder
    robot = Robot.from_urdf(folder / "so101.urdf")
    names = sorted(path.name for path in folder.iterdir() if path.is_dir())
    log = pd.concat([read(folder / m, k) for k, m in enumerate(names)], ignore_index=True)
    if options.gains:
        for k, name in enumerate(names):
            try:
                servo = fit_servo(robot, log[log["trajectory"] == k], shared=True)
            except SkidynError:
                print(f"{name:20s} shows no gain")
                continue
            model = RBDRegressor(robot, EFFECTS)
            found = diagnose(
                model, log[log["trajectory"] == k], controller=servo, effects=SETTINGS, force=True
            )
            told = [
                f"{f.kind} of joint {f.joints[0]}" for f in found.findings if f.kind in SETTINGS
            ]
            told = told or ["-"]
            gain, delay = float(servo.stiffness[0]), 1e3 * servo.delay
            print(f"{name:20s} {gain:8.1f} N m/rad {delay:6.0f} ms  {', '.join(told)}", flush=True)
        return
    X = log[[c for c in log if "ref" not in c]]
    print(f"{'held-out motion':20s} {'before, mrad':>12s} {'after, mrad':>12s} {'N m/rad':>8s}")
    for k, name in enumerate(names):
        train = log["trajectory"] != k
        servo = fit_servo(robot, log[train], shared=True)
        torque = servo_torque(servo, log)
        errors = []
        for effects in ((), EFFECTS):
            model = RBDRegressor(robot, effects, "nominal", consistent=True)
            model.fit(X[train], torque[train])
            found = simulation_errors(model, log[~train], controller=servo, step=5e-3)
            errors.append(1e3 * np.sqrt(np.mean(found.position**2)))
        gain = float(servo.stiffness[0])
        print(f"{name:20s} {errors[0]:12.1f} {errors[1]:12.1f} {gain:8.1f}", flush=True)


if __name__ == "__main__":
    main()
