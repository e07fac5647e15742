# SPDX-License-Identifier: BSD-3-Clause
"""Paper 002 (classical identification, ELM) with the validation that it lacked, on the UR10e.

    SKIDYN_DATA=... python benchmarks/papers/paper_002.py

The paper trains and tests on one motion and promises validation with point-to-point motions and
curves over the amount of data. Here both models learn excitation runs; they are judged on runs of
other dates, and on a point-to-point run of another day. Fitted and judged on the same rows stands
beside it, as in the paper.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
from typing import Any

import numpy as np
from _common import (
    BASE,
    COMPLETE,
    LinearPhysics,
    load_ur10e,
    load_ur10e_point_to_point,
    print_table,
)
from numpy.typing import NDArray
from sklearn.base import clone
from sklearn.model_selection import KFold

from skidyn.committee import ELMCommittee
from skidyn.hybrid import HybridRegressor
from skidyn.model_selection import TrajectoryKFold, leakage_report, trajectory_learning_curve

JOINTS = [f"J{j}" for j in range(1, 7)]


def row(y: NDArray, prediction: NDArray) -> list[float]:
    rmse = np.sqrt(((y - prediction) ** 2).mean(axis=0))
    return [*rmse, rmse.mean()]


def main() -> None:
    argparse.ArgumentParser(description=__doc__).parse_args()
    robot, X, y, fold = load_ur10e(keep_every=4)
    elm = ELMCommittee(random_state=0)  # of the paper: ten machines, 500 units, p = 0.5
    base = LinearPhysics(robot, BASE)
    models: dict[str, Any] = {
        "classical (rigid body, friction)": base,
        "classical, completed": LinearPhysics(robot, COMPLETE),
        "ELM": elm,
        "ELM, weak ridge (p = 0.99)": ELMCommittee(p=0.99, random_state=0),
        "classical + ELM (hybrid)": HybridRegressor(base, clone(elm)),
    }
    other, torque = load_ur10e_point_to_point(keep_every=4)
    tables: dict[str, dict[str, list[float]]] = {
        "the training rows themselves, as in the paper": {},
        "excitation runs of other dates": {},
        "a point-to-point run": {},
    }
    for name, model in models.items():
        held_out = np.zeros_like(y)
        for k in np.unique(fold):
            train, test = fold != k, fold == k
            held_out[test] = clone(model).fit(X[train], y[train]).predict(X[test])
        fitted = clone(model).fit(X, y)
        predictions = (y, fitted.predict(X)), (y, held_out), (torque, fitted.predict(other))
        for rows, pair in zip(tables.values(), predictions, strict=True):
            rows[name] = row(*pair)
    for title, rows in tables.items():
        print_table(f"RMSE on {title}, N m", rows, [*JOINTS, "mean"])

    print("\n**R2 against the number of training recordings** (5 folds by recording)\n")
    for name in ("classical (rigid body, friction)", "classical, completed", "ELM"):
        curve = trajectory_learning_curve(models[name], X, y, random_state=0)
        scores = ", ".join(
            f"{n}: {s:.4f}"
            for n, s in zip(curve.n_trajectories, curve.test_scores.mean(axis=1), strict=True)
        )
        print(f"{name:32s} {scores}", flush=True)

    print("\n**What random rows would have claimed** (R2)\n")
    for name in ("classical, completed", "ELM", "ELM, weak ridge (p = 0.99)"):
        report = leakage_report(
            models[name], X, y,
            cv=KFold(5, shuffle=True, random_state=0), honest_cv=TrajectoryKFold(5),
        )  # fmt: skip
        print(f"{name}: random rows {report.claimed.mean():.4f}, honest {report.honest.mean():.4f}")


if __name__ == "__main__":
    main()
