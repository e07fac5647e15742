# SPDX-License-Identifier: BSD-3-Clause
"""A UR10e and a Panda identified by mujoco.sysid and by skidyn, both simulated by MuJoCo.

    pip install "mujoco[sysid]"
    SKIDYN_DATA=FOLDER python benchmarks/identification/beside_mujoco.py [--iterations 40]

mujoco.sysid fits inertias (its pseudo-inertia parametrisation, which keeps bodies possible), dry
friction, damping and armature of every joint so that rollouts of a quarter of a second from
recorded states follow the recording, started from the URDF. skidyn fits ``RBDRegressor`` with the
same effects and bodies that can exist, once by least squares of the torque and once by simulating
the same quarters of a second (``output_error``), and exports it as MJCF. All are then run by MuJoCo
under the torque of recordings that neither saw, in pieces of a quarter of a second; the error is
that of the position at the pieces' ends, in mrad, beside the URDF's own. Needs the data of
``ur10e.py``; the Panda's one run is divided after two thirds.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
import warnings
from functools import partial
from pathlib import Path

import mujoco
import numpy as np
from mujoco import sysid
from scipy.signal import butter, filtfilt
from ur10e import recording

from skidyn.export import write_mjcf
from skidyn.identification import RBDRegressor
from skidyn.logs import load_recording
from skidyn.robots import Robot

sys.path.append(str(Path(__file__).resolve().parents[1] / "peers"))
from mujoco_sysid import PIECE, fit, parameters, pieces, read

DATA = Path(os.environ.get("SKIDYN_DATA", "no folder given"))
STEP, PIECES = 0.0025, 40
#: Start and bound of what mujoco.sysid fits for every drive, SI units.
DRIVES = {"frictionloss": (2.0, 60.0), "damping": (2.0, 80.0), "armature": (0.5, 10.0)}
EFFECTS = ("viscous", "coulomb", "rotor_inertia")


def ur10e():
    """Description, joints, run to fit and run to test."""
    train = recording("ur10e_excitation.npz", "ur-20_02_10-30sec_12harm", slice(634, 3510))
    test = recording("ur10e_excitation.npz", "ur-20_02_12-50sec_12harm", slice(354, 5090))
    return DATA / "ur10e" / "ur10e_min.urdf", 6, train, test


def panda():
    """Description, joints, the first two thirds of the run and the rest."""
    frame = load_recording(DATA / "panda" / "panda_gaz.npz").frame.iloc[::5]
    names = [f"dq{j}" for j in range(1, 8)]
    frame[names] = filtfilt(*butter(4, 10, fs=200), frame[names].to_numpy(), axis=0)
    clock = frame["time"].to_numpy()
    frame[[f"d{n}" for n in names]] = np.gradient(frame[names].to_numpy(), clock, axis=0)
    third = int(len(frame) * 2 / 3)
    return DATA / "panda" / "panda_min.urdf", 7, frame.iloc[:third], frame.iloc[third:]


def cut(model, n: int, table) -> list:
    """Pieces of a recording, spread evenly."""
    motion = {k: table[[f"{k}{j + 1}" for j in range(n)]].to_numpy() for k in ("q", "dq", "tau")}
    clock = table["time"].to_numpy()
    starts = np.linspace(clock[0], clock[-1] - PIECE - STEP, PIECES)
    return pieces(model, motion | {"time": clock}, starts)


def with_mujoco(path: Path, n: int, train, iterations: int):
    """Description with the parameters that mujoco.sysid finds."""
    spec, joints = read(path.read_text(), n, STEP)
    known = cut(spec.compile(), n, train)
    start = {what: np.full(n, value) for what, (value, _) in DRIVES.items()}
    most = {what: np.full(n, value) for what, (_, value) in DRIVES.items()}
    speed = np.sqrt(np.mean(train[[f"dq{j + 1}" for j in range(n)]].to_numpy() ** 2, axis=0))
    scale = np.hstack([PIECE * speed, speed])
    found, _ = fit(spec, known, parameters(spec, joints, start, most), scale, iterations)
    return sysid.apply_param_modifiers(found, spec)


def with_skidyn(path: Path, n: int, train, _, estimator: str = "weighted"):
    """Description with the parameters that skidyn finds."""
    names = [f"tau{j + 1}" for j in range(n)]
    words = {"consistent": True, "estimator": estimator, "horizon": PIECE}
    model = RBDRegressor(Robot.from_urdf(path), EFFECTS, **words).fit(train, train[names])
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "model.xml")
        write_mjcf(model, file)
        return read(file.read_text(), n, STEP)[0].compile()


def as_described(path: Path, n: int, *_):
    """The URDF as it is."""
    return read(path.read_text(), n, STEP)[0].compile()


def error(model, path: Path, n: int, test) -> np.ndarray:
    """Error of the position at the pieces' ends, mrad, root mean square over pieces."""
    spec, _ = read(path.read_text(), n, STEP)
    data, left = mujoco.MjData(model), []
    for piece in cut(spec.compile(), n, test):
        mujoco.mj_setState(
            model, data, piece.initial_state, mujoco.mjtState.mjSTATE_FULLPHYSICS.value
        )
        for torque in piece.control.data[:-1]:
            data.ctrl[:] = torque
            mujoco.mj_step(model, data)
        left.append(data.qpos[:n] - piece.sensordata.data[-1, :n])
    return 1e3 * np.sqrt(np.mean(np.square(left), axis=0))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--iterations", type=int, default=40)
    parser.add_argument("--robots", default="ur10e,panda")
    parser.add_argument("--only", default="", help="methods whose names begin so")
    options = parser.parse_args()
    if not DATA.is_dir():
        sys.exit("set SKIDYN_DATA to the folder that holds ur10e/ and panda/")
    warnings.simplefilter("ignore")
    for name in options.robots.split(","):
        path, n, train, test = {"ur10e": ur10e, "panda": panda}[name]()
        print(f"{name}: position after {PIECE:g} s, mrad, joints 1 to {n}; mean; CPU s of the fit")
        methods = {
            "as described": as_described,
            "mujoco.sysid": with_mujoco,
            "skidyn": with_skidyn,
            "skidyn, output error": partial(with_skidyn, estimator="output_error"),
        }
        for title, method in methods.items():
            if not title.startswith(options.only):
                continue
            start = time.process_time()
            model = method(path, n, train, options.iterations)
            seconds = time.process_time() - start
            miss = error(model, path, n, test)
            cells = "".join(f"{e:8.1f}" for e in miss)
            print(f"  {title:20s}{cells}{miss.mean():9.1f}{seconds:8.1f}", flush=True)


if __name__ == "__main__":
    main()
