# SPDX-License-Identifier: BSD-3-Clause
"""The first screen of a fleet: robots that deviate, and the largest deviation."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from skidyn.report._picture import Canvas, Picture, Summary

if TYPE_CHECKING:
    from skidyn.report._fleet import Fleet

#: Number of robots with a bar, and least deviation, in scatters, at the end of a bar.
SHOWN, REACH = 12, 6.0


class Glance(Picture):
    """Bars of the robots that deviate most, and all robots in the clearest coefficient."""

    place = 0

    def read(self, subject: Fleet) -> dict[str, Any]:
        """Largest deviation of every robot, and the coefficient in which one deviates most."""
        comparison = subject.comparison
        score = np.nan_to_num(np.abs(comparison.score))
        largest = score.argmax(axis=1)
        robots = [
            {"robot": name, "score": float(score[k, c]), "column": comparison.columns[c]}
            for k, (name, c) in enumerate(zip(comparison.robots, largest, strict=True))
        ]
        column = int(score.max(axis=0).argmax())
        common = comparison.common.get(comparison.columns[column], 0.0)
        return {
            "robots": sorted(robots, key=lambda row: -row["score"]),
            "column": comparison.columns[column],
            "values": common + comparison.deviation[:, column],
        }

    def show(self, summary: Summary, canvas: Canvas) -> dict[str, Any]:
        """Robots in the order of the coefficient, those that deviate marked."""
        own, report = summary["glance"], summary["report"]
        deviating = {row["robot"] for row in report["deviating"] if row["column"] == own["column"]}
        known = [
            (value, name)
            for value, name in zip(own["values"], report["robots"], strict=True)
            if value is not None
        ]
        known.sort()
        places = list(range(1, len(known) + 1))
        figure = canvas.figure(
            {
                "type": "lines",
                "x": places,
                "x_label": "robots in order",
                "y_label": "value in SI units",
                "series": [
                    {"label": label, "colour": colour, "style": "points",
                     "values": [v if (name in deviating) == out else None for v, name in known]}
                    for label, colour, out in (
                        ("like the others", "measured", False), ("deviating", "before", True))
                ],
            }
        )  # fmt: skip
        marked = {row["robot"] for row in report["deviating"]}
        rows = own["robots"][: max(SHOWN, len(marked))]
        reach = max([REACH, *(row["score"] for row in rows)])
        return {
            "rows": [
                {**row, "width": round(100 * row["score"] / reach, 1),
                 "deviates": row["robot"] in marked}
                for row in rows
            ],
            "figure_number": figure,
        }  # fmt: skip
