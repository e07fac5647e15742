# SPDX-License-Identifier: BSD-3-Clause
"""Parameters of a finding as rows of a table."""

from __future__ import annotations

from typing import Any


def parameter_rows(finding: dict[str, Any]) -> list[dict[str, Any]]:
    """One row per parameter and joint of a finding; the joint is a dash for a common parameter."""
    rows = []
    for name, p in finding["parameters"].items():
        values = p["value"] if isinstance(p["value"], list) else [p["value"]]
        # Directions and numbers of trajectories have no interval.
        lows, highs = (
            p[k] if isinstance(p[k], list) else [p[k]] * len(values) for k in ("low", "high")
        )
        for i, (value, low, high) in enumerate(zip(values, lows, highs, strict=True)):
            own = len(values) == len(finding["joints"])
            joint = finding["joints"][i] if own else "–"
            rows.append(
                {"name": name, "joint": joint, "value": value, "low": low, "high": high,
                 "unit": p["unit"]}
            )  # fmt: skip
    return rows
