# SPDX-License-Identifier: BSD-3-Clause
"""The residual over two variables: the shape of an unknown effect."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import numpy as np

from skidyn._signals import Array, Signals

if TYPE_CHECKING:
    from skidyn.diagnosis import Diagnosis, Finding

#: Tiles along each axis, and samples a tile needs to be drawn.
TILES, FEWEST = 14, 5


def residual_maps(diagnosis: Diagnosis, finding: Finding) -> list[dict[str, Any]]:
    """Median residual on tiles of the two variables on which an unknown effect depends.

    ``x`` and ``y`` are edges of the tiles, ``table`` of shape (n_y, n_x) is in N m or N and NaN
    where the log has no samples. Only an unknown effect of two logged signals has maps, one per
    joint.
    """
    comparison = diagnosis.comparison
    read = [_variable(comparison.signals, name) for name in finding.variables]
    if finding.kind != "unknown" or len(read) != 2:
        return []
    (first, second) = read
    if first is None or second is None:
        return []
    maps = []
    for joint in finding.joints:
        use = comparison.sliding[:, joint - 1]
        if use.sum() < FEWEST * TILES:
            continue
        residual = comparison.residual[use, joint - 1]
        x, y, table = _tiles(first[0][use], second[0][use], residual)
        maps.append(
            {
                "joint": joint,
                "variables": list(finding.variables),
                "units": [first[1], second[1]],
                "x": x,
                "y": y,
                "table": table,
            }
        )
    return maps


def _variable(signals: Signals, name: str) -> tuple[Array, str] | None:
    """Signal and unit of a variable such as ``"dq3"``; None for anything else."""
    match = re.fullmatch(r"(q|dq|ddq)(\d+)", name)
    if match is None or not 1 <= int(match[2]) <= signals.n_joints:
        return None
    joint = int(match[2]) - 1
    length = "m" if signals.prismatic[joint] else "rad"
    unit = length + {"q": "", "dq": "/s", "ddq": "/s²"}[match[1]]
    return getattr(signals, match[1])[:, joint], unit


def _tiles(x: Array, y: Array, value: Array) -> tuple[Array, Array, Array]:
    edges = [np.linspace(v.min(), v.max(), TILES + 1) for v in (x, y)]
    column, row = (
        np.clip(np.searchsorted(e, v, side="right") - 1, 0, TILES - 1)
        for e, v in zip(edges, (x, y), strict=True)
    )
    tile = row * TILES + column
    order = np.argsort(tile, kind="stable")
    borders = np.searchsorted(tile[order], np.arange(TILES * TILES + 1))
    table = np.full(TILES * TILES, np.nan)
    for k, (start, stop) in enumerate(zip(borders[:-1], borders[1:], strict=True)):
        if stop - start >= FEWEST:
            table[k] = np.median(value[order[start:stop]])
    return edges[0], edges[1], table.reshape(TILES, TILES)
