# SPDX-License-Identifier: BSD-3-Clause
"""Measure every learner with its defaults on real and simulated robots.

    SKIDYN_DATA=... python benchmarks/learners/defaults.py

It prints the error on held-out parts: RMSE over the standard deviation of the torque, mean over the
joints. Physics is ``RBDRegressor`` with plain friction; "Ridge" is ten lines of scikit-learn on the
columns of rigid body and friction. ``--unseen`` uses the logs that were not used to develop the
learners, ``--fresh`` simulated ones that were used for nothing; ``--only`` selects logs,
``--models`` estimators, ``--joints`` prints joints.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
import time
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from _logs import FRESH, LOGS, UNSEEN, Array, Log
from sklearn.ensemble import HistGradientBoostingRegressor
from sklearn.linear_model import RidgeCV
from sklearn.multioutput import MultiOutputRegressor
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from skidyn.committee import ELMCommittee
from skidyn.diagnosis import EffectSearchCV
from skidyn.hybrid import HybridRegressor
from skidyn.identification import RBDRegressor
from skidyn.neural_network import BLLRegressor, LSTMRegressor, NDLRegressor, SDLRegressor
from skidyn.preprocessing import DropKeys


class RidgeOnColumns:
    """What a user of scikit-learn writes in ten lines: one ridge for each joint."""

    def __init__(self, log: Log) -> None:
        self.log = log

    def columns(self, X: Any, joint: int) -> Array:
        """Columns of the rigid body, of friction, rotor and offset of one joint."""
        robot = self.log.robot
        q, dq, ddq = (X.filter(regex=rf"^{s}\d+$").to_numpy() for s in ("q", "dq", "ddq"))
        own = np.c_[dq[:, joint], np.sign(dq[:, joint]), ddq[:, joint]]
        return np.c_[robot.torque_regressor(q, dq, ddq)[:, joint], own]

    def fit(self, X: Any, y: Array) -> RidgeOnColumns:
        """Fit every joint."""
        make = lambda: make_pipeline(StandardScaler(), RidgeCV(np.logspace(-6, 2, 9)))  # noqa: E731
        self.joints = [make().fit(self.columns(X, j), y[:, j]) for j in range(y.shape[1])]
        return self

    def predict(self, X: Any) -> Array:
        """Predict every joint."""
        return np.stack([m.predict(self.columns(X, j)) for j, m in enumerate(self.joints)], axis=1)


def boosting() -> Any:
    """Boosted trees with their defaults, one for each joint, without the key columns."""
    return make_pipeline(
        DropKeys(), MultiOutputRegressor(HistGradientBoostingRegressor(random_state=0))
    )


def models(log: Log) -> dict[str, Callable[[], Any]]:
    """Every estimator with its defaults, and a rigid body that takes the data's word for all."""
    alone: dict[str, Callable[[], Any]] = {
        "HistGradientBoosting": boosting,
        "LSTM": lambda: LSTMRegressor(random_state=0),
        "NDL": lambda: NDLRegressor(random_state=0),
        "BLL": lambda: BLLRegressor(random_state=0),
        "ELM committee": lambda: ELMCommittee(random_state=0),
    }
    if log.robot is None:
        return alone

    def rbd() -> RBDRegressor:
        return RBDRegressor(log.robot, log.effects)

    return {
        "Ridge on columns": lambda: RidgeOnColumns(log),
        "RBD": rbd,
        "RBD without trust in the URDF": lambda: rbd().set_params(prior_std=np.inf),
        "effect search": lambda: EffectSearchCV(rbd()),
        "SDL(RBD)": lambda: SDLRegressor(rbd(), random_state=0),
        "hybrid, own joints": lambda: HybridRegressor(rbd()),
        "hybrid, boosting": lambda: HybridRegressor(rbd(), boosting()[-1]),
        "hybrid, ELM": lambda: HybridRegressor(rbd(), ELMCommittee(random_state=0)),
        "hybrid, LSTM": lambda: HybridRegressor(rbd(), LSTMRegressor(random_state=0)),
        "hybrid, BLL": lambda: HybridRegressor(rbd(), BLLRegressor(random_state=0)),
        **alone,
        "SDL(robot)": lambda: SDLRegressor(log.robot, random_state=0),
    }


def held_out_errors(log: Log, make: Callable[[], Any]) -> Array:
    """RMSE over standard deviation of every joint, on rows that were held out."""
    squares = np.zeros(log.y.shape)
    for train, test in log.splits():
        model = make().fit(log.X.iloc[train], log.y[train])
        predicted = np.reshape(model.predict(log.X.iloc[test]), (len(test), -1))
        squares[test] = (log.y[test] - predicted) ** 2
    return np.asarray(np.sqrt(squares.mean(axis=0)) / log.y.std(axis=0))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", nargs="+", choices=[*LOGS, *UNSEEN, *FRESH])
    parser.add_argument("--unseen", action="store_true")
    parser.add_argument("--fresh", action="store_true")
    parser.add_argument("--models", nargs="+")
    parser.add_argument("--joints", action="store_true", help="print every joint as well")
    options = parser.parse_args()
    warnings.filterwarnings("ignore")  # remarks on the data
    for name in options.only or (FRESH if options.fresh else UNSEEN if options.unseen else LOGS):
        log = {**LOGS, **UNSEEN, **FRESH}[name]()
        print(f"\n**{log.title}**: {len(log.X)} rows, {log.y.shape[1]} joints\n")
        joints = "joints | ", "---|"
        head, line = joints if options.joints else ("", "")
        print(f"| model | error | {head}s |\n|---|---|{line}---|", flush=True)
        for title, make in models(log).items():
            if options.models is None or title in options.models:
                start = time.process_time()
                errors = held_out_errors(log, make)
                spent = time.process_time() - start
                own = " ".join(f"{e:.3f}" for e in errors) + " | " if options.joints else ""
                print(f"| {title} | {errors.mean():.4f} | {own}{spent:.0f} |", flush=True)


if __name__ == "__main__":
    main()
