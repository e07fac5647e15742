# SPDX-License-Identifier: BSD-3-Clause
"""Papers 001 (NDL, SDL) and 002 (ELM) in form, on the UR10e, with recordings held out.

    SKIDYN_DATA=... python benchmarks/papers/paper_001.py

The UR5 data of paper 001 is not public. Thirteen unloaded UR10e runs of eight dates stand in; folds
are pairs of dates. Prints RMSE over range (table 3), RMSE (table 2), each model's error relative to
the plain physics with an interval over recordings, error against the number of training recordings
(which paper 002 promised), and what random rows would have claimed.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
import time

import numpy as np
from _common import BASE, COMPLETE, LinearPhysics, load_ur10e, print_table
from numpy.typing import NDArray
from sklearn.base import clone
from sklearn.ensemble import HistGradientBoostingRegressor
from sklearn.model_selection import KFold
from sklearn.multioutput import MultiOutputRegressor

from skidyn.committee import ELMCommittee
from skidyn.hybrid import HybridRegressor
from skidyn.metrics import paired_comparison, trajectory_errors
from skidyn.model_selection import TrajectoryKFold, leakage_report, trajectory_learning_curve
from skidyn.neural_network import LSTMRegressor, NDLRegressor, SDLRegressor

JOINTS = [f"J{j}" for j in range(1, 7)]
PAPER = {
    "paper RBD (UR5)": [0.0599, 0.0262, 0.0473, 0.1126, 0.1357, 0.0649],
    "paper NDL (UR5)": [0.0531, 0.0250, 0.0359, 0.0674, 0.0991, 0.0626],
    "paper SDL (UR5)": [0.0372, 0.0178, 0.0241, 0.0589, 0.0937, 0.0578],
}


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--epochs", type=int, default=15)
    parser.add_argument("--models", nargs="*", help="only models whose names hold one of these")
    options = parser.parse_args()
    robot, X, y, fold = load_ur10e()
    folds = [(np.flatnonzero(fold != k), np.flatnonzero(fold == k)) for k in np.unique(fold)]
    base, complete = LinearPhysics(robot, BASE), LinearPhysics(robot, COMPLETE)
    network = {"max_epochs": options.epochs, "batch_size": 8, "random_state": 0}
    boosting = MultiOutputRegressor(HistGradientBoostingRegressor(random_state=0))
    models = {
        "RBD, no friction": LinearPhysics(robot),
        "BASE": base,
        "completed physics": complete,
        "NDL": NDLRegressor(**network),
        "SDL as in the paper": SDLRegressor(robot, residual=False, **network),
        "SDL, residual": SDLRegressor(robot, **network),
        "SDL, residual, frozen": SDLRegressor(robot, rigid_body="frozen", **network),
        "ELM alone": ELMCommittee(random_state=0),
        "BASE + hybrid(own joints)": HybridRegressor(base),
        "completed + hybrid(own joints)": HybridRegressor(complete),
        "completed + hybrid(LSTM)": HybridRegressor(
            complete, LSTMRegressor(**network | {"max_epochs": options.epochs // 2}), cv=3
        ),
        "completed + hybrid(ELM)": HybridRegressor(complete, ELMCommittee(random_state=0)),
        "completed + hybrid(boosting)": HybridRegressor(complete, boosting),
    }
    if options.models:
        wanted = ("BASE", "completed physics", *options.models)
        models = {
            name: model
            for name, model in models.items()
            if name in wanted or any(part in name for part in options.models)
        }
    rmse, per_recording = {}, {}
    recording = X["trajectory"].to_numpy(int)
    for name, model in models.items():
        start = time.perf_counter()
        prediction: NDArray = np.zeros_like(y)
        for train, test in folds:
            prediction[test] = clone(model).fit(X.iloc[train], y[train]).predict(X.iloc[test])
        rmse[name] = np.sqrt(((y - prediction) ** 2).mean(axis=0))
        per_recording[name] = trajectory_errors(y, prediction, recording)[1]
        print(f"{name}: {time.perf_counter() - start:.1f} s", flush=True)
    span = np.ptp(y, axis=0)
    print_table("Table 3: RMSE over range", PAPER | {k: v / span for k, v in rmse.items()}, JOINTS)
    print_table("Table 2: RMSE, N m", rmse, JOINTS)
    print(
        "\n**RMSE relative to BASE** (mean over joints; then with 95 % interval over recordings)\n"
    )
    for name, errors in per_recording.items():
        mean = (rmse[name] / rmse["BASE"]).mean()
        print(f"{name:32s} {mean:.3f}   {paired_comparison(per_recording['BASE'], errors)}")
    print("\n**and relative to the completed physics**\n")
    for name in models:
        if name.startswith("completed"):
            pair = per_recording["completed physics"], per_recording[name]
            if name != "completed physics":
                print(f"{name:32s} {paired_comparison(*pair)}")

    print("\n**R2 against the number of training recordings** (5 folds by recording)\n")
    for name in ("BASE", "completed physics", "ELM alone"):
        if name not in models:
            continue
        curve = trajectory_learning_curve(models[name], X, y, random_state=0)
        scores = ", ".join(
            f"{n}: {s:.4f}"
            for n, s in zip(curve.n_trajectories, curve.test_scores.mean(axis=1), strict=True)
        )
        print(f"{name:20s} {scores}")

    print("\n**What random rows would have claimed** (R2)\n")
    for name in ("completed physics", "ELM alone"):
        if name not in models:
            continue
        report = leakage_report(
            models[name], X, y,
            cv=KFold(5, shuffle=True, random_state=0), honest_cv=TrajectoryKFold(5),
        )  # fmt: skip
        print(f"{name}: random rows {report.claimed.mean():.4f}, honest {report.honest.mean():.4f}")
    print(report.message)


if __name__ == "__main__":
    main()
