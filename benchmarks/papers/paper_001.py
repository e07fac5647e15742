# SPDX-License-Identifier: BSD-3-Clause
"""Tables 2 and 3 of paper 001 (RBD, NDL, SDL) in form, on the UR10e.

    SKIDYN_DATA=... python benchmarks/papers/paper_001.py

The UR5 data of the paper is not public; thirteen unloaded UR10e runs stand in, in five folds by
recording. Printed are the RMSE of every fold (table 2), its mean over the range of the torque
(table 3), the same with physics that has friction and further effects, what the networks' scaling
and number of epochs do, and an interval over recordings.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
import time

import numpy as np
from _common import load_ur10e, print_table
from numpy.typing import NDArray
from sklearn.base import clone

from skidyn.identification import RBDRegressor
from skidyn.metrics import paired_comparison, trajectory_errors
from skidyn.model_selection import TrajectoryKFold
from skidyn.neural_network import NDLRegressor, SDLRegressor

JOINTS = [f"J{j}" for j in range(1, 7)]
PAPER = {
    "paper RBD (UR5)": [0.0599, 0.0262, 0.0473, 0.1126, 0.1357, 0.0649],
    "paper NDL (UR5)": [0.0531, 0.0250, 0.0359, 0.0674, 0.0991, 0.0626],
    "paper SDL (UR5)": [0.0372, 0.0178, 0.0241, 0.0589, 0.0937, 0.0578],
}
FRICTION = ("viscous", "coulomb", "offset", "rotor_inertia")
#: Kinds that the diagnosis adds in ``learners_on_physics.py --only ur10e``, simplest forms.
EFFECTS = (*FRICTION, ("load_dependent_friction", [2, 3]), "nonlinear_viscous", "dahl")


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--epochs", type=int, default=20)
    parser.add_argument("--models", nargs="*", help="only models whose names hold one of these")
    options = parser.parse_args()
    robot, X, y, _ = load_ur10e(keep_every=4)
    folds = list(TrajectoryKFold(5).split(X))
    friction, effects = (RBDRegressor(robot, terms) for terms in (FRICTION, EFFECTS))
    network = {"max_epochs": options.epochs, "random_state": 0}
    quick = {"max_epochs": 10, "random_state": 0}
    models = {
        "RBD": RBDRegressor(robot, ()),
        "NDL": NDLRegressor(**network),
        "SDL": SDLRegressor(robot, residual=False, **network),
        "SDL, residual": SDLRegressor(robot, **network),
        "RBD + friction": friction,
        "SDL on friction, residual": SDLRegressor(friction, **network),
        "RBD + effects": effects,
        "SDL on effects": SDLRegressor(effects, residual=False, **network),
        "SDL on effects, residual": SDLRegressor(effects, **network),
        "NDL, 10 epochs": NDLRegressor(**quick),
        "NDL, 10 epochs, 0 to 1": NDLRegressor(scaling="minmax", **quick),
        "SDL, residual, 10 epochs": SDLRegressor(robot, **quick),
        "SDL, residual, 10 epochs, 0 to 1": SDLRegressor(robot, scaling="minmax", **quick),
    }
    if options.models:
        wanted = [name for name in models if any(part in name for part in options.models)]
        models = {name: models[name] for name in {"RBD + friction": 0} | dict.fromkeys(wanted, 0)}
    recording = X["trajectory"].to_numpy(int)
    by_fold: list[dict[str, NDArray]] = [{} for _ in folds]
    rmse, errors = {}, {}
    for name, model in models.items():
        start = time.perf_counter()
        prediction: NDArray = np.zeros_like(y)
        for k, (train, test) in enumerate(folds):
            prediction[test] = clone(model).fit(X.iloc[train], y[train]).predict(X.iloc[test])
            squares = ((y[test] - prediction[test]) ** 2).mean(axis=0)
            by_fold[k][name] = np.sqrt(np.append(squares, squares.mean()))
        rmse[name] = np.sqrt(((y - prediction) ** 2).mean(axis=0))
        errors[name] = trajectory_errors(y, prediction, recording)[1]
        print(f"{name}: {time.perf_counter() - start:.0f} s", flush=True)
    for k, rows in enumerate(by_fold, 1):
        print_table(f"Table 2, cross {k}: RMSE, N m", rows, [*JOINTS, "all"])
    average = {name: np.mean([rows[name] for rows in by_fold], axis=0) for name in models}
    print_table("Table 2, cross average: RMSE, N m", average, [*JOINTS, "all"])
    span = np.ptp(y, axis=0)
    ratios = {name: values[:6] / span for name, values in average.items()}
    print_table("Table 3: cross average over range", PAPER | ratios, JOINTS)
    print("\n**RMSE relative to RBD + friction** (mean over joints; interval over recordings)\n")
    for name in models:
        mean = (rmse[name] / rmse["RBD + friction"]).mean()
        print(
            f"{name:34s} {mean:.3f}   {paired_comparison(errors['RBD + friction'], errors[name])}"
        )


if __name__ == "__main__":
    main()
