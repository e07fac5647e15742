# SPDX-License-Identifier: BSD-3-Clause
"""A TX40 and a UR10e identified by figaroh and by skidyn from the same samples.

    pip install figaroh
    SKIDYN_DATA=FOLDER python benchmarks/identification/beside_figaroh.py

Both get the same filtered motion and unfiltered torque, and the same model: rigid body, viscous and
dry friction, offset, rotor inertia. figaroh: its regressor, base parameters by QR, least squares
weighted joint by joint, on all samples as in its examples (without those at rest its error is
larger on the TX40, equal on the UR10e). skidyn: ``RBDRegressor``, without and with the findings of
its diagnosis. TX40: one run of 9 s, positions low-passed at 100 Hz as in figaroh's example, every
tenth sample; fitted to the first 6 s, tested on the rest. UR10e: as in ``ur10e.py``, one run of 30
s and one of 50 s two days later. Errors in percent of the torque's norm.
"""

from __future__ import annotations

import os
import sys
import time
import warnings
from pathlib import Path

import numpy as np
import pandas as pd
import pinocchio
from scipy.signal import butter, filtfilt
from ur10e import recording

from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor
from skidyn.logs import load_recording
from skidyn.robots import Robot

sys.path.append(str(Path(__file__).resolve().parents[1] / "peers"))
from figaroh_identify import identify, regressor

DATA = Path(os.environ.get("SKIDYN_DATA", "no folder given"))
BASE = ("viscous", "coulomb", "offset", "rotor_inertia")
TORQUES = [f"tau{j}" for j in range(1, 7)]


def tx40() -> tuple[Path, pd.DataFrame, pd.DataFrame]:
    """Description, training and test part."""
    frame = load_recording(DATA / "tx40" / "staubli_tx40.npz").frame
    clock = frame["time"].to_numpy()
    position = frame[[f"q{j}" for j in range(1, 7)]].to_numpy()
    q = filtfilt(*butter(4, 100, fs=5000), position, axis=0)
    dq = np.gradient(q, clock, axis=0)
    ddq = np.gradient(dq, clock, axis=0)
    table = {"time": clock, "trajectory": 1 + (clock - clock[0] > 6).astype(int)}
    for name, values in (("q", q), ("dq", dq), ("ddq", ddq)):
        table |= {f"{name}{j + 1}": values[:, j] for j in range(6)}
    table |= {name: frame[name].to_numpy() for name in TORQUES}
    rows = pd.DataFrame(table).iloc[20:-20:10]
    late = rows["trajectory"] == 2
    return DATA / "tx40" / "tx40_min.urdf", rows[~late], rows[late]


def ur10e() -> tuple[Path, pd.DataFrame, pd.DataFrame]:
    """Description, training and test run."""
    train = recording("ur10e_excitation.npz", "ur-20_02_10-30sec_12harm", slice(634, 3510))
    test = recording("ur10e_excitation.npz", "ur-20_02_12-50sec_12harm", slice(354, 5090))
    return DATA / "ur10e" / "ur10e_min.urdf", train, test


def with_figaroh(urdf: Path, train: pd.DataFrame, test: pd.DataFrame):
    """Prediction of the test part, number of coefficients."""
    model = pinocchio.buildModelFromUrdf(str(urdf))

    def motion(table: pd.DataFrame) -> dict[str, np.ndarray]:
        names = ("q", "dq", "ddq", "tau")
        return {n: table[[f"{n}{j}" for j in range(1, 7)]].to_numpy() for n in names}

    known = motion(train)
    whole, _ = identify(model, known, np.ones(len(train), bool), rest=0.0)
    asked = motion(test)
    torque = regressor(model, *(asked[k] for k in ("q", "dq", "ddq"))) @ whole
    return torque.reshape(6, -1).T, np.count_nonzero(whole)


def with_skidyn(urdf: Path, train: pd.DataFrame, test: pd.DataFrame, search: bool):
    """Prediction of the test part, number of coefficients."""
    model = RBDRegressor(Robot.from_urdf(urdf), BASE).fit(train, train[TORQUES])
    if search:
        found = diagnose(model, train, train[TORQUES])
        model = found.model
        kinds = [f"{f.kind} {','.join(map(str, f.joints))}" for f in found.findings]
        print(f"  found: {'; '.join(kinds) or 'nothing'}")
    return model.predict(test), len(model.coef_)


def main() -> None:
    """Print a table for each robot."""
    if not DATA.is_dir():
        sys.exit("set SKIDYN_DATA to the folder that holds tx40/ and ur10e/")
    warnings.simplefilter("ignore")
    for name, load in (("TX40", tx40), ("UR10e", ur10e)):
        urdf, train, test = load()
        measured = test[TORQUES].to_numpy()
        print(f"{name}: {len(train)} samples to fit, {len(test)} to test")
        print(f"  {'':22s}{'coefficients':>13s}{'s':>7s}   error, % of each joint; mean")
        methods = {
            "figaroh": lambda *log: with_figaroh(*log),
            "skidyn": lambda *log: with_skidyn(*log, search=False),
            "skidyn, findings added": lambda *log: with_skidyn(*log, search=True),
        }
        for title, method in methods.items():
            start = time.process_time()
            told, number = method(urdf, train, test)
            seconds = time.process_time() - start
            share = np.linalg.norm(measured - told, axis=0) / np.linalg.norm(measured, axis=0)
            cells = "".join(f"{100 * s:6.1f}" for s in share) + f"{100 * share.mean():8.1f}"
            print(f"  {title:22s}{number:13d}{seconds:7.1f}   {cells}", flush=True)


if __name__ == "__main__":
    main()
