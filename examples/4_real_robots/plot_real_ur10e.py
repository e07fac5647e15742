# SPDX-License-Identifier: BSD-3-Clause
"""
Missing effects of a UR10e
==========================

A rigid body with viscous and Coulomb friction, rotor inertia and offsets is fitted to a 30 s
recording of a UR10e (motor currents times drive gains). Missing effects are identified on that
recording and two more, and tested on two held-out recordings: 50 s of a Fourier motion, and
point-to-point motion.
"""

# %%
# Three recordings are used for the identification and two for the test.
import os
import sys
from pathlib import Path

import numpy as np
from scipy.signal import butter, filtfilt

from skidyn.diagnosis import Settings, diagnose
from skidyn.identification import RBDRegressor
from skidyn.logs import load_recording
from skidyn.robots import Robot

DATA = Path(os.environ.get("SKIDYN_DATA", "no folder given")) / "ur10e"
if not DATA.is_dir():
    print("The UR10e recordings are not here; set SKIDYN_DATA to the folder that holds ur10e/.")
    sys.exit(0)

# Drive gains in N m/A, De Luca's set as in the source of the data.
GAINS = (14.87, 13.26, 11.13, 10.62, 11.03, 11.47)
TAU = [f"tau{j + 1}" for j in range(6)]


def recording(name, file="ur10e_excitation.npz"):
    """Table of one run, time from zero."""
    frame = load_recording(DATA / file, run=name, drive_gains=GAINS).frame
    return frame.assign(time=frame["time"] - frame["time"].iloc[0])


train = recording("ur-20_02_10-30sec_12harm")
choose = load_recording(
    DATA / "ur10e_excitation.npz",
    run=["ur-20_02_10-30sec_12harm", "ur-20_02_12-40sec_12harm", "ur-20_02_05-20sec_12harm"],
    drive_gains=GAINS,
).frame
judge = {
    "50 s Fourier": recording("ur-20_02_12-50sec_12harm"),
    "point to point": recording("ur-20_01_17-ptp_10_points", "ur10e_validation.npz"),
}

# %%
# The missing effects of the three recordings are listed in the order in which they were added.
robot = Robot.from_urdf(DATA / "ur10e_min.urdf")
model = RBDRegressor(robot, ("viscous", "coulomb", "offset", "rotor_inertia"))
diagnosis = diagnose(model, choose, choose[TAU], settings=Settings(max_findings=6))
for finding in diagnosis.findings:
    print(finding.sentence)

# %%
# Both models are fitted to the 30 s run alone.
base = model.fit(train, train[TAU])
terms = [term for finding in diagnosis.findings for term in finding.terms]
better = base.with_effects(terms).fit(train, train[TAU])


def errors(fitted, frame):
    """RMSE per joint below 5 Hz: from first to last motion, moving, and standing still."""
    b, a = butter(4, 5, fs=1 / np.median(np.diff(frame["time"])))
    residual = filtfilt(b, a, frame[TAU].to_numpy() - fitted.predict(frame), axis=0)
    moves = np.abs(frame[[f"dq{j + 1}" for j in range(6)]].to_numpy()) > 0.02
    first, *_, last = np.flatnonzero(moves.any(1))
    run = np.zeros_like(moves)
    run[first : last + 1] = True
    return [
        np.sqrt(np.where(m, residual**2, 0).sum(0) / np.maximum(m.sum(0), 1))
        for m in (run, moves, ~moves)
    ]


RATIOS = {}
for name, frame in judge.items():
    print(f"{name}: RMSE in N m, joints 1 to 6, model and completed model")
    parts = ("from first to last motion", "while the joint moves", "while it stands still")
    for part, before, after in zip(parts, errors(base, frame), errors(better, frame), strict=True):
        RATIOS[name, part] = float(np.mean(after / before))
        change = f"{RATIOS[name, part] - 1:+.0%} in the mean over joints"
        print(f"   {part:26s}", np.round(before, 2), np.round(after, 2), change)

# %%
# Joints 5 and 6 are at rest during most of the point-to-point run, where friction has the value
# that the controller last left. No model of sliding friction can predict it, so an error within the
# dry friction is not a failure of the model.
ptp = judge["point to point"]
where = diagnose(model, ptp, ptp[TAU], settings=Settings(max_findings=0))
REST = [error for error in where.rest_errors if error.joint in (5, 6)]
for error in REST:
    print(error.sentence)

# %%
# The pictures have the error by joint and regime before and after.
if not os.environ.get("SKIDYN_SMALL"):
    from skidyn.inspection import ErrorMapDisplay

    ErrorMapDisplay.from_diagnosis(diagnosis)
