# SPDX-License-Identifier: BSD-3-Clause
"""Forward selection of skidyn's columns by the Bayesian information criterion."""

import numpy as np
from _answers import by_columns, refitted

PACKAGE = "numpy"
MOST = 20


def forward_selection(columns: np.ndarray, torque: np.ndarray) -> list[int]:
    """Columns added one by one while the criterion falls.

    Parameters
    ----------
    columns : ndarray of shape (n_rows, n_columns)
    torque : ndarray of shape (n_rows,), N m or N

    Returns
    -------
    list of int
    """
    n, chosen = len(torque), []
    best = n * np.log(np.mean(torque**2))
    while len(chosen) < MOST:
        basis = np.linalg.qr(columns[:, chosen])[0] if chosen else np.zeros((n, 0))
        left = torque - basis @ (basis.T @ torque)
        rest = columns - basis @ (basis.T @ columns)
        size = np.maximum(np.sum(rest**2, axis=0), 1e-9)
        drop = np.where(size > 1e-6 * n, (rest.T @ left) ** 2 / size, 0.0)
        i = int(np.argmax(drop))
        score = n * np.log((left @ left - drop[i]) / n) + (len(chosen) + 1) * np.log(n)
        if score >= best:
            break
        chosen.append(i)
        best = score
    return chosen


def choose(rows) -> dict[int, float]:
    return refitted(rows, forward_selection(rows.columns, rows.torque))


def answer(log, robot) -> dict:
    return by_columns(log, choose)
