# SPDX-License-Identifier: BSD-3-Clause
"""Forward selection of skidyn's columns by the Bayesian information criterion."""

import numpy as np
from _answers import by_columns, refitted

PACKAGE = "numpy"
MOST = 20


def choose(rows) -> dict[int, float]:
    n, chosen = len(rows.torque), []
    best = n * np.log(np.mean(rows.torque**2))
    while len(chosen) < MOST:
        basis = np.linalg.qr(rows.columns[:, chosen])[0] if chosen else np.zeros((n, 0))
        left = rows.torque - basis @ (basis.T @ rows.torque)
        rest = rows.columns - basis @ (basis.T @ rows.columns)
        size = np.maximum(np.sum(rest**2, axis=0), 1e-9)
        drop = np.where(size > 1e-6 * n, (rest.T @ left) ** 2 / size, 0.0)
        i = int(np.argmax(drop))
        score = n * np.log((left @ left - drop[i]) / n) + (len(chosen) + 1) * np.log(n)
        if score >= best:
            break
        chosen.append(i)
        best = score
    return refitted(rows, chosen)


def answer(log, robot) -> dict:
    return by_columns(log, choose)
