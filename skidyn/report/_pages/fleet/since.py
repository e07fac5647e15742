# SPDX-License-Identifier: BSD-3-Clause
"""Since when: coefficients of single robots over time, with their bands."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from skidyn.report._picture import Canvas, Picture, Summary
from skidyn.report._words import since_told

if TYPE_CHECKING:
    from skidyn.report._fleet import Fleet


class Since(Picture):
    """Moving averages that left their bands."""

    place, title = 30, "Start of the change"

    def read(self, subject: Fleet) -> list[dict[str, Any]]:
        """Curves of the coefficients that raised an alarm."""
        curves = []
        for robot, report in subject.drift.items():
            for alarm in report.alarms():
                c = report.columns.index(alarm["column"])
                low, high = (np.where(np.isfinite(b), b, np.nan) for b in (report.low, report.high))
                curves.append(
                    {
                        "robot": robot,
                        "column": alarm["column"],
                        "since": since_told(alarm["date"]),
                        "value": report.value[:, c],
                        "low": low[:, c],
                        "high": high[:, c],
                    }
                )
        return curves

    def show(self, summary: Summary, canvas: Canvas) -> dict[str, Any] | None:
        """Figures with bands; nothing if no robot was monitored."""
        curves = []
        for curve in summary["since"]:
            middle = [
                None if low is None or high is None else (low + high) / 2
                for low, high in zip(curve["low"], curve["high"], strict=True)
            ]
            drawn = {
                "type": "lines",
                "x": list(range(1, len(curve["value"]) + 1)),
                "x_label": "trajectory",
                "y_label": "value in SI units",
                "series": [
                    {"label": "expected", "colour": "measured", "style": "line", "dash": True,
                     "values": middle, "low": curve["low"], "high": curve["high"]},
                    {"label": "moving average", "colour": "before", "style": "line",
                     "values": curve["value"]},
                ],
            }  # fmt: skip
            curves.append({**curve, "figure": canvas.figure(drawn)})
        return {"curves": curves} if curves else None
