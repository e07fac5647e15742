# SPDX-License-Identifier: BSD-3-Clause
"""Comparison of learners with physics completed by a diagnosis.

    SKIDYN_DATA=... python benchmarks/papers/learners_on_physics.py --only emps --learners ELM

Held-out recordings (pairs of dates for the UR10e, quarters of the path for the Panda, blocks for
EMPS) of five logs. In every fold the physics is completed by a diagnosis of the training rows only;
learners are added by HybridRegressor with its defaults. The script prints the RMSE relative to BASE
(least squares of rigid body and plain friction on low-passed signals), and relative to the
learner's own physics with a 95 % interval over recordings. The practice logs are simulated; they
are in a folder next to the recordings (``../practice``).
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
import time
import warnings
from collections import defaultdict
from typing import Any

import numpy as np
from _common import REST, Array, LinearPhysics, print_table
from _logs import LOGS, RecordedLog
from sklearn.base import clone
from sklearn.ensemble import HistGradientBoostingRegressor
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel
from sklearn.multioutput import MultiOutputRegressor
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from skidyn.committee import ELMCommittee
from skidyn.hybrid import HybridRegressor
from skidyn.metrics import paired_comparison, rmse_over_range, trajectory_errors
from skidyn.neural_network import BLLRegressor, LSTMRegressor, SDLRegressor


class ThinnedGaussianProcess(GaussianProcessRegressor):
    """A Gaussian process of at most 700 evenly spaced rows: its cost grows with their cube."""

    def fit(self, X: Array, y: Array) -> ThinnedGaussianProcess:
        """Fit the process to every so many rows."""
        rows = np.unique(np.linspace(0, len(X) - 1, 700).astype(int))
        return super().fit(X[rows], y[rows])


def learners(epochs: int) -> dict[str, Any]:
    """Learners that come on top of a physics."""
    kernel = ConstantKernel(1.0) * RBF(3.0) + WhiteKernel(0.3)
    process = ThinnedGaussianProcess(kernel, optimizer=None, normalize_y=True)
    network = LSTMRegressor(hidden_size=16, max_epochs=epochs, random_state=0)
    boosting = HistGradientBoostingRegressor(max_iter=60, max_leaf_nodes=15, random_state=0)

    return {
        "own joints": None,
        "boosting": MultiOutputRegressor(boosting),
        "Gaussian process": make_pipeline(StandardScaler(), process),
        "ELM": ELMCommittee(p=0.9, random_state=0),
        "LSTM": network,
        "BLL": BLLRegressor(network, n_estimators=4, random_state=0),
        "SDL": None,
    }


def compare(log: RecordedLog, wanted: list[str], alpha: float, epochs: int) -> None:
    """Print one table."""
    X, y = log.X, log.y
    print(f"\n**{log.title}** ({len(X)} rows, {y.shape[1]} joints)\n", flush=True)
    predicted: dict[Any, Array] = defaultdict(lambda: np.zeros_like(y))
    kept = defaultdict(list)
    effects = tuple((kind, ()) for kind in log.effects)
    for train, test in log.outer.split(X, y):
        training, unseen = X.iloc[train], X.iloc[test]

        def predict(model: Any) -> Array:
            return np.reshape(model.predict(unseen), (len(unseen), -1))  # noqa: B023

        start = time.perf_counter()
        base = LinearPhysics(log.robot, effects).fit(training, y[train])
        predicted["BASE", ""][test] = predict(base)
        plain, completed, added = log.physics(train)
        print("training rows of one fold:", ", ".join(added), flush=True)
        for name, physics in (("plain", plain), ("completed", completed)):
            predicted[name, ""][test] = predict(clone(physics).fit(training, y[train]))
            for learner in wanted:
                if learner == "SDL":  # has its own way to fall back, and no gate
                    model: Any = SDLRegressor(
                        physics.model, scaling="standard", max_epochs=epochs, random_state=0
                    )
                else:
                    model = HybridRegressor(
                        physics, learners(epochs)[learner], cv=log.inner, alpha=alpha
                    )
                model.fit(training, y[train])
                predicted[name, learner][test] = predict(model)
                weight = getattr(model, "learned_weight_", np.ones(y.shape[1]))
                kept[name, learner].append(int((weight > 0).sum()))
        print(f"  {time.perf_counter() - start:.0f} s", flush=True)

    base_rmse = np.sqrt(((y - predicted["BASE", ""]) ** 2).mean(axis=0))
    errors = {k: trajectory_errors(y, p, log.units())[1] for k, p in predicted.items()}
    print("\n| model | mean RMSE | relative to BASE | against its physics | joints kept |")
    print("|---|---|---|---|---|")
    for (name, learner), prediction in predicted.items():
        rmse = np.sqrt(((y - prediction) ** 2).mean(axis=0))
        against = ""
        if learner:
            against = str(paired_comparison(errors[name, ""], errors[name, learner]))
        elif name == "completed":
            against = f"{paired_comparison(errors['plain', ''], errors[name, ''])}, on plain"
        joints = " ".join(map(str, kept[name, learner])) if learner else ""
        label = f"{name} + {learner}" if learner else name
        print(
            f"| {label} | {rmse.mean():.4f} | {(rmse / base_rmse).mean():.3f} | {against} "
            f"| {joints} |",
            flush=True,
        )
    joints = [f"J{j + 1}" for j in range(y.shape[1])]
    print_table(
        "RMSE over the range of the torque",
        {
            " + ".join(filter(None, key)): rmse_over_range(y, p, multioutput="raw_values")
            for key, p in predicted.items()
        },
        joints,
    )
    squares = (y - predicted["completed", ""]) ** 2
    rest = np.abs(X.filter(regex=r"^dq\d+$").to_numpy()) < REST
    rows = {
        "share of the time": rest.mean(axis=0),
        "share of the squared error": (squares * rest).sum(axis=0) / squares.sum(axis=0),
    }
    print_table(f"Completed physics below {REST} rad/s (m/s)", rows, joints)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", nargs="+", choices=list(LOGS), default=list(LOGS))
    parser.add_argument(
        "--learners", nargs="*", choices=list(learners(1)), default=list(learners(1))
    )
    parser.add_argument("--alpha", type=float, default=0.05, help="level of the hybrid's gate")
    parser.add_argument("--epochs", type=int, default=10, help="of the networks")
    options = parser.parse_args()
    warnings.filterwarnings("ignore", category=UserWarning)  # remarks of the diagnosis on the data
    for name in options.only:
        compare(LOGS[name](), options.learners, options.alpha, options.epochs)


if __name__ == "__main__":
    main()
