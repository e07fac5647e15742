# SPDX-License-Identifier: BSD-3-Clause
"""Curves of two diagnoses in one picture: over time, and over each joint's own motion."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from skidyn._signals import Array
from skidyn.report._traces import elapsed, thinned

if TYPE_CHECKING:
    from collections.abc import Sequence

    from skidyn.diagnosis import Diagnosis

#: Bins along a signal, and samples a bin needs to be drawn.
BINS, FEWEST = 36, 20


def overlays(both: Sequence[Diagnosis]) -> list[dict[str, Any]]:
    """Residual of both given models against velocity and position of the own joint.

    ``apart`` is the difference of the two relative to the noise; each of the two ``sides`` contains
    median and quartiles of the residual while the joint slides, N m or N, NaN without samples.
    """
    signals = both[0].comparison.signals
    pictures = []
    for j, slides in enumerate(signals.prismatic):
        length = "m" if slides else "rad"
        for name, unit in (("dq", f"{length}/s"), ("q", length)):
            pairs = [_sliding(d, name, j) for d in both]
            values = np.concatenate([x for x, _ in pairs])
            if len(values) < 2 * FEWEST:
                continue
            # the tails contain few samples, and would compress the rest
            low, high = np.quantile(values, [0.002, 0.998])
            if not high > low:
                continue
            edges = np.linspace(low, high, BINS + 1)
            pictures.append(
                {
                    "joint": j + 1,
                    "variable": f"{name}{j + 1}",
                    "unit": unit,
                    "x": (edges[:-1] + edges[1:]) / 2,
                    "sides": (sides := [_quartiles(x, r, edges) for x, r in pairs]),
                    "apart": _apart(sides, both[0].noise[j]),
                }
            )
    return pictures


def _apart(sides: Sequence[dict[str, Array]], noise: float) -> float:
    """Difference of two curves relative to the noise: medians and quartiles, mean over bins."""
    gaps = np.abs([sides[0][key] - sides[1][key] for key in ("low", "median", "high")])
    known = np.isfinite(gaps)
    return float(gaps[known].mean() / max(noise, 1e-300)) if known.any() else 0.0


def _sliding(diagnosis: Diagnosis, name: str, joint: int) -> tuple[Array, Array]:
    comparison = diagnosis.comparison
    use = comparison.sliding[:, joint]
    return getattr(comparison.signals, name)[use, joint], comparison.residual[use, joint]


def _quartiles(x: Array, residual: Array, edges: Array) -> dict[str, Array]:
    bins = np.searchsorted(edges, x, side="right") - 1
    table = np.full((3, len(edges) - 1), np.nan)
    for k in range(len(edges) - 1):
        here = residual[bins == k]
        if len(here) >= FEWEST:
            table[:, k] = np.quantile(here, [0.25, 0.5, 0.75])
    return {"low": table[0], "median": table[1], "high": table[2]}


def time_tables(both: Sequence[Diagnosis], same: bool) -> dict[str, Any]:
    """Measured and modelled torque over time, thinned without losing a peak.

    ``joints``: for each joint one table with both models, or one table per log; ``starts`` of the
    trajectories where the tables share them; ``end`` in s.
    """
    one, other = (d.comparison for d in both)
    clocks = [elapsed(one.signals)] if same else [elapsed(c.signals) for c in (one, other)]
    joints = []
    for j in range(one.signals.n_joints):
        if same:
            columns = {"measured": one.measured, "first": one.predicted, "second": other.predicted}
            tables = [thinned(one.signals, clocks[0][0], columns, j)]
        else:
            tables = [
                thinned(c.signals, clock, {"measured": c.measured, "model": c.predicted}, j)
                for c, (clock, _) in zip((one, other), clocks, strict=True)
            ]
        joints.append(tables)
    agree = all(starts == clocks[0][1] for _, starts in clocks)
    return {
        "joints": joints,
        "starts": clocks[0][1] if agree else [],
        "end": max(float(clock[-1]) for clock, _ in clocks),
    }
