# SPDX-License-Identifier: BSD-3-Clause
"""PySINDy's STLSQ on the weak form of skidyn's columns.

Columns and torque are integrated against bumps of half a second that overlap by half, as PySINDy's
weak libraries do with derivatives. Its own libraries need one uniform time grid, which logs of
several recordings without rows at rest do not have.
"""

from dataclasses import replace

import numpy as np
import pysindy
from _answers import by_columns

PACKAGE = "pysindy"
LENGTH, POWER, FEWEST = 0.5, 2, 4


def choose(rows, clock) -> dict[int, float]:
    total = np.asarray(rows.weights.sum(axis=1)).ravel()
    time = (rows.weights @ clock) / total
    tests = []
    for g in np.unique(rows.trajectory):
        here = rows.trajectory == g
        for middle in np.arange(time[here].min(), time[here].max(), LENGTH / 2):
            bump = np.maximum(0.0, 1 - (2 * (time - middle) / LENGTH) ** 2) ** POWER * here
            if np.count_nonzero(bump) >= FEWEST:
                tests.append(bump / np.linalg.norm(bump))
    tests = np.array(tests)
    weak = replace(rows, columns=tests @ rows.columns, torque=tests @ rows.torque)
    size = np.maximum(np.sqrt(np.mean(weak.columns**2, axis=0)), 1e-12)
    scale = max(np.sqrt(np.mean(weak.torque**2)), 1e-12)
    model = pysindy.STLSQ(threshold=0.1, alpha=0.05, normalize_columns=False)
    found = np.ravel(model.fit(weak.columns / size, weak.torque[:, None] / scale).coef_)
    return {int(i): float(found[i] * scale / size[i]) for i in np.flatnonzero(found)}


def answer(log, robot) -> dict:
    return by_columns(log, lambda rows: choose(rows, log.motion["time"]))
