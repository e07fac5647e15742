# SPDX-License-Identifier: BSD-3-Clause
"""Free run of the EMPS benchmark, official split and metric.

Two recordings of the benchmark (Janot, Gautier, Brunot, 2019), ``DATA_EMPS.mat`` to fit and
``DATA_EMPS_PULSES.mat`` to test, are read from a folder; both are in the repository
forgi86/sysid-neural-continuous and in the benchmark's own archive. The test run is simulated as a
whole, 25 s, from its first sample and the voltage alone; the error is the root mean square of the
position without the first 20 samples.

    python benchmarks/identification/emps_simulation.py FOLDER
"""

import argparse
import time
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.io import loadmat

from skidyn.effects import Term
from skidyn.identification import RBDRegressor
from skidyn.robots import Robot
from skidyn.simulation import judge_by_simulation, simulate

URDF = """<robot name="emps"><link name="base"/><link name="carriage"><inertial><mass value="90"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="slide" type="prismatic"><axis xyz="1 0 0"/><parent link="base"/>
<child link="carriage"/><limit effort="400" velocity="1" lower="-1" upper="1"/></joint></robot>"""
SYMMETRIC = ("viscous", "coulomb", "offset")
MODELS = {
    "symmetric friction": SYMMETRIC,
    "direction-dependent friction": ("viscous", "coulomb", "asymmetric_friction"),
    "Stribeck friction": (*SYMMETRIC, "stribeck"),
    "Dahl friction": ("viscous", "dahl", "offset"),
    "a wave along the travel": (
        *SYMMETRIC,
        # of 15, 30 and 60 rad/m, the waves of the catalogue, that with the smallest error of the
        # free run of the recording that is fitted
        Term("position_dependent_friction", (1,), {"n": 15.0}),
    ),
    "a wave with overtone": (*SYMMETRIC, "position_dependent_friction"),
}
SKIPPED = 20
COLUMNS = ["time", "q1", "dq1"]


def read(path):
    """Motion and force of a recording."""
    data = loadmat(path)
    t, q = data["t"][:, 0], data["qm"][:, 0]
    frame = pd.DataFrame({"time": t, "q1": q, "dq1": np.gradient(q, t)})
    return frame, data["vir"][:, 0] * float(data["gtau"][0, 0])


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--models", nargs="*", default=list(MODELS), choices=list(MODELS))
    parser.add_argument(
        "--judge",
        action="store_true",
        help="only: direction-dependent friction judged over pieces of a second and of five",
    )
    options = parser.parse_args()
    X, y = read(options.folder / "DATA_EMPS.mat")
    X_test, y_test = read(options.folder / "DATA_EMPS_PULSES.mat")
    if options.judge:
        plain = RBDRegressor(Robot.from_urdf(URDF), SYMMETRIC)
        models = [plain.fit(X, y), plain.with_effects(["asymmetric_friction"]).fit(X, y)]
        for horizon in (1.0, 5.0):
            verdict = judge_by_simulation(*models, X_test, y_test, horizon=horizon)
            print(f"pieces of {horizon:g} s: {verdict}", flush=True)
        return
    print(f"{'model':30s} {'estimator':14s} {'free run, mm':>12s} {'seconds':>8s}")
    for name in options.models:
        for estimator in ("weighted", "output_error"):
            start = time.perf_counter()
            model = RBDRegressor(
                Robot.from_urdf(URDF), MODELS[name], estimator=estimator, horizon=None
            ).fit(X, y)
            seconds = time.perf_counter() - start
            motion = simulate(model, X_test, y_test)
            error = (motion["q1"] - X_test["q1"]).to_numpy()[SKIPPED:]
            rms = 1e3 * np.sqrt(np.mean(error**2))
            print(f"{name:30s} {estimator:14s} {rms:12.2f} {seconds:8.0f}", flush=True)


if __name__ == "__main__":
    main()
