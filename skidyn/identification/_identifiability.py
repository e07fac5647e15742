# SPDX-License-Identifier: BSD-3-Clause
"""Identifiability: the coefficients that a log determines.

References
----------
M. Gautier, W. Khalil (1992), Exciting trajectories for the identification of base inertial
parameters of robots, Int. J. Robotics Research 11(4), 362-375.
C. M. Pham, M. Gautier (1991), Essential parameters of robots, IEEE CDC, 2769-2774.
D. A. Belsley, E. Kuh, R. E. Welsch (1980), Regression Diagnostics, chapter 3.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.linalg import solve_triangular

from skidyn._signals import Array

#: Condition index from which a combination counts as undetermined, and least share of a
#: coefficient's variance due to a combination for it to be listed there (Belsley et al.).
OPEN, INVOLVED = 100.0, 0.5
#: Condition index beyond which rounding dominates.
NOTHING = 1e8
#: Most coefficients that are listed in one combination.
MOST_NAMED = 4


def condition_number(rows: Array) -> float:
    """Condition number of columns scaled to equal length; infinite if one is zero.

    The rows are weighted; their triangular factor is equivalent.
    """
    if rows.shape[1] == 0:
        return 1.0
    size = np.linalg.norm(rows, axis=0)
    if not np.all(size > 0):
        return float("inf")
    values = np.linalg.svd(rows / size, compute_uv=False)
    if len(values) < rows.shape[1] or values[-1] <= 0:
        return float("inf")
    return float(values[0] / values[-1])


def open_combinations(rows: Array, names: Sequence[str]) -> list[dict[str, Any]]:
    """Combinations of coefficients that the rows hardly determine, the worst first.

    The rows are weighted; their triangular factor is equivalent. ``combination`` maps names of
    columns to factors.
    """
    size = np.linalg.norm(rows, axis=0)
    shown: list[int] = np.flatnonzero(size > 0).tolist()
    silent: list[int] = np.flatnonzero(size == 0).tolist()
    found = [
        {
            "combination": {names[k]: 1.0},
            "condition_index": float("inf"),
            "sentence": f"{names[k]} causes no torque in this data.",
        }
        for k in silent
    ]
    if not shown:
        return found
    # A square factor: every column gets a direction, also with fewer rows.
    padded = np.vstack([rows[:, shown] / size[shown], np.zeros((len(shown), len(shown)))])
    _, values, right = np.linalg.svd(padded, full_matrices=False)
    index = values[0] / np.maximum(values, values[0] / NOTHING)
    variance = right**2 * index[:, None] ** 2
    share = variance / variance.sum(0)
    for i in np.argsort(-index):
        if index[i] < OPEN:
            break
        # If rounding dominates, shares have no meaning: the coefficients are those of the
        # direction.
        lost = index[i] >= NOTHING
        involved = np.abs(right[i]) > 0.1 * np.abs(right[i]).max() if lost else share[i] > INVOLVED
        # Equal entries keep the order of the columns, independent of rounding.
        order = np.argsort(-np.round(np.abs(right[i]) / np.abs(right[i]).max(), 6), kind="stable")
        chosen = [k for k in order if involved[k] or k in order[:2]]
        factors = right[i] / size[shown]
        lead = chosen[0]
        named = {names[shown[k]]: float(factors[k] / factors[lead]) for k in chosen[:MOST_NAMED]}
        effect = 0.0 if lost else float(values[i] / abs(right[i, lead]))
        found.append(
            {
                "combination": named,
                "condition_index": float("inf") if lost else float(index[i]),
                "sentence": _sentence(named, effect),
            }
        )
    return found


def _sentence(named: dict[str, float], effect: float) -> str:
    (lead, _), *others = named.items()
    if not others:
        return f"{lead} is the only coefficient."
    changes = [
        f"{'raising' if factor > 0 else 'lowering'} {name} by {abs(factor):.3g}"
        for name, factor in others
    ]
    moved = f"{lead} by 1 and {', '.join(changes)}"
    if effect < 1e-7:
        return f"Raising {moved} changes no torque."
    return (
        f"Raising {moved} changes the torque by {100 * effect:.2g} % of what raising {lead} "
        "alone does."
    )


def essential_parameters(
    rows: Array, names: Sequence[str], count: float, ratio: float, growth: float
) -> dict[str, Any]:
    """Coefficients left when those with the largest relative standard errors are dropped in turn.

    The rows are [columns | torque], weighted by the noise, or their triangular factor; ``count`` is
    the number of rows of the log. Dropping ends when no relative standard error is larger than
    ``ratio`` times the smallest, or before the error grows by more than the share ``growth``.
    """
    rows = np.asarray(np.linalg.qr(rows, mode="r"))
    kept: list[int] = np.flatnonzero(np.linalg.norm(rows[:, :-1], axis=0) > 0).tolist()
    dropped = [k for k in range(len(names)) if k not in kept]
    found = _least_squares(rows[:, [*kept, -1]], count)
    all_squares = found[2]
    while len(kept) > 1:
        values, std, _ = found
        relative = std / np.maximum(np.abs(values), 1e-300)
        worst = int(np.argmax(relative))
        if relative[worst] <= ratio * relative.min():
            break
        fewer = kept[:worst] + kept[worst + 1 :]
        without = _least_squares(rows[:, [*fewer, -1]], count)
        if without[2] > (1 + growth) ** 2 * all_squares:
            break
        dropped.append(kept[worst])
        kept, found = fewer, without
    values, std, squares = found
    return {
        "parameters": [
            {
                "name": names[k],
                "value": float(v),
                "std": float(s),
                "relative_std": float(s / abs(v)) if v else float("inf"),
            }
            for k, v, s in zip(kept, values, std, strict=True)
        ],
        "eliminated": [names[k] for k in dropped],
        "error_ratio": float(np.sqrt(squares / all_squares)) if all_squares else 1.0,
    }


def _least_squares(rows: Array, count: float) -> tuple[Array, Array, float]:
    """Coefficients, their standard errors for white noise, and the residual sum of squares."""
    p = rows.shape[1] - 1
    size = np.linalg.norm(rows[:, :p], axis=0)
    scaled = np.column_stack([rows[:, :p] / size, rows[:, -1]])
    factor: Array = np.asarray(np.linalg.qr(scaled, mode="r"))
    triangle, right = factor[:p, :p].copy(), factor[:p, -1]
    # A direction without information gets the largest standard error, and is dropped first.
    weak = np.abs(np.diag(triangle)) < 1.0 / NOTHING
    triangle[weak, weak] = 1.0 / NOTHING
    squares = float(np.sum(factor[p:, -1] ** 2))
    inverse = solve_triangular(triangle, np.eye(p))
    spread = np.sqrt(squares / max(count - p, 1.0))
    std = spread * np.linalg.norm(inverse, axis=1) / size
    return solve_triangular(triangle, right) / size, std, squares
