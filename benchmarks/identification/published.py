# SPDX-License-Identifier: BSD-3-Clause
"""KUKA LWR4+ and EMPS, compared with published results for the same recordings.

    SKIDYN_DATA=FOLDER python benchmarks/identification/published.py

LWR4+: fitted to the first recording, tested on the second one (the same motion) as FloBaRoID does,
and on the third (a faster one), for which it gives no figure; the first 500 samples of each are
left out, as there. The figure is the mean over joints of the root mean square error over the range
of the torque in the description, in percent. FloBaRoID's (documentation/analysis_findings.md) are
for physically consistent bodies, viscous and dry friction, and three kinds of regularisation
towards the description. EMPS: the parameters that its authors identify (Janot, Gautier, Brunot,
2019), from positions and the force.
"""

from __future__ import annotations

import os
import sys
import warnings
from pathlib import Path

import numpy as np

from skidyn.identification import RBDRegressor
from skidyn.logs import load_recording
from skidyn.robots import Robot

DATA = Path(os.environ.get("SKIDYN_DATA", "no folder given"))
TORQUES = [f"tau{j}" for j in range(1, 8)]
LIMITS = np.array([176, 176, 100, 100, 100, 38, 38.0])
SKIPPED = 500
PUBLISHED = {"uniform": 0.211, "observability": 0.176, "geometric": 0.181}
FRICTION = ("viscous", "coulomb", "offset")
EMPS = """<robot name="emps"><link name="base"/><link name="carriage"><inertial><mass value="90"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="slide" type="prismatic"><axis xyz="1 0 0"/><parent link="base"/>
<child link="carriage"/><limit effort="400" velocity="1" lower="-1" upper="1"/></joint></robot>"""
PUBLISHED_EMPS = {
    "mass, kg": 95.11,
    "viscous friction, N s/m": 203.5,
    "dry friction, N": 20.39,
    "offset, N": -3.165,
}
MODELS = {
    "viscous, dry friction, offset": FRICTION,
    "+ Dahl": (*FRICTION, "dahl"),
    "+ load-dependent": (*FRICTION, "load_dependent_friction"),
}


def lwr4() -> None:
    """Print the table of the LWR4+."""
    frame = load_recording(DATA / "kuka_lwr4" / "kuka_lwr4.npz").frame
    runs = [run.iloc[SKIPPED:] for _, run in frame.groupby("trajectory")]
    robot = Robot.from_urdf(DATA / "kuka_lwr4" / "kuka_lwr4_min.urdf")
    print(f"{'error over the range of the torque, %':44s}{'run 2':>8s}{'run 3':>8s}")
    for name, value in PUBLISHED.items():
        print(f"  {'FloBaRoID, ' + name:42s}{value:8.3f}")
    for name, effects in MODELS.items():
        model = RBDRegressor(robot, effects, consistent=True).fit(runs[0], runs[0][TORQUES])
        print(f"  {'skidyn, ' + name:42s}" + "".join(_error(model, run) for run in runs[1:]))


def _error(model: RBDRegressor, run) -> str:
    left = run[TORQUES].to_numpy() - model.predict(run)
    share = np.sqrt(np.mean(left**2, axis=0)) / (2 * LIMITS)
    return f"{100 * share.mean():8.3f}"


def emps() -> None:
    """Print the parameters of EMPS."""
    frame = load_recording(DATA / "emps" / "emps.npz").frame
    frame["dq1"] = np.gradient(frame["q1"], frame["time"])
    model = RBDRegressor(Robot.from_urdf(EMPS), FRICTION, smooth=True)
    model.fit(frame[["time", "q1", "dq1"]], frame[["tau1"]])
    print(f"\n{'EMPS':34s}{'published':>10s}{'skidyn':>10s}{'95 %':>10s}")
    rows = zip(model.coef_, model.coef_std_, PUBLISHED_EMPS.items(), strict=True)
    for value, deviation, (name, published) in rows:
        band = f"± {1.96 * deviation:.2f}"
        print(f"  {name:32s}{published:10.2f}{value:10.2f}{band:>10s}")


def main() -> None:
    """Print both tables."""
    if not DATA.is_dir():
        sys.exit("set SKIDYN_DATA to the folder that holds kuka_lwr4/ and emps/")
    warnings.simplefilter("ignore")
    lwr4()
    emps()


if __name__ == "__main__":
    main()
