# SPDX-License-Identifier: BSD-3-Clause
"""Rows of a log for methods without a robot model: columns of skidyn's catalogue, and signals.

They get the columns from which skidyn itself chooses, with the base model projected out, so that
only the choice differs.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from _log import HELD_OUT

from skidyn._signals import read_signals
from skidyn._writing import replacing
from skidyn.diagnosis import catalogue_candidates
from skidyn.effects import make_terms, searched_kinds
from skidyn.evidence import make_problem
from skidyn.logs import check_log, read_log
from skidyn.robots import Robot

#: Directions of the base model that the log excites less than this stay as in the URDF.
OPEN = 1e-3


def read_as_told(case: Path, robot: Robot):
    """Read the log with the remedy that its check names, as a user would do after a refusal.

    Clocks are the only mistake of the suite's logs that is certain enough for a refusal.
    """
    file = [str(case / "log.parquet")]
    frame = read_log(file, robot=robot)
    for doubt in check_log(frame, robot).checks:
        advice = doubt.remedy.code if doubt.certainty == "certain" and doubt.remedy else ""
        if advice == "clock='regular'":
            return read_log(file, robot=robot, clock="regular")
    return frame


def prepare(case: Path) -> Path:
    """``prepared/NAME.npz`` of a case, which :func:`_log.read` reads."""
    out = case.parents[1] / "prepared" / f"{case.name}.npz"
    if out.exists():
        return out
    robot = Robot.from_urdf(case / "robot.urdf")
    frame = read_as_told(case, robot)
    tau = frame[[f"tau{j + 1}" for j in range(robot.n_joints)]].to_numpy()
    base = json.loads((case / "meta.json").read_text())["base_model"]
    base = [kind for kind in base if kind != "rigid_body"]
    recorded, torque = read_signals(frame, tau, robot)
    terms = make_terms(base, robot.n_joints)
    problem = make_problem(recorded, torque, robot=robot, rigid_body=True, terms=terms)
    problem.set_fit(problem.fit(terms, passes=3))
    pool = [c for c in catalogue_candidates(problem, searched_kinds()) if c.kind not in base]
    design = problem.design([problem.term_rows(t) for t in terms])
    signals = problem.signals  # smoothed
    motion = {"q": signals.q, "dq": signals.dq, "ddq": signals.ddq, "tau": torque}
    keys = {"trajectory": signals.trajectory, "time": signals.time}
    late = np.unique(signals.trajectory)[-HELD_OUT]
    store: dict[str, np.ndarray] = motion | keys
    signal_names, features = _signals(signals)
    for j in range(robot.n_joints):
        own = [c for c in pool if j in c.joints]
        kinds = [
            (c.kind, [i + 1 for i in c.joints]) for c in own for _ in range(c.rows[j].shape[1])
        ]
        matrix = np.column_stack([*(c.rows[j] for c in own), problem.target[j]])
        rows = problem.rows
        weights = rows.weights[j].tocsr()
        shared = {
            "signals": rows.average(features, j) / rows.average(np.ones((len(features), 1)), j),
            "trajectory": rows.trajectory[j],
            "data": weights.data,
            "indices": weights.indices,
            "indptr": weights.indptr,
        }
        every = np.ones(len(matrix), bool)
        for view, use in (("whole", every), ("split", rows.trajectory[j] < late)):
            part = _swept(matrix, design[j], use, kinds) | shared
            measured = rows.average(torque[:, j], j)
            part["base"] = measured - part["scale"] * part["torque"]
            part["names"] = np.array(
                json.dumps({"columns": part["names"], "signals": signal_names})
            )
            store |= {f"{view}{j}_{key}": value for key, value in part.items()}
    with replacing(out) as file:
        np.savez(file, **store)
    return out


def _swept(matrix: np.ndarray, base: np.ndarray, use: np.ndarray, kinds: list) -> dict:
    """Columns and torque without the base model, in units of their size in the used rows."""
    base = base / np.maximum(np.linalg.norm(base[use], axis=0), 1e-12)
    mimic = np.linalg.lstsq(base[use], matrix[use], rcond=OPEN)[0]
    swept = matrix - base @ mimic
    root = np.sqrt(use.sum())
    size = np.linalg.norm(swept[use], axis=0) / root
    whole = np.maximum(np.linalg.norm(matrix[use], axis=0) / root, 1e-12)
    seen = np.flatnonzero(size[:-1] > 1e-5 * whole[:-1])
    scale = max(float(size[-1]), 1e-12)
    return {
        "names": [kinds[i] for i in seen],
        "columns": (swept[:, seen] / size[seen]).astype(np.float32),
        "torque": swept[:, -1] / scale,
        "scale": np.array(scale),
    }


def _signals(signals) -> tuple[list[str], np.ndarray]:
    """Names and values of the signals for learners, (n_samples, n_signals)."""
    parts = {"q": signals.q, "dq": signals.dq, "ddq": signals.ddq}
    if signals.temperature is not None:
        parts["temp"] = signals.temperature
    names = [f"{key}{j + 1}" for key, values in parts.items() for j in range(values.shape[1])]
    start = {g: signals.time[signals.trajectory == g].min() for g in np.unique(signals.trajectory)}
    since = signals.time - np.array([start[g] for g in signals.trajectory])
    clocks = np.column_stack([signals.time, since])
    return [*names, "time", "time since start"], np.hstack([*parts.values(), clocks])
