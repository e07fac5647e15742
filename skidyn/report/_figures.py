# SPDX-License-Identifier: BSD-3-Clause
"""Data of the page's static figures, which the script passes to the plotting library."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from skidyn._text import listed

Number = float | None

#: Colours of the two sides of a comparison, by their names in page.css.
COLOURS = ("before", "after")


def curve_figure(curve: dict[str, Any], unit: str) -> dict[str, Any]:
    """Residual against a signal, with the effect's curve as in ``Finding.curves``."""
    rows = [k for k, x in enumerate(curve["x"]) if x is not None]
    column = {
        key: [curve[key][k] for k in rows] for key in ("x", "effect", "measured", "low", "high")
    }
    return {
        "type": "lines",
        "x": column["x"],
        "x_label": f"{curve['variable']} in {curve['unit']}",
        "y_label": f"residual in {unit}",
        "series": [
            {"label": "residual", "colour": "measured", "style": "points",
             **{key: column[name] for key, name in
                (("values", "measured"), ("low", "low"), ("high", "high"))}},
            {"label": "effect", "colour": "after", "style": "line", "values": column["effect"]},
        ],
    }  # fmt: skip


def overlay_figure(picture: dict[str, Any], report: dict[str, Any]) -> dict[str, Any]:
    """Residuals of two diagnoses against one signal, from a picture of :func:`overlays`."""
    unit = report["units"][picture["joint"] - 1]
    return {
        "type": "lines",
        "x": picture["x"],
        "x_label": f"{picture['variable']} in {picture['unit']}",
        "y_label": f"residual in {unit}",
        "series": [
            {"label": name, "colour": colour, "style": "line", "dash": k == 0,
             "values": side["median"], "low": side["low"], "high": side["high"]}
            for k, (name, colour, side) in enumerate(
                zip(report["names"], COLOURS, picture["sides"], strict=True))
        ],
    }  # fmt: skip


def finding_charts(finding: dict[str, Any], units: Sequence[str]) -> list[dict[str, Any]]:
    """Pictures of a finding: the residual over two variables, or against one with its curve.

    Each is the curve or map with ``drawn``, its figure, and ``over``, its variables in words.
    """
    maps = [
        {**table, "drawn": map_figure(table), "over": listed(table["variables"])}
        for table in finding["maps"]
    ]
    curves = [
        {**curve, "drawn": curve_figure(curve, units[curve["joint"] - 1]),
         "over": curve["variable"]}
        for curve in finding["curves"]
    ]  # fmt: skip
    return maps + curves


def fall_figure(errors: Sequence[Number], floor: Number, unit: str) -> dict[str, Any]:
    """Error of one joint, decreasing step by step to its noise floor."""
    return {"type": "bars", "values": list(errors), "floor": floor, "y_label": f"error in {unit}"}


def map_figure(table: dict[str, Any]) -> dict[str, Any]:
    """Residual over two variables, from a map of a finding; the largest absolute value is added."""
    values = [abs(v) for row in table["table"] for v in row if v is not None]
    (x, y) = (f"{v} in {u}" for v, u in zip(table["variables"], table["units"], strict=True))
    return {
        "type": "map", "x": table["x"], "y": table["y"], "table": table["table"],
        "x_label": x, "y_label": y, "largest": max(values, default=0.0) or 1.0,
    }  # fmt: skip


def budget_bars(
    budget: Sequence[dict[str, Number]], causes: Sequence[str]
) -> list[list[dict[str, Any]]]:
    """Shares of each joint's squared error by cause, stacked: one list of pieces per joint.

    ``index`` is that of the colour of a cause; the shares of a joint add up to one.
    """
    rows = []
    for shares in budget:
        # a step can increase the error of another joint, which is not a share of it
        positive = {cause: max(shares.get(cause) or 0.0, 0.0) for cause in causes}
        total = sum(positive.values()) or 1.0
        rows.append(
            [
                {"cause": cause, "index": k, "share": positive[cause] / total}
                for k, cause in enumerate(causes)
            ]
        )
    return rows
