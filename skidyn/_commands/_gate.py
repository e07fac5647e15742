# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn compare --fail-above``: test for a change since a healthy recording."""

from __future__ import annotations

import argparse
import warnings
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from skidyn._commands._input import read_inputs
from skidyn._commands._kept import noting
from skidyn._commands._output import print_json
from skidyn._exceptions import LogWarning, SkidynError
from skidyn._text import listed

if TYPE_CHECKING:
    import pandas as pd

#: A joint moves above this share of the speed that it exceeds in 5 % of the healthy recording.
MOVING = 0.05
FOLDS = 4


def gate(options: argparse.Namespace) -> bool:
    """Print the ratio of errors of every joint; True if none is above the limit."""
    _check(options)
    healthy = argparse.Namespace(**{**vars(options), "logs": options.against})
    with noting() as noted:  # suspicions would hide the error below
        _, _, usual_frame, usual_tau, _ = read_inputs(healthy)
    n_trajectories = usual_frame["trajectory"].nunique()
    if n_trajectories < 2:
        raise SkidynError(
            "--against has one trajectory, but the usual error is measured on trajectories left "
            "out of the fit: give at least two"
        )
    for note in noted:
        warnings.warn(note, LogWarning, stacklevel=2)
    robot, model, frame, tau, _ = read_inputs(options)
    from skidyn.metrics import drift
    from skidyn.model_selection import TrajectoryKFold

    folds = TrajectoryKFold(min(FOLDS, n_trajectories)).split(usual_frame, usual_tau)
    result = drift(
        model,
        frame,
        tau,
        usual_frame,
        usual_tau,
        moving=_moving(frame, usual_frame, tau.shape[1]),
        folds=list(folds),
    )
    failed = result.drifted(options.fail_above)
    joints = [
        {
            "joint": j + 1,
            "name": name,
            "reference_rmse": float(result.reference[j]),
            "rmse": float(result.error[j]),
            "ratio": float(result.ratio[j]),
            "failed": bool(failed[j]),
        }
        for j, name in enumerate(robot.joint_names)
    ]
    if options.junit:
        _write_junit(options.junit, joints, options.fail_above)
    if options.json:
        print_json({"passed": not failed.any(), "limit": options.fail_above, "joints": joints})
    else:
        _print(joints, options.fail_above)
    return not failed.any()


def _check(options: argparse.Namespace) -> None:
    if options.fail_above is None:
        raise SkidynError("--junit writes the result of --fail-above; give both")
    if not options.fail_above > 0:
        raise SkidynError(f"--fail-above is {options.fail_above:g}; expected a ratio above 0")
    if not options.against:
        raise SkidynError("--fail-above needs a healthy recording: --against LOG [LOG ...]")
    if not options.urdf:
        raise SkidynError("--urdf is missing: give the description of the robot")
    if options.against_model or options.html or options.names or options.traces:
        raise SkidynError(
            "--fail-above makes no page: leave out --against-model, --html, --names, --traces"
        )


def _moving(
    frame: pd.DataFrame, usual: pd.DataFrame, n_joints: int
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Samples in motion, because dry friction at rest may have any torque."""
    columns = [f"dq{j + 1}" for j in range(n_joints)]
    speeds = [np.abs(f[columns].to_numpy()) for f in (frame, usual)]
    least = MOVING * np.quantile(speeds[1], 0.95, axis=0)
    return speeds[0] > least, speeds[1] > least


def _print(joints: list[dict[str, Any]], limit: float) -> None:
    print("ratio of the error on the new recording to the usual error, while the joint moves")
    print(f"  {'':24s} {'usual':>10s} {'new':>10s} {'ratio':>7s}")
    for j in joints:
        mark = "  changed" if j["failed"] else ""
        numbers = f"{j['reference_rmse']:10.4g} {j['rmse']:10.4g} {j['ratio']:7.2f}"
        print(f"  {j['name']:24s} {numbers}{mark}")
    names = [j["name"] for j in joints if j["failed"]]
    if names:
        print(f"failed: the error of {listed(names)} is above {limit:g} times the usual one")
    else:
        print(f"passed: the error of no joint is above {limit:g} times the usual one")


def _write_junit(path: str, joints: list[dict[str, Any]], limit: float) -> None:
    """Result in the JUnit format of most build servers: one test per joint."""
    from skidyn._writing import write_bytes

    n_failed = sum(j["failed"] for j in joints)
    suite = ElementTree.Element(
        "testsuite", name="skidyn compare", tests=str(len(joints)), failures=str(n_failed)
    )
    for j in joints:
        test = ElementTree.SubElement(suite, "testcase", classname="skidyn.drift", name=j["name"])
        if j["failed"]:
            message = f"error {j['ratio']:.2f} times the usual one, limit {limit:g}"
            ElementTree.SubElement(test, "failure", message=message)
    write_bytes(path, ElementTree.tostring(suite, encoding="utf-8", xml_declaration=True))
