# SPDX-License-Identifier: BSD-3-Clause
"""Motions designed and recorded by others, compared with motions of skidyn in the same range.

    SKIDYN_DATA=FOLDER python benchmarks/excitation/recorded.py [--robots lwr4,tx40,panda,ur10e]

LWR4+: designed by FloBaRoID; TX40: Janot and Gautier's, in figaroh's example; Panda: Gaz et al.;
UR10e: Mamedov and Mikhel. skidyn's motions last as long and stay within the recorded positions,
speeds, accelerations (99.9 % of them) and torques of every joint. Condition number of the columns
of base parameters, viscous and dry friction: with columns of equal length, and in SI units, as
printed by figaroh and FloBaRoID. Precision: one over the standard error of white noise, geometric
mean over the coefficients (the determinant), relative to the recorded motion.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.signal import butter, filtfilt

sys.path.append(str(Path(__file__).resolve().parents[1] / "identification"))
from ur10e import recording

from skidyn.excitation import MotionLimits, design_excitation
from skidyn.logs import load_recording
from skidyn.robots import Robot, find_base_parameters

DATA = Path(os.environ.get("SKIDYN_DATA", "no folder given"))
RATE, CUT_OFF, SHARE, SPEED = 100.0, 10.0, 0.999, 0.003


def motion_of(frame, n: int) -> tuple[np.ndarray, ...]:
    """Time, q, dq, ddq and torque; positions low-passed without delay and differentiated."""
    clock = frame["time"].to_numpy() - frame["time"].iloc[0]
    position = frame[[f"q{j + 1}" for j in range(n)]].to_numpy()
    rate = 1 / np.median(np.diff(clock))
    q = filtfilt(*butter(4, CUT_OFF, fs=rate), position, axis=0)
    dq = np.gradient(q, clock, axis=0)
    ddq = filtfilt(*butter(4, CUT_OFF, fs=rate), np.gradient(dq, clock, axis=0), axis=0)
    every = slice(None, None, max(1, round(rate / RATE)))
    torque = frame[[f"tau{j + 1}" for j in range(n)]].to_numpy()
    return clock[every], q[every], dq[every], ddq[every], torque[every]


def lwr4():
    """FloBaRoID's third recording, the faster one."""
    frame = load_recording(DATA / "kuka_lwr4" / "kuka_lwr4.npz").frame
    return frame[frame["trajectory"] == frame["trajectory"].iloc[-1]]


def panda():
    return load_recording(DATA / "panda" / "panda_gaz.npz").frame


def tx40():
    return load_recording(DATA / "tx40" / "staubli_tx40.npz").frame


def ur10e():
    return recording("ur10e_excitation.npz", "ur-20_02_10-30sec_12harm", slice(634, 3510))


ROBOTS: dict[str, tuple[Callable, str]] = {
    "lwr4": (lwr4, "kuka_lwr4/kuka_lwr4_min.urdf"),
    "tx40": (tx40, "tx40/tx40_min.urdf"),
    "panda": (panda, "panda/panda_min.urdf"),
    "ur10e": (ur10e, "ur10e/ur10e_min.urdf"),
}


def judge(robot: Robot, *states: np.ndarray) -> tuple[int, float, float, float]:
    """Number of columns; their condition number at equal length and in SI units; precision."""
    base = find_base_parameters(robot)
    columns = robot.torque_regressor(*states)[:, :, base.index]
    unit = np.eye(robot.n_joints)
    viscous, dry = (unit * x[:, :, None] for x in (states[1], np.tanh(states[1] / SPEED)))
    blocks = np.concatenate([columns, viscous, dry], axis=2)
    whole = blocks.reshape(-1, blocks.shape[2])
    sizes = np.linalg.svd(whole, compute_uv=False)
    equal = np.linalg.cond(whole / np.linalg.norm(whole, axis=0))
    precision = np.exp(np.mean(np.log(sizes))) / np.sqrt(len(states[0]))
    return whole.shape[1], float(equal), float(sizes[0] / sizes[-1]), float(precision)


def reach(robot: Robot, states: tuple[np.ndarray, ...], torque: np.ndarray) -> MotionLimits:
    """What the recorded motion reaches."""
    q, dq, ddq = states
    speed, acceleration = (np.quantile(np.abs(x), SHARE, axis=0) for x in (dq, ddq))
    rigid = np.abs(robot.inverse_dynamics(*states)).max(axis=0)
    return MotionLimits(
        position=np.column_stack([q.min(axis=0), q.max(axis=0)]),
        velocity=speed,
        acceleration=acceleration,
        torque=np.maximum(rigid, np.quantile(np.abs(torque), SHARE, axis=0)),
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robots", default=",".join(ROBOTS))
    options = parser.parse_args()
    if not DATA.is_dir():
        sys.exit("set SKIDYN_DATA to the folder that holds kuka_lwr4/, tx40/, panda/ and ur10e/")
    warnings.simplefilter("ignore")
    print(f"{'condition number of columns':36s}equal length   SI units   precision")
    for name in options.robots.split(","):
        load, urdf = ROBOTS[name]
        robot = Robot.from_urdf(DATA / urdf)
        clock, *states, torque = motion_of(load(), robot.n_joints)
        duration = float(clock[-1])
        number, equal, plain, usual = judge(robot, *states)
        print(f"{name}: {number} columns, {duration:.1f} s")
        print(f"  {'recorded':34s}{equal:12.1f}{plain:11.0f}{1:12.2f}", flush=True)
        within = reach(robot, tuple(states), torque)
        for criterion in ("condition", "determinant"):
            start = time.process_time()
            words = {"duration": duration, "limits": within, "criterion": criterion}
            best = design_excitation(robot, **words, base_frequency=max(0.1, 1 / duration))
            title = f"skidyn, {criterion}, {time.process_time() - start:.0f} s"
            _, equal, plain, precision = judge(robot, *best.sample(RATE)[1:])
            print(f"  {title:34s}{equal:12.1f}{plain:11.0f}{precision / usual:12.2f}", flush=True)


if __name__ == "__main__":
    main()
