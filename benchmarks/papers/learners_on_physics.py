# SPDX-License-Identifier: BSD-3-Clause
"""Ask whether a learner beats the physics that a diagnosis completed.

    SKIDYN_DATA=... python benchmarks/papers/learners_on_physics.py --only emps --learners ELM

Held-out recordings (pairs of dates for the UR10e, parts of the path for the Panda, blocks for EMPS)
of five logs; RMSE of every combination relative to the plain physics, and the learner against its
own physics with a 95 % interval over recordings. The practice logs are simulated; they are found
beside the recordings (``../practice``).
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
import json
from typing import Any

import numpy as np
import pandas as pd
from _common import (
    BASE,
    COMPLETE,
    DAHL,
    PANDA_PERIOD,
    LinearPhysics,
    data_dir,
    filtered_physics,
    load_emps,
    load_panda,
    load_ur10e,
    make_log,
)
from sklearn.base import clone
from sklearn.model_selection import PredefinedSplit

from skidyn.committee import ELMCommittee
from skidyn.hybrid import HybridRegressor
from skidyn.metrics import paired_comparison, trajectory_errors
from skidyn.model_selection import PhaseKFold, TrajectoryKFold
from skidyn.neural_network import LSTMRegressor
from skidyn.robots import Robot


def load_practice(case: str) -> tuple[Robot, pd.DataFrame, np.ndarray, tuple]:
    """Robot, X, torque and base effects of a simulated log."""
    folder = data_dir().parent / "practice" / "cases" / case
    frame = pd.read_parquet(folder / "log.parquet")
    meta = json.loads((folder / "meta.json").read_text())
    runs = []
    for _, run in frame.groupby("trajectory"):
        signals = [run.filter(regex=rf"^{s}\d+$").to_numpy() for s in ("q", "dq", "tau")]
        runs.append((run["time"].to_numpy(), *signals))
    rate = float(meta["nominal_rate_hz"])
    X, y = make_log(runs, rate=rate, cutoff=10.0, torque_cutoff=10.0, keep_every=2)
    effects = tuple((kind, ()) for kind in meta["base_model"] if kind != "rigid_body")
    return Robot.from_urdf(folder / "robot.urdf"), X, y, effects


LEARNERS = ("own joints", "ELM", "LSTM")
OPTIONS = argparse.Namespace(learners=LEARNERS, alpha=0.05)


def compare(
    title: str, models: dict[str, LinearPhysics], X: Any, y: Any, cv: Any, inner: Any
) -> None:
    """Print one table; `cv` is a splitter or the fold of every row."""
    print(f"\n**{title}** ({len(X)} rows, {y.shape[1]} joints)\n")
    if isinstance(cv, np.ndarray):
        cv = PredefinedSplit(cv)
    folds = list(cv.split(X, y))
    unit = X["trajectory"].to_numpy()
    if len(np.unique(unit)) == 1:
        unit = np.zeros(len(X), dtype=int)
        for k, (_, test) in enumerate(folds):
            unit[test] = k
    every = {
        "own joints": None,
        "ELM": ELMCommittee(p=0.9, random_state=0),
        "LSTM": LSTMRegressor(max_epochs=15, batch_size=8, random_state=0),
    }
    learners = {name: every[name] for name in OPTIONS.learners}
    first = None
    for physics_name, physics in models.items():
        own = None
        for learner_name, learner in {"": "none", **learners}.items():
            model: Any = physics
            if learner_name:
                model = HybridRegressor(physics, learner, cv=inner, alpha=OPTIONS.alpha)
            prediction = np.zeros_like(y)
            kept = []
            for train, test in folds:
                fitted = clone(model).fit(X.iloc[train], y[train])
                prediction[test] = fitted.predict(X.iloc[test])
                kept.append((getattr(fitted, "learned_weight_", np.zeros(1)) > 0).sum())
            rmse = np.sqrt(((y - prediction) ** 2).mean(axis=0))
            errors = trajectory_errors(y, prediction, unit)[1]
            first = rmse if first is None else first
            own = errors if own is None else own
            name, against = physics_name, ""
            if learner_name:
                name += f" + {learner_name}"
                against = f"   on its physics {paired_comparison(own, errors)}"
                against += f"   joints kept {np.mean(kept):.1f}"
            print(
                f"{name:32s} mean RMSE {rmse.mean():.4f}   to BASE {(rmse / first).mean():.3f}"
                f"{against}",
                flush=True,
            )


def plain(robot: Robot, base: tuple, completed: tuple) -> dict[str, LinearPhysics]:
    """Physics before and after an effect is added."""
    return {"BASE": LinearPhysics(robot, base), "completed": LinearPhysics(robot, completed)}


def ur10e() -> None:
    robot, every_row, torque, fold = load_ur10e(keep_every=1)
    filtered = filtered_physics(robot, every_row, COMPLETE, 5.0, 100.0, 4)
    X, y = every_row[::4].reset_index(drop=True), torque[::4]
    models = plain(robot, BASE, COMPLETE) | {"completed, filtered": filtered}
    compare("UR10e, pairs of dates held out", models, X, y, fold[::4], 5)


def panda() -> None:
    dahl = tuple(("dahl", (("presliding", width),)) for width in (0.01, 0.05, 0.2))
    completed = (*BASE, *dahl)
    robot, every_row, torque = load_panda(rate=1000.0)
    filtered = {
        f"{name}, filtered": filtered_physics(robot, every_row, effects, 10.0, 1000.0, 10)
        for name, effects in (("BASE", BASE), ("completed", completed))
    }
    X, y = every_row[::10].reset_index(drop=True), torque[::10]
    cv, inner = (PhaseKFold(n, period=PANDA_PERIOD) for n in (4, 5))
    models = plain(robot, BASE, completed) | filtered
    compare("Panda, parts of the path held out", models, X, y, cv, inner)


def emps() -> None:
    robot, X, y = load_emps()
    short = tuple(("dahl", (("presliding", way),)) for way in (0.0003, 0.001, 0.005))
    base = BASE[:3]
    completed = (*base, ("asymmetric_friction", ()), *short)
    compare("EMPS, 8 blocks", plain(robot, base, completed), X, y, TrajectoryKFold(8), 7)


def dahl() -> None:
    robot, X, y, base = load_practice("practice_33")
    models = plain(robot, base, (*base, *DAHL))
    compare("Practice, Dahl friction", models, X, y, TrajectoryKFold(5), 5)


def unknown() -> None:
    robot, X, y, base = load_practice("practice_20")
    models = plain(robot, base, (*base, *COMPLETE[4:]))
    title = "Practice, an effect of no known kind (completed: friction added in vain)"
    compare(title, models, X, y, TrajectoryKFold(5), 5)


LOGS = {f.__name__: f for f in (ur10e, panda, emps, dahl, unknown)}


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", nargs="+", choices=list(LOGS), default=list(LOGS))
    parser.add_argument("--learners", nargs="*", choices=LEARNERS, default=LEARNERS)
    parser.add_argument("--alpha", type=float, default=0.05, help="level of the hybrid's gate")
    OPTIONS = parser.parse_args()
    for name in OPTIONS.only:
        LOGS[name]()
