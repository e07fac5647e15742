# SPDX-License-Identifier: BSD-3-Clause
"""Answers of general methods: the columns that they choose, or the signals that they need."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from _log import Log, Rows

#: A learner claims a torque if it predicts this share of its square on trajectories left out.
CLEAR = 0.1
#: A signal counts if it matters at least this share of the most important one.
MATTERS = 0.25
#: A joint with fewer averaged rows hardly moves and is left out.
FEWEST = 30


def by_columns(log: Log, choose: Callable[[Rows], dict[int, float]]) -> dict:
    """Kinds with a chosen column, in order of the share of the torque that they explain.

    ``choose`` returns the coefficients of the chosen columns. Columns and torque have unit size, so
    that the square of a coefficient is about the share that its column explains.
    """
    weights = [choose(rows) if len(rows.torque) >= FEWEST else {} for rows in log.joints]
    size: dict[tuple[str, tuple[int, ...]], float] = {}
    for rows, chosen in zip(log.joints, weights, strict=True):
        for i, w in chosen.items():
            size[rows.names[i]] = size.get(rows.names[i], 0.0) + w * w
    effects = [
        {"kind": kind, "joints": list(joints), "parameters": {}, "variables": []}
        for kind, joints in sorted(size, key=lambda name: -size[name])
    ]

    def predict(other: Log) -> list[np.ndarray]:
        return [
            rows.columns[:, list(chosen)] @ np.array(list(chosen.values()), float)
            for rows, chosen in zip(other.joints, weights, strict=True)
        ]

    verdict = "missing" if effects else "complete"
    return {"verdict": verdict, "effects": effects, "predict": predict}


def by_signals(log: Log, make: Callable[[], Any], most: int = 4000) -> dict:
    """An unknown torque on every joint where a learner predicts it, with its signals.

    The learner is fitted to two thirds of the trajectories and judged on the others by the share of
    the square that it predicts; signals are judged by permutation importance.
    """
    found: list[tuple[float, dict]] = []
    models: list[Any] = []
    rng = np.random.default_rng(0)
    for j, rows in enumerate(log.joints):
        if len(rows.torque) < FEWEST:
            models.append(None)
            continue
        groups = np.unique(rows.trajectory)
        held = np.isin(rows.trajectory, groups[::3])
        some = np.flatnonzero(~held)
        some = some[:: max(1, -(-len(some) // most))]
        gain = rows.gain
        model = make().fit(rows.signals[some], rows.torque[some] / gain[some])
        models.append(model)
        test, y = rows.signals[held], rows.torque[held] / gain[held]
        error = np.mean((y - model.predict(test)) ** 2)
        share = 1 - error / np.mean(y**2)
        if share < CLEAR:
            continue
        harm = np.empty(test.shape[1])
        for k in range(test.shape[1]):
            mixed = test.copy()
            mixed[:, k] = rng.permutation(mixed[:, k])
            harm[k] = np.mean((y - model.predict(mixed)) ** 2) - error
        names = [rows.signal_names[k] for k in np.argsort(-harm) if harm[k] > MATTERS * harm.max()]
        size = share * rows.scale
        found.append((size, {"kind": "unknown", "joints": [j + 1], "variables": names}))

    def predict(other: Log) -> list[np.ndarray]:
        pairs = zip(models, other.joints, strict=True)
        return [0 * r.torque if m is None else r.gain * m.predict(r.signals) for m, r in pairs]

    effects = [effect for _, effect in sorted(found, key=lambda item: -item[0])]
    verdict = "unknown" if effects else "complete"
    return {"verdict": verdict, "effects": effects, "predict": predict}


def refitted(rows: Rows, chosen: list[int]) -> dict[int, float]:
    """Least-squares coefficients of the chosen columns."""
    weights = np.linalg.lstsq(rows.columns[:, chosen], rows.torque, rcond=1e-8)[0]
    return {i: float(w) for i, w in zip(chosen, weights, strict=True)}
