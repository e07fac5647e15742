# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn.diagnosis.diagnose`` with default options and the clock that the check recommends."""

import numpy as np
from _prepare import read_as_told

from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor
from skidyn.robots import Robot

PACKAGE = "skidyn"
KEYS = ("kind", "joints", "variables", "trajectories", "confidence")


def answer(log, robot) -> dict:
    robot = Robot.from_urdf(robot)
    frame = read_as_told(log.folder, robot)
    torques = [f"tau{j + 1}" for j in range(robot.n_joints)]
    part = frame[log.use]
    base = [kind for kind in log.base_model if kind != "rigid_body"]
    found = diagnose(RBDRegressor(robot, base), part.drop(columns=torques), part[torques])
    report = found.to_dict()
    effects = [
        {k: e[k] for k in KEYS if e.get(k) is not None}
        | {"parameters": {k: p["value"] for k, p in e["parameters"].items()}}
        for e in report["effects"]
    ]

    def predict(other) -> list[np.ndarray]:
        torque = found.model.predict(frame.drop(columns=torques))
        return [rows.from_samples(torque[:, j]) for j, rows in enumerate(other.joints)]

    said = {"verdict": report["verdict"], "effects": effects}
    return said | {"predict": predict, "model": found.model}
