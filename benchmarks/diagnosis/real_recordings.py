# SPDX-License-Identifier: BSD-3-Clause
"""Findings of the diagnosis on recordings of real robots, compared with known facts.

    SKIDYN_DATA=FOLDER python benchmarks/diagnosis/real_recordings.py [NAME ...]

All options have their defaults. A recording whose folder is absent is left out with a message.
"""

from __future__ import annotations

import os
import sys
import time
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.signal import decimate
from sklearn.base import BaseEstimator, RegressorMixin

from skidyn.diagnosis import Diagnosis, Finding, diagnose
from skidyn.identification import RBDRegressor
from skidyn.logs import load_recording
from skidyn.robots import Robot

DATA = Path(os.environ.get("SKIDYN_DATA", "no folder given"))
UR10E_GAINS = 0.91 * np.array([14.87, 13.26, 11.13, 10.62, 11.03, 11.47])

#: A chain of joints: (name, type, axis, origin, mass, centre of mass).
LINK = """<link name="{name}"><inertial><origin xyz="{com}"/><mass value="{mass}"/>
<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial></link>
<joint name="{name}_joint" type="{kind}"><parent link="{parent}"/><child link="{name}"/>
<origin xyz="{origin}"/><axis xyz="{axis}"/>
<limit lower="-20" upper="20" velocity="100" effort="1000"/></joint>"""


def chain(*links: tuple[str, str, str, float, str]) -> Robot:
    """A robot from (type, axis, origin, mass, centre of mass) of each link."""
    parts, parent = ['<robot name="rig"><link name="base"/>'], "base"
    for k, (kind, axis, origin, mass, com) in enumerate(links):
        name = f"link{k + 1}"
        fields = {"name": name, "kind": kind, "axis": axis, "origin": origin, "mass": mass}
        parts.append(LINK.format(parent=parent, com=com, **fields))
        parent = name
    return Robot.from_urdf("".join(parts) + "</robot>")


def torques(frame, n: int):
    """Torque columns."""
    return frame[[f"tau{j + 1}" for j in range(n)]]


def ur10e_payload() -> Diagnosis:
    """One run with and one without 2.805 kg at the flange."""
    folder = DATA / "ur10e"
    runs = ["ur-20_02_19_14harm50sec", "ur-20_02_19_14harm50secLoad"]
    file = folder / "ur10e_excitation.npz"
    frame = load_recording(file, run=runs, drive_gains=UR10E_GAINS).frame
    model = RBDRegressor(
        Robot.from_urdf(folder / "ur10e_min.urdf"),
        ("viscous", "coulomb", "offset", "rotor_inertia"),
    )
    return diagnose(model, frame, torques(frame, 6))


def ur10e_warm_up() -> Diagnosis:
    """Joint 4 swept alone, 6 to 22 and 64 to 69 minutes after the controller's start."""
    folder = DATA / "ur10e"
    runs = ["ur-20_01_22-joint_4", "ur-20_01_14-link_4"]
    file = folder / "ur10e_jointwise.npz"
    frame = load_recording(file, run=runs, drive_gains=UR10E_GAINS).frame
    clock = [c for c in frame.columns if c.startswith("t_controller")]
    if clock:
        frame["time"] = frame[clock[0]]
    model = RBDRegressor(Robot.from_urdf(folder / "ur10e_min.urdf"), ("viscous", "coulomb"))
    return diagnose(model, frame, torques(frame, 6))


def dvrk_weight() -> Diagnosis:
    """PSM, pitch axis with 105 g on the parallelogram in one run of two; 3 of its joints."""
    runs = ["psm/one_results", "psm/one_105_grams_parallel_results"]
    frame = load_recording(DATA / "dvrk" / "dvrk_psm.npz", run=runs).frame
    keep = ["time", "trajectory", *(f"{s}{j}" for s in ("q", "dq", "tau") for j in (1, 2, 3))]
    robot = chain(
        ("revolute", "1 0 0", "0 0 0", 1.0, "0 0 0.1"),
        ("revolute", "0 1 0", "0 0 0", 1.0, "0 0 -0.1"),
        ("prismatic", "0 0 -1", "0 0 0", 0.5, "0 0 0"),
    )
    model = RBDRegressor(robot, ("viscous", "coulomb", "offset", "rotor_inertia"))
    return diagnose(model, frame[keep[:8]], torques(frame, 3))


def emps() -> Diagnosis:
    """One axis with a ball screw; viscous and Coulomb friction alike both ways, and an offset."""
    frame = load_recording(DATA / "emps" / "emps.npz").frame
    robot = chain(("prismatic", "1 0 0", "0 0 0", 95.0, "0 0 0"))
    return diagnose(RBDRegressor(robot, ("viscous", "coulomb", "offset")), frame, torques(frame, 1))


def tx40() -> Diagnosis:
    """Every tenth sample after a low-pass; friction by joint, no rotors, no coupling."""
    folder = DATA / "tx40"
    frame = load_recording(folder / "staubli_tx40.npz").frame
    slow = {c: decimate(frame[c].to_numpy(), 10, ftype="fir") for c in frame if c[0] in "qt"}
    slow |= {c: decimate(frame[c].to_numpy(), 10, ftype="fir") for c in frame if c[:2] == "dq"}
    slow["time"] = frame["time"].to_numpy()[::10]
    slow["trajectory"] = frame["trajectory"].to_numpy()[::10]
    import pandas as pd

    table = pd.DataFrame(slow)
    columns = ["time", "trajectory", *(f"{s}{j}" for s in ("q", "dq") for j in range(1, 7))]
    model = RBDRegressor(Robot.from_urdf(folder / "tx40_min.urdf"), ("viscous", "coulomb"))
    return diagnose(model, table[columns], torques(table, 6))


def xl330() -> Diagnosis:
    """A servo swings 0.49 kg at 0.1 m; currents times the authors' torque constant."""
    frame = load_recording(DATA / "bam" / "bam_pendulum.npz", drive_gains=[0.387]).frame
    enabled = [c for c in frame if c.startswith("torque_enable")]
    frame = frame[frame[enabled[0]] > 0] if enabled else frame
    robot = chain(("revolute", "0 1 0", "0 0 0", 0.49, "0 0 -0.1"))
    columns = ["time", "trajectory", "q1", "dq1"]
    model = RBDRegressor(robot, ("viscous", "coulomb", "rotor_inertia"))
    return diagnose(model, frame[columns], torques(frame, 1))


def screw_drive_3() -> Diagnosis:
    """A worm drive at constant speeds, seen from its motor, with a hanging weight."""
    file = DATA / "screw_drive" / "screw_drives.npz"
    with np.load(file, allow_pickle=False) as archive:
        runs = [str(r) for r in archive["traj_name"] if str(r).startswith("drive3")]
    frame = load_recording(file, run=runs).frame
    robot = chain(("continuous", "0 0 1", "0 0 0", 0.01, "0 0 0"))
    frame["ddq1"] = 0.0  # every run has one speed
    columns = ["time", "trajectory", "q1", "dq1", "ddq1"]
    model = RBDRegressor(robot, ("viscous", "coulomb", "offset"))
    return diagnose(model, frame[columns], torques(frame, 1), smooth=False)


class _OtherRun(RegressorMixin, BaseEstimator):
    """Predicts what another run of the same motion measured at the same moment."""

    def __init__(self, time=None, torque=None):
        self.time = time
        self.torque = torque

    def fit(self, X, y=None):
        self.fitted_ = True
        return self

    def predict(self, X):
        moments = X["time"].to_numpy() - X["time"].iloc[0]
        return np.column_stack([np.interp(moments, self.time, t) for t in self.torque.T])


def lwr4_twice() -> Diagnosis:
    """Run 1 against run 2 of the same motion: nothing is to be found."""
    folder = DATA / "kuka_lwr4"
    one, two = (load_recording(folder / "kuka_lwr4.npz", run=k).frame for k in (0, 1))
    moments = two["time"].to_numpy() - two["time"].iloc[0]
    shift = _best_shift(one, two)
    other = _OtherRun(moments - shift, torques(two, 7).to_numpy()).fit(one)
    columns = ["time", "trajectory", *(f"{s}{j}" for s in ("q", "dq") for j in range(1, 8))]
    robot = Robot.from_urdf(folder / "kuka_lwr4_min.urdf")
    other.time_column = "time"
    # The stamps lie 30 us around even steps, which changes nothing here.
    return diagnose(_Plain(other), one[columns], torques(one, 7), robot=robot, force=True)


class _Plain(RegressorMixin, BaseEstimator):
    """A fitted regressor without attributes of its own that name columns."""

    def __init__(self, regressor=None):
        self.regressor = regressor

    def fit(self, X, y=None):
        return self

    def predict(self, X):
        return self.regressor.predict(X)


def _best_shift(one, two) -> float:
    """Delay of the second run, s, by the least difference of positions."""
    a = one["time"].to_numpy() - one["time"].iloc[0]
    b = two["time"].to_numpy() - two["time"].iloc[0]
    q1, q2 = (f[[f"q{j}" for j in range(1, 8)]].to_numpy() for f in (one, two))
    shifts = np.arange(-1.0, 1.0, 0.005)
    middle = (a > 2) & (a < a[-1] - 2)

    def distance(shift: float) -> float:
        moved = np.column_stack([np.interp(a + shift, b, q) for q in q2.T])
        return float(np.sum((moved - q1)[middle] ** 2))

    return float(shifts[np.argmin([distance(s) for s in shifts])])


def double_pendulum() -> Diagnosis:
    """Swing-ups on hardware without a disturbance; torque as read by the drives."""
    frame = load_recording(DATA / "dfki" / "double_pendulum_perturbed.npz").frame
    robot = chain(
        ("revolute", "0 1 0", "0 0 0", 0.523, "0 0 -0.2"),
        ("revolute", "0 1 0", "0 0 -0.2", 0.626, "0 0 -0.256"),
    )
    columns = ["time", "trajectory", "q1", "q2", "dq1", "dq2"]
    model = RBDRegressor(robot, ("viscous", "coulomb", "offset", "rotor_inertia"))
    return diagnose(model, frame[columns], torques(frame, 2))


#: Name: (recording, what is known, kinds that count as right).
CASES: dict[str, tuple[Callable[[], Diagnosis], str, set[str]]] = {
    "UR10e payload": (ur10e_payload, "payload 2.805 kg in one run of two", {"payload"}),
    "UR10e warm-up": (
        ur10e_warm_up,
        "viscous friction of joint 4 falls by 8 % with uptime",
        {"friction_drift"},
    ),
    "dVRK 105 g": (
        dvrk_weight,
        "105 g on the pitch link in one run of two",
        {"payload", "external_wrench"},
    ),
    "EMPS": (emps, "friction differs by direction", {"asymmetric_friction"}),
    "TX40": (
        tx40,
        "rotor inertias; joints 5 and 6 coupled",
        {"rotor_inertia", "coupled_friction", "coupled_inertia"},
    ),
    "XL330": (
        xl330,
        "friction grows with load; m g l = 0.481 N m",
        {"load_dependent_friction"},
    ),
    "worm drive": (screw_drive_3, "Stribeck friction, 2.08 to 1.83 mN m", {"stribeck"}),
    "LWR4+ twice": (lwr4_twice, "nothing: the same motion twice", set()),
    "double pendulum": (double_pendulum, "nothing planted", set()),
}


def _mass_is_known(payload: Finding) -> bool:
    return abs(payload.parameters["mass"]["value"] - 2.805) < 0.1 * 2.805


def _run_is_loaded(payload: Finding) -> bool:
    return payload.trajectories == (1,)  # run 1 carries the weight


#: What else a finding of the right kind must get right.
CHECKS: dict[str, Callable[[Finding], bool]] = {
    "UR10e payload": _mass_is_known,
    "dVRK 105 g": _run_is_loaded,
}


def gravity_moment(diagnosis: Diagnosis) -> float:
    """Largest gravity torque of a single pendulum about a horizontal axis, N m."""
    names = list(diagnosis.model.coef_names_)
    moments = [diagnosis.model.coef_[names.index(f"mc{axis}_link1")] for axis in "xz"]
    return 9.81 * float(np.hypot(*moments))


def main() -> None:
    warnings.simplefilter("ignore")
    chosen = sys.argv[1:] or list(CASES)
    for name in chosen:
        make, truth, right = CASES[name]
        start = time.perf_counter()
        try:
            diagnosis = make()
        except FileNotFoundError as error:
            print(f"{name}: left out ({error})")
            continue
        kinds = [f.kind for f in diagnosis.findings]
        if not right:
            verdict = "right" if not kinds else "finds something"
        else:
            check = CHECKS.get(name, lambda finding: True)
            found = [f.kind in right and check(f) for f in diagnosis.findings]
            verdict = "right" if found[:1] == [True] else "among others" if any(found) else "miss"
        drop = 1 - np.mean(diagnosis.rmse_after / np.maximum(diagnosis.rmse_before, 1e-300))
        print(f"{name}: {truth}")
        print(f"   {verdict}; error -{drop:.0%}; {time.perf_counter() - start:.0f} s")
        print(f"   verdict: {diagnosis.verdict}; unexplained: {diagnosis.unexplained}")
        for finding in diagnosis.findings:
            sure = "" if finding.confidence is None else f" (confidence {finding.confidence:.2f})"
            print(f"   found: {finding.sentence}{sure}")
        if name == "XL330":
            print(f"   load: m g l = {gravity_moment(diagnosis):.3f} N m in the final model")
        for note in diagnosis.warnings:
            print(f"   note: {note}")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
