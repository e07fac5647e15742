# SPDX-License-Identifier: BSD-3-Clause
"""The first screen: verdict, error over noise of every joint, and the effect on the worst joint."""

from __future__ import annotations

from typing import Any

from skidyn.report._bars import scale_of
from skidyn.report._figures import finding_charts
from skidyn.report._picture import Canvas, Picture, Summary


class Glance(Picture):
    """Location, effect and confidence, visible without scrolling."""

    place = 0

    def show(self, summary: Summary, canvas: Canvas) -> dict[str, Any]:
        """The story, its bars, and one chart."""
        rows = summary["story"]["joints"]
        return {
            "ranked": sorted(rows, key=lambda row: -(row["ratios"][0] or 0.0)),
            "scale": scale_of(ratio for row in rows for ratio in row["ratios"]),
            "hero": _hero(summary, canvas),
        }


def _hero(summary: Summary, canvas: Canvas) -> dict[str, Any] | None:
    """The effect on the joint with the largest error."""
    rows = summary["story"]["joints"]
    charts = [
        {**chart, "title": finding["title"]}
        for finding in summary["what"]
        for chart in finding_charts(finding, summary["units"])
    ]
    if not charts:
        return None
    worst = max(charts, key=lambda chart: rows[chart["joint"] - 1]["ratios"][0] or 0.0)
    return {**worst, "figure": canvas.figure(worst["drawn"])}
