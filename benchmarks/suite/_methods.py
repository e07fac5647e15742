# SPDX-License-Identifier: BSD-3-Clause
"""Methods of the suite: a folder of a case to an answer. A new one is a function and a line."""

from __future__ import annotations

import json
import tempfile
import time
import warnings
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path

import numpy as np
from _columns import Columns, claims, columns_of, read_case
from sklearn.ensemble import HistGradientBoostingRegressor
from sklearn.inspection import permutation_importance
from sklearn.linear_model import LassoCV
from sklearn.model_selection import GroupKFold, cross_val_predict

FOLDS = 3


def skidyn(case: Path) -> dict:
    """``skidyn diagnose`` with its default options."""
    from skidyn.cli import main

    base = json.loads((case / "meta.json").read_text())["base_model"]
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder, "report.json")
        words = ["diagnose", str(case / "log.parquet"), "--urdf", str(case / "robot.urdf")]
        if main([*words, "--model", ",".join(base), "--out", str(out)]):
            raise RuntimeError("skidyn refused the log")
        report = json.loads(out.read_text())
    keys = ("kind", "joints", "variables", "trajectories", "confidence")
    effects = [{k: e[k] for k in keys if e.get(k) is not None} for e in report["effects"]]
    for effect, full in zip(effects, report["effects"], strict=True):
        effect["parameters"] = {k: p["value"] for k, p in full["parameters"].items()}
    return {"verdict": report["verdict"], "effects": effects}


def _by_joint(choose: Callable[[Columns], dict[int, float]]) -> Callable[[Path], dict]:
    def method(case: Path) -> dict:
        columns, seconds = columns_of(case)
        start = time.perf_counter()
        said = claims(columns, [choose(c) for c in columns])
        return said | {"seconds": seconds + time.perf_counter() - start}

    return method


def lasso(c: Columns) -> dict[int, float]:
    """Lasso, penalty of the least error over held-out trajectories."""
    model = _lasso_path(c)
    return {int(i): float(model.coef_[i]) for i in np.flatnonzero(model.coef_)}


def lasso_one_error(c: Columns) -> dict[int, float]:
    """Lasso, the largest penalty within one standard error of the least (fewer false claims)."""
    model = _lasso_path(c)
    mean = model.mse_path_.mean(axis=1)
    best = int(np.argmin(mean))
    error = model.mse_path_.std(axis=1, ddof=1)[best] / np.sqrt(FOLDS)
    alpha = model.alphas_[np.flatnonzero(mean <= mean[best] + error)].max()
    path = model.path(c.matrix, c.torque, alphas=[alpha], max_iter=2000)[1][:, 0]
    return {int(i): float(path[i]) for i in np.flatnonzero(path)}


def _lasso_path(c: Columns) -> LassoCV:
    folds = list(GroupKFold(FOLDS).split(c.matrix, groups=c.groups))
    model = LassoCV(cv=folds, fit_intercept=False, alphas=25, eps=3e-3, max_iter=2000)
    return model.fit(c.matrix, c.torque)


def stepwise(c: Columns) -> dict[int, float]:
    """Forward selection by the Bayesian information criterion."""
    n, chosen = len(c.torque), []
    best = n * np.log(np.mean(c.torque**2))
    while len(chosen) < 20:
        basis = np.linalg.qr(c.matrix[:, chosen])[0] if chosen else np.zeros((n, 0))
        left = c.torque - basis @ (basis.T @ c.torque)
        rest = c.matrix - basis @ (basis.T @ c.matrix)
        size = np.maximum(np.sum(rest**2, axis=0), 1e-9)
        drop = np.where(size > 1e-6 * n, (rest.T @ left) ** 2 / size, 0.0)
        i = int(np.argmax(drop))
        score = n * np.log((left @ left - drop[i]) / n) + (len(chosen) + 1) * np.log(n)
        if score >= best:
            break
        chosen.append(i)
        best = score
    return _refitted(c, chosen)


def sindy(c: Columns) -> dict[int, float]:
    """PySINDy's STLSQ with its defaults for normalised columns."""
    import pysindy

    model = pysindy.STLSQ(threshold=0.1, alpha=0.05, normalize_columns=False)
    found = np.ravel(model.fit(c.matrix, c.torque[:, None]).coef_)
    return {int(i): float(found[i]) for i in np.flatnonzero(found)}


def sindy_ensemble(c: Columns) -> dict[int, float]:
    """PySINDy's STLSQ on bootstraps of trajectories; terms that 60 % of the models keep."""
    import pysindy

    rng = np.random.default_rng(0)
    groups = np.unique(c.groups)
    found = []
    for _ in range(20):
        drawn = rng.choice(groups, len(groups))
        rows = np.concatenate([np.flatnonzero(c.groups == g) for g in drawn])
        model = pysindy.STLSQ(threshold=0.1, alpha=0.05, normalize_columns=False)
        found.append(np.ravel(model.fit(c.matrix[rows], c.torque[rows, None]).coef_))
    found = np.array(found)
    kept = np.flatnonzero((found != 0).mean(axis=0) >= 0.6)
    return {int(i): float(np.median(found[:, i])) for i in kept}


def _refitted(c: Columns, chosen: list[int]) -> dict[int, float]:
    weights = np.linalg.lstsq(c.matrix[:, chosen], c.torque, rcond=1e-8)[0]
    return {i: float(w) for i, w in zip(chosen, weights, strict=True)}


def trees(case: Path) -> dict:
    """Boosted trees on the residual; joints with held-out R2 above .1, signals by permutation.

    They name no effect: ``unknown`` with joints and signals is all that they can say.
    """
    from skidyn.identification import RBDRegressor

    robot, frame, tau, base = read_case(case)
    left = tau - RBDRegressor(robot, base).fit(frame, tau).predict(frame)
    every = slice(None, None, max(1, len(frame) // 4000))
    names = [n for n in frame.columns if not n.startswith("tau")]
    signals, groups = frame[names].iloc[every], frame["trajectory"].to_numpy()[every]
    found = []
    for j in range(robot.n_joints):
        y = left[every, j]
        model = HistGradientBoostingRegressor(max_iter=80, random_state=0)
        folds = GroupKFold(FOLDS)
        told = cross_val_predict(model, signals, y, groups=groups, cv=folds)
        share = 1 - np.mean((y - told) ** 2) / np.var(y)
        if share < 0.1:
            continue
        weight = permutation_importance(
            model.fit(signals, y), signals, y, n_repeats=2, random_state=0
        ).importances_mean
        order = np.argsort(-weight)
        most = [names[i] for i in order if weight[i] > 0.25 * weight.max()]
        found.append((share, {"kind": "unknown", "joints": [j + 1], "variables": most}))
    effects = [effect for _, effect in sorted(found, key=lambda item: -item[0])]
    return {"verdict": "unknown" if effects else "complete", "effects": effects}


def silent(case: Path) -> dict:
    """Says that nothing is missing, always: what a score is worth."""
    return {"verdict": "complete", "effects": []}


METHODS: dict[str, tuple[Callable[[Path], dict], str]] = {
    "skidyn": (skidyn, "skidyn"),
    "LassoCV": (_by_joint(lasso), "scikit-learn"),
    "LassoCV 1 SE": (_by_joint(lasso_one_error), "scikit-learn"),
    "stepwise BIC": (_by_joint(stepwise), "numpy"),
    "PySINDy STLSQ": (_by_joint(sindy), "pysindy"),
    "PySINDy ensemble": (_by_joint(sindy_ensemble), "pysindy"),
    "boosted trees": (trees, "scikit-learn"),
    "silence": (silent, "numpy"),
}


def answer(method: str, case: Path) -> dict:
    """The method's answer; what it cannot read counts as silence, with the reason."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return METHODS[method][0](case)
        except Exception as error:  # a peer's fault must not end the comparison
            return {
                "verdict": "complete",
                "effects": [],
                "error": f"{type(error).__name__}: {error}",
            }


def package(method: str) -> str:
    """Package behind the method with its version."""
    name = METHODS[method][1]
    return f"{name} {version(name)}"
