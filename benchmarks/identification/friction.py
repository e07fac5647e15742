# SPDX-License-Identifier: BSD-3-Clause
"""Friction of a Staubli TX40 and a Franka Panda, and values published with the recordings.

    SKIDYN_DATA=FOLDER python benchmarks/identification/friction.py

TX40: one run of 9 s, every tenth sample after a low-pass, wrist coupled through q5 + q6. Panda: one
run of 28 s; the published friction is a curve over velocity, to which ours is compared where the
joint moved. Intervals are 1.96 standard errors.
"""

from __future__ import annotations

import os
import sys
import warnings
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.signal import decimate

from skidyn.identification import RBDRegressor
from skidyn.logs import load_recording
from skidyn.robots import Robot

DATA = Path(os.environ.get("SKIDYN_DATA", "no folder given"))
#: Of joints 1 to 6: N m, N m s/rad; then of the shaft that turns with q5 + q6.
TX40_DRY = (7.14, 8.26, 6.34, 2.48, 3.03, 0.282, 1.95)
TX40_VISCOUS = (8.05, 5.53, 1.97, 1.11, 1.86, 0.65, 0.616)
#: tau = A / (1 + exp(-a (dq + s))) - A / (1 + exp(-a s)).
PANDA_A = np.array([0.54615, 0.87224, 0.64068, 1.2794, 0.83904, 0.30301, 0.56489])
PANDA_S = np.array([0.039533, 0.025882, -0.04607, 0.036194, 0.026226, -0.021047, 0.0035526])
PANDA_SLOPE = np.array([5.1181, 9.0657, 10.136, 5.5903, 8.3469, 17.133, 10.336])


def tx40() -> None:
    """Print the table of the TX40."""
    frame = load_recording(DATA / "tx40" / "staubli_tx40.npz").frame
    signals = [f"{s}{j}" for s in ("q", "dq", "tau") for j in range(1, 7)]
    slow = pd.DataFrame({c: decimate(frame[c].to_numpy(), 10, ftype="fir") for c in signals})
    slow["time"] = frame["time"].to_numpy()[::10]
    effects = ["viscous", "coulomb", "rotor_inertia", "offset"]
    effects += [("coupled_friction", [5, 6]), ("coupled_inertia", [5, 6])]
    robot = Robot.from_urdf(DATA / "tx40" / "tx40_min.urdf")
    model = RBDRegressor(robot, effects, smooth=True).fit(
        slow, slow[[f"tau{j}" for j in range(1, 7)]]
    )
    rows = {row["name"]: (row["value"], row["std"]) for row in model.parameter_table()}
    print("TX40          dry friction, N m             viscous, N m s/rad")
    print(f"{'joint':10s}{'published':>10s}{'skidyn':>16s}{'published':>12s}{'skidyn':>16s}")
    shared = rows["coupled_friction.Fv[5,6]"][0]
    for k in range(7):
        joint = str(k + 1) if k < 6 else "5,6"
        kinds = ("coulomb", "viscous") if k < 6 else ("coupled_friction", "coupled_friction")
        dry, viscous = rows[f"{kinds[0]}.Fc[{joint}]"], rows[f"{kinds[1]}.Fv[{joint}]"]
        # The published wrist counts the shared shaft's viscous friction among that of joint 5.
        value = viscous[0] + (shared if k in (4, 5) else 0.0)
        print(
            f"{joint:10s}{TX40_DRY[k]:10.2f}{dry[0]:10.2f} ± {1.96 * dry[1]:4.2f}"
            f"{TX40_VISCOUS[k]:11.2f}{value:10.2f} ± {1.96 * viscous[1]:4.2f}"
        )


def panda() -> None:
    """Print the table of the Panda."""
    frame = load_recording(DATA / "panda" / "panda_gaz.npz").frame
    names = [f"tau{j}" for j in range(1, 8)]
    robot = Robot.from_urdf(DATA / "panda" / "panda_min.urdf")
    columns = ["time", "trajectory", *(f"{s}{j}" for s in ("q", "dq") for j in range(1, 8))]
    model = RBDRegressor(robot, ("viscous", "coulomb", "offset")).fit(frame[columns], frame[names])
    values = dict(zip(model.coef_names_, model.coef_, strict=True))
    print("\nPanda: friction at the joint's 90 % velocity, and the curves where it moves")
    print(f"{'joint':8s}{'rad/s':>8s}{'published, N m':>16s}{'skidyn':>8s}{'difference, rms':>18s}")
    for j in range(7):
        velocity = frame[f"dq{j + 1}"].to_numpy()
        top = float(np.quantile(np.abs(velocity), 0.9))
        dry, viscous = values[f"coulomb.Fc[{j + 1}]"], values[f"viscous.Fv[{j + 1}]"]
        theirs = (_published(j, top) - _published(j, -top)) / 2
        moving = velocity[np.abs(velocity) > 0.05]
        gap = dry * np.sign(moving) + viscous * moving - _published(j, moving)
        gap -= gap.mean()  # an offset is not friction
        print(
            f"{j + 1:<8d}{top:8.2f}{theirs:16.3f}{dry + viscous * top:8.3f}"
            f"{np.sqrt(np.mean(gap**2)):18.3f}"
        )


def _published(joint: int, velocity):
    a, s, slope = PANDA_A[joint], PANDA_S[joint], PANDA_SLOPE[joint]
    return a / (1 + np.exp(-slope * (velocity + s))) - a / (1 + np.exp(-slope * s))


def main() -> None:
    """Print both tables."""
    if not DATA.is_dir():
        sys.exit("set SKIDYN_DATA to the folder that holds tx40/ and panda/")
    warnings.simplefilter("ignore")
    tx40()
    panda()


if __name__ == "__main__":
    main()
