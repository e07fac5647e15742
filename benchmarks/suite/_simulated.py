# SPDX-License-Identifier: BSD-3-Clause
"""Ratio of the errors of simulated motion of models to the base model's.

    python _simulated.py FOLDER CASE ...

A peer that can be simulated writes its model of all but the last two trajectories to
``models/PEER/case_017.json``, with ``bodies`` (a row for each joint: mass, its three
moments, and the inertia xx, xy, xz, yy, yz, zz about the joint's frame) and values of drives for
each joint (``viscous``, ``coulomb``, ``rotor_inertia``, ``offset``), or a model of skidyn,
``case_017.skops``. Every model starts on the last two trajectories every quarter of a second, with
the state of the log, under the torque of the log; one integrator runs them all.
"""

from __future__ import annotations

import json
import sys
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from _log import read
from _prepare import read_as_told

import skidyn
from skidyn.exceptions import SkidynError
from skidyn.identification import RBDRegressor
from skidyn.robots import Robot
from skidyn.simulation import judge_by_simulation

#: Time after which a model is set back to the state of the log, s.
PIECE = 0.25
DRIVES = ("viscous", "coulomb", "rotor_inertia", "offset")


def models(folder: Path, case: str) -> dict[str, Path]:
    """Files of the models of peers for a case."""
    found = sorted((folder / "models").glob(f"*/{case}.*"))
    return {file.parent.name: file for file in found}


def compare(folder: Path, case: str) -> dict[str, Any]:
    """Ratio of the error of every model's motion to the base model's, or why there is none."""
    place = folder / "cases" / case
    _, train, test = read(place)
    robot = Robot.from_urdf(place / "robot.urdf")
    frame = read_as_told(place, robot)
    torques = [f"tau{j + 1}" for j in range(robot.n_joints)]
    X, y = frame.drop(columns=torques), frame[torques]
    known = [kind for kind in train.base_model if kind != "rigid_body"]
    base = RBDRegressor(robot, known).fit(X[train.use], y[train.use])
    said: dict[str, Any] = {}
    for peer, file in models(folder, case).items():
        try:
            model = _model(file, robot, X[train.use], y[train.use])
            verdict = judge_by_simulation(base, model, X[test.use], y[test.use], horizon=PIECE)
            said[peer] = float(np.exp(verdict.change))
        except SkidynError as error:  # of that model: it cannot be run
            said[peer] = str(error)
    return said


def _model(file: Path, robot: Robot, X: Any, y: Any) -> RBDRegressor:
    """Read a model from a file; stored numbers of bodies and drives replace the fitted ones."""
    if file.suffix == ".skops":
        return skidyn.load_model(file)
    numbers = json.loads(file.read_text())
    model = RBDRegressor(robot, DRIVES).fit(X, y)
    model.inertial_parameters_ = np.array(numbers["bodies"], float)
    for term in model.effect_terms_:
        value = numbers[term.kind][term.places[0]]
        model.effect_coefficients_[term] = np.array([value], float)
    return model


def main() -> None:
    warnings.simplefilter("ignore")
    folder = Path(sys.argv[1])
    (folder / "simulated").mkdir(exist_ok=True)
    for case in sys.argv[2:]:
        told = json.dumps(compare(folder, case), indent=1)
        (folder / "simulated" / f"{case}.json").write_text(told)


if __name__ == "__main__":
    main()
