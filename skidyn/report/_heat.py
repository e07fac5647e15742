# SPDX-License-Identifier: BSD-3-Clause
"""Errors by joint and regime, coloured by error over noise."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from skidyn.diagnosis import Diagnosis

#: Error over noise that has the strongest colour of an error map.
DEEPEST = 5.0


def judged_regimes(diagnosis: Diagnosis) -> list[list[bool]]:
    """Whether effects are judged in a regime, by joint and regime."""
    from skidyn.diagnosis import regimes  # not needed to write a page

    judged = diagnosis.comparison.judged_samples
    table = []
    for inside in regimes(diagnosis.comparison).values():
        count = np.maximum(inside.sum(0), 1)
        table.append((inside & judged).sum(0) >= 0.5 * count)
    found: list[list[bool]] = np.array(table).T.tolist()
    return found


def heat(
    table: list[list[float | None]],
    noise: Sequence[float | None],
    judged: Sequence[Sequence[bool]] | None = None,
) -> list[list[dict[str, Any]]]:
    """Cells of an error map by joint and regime; the colour is the error over the noise.

    ``depth`` is between 0 (noise) and 1; ``judged`` states whether effects are judged there.
    """
    rows = []
    for j, row in enumerate(table):
        floor = noise[j]
        cells = []
        for k, value in enumerate(row):
            ratio = 1.0 if value is None or not floor else value / floor
            depth = min(max((ratio - 1) / (DEEPEST - 1), 0.0), 1.0)
            counts = True if judged is None else judged[j][k]
            cells.append({"value": value, "depth": round(depth, 2), "judged": counts})
        rows.append(cells)
    return rows
