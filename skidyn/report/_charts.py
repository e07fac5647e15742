# SPDX-License-Identifier: BSD-3-Clause
"""Geometry of the page's still pictures: numbers to SVG paths. The template draws them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

Number = float | None


class Scale:
    """Linear map from values to pixels, with round tick marks.

    Parameters
    ----------
    low, high : float
        Range of the values.
    start, end : float
        Pixels of ``low`` and ``high``.
    """

    def __init__(self, low: float, high: float, start: float, end: float) -> None:
        if not high > low:
            low, high = low - 0.5 * (abs(low) or 1.0), high + 0.5 * (abs(high) or 1.0)
        self.low, self.high, self.start, self.end = low, high, start, end

    def __call__(self, value: float) -> float:
        """Pixel of a value, to a tenth."""
        share = (value - self.low) / (self.high - self.low)
        return round(self.start + share * (self.end - self.start), 1)

    def ticks(self, count: int = 5) -> list[dict[str, Any]]:
        """About ``count`` round values inside the range: pixel and label."""
        raw = (self.high - self.low) / max(count, 1)
        power = 10.0 ** math.floor(math.log10(raw))
        step = next(m * power for m in (1, 2, 2.5, 5, 10) if m * power >= 0.999 * raw)
        first = math.ceil(self.low / step - 1e-9)
        last = math.floor(self.high / step + 1e-9)
        values = [k * step for k in range(first, last + 1)]
        return [{"at": self(v), "label": f"{v:.6g}"} for v in values]


def curve_chart(curve: dict[str, Any], width: int = 460, height: int = 250) -> dict[str, Any]:
    """Residual against a signal, with the effect's curve: axes and paths.

    Parameters
    ----------
    curve : dict
        ``x, effect, measured, low, high``, as in ``Finding.curves``.
    width, height : int
        Size in pixels.

    Returns
    -------
    dict
        ``x_ticks, y_ticks, band, effect, points`` and the frame.
    """
    values = [v for key in ("effect", "measured", "low", "high") for v in curve[key]]
    finite = [v for v in values if v is not None] or [0.0]
    x_finite = [v for v in curve["x"] if v is not None] or [0.0]
    pad = 0.06 * ((max(finite) - min(finite)) or 1.0)
    left, right, top, bottom = 56, width - 12, 10, height - 42
    x = Scale(min(x_finite), max(x_finite), left, right)
    y = Scale(min(finite) - pad, max(finite) + pad, bottom, top)
    frame = {"left": left, "right": right, "top": top, "bottom": bottom}
    return {
        **frame,
        "width": width,
        "height": height,
        "x_ticks": x.ticks(6),
        "y_ticks": y.ticks(5),
        "zero": y(0.0) if y.low < 0 < y.high else None,
        "band": _band(curve["x"], curve["low"], curve["high"], x, y),
        "effect": _line(curve["x"], curve["effect"], x, y),
        "points": [
            {"x": x(a), "y": y(b), "title": f"{a:.4g}: {b:.4g}"}
            for a, b in zip(curve["x"], curve["measured"], strict=True)
            if a is not None and b is not None
        ],
    }


def fall_chart(
    errors: Sequence[float], floor: Number, width: int = 300, height: int = 190
) -> dict[str, Any]:
    """Error of one joint falling step by step to its noise floor.

    Parameters
    ----------
    errors : sequence of float
        Held-out error of the first model and after every step.
    floor : float or None
        Noise floor.
    width, height : int
        Size in pixels.

    Returns
    -------
    dict
        Bars, ticks and the floor's height in pixels.
    """
    left, right, top, bottom = 48, width - 8, 20, height - 26
    top_value = 1.08 * max([*errors, floor or 0.0, 1e-12])
    y = Scale(0.0, top_value, bottom, top)
    pitch = (right - left) / len(errors)
    wide = min(0.66 * pitch, 60.0)
    bars = []
    for k, error in enumerate(errors):
        centre = left + (k + 0.5) * pitch
        bars.append(
            {"x": round(centre - wide / 2, 1), "width": round(wide, 1), "y": y(error),
             "height": round(bottom - y(error), 1), "centre": round(centre, 1), "value": error,
             "step": k}
        )  # fmt: skip
    return {
        "left": left, "right": right, "top": top, "bottom": bottom, "width": width,
        "height": height, "bars": bars, "y_ticks": y.ticks(4),
        "floor": None if floor is None else y(floor),
    }  # fmt: skip


def budget_bars(
    budget: Sequence[dict[str, Number]], causes: Sequence[str]
) -> list[list[dict[str, Any]]]:
    """Stacked shares in per cent of the width, one list of pieces per joint."""
    rows = []
    for shares in budget:
        # a step can raise the error of a joint it does not serve: that is no share of it
        positive = {cause: max(shares.get(cause) or 0.0, 0.0) for cause in causes}
        total = sum(positive.values()) or 1.0
        start, pieces = 0.0, []
        for index, cause in enumerate(causes):
            share = positive[cause] / total
            piece = {"cause": cause, "index": index, "share": share}
            pieces.append({**piece, "x": round(100 * start, 3), "width": round(100 * share, 3)})
            start += share
        rows.append(pieces)
    return rows


def map_chart(table: dict[str, Any], width: int = 460, height: int = 320) -> dict[str, Any]:
    """Tiles coloured by a value: blue where negative, orange where positive.

    Parameters
    ----------
    table : dict
        ``x`` and ``y`` (edges) and ``table``, as from the maps of a finding.
    width, height : int
        Size in pixels.

    Returns
    -------
    dict
        Tiles with their colours, ticks, colour scale and the largest absolute value.
    """
    left, right, top, bottom = 56, width - 74, 10, height - 42
    x = Scale(table["x"][0], table["x"][-1], left, right)
    y = Scale(table["y"][0], table["y"][-1], bottom, top)
    values = [v for row in table["table"] for v in row if v is not None]
    largest = max((abs(v) for v in values), default=0.0) or 1.0
    tiles = []
    for i, row in enumerate(table["table"]):
        for k, value in enumerate(row):
            if value is None:
                continue
            x0, x1, y0, y1 = (x(table["x"][k]), x(table["x"][k + 1]),
                              y(table["y"][i]), y(table["y"][i + 1]))  # fmt: skip
            # a hair wider than the tile, so that no seams show
            size = {"width": round(x1 - x0 + 0.4, 1), "height": round(y0 - y1 + 0.4, 1)}
            fill = _diverging(value / largest)
            tiles.append({"x": x0, "y": y1, **size, "fill": fill, "title": f"{value:.4g}"})
    step = (bottom - top) / 21
    scale = [
        {"y": round(top + k * step, 1), "height": round(step + 0.4, 1),
         "fill": _diverging(1 - k / 10)}
        for k in range(21)
    ]  # fmt: skip
    return {
        "left": left, "right": right, "top": top, "bottom": bottom, "width": width,
        "height": height, "tiles": tiles, "scale": scale, "largest": largest,
        "x_ticks": x.ticks(6), "y_ticks": y.ticks(5),
    }  # fmt: skip


def _diverging(share: float) -> str:
    """Colour between blue (-1), pale grey (0) and orange (1), safe for colour-blind readers."""
    end = (230, 126, 0) if share > 0 else (0, 96, 160)
    mixed = [round(238 + (e - 238) * min(abs(share), 1.0)) for e in end]
    return "#{:02x}{:02x}{:02x}".format(*mixed)


def _line(xs: Sequence[Number], ys: Sequence[Number], x: Scale, y: Scale) -> str:
    """Path through the points, interrupted where a value is missing."""
    path, pen = [], "M"
    for a, b in zip(xs, ys, strict=True):
        if a is None or b is None:
            pen = "M"
            continue
        path.append(f"{pen}{x(a)},{y(b)}")
        pen = "L"
    return "".join(path)


def _band(
    xs: Sequence[Number], low: Sequence[Number], high: Sequence[Number], x: Scale, y: Scale
) -> str:
    rows = [
        (x(a), y(b), y(c))
        for a, b, c in zip(xs, low, high, strict=True)
        if a is not None and b is not None and c is not None
    ]
    if not rows:
        return ""
    there = [f"{a},{b}" for a, b, _ in rows]
    back = [f"{a},{c}" for a, _, c in reversed(rows)]
    return "M" + "L".join(there + back) + "Z"
