# SPDX-License-Identifier: BSD-3-Clause
"""The usual methods of selecting terms, and skidyn's, on the same columns of the same logs.

    python -m pip install pysindy
    python benchmarks/diagnosis/side_by_side.py [--jobs 2]

Every method gets the same averaged rows of the first eight trajectories: the torque and the columns
of every effect of the catalogue on its grid of shapes, with the rigid body and viscous and Coulomb
friction eliminated from both. It selects columns; the model with them is fitted to these
trajectories, and its error is measured on the two others, as a share of the base model's. The
answer is right if the hidden effect is among the selected ones on its joint (any member for the
hysteresis family); every other selected kind is a false alarm.
"""

from __future__ import annotations

import argparse
import sys
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from joblib import Parallel, delayed
from scipy.stats import f as f_distribution, false_discovery_control
from sklearn.linear_model import LassoCV
from sklearn.model_selection import GroupKFold

from skidyn._signals import read_signals
from skidyn.datasets import load_planar_arm, load_ur5, make_hidden_effect_log
from skidyn.diagnosis import catalogue_candidates, diagnose
from skidyn.effects import make_terms, searched_kinds
from skidyn.evidence import Problem, make_problem
from skidyn.identification import RBDRegressor

sys.path.append(str(Path(__file__).resolve().parents[1] / "suite"))
sys.path.append(str(Path(__file__).resolve().parents[1] / "peers"))
from stepwise_bic import forward_selection

ROBOTS = {"planar arm": (load_planar_arm, 2), "ur5": (load_ur5, 3)}
KINDS = (
    *("offset", "stribeck", "asymmetric_friction", "nonlinear_viscous", "load_dependent_friction"),
    *("dahl", "maxwell_slip", "position_dependent_friction", "spring", "end_stop"),
    *("temperature_friction", "torque_gain"),
)
BASE = ("viscous", "coulomb")
HELD_OUT = 2
NULLS = 3
HYSTERESIS = {"dahl", "lugre", "maxwell_slip"}


@dataclass
class Columns:
    """Rows of one joint: candidates and torque with the base model swept out."""

    kinds: list[str]
    train: np.ndarray
    torque: np.ndarray
    groups: np.ndarray
    test: np.ndarray
    test_torque: np.ndarray


def columns_of(log) -> tuple[Problem, list[Columns]]:
    """Rows of the log, and the candidates of every joint."""
    names = [f"tau{j + 1}" for j in range(log.robot.n_joints)]
    signals, torque = read_signals(log.X, log.y, log.robot)
    terms = make_terms(BASE, len(names))
    problem = make_problem(signals, torque, robot=log.robot, rigid_body=True, terms=terms)
    fit = problem.fit(terms, passes=3)
    problem.set_fit(fit)
    pool = [c for c in catalogue_candidates(problem, searched_kinds()) if len(c.joints) == 1]
    design = problem.design([problem.term_rows(t) for t in terms])
    last = np.unique(signals.trajectory)[-HELD_OUT]
    joints = []
    for j in range(len(names)):
        own = [c for c in pool if c.joints == (j,)]
        blocks = [c.rows[j] for c in own]
        kinds = [c.kind for c, b in zip(own, blocks, strict=True) for _ in range(b.shape[1])]
        matrix, y, base = np.hstack(blocks), problem.target[j], design[j]
        train = problem.rows.trajectory[j] < last
        mimic = np.linalg.lstsq(base[train], np.column_stack([matrix, y])[train], rcond=1e-9)[0]
        swept = np.column_stack([matrix, y]) - base @ mimic
        size = np.linalg.norm(swept[train, :-1], axis=0) / np.sqrt(train.sum())
        whole = np.linalg.norm(matrix[train], axis=0) / np.sqrt(train.sum())
        seen = size > 1e-5 * np.maximum(whole, 1e-12)
        scale = swept[train, -1].std()
        z = swept[:, :-1][:, seen] / size[seen]
        target = swept[:, -1] / scale
        joints.append(
            Columns(
                [k for k, s in zip(kinds, seen, strict=True) if s],
                z[train],
                target[train],
                problem.rows.trajectory[j][train],
                z[~train],
                target[~train],
            )
        )
    return problem, joints


def t_test(c: Columns) -> list[int]:
    """Columns that a test of each by itself calls significant, Benjamini-Hochberg at 5 %."""
    n = len(c.torque)
    share = (c.train.T @ c.torque) ** 2 / (n * (c.torque @ c.torque))
    statistic = share / np.maximum(1 - share, 1e-12) * (n - 2)
    q = false_discovery_control(f_distribution.sf(statistic, 1, n - 2))
    return np.flatnonzero(q < 0.05).tolist()


def stepwise_bic(c: Columns) -> list[int]:
    """Forward selection by the Bayesian information criterion."""
    return forward_selection(c.train, c.torque)


def lasso(c: Columns) -> list[int]:
    """Lasso with its penalty by cross-validation over trajectories."""
    folds = list(GroupKFold(4).split(c.train, groups=c.groups))
    model = LassoCV(cv=folds, fit_intercept=False, alphas=30, max_iter=3000)
    return np.flatnonzero(model.fit(c.train, c.torque).coef_).tolist()


def stlsq(c: Columns) -> list[int]:
    """PySINDy: sequentially thresholded least squares."""
    import pysindy

    model = pysindy.STLSQ(threshold=0.1, alpha=0.05, normalize_columns=False)
    return np.flatnonzero(np.ravel(model.fit(c.train, c.torque[:, None]).coef_)).tolist()


def stlsq_ensemble(c: Columns) -> list[int]:
    """PySINDy: terms that at least 60 % of the models of row bootstraps keep."""
    import pysindy

    rng = np.random.default_rng(0)
    kept = np.zeros(c.train.shape[1])
    for _ in range(20):
        rows = rng.integers(0, len(c.torque), len(c.torque))
        model = pysindy.STLSQ(threshold=0.1, alpha=0.05, normalize_columns=False)
        kept += np.ravel(model.fit(c.train[rows], c.torque[rows, None]).coef_) != 0
    return np.flatnonzero(kept >= 0.6 * 20).tolist()


METHODS: dict[str, Callable[[Columns], list[int]]] = {
    "t-test, Benjamini-Hochberg": t_test,
    "stepwise BIC": stepwise_bic,
    "LassoCV": lasso,
    "PySINDy STLSQ": stlsq,
    "PySINDy STLSQ, ensemble": stlsq_ensemble,
}


def with_skidyn(log, problem: Problem) -> tuple[set[tuple[str, int]], list[float]]:
    """What the diagnosis of the same trajectories names, and the error with it on the same rows."""
    last = np.unique(log.X["trajectory"])[-HELD_OUT]
    train = (log.X["trajectory"] < last).to_numpy()
    torque = np.asarray(log.y)
    model = RBDRegressor(log.robot, BASE)
    diagnosis = diagnose(model, log.X[train], torque[train])
    named = {(f.kind, j) for f in diagnosis.findings for j in f.joints}
    before = torque - model.fit(log.X[train], torque[train]).predict(log.X)
    after = torque - diagnosis.model.predict(log.X)
    errors = []
    for j in range(problem.n_joints):
        test = problem.rows.trajectory[j] >= last
        rows = [problem.rows.average(x[:, j], j)[test] for x in (after, before)]
        errors.append(float(np.sqrt(np.mean(rows[0] ** 2) / np.mean(rows[1] ** 2))))
    return named, errors


def contest(kind: str | None, robot: str, seed: int) -> dict[str, tuple[bool, int, float]]:
    """Right name, false alarms and held-out error (of the base model's) of every method."""
    warnings.simplefilter("ignore")
    load, joint = ROBOTS[robot]
    where = None if kind is None else [joint]
    log = make_hidden_effect_log(load(), kind, joints=where, noise="high", random_state=700 + seed)
    problem, joints = columns_of(log)
    truth = HYSTERESIS if kind in HYSTERESIS else {kind}
    scores = {}
    for name, method in METHODS.items():
        named, errors = set(), []
        for j, c in enumerate(joints):
            chosen = method(c)
            named |= {(c.kinds[i], j + 1) for i in chosen}
            weights = np.linalg.lstsq(c.train[:, chosen], c.torque, rcond=1e-8)[0]
            left = c.test_torque - c.test[:, chosen] @ weights
            errors.append(float(np.sqrt(np.mean(left**2) / np.mean(c.test_torque**2))))
        scores[name] = _score(named, truth, joint, errors, kind)
    named, errors = with_skidyn(log, problem)
    scores["skidyn"] = _score(named, truth, joint, errors, kind)
    return scores


def _score(named, truth, joint, errors, kind) -> tuple[bool, int, float]:
    right = any(k in truth and j == joint for k, j in named)
    false = len({k for k, j in named if not (k in truth and j == joint)})
    return right, false, errors[joint - 1] if kind else float(np.mean(errors))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    cases = [(k, r, 0) for k in KINDS for r in ROBOTS]
    cases += [(None, r, s) for r in ROBOTS for s in range(NULLS)]
    results = Parallel(n_jobs=options.jobs)(delayed(contest)(*case) for case in cases)
    hidden = [r for c, r in zip(cases, results, strict=True) if c[0]]
    null = [r for c, r in zip(cases, results, strict=True) if c[0] is None]
    print(f"{len(hidden)} logs with a hidden effect, {len(null)} without; errors: geometric mean")
    print(
        f"{'':28s}{'right name':>11s}{'false kinds':>12s}{'error':>7s}"
        f"{'no alarm on nulls':>19s}{'error there':>12s}"
    )
    for name in results[0]:
        right = np.mean([r[name][0] for r in hidden])
        false = np.mean([r[name][1] for r in hidden])
        error = np.exp(np.mean([np.log(r[name][2]) for r in hidden]))
        quiet = np.mean([r[name][1] == 0 and not r[name][0] for r in null])
        there = np.exp(np.mean([np.log(r[name][2]) for r in null]))
        print(f"{name:28s}{right:11.2f}{false:12.1f}{error:7.2f}{quiet:19.2f}{there:12.2f}")


if __name__ == "__main__":
    main()
