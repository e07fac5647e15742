# SPDX-License-Identifier: BSD-3-Clause
"""PySINDy's STLSQ on bootstraps of trajectories; columns that 60 % of the models contain."""

import numpy as np
import pysindy
from _answers import by_columns

PACKAGE = "pysindy"
MODELS, KEPT = 10, 0.6


def choose(rows) -> dict[int, float]:
    rng = np.random.default_rng(0)
    groups = np.unique(rows.trajectory)
    found = []
    for _ in range(MODELS):
        drawn = rng.choice(groups, len(groups))
        use = np.concatenate([np.flatnonzero(rows.trajectory == g) for g in drawn])
        model = pysindy.STLSQ(threshold=0.1, alpha=0.05, normalize_columns=False)
        found.append(np.ravel(model.fit(rows.columns[use], rows.torque[use, None]).coef_))
    kept = np.flatnonzero((np.array(found) != 0).mean(axis=0) >= KEPT)
    return {int(i): float(np.median([f[i] for f in found])) for i in kept}


def answer(log, robot) -> dict:
    return by_columns(log, choose)
