# SPDX-License-Identifier: BSD-3-Clause
"""Every robot in every coefficient, coloured by its distance from the others."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from skidyn.report._picture import Canvas, Picture, Summary

if TYPE_CHECKING:
    from skidyn.report._fleet import Fleet

#: Scatters between the robots without and with the strongest colour.
FAINT, DEEPEST = 2.0, 6.0


class Where(Picture):
    """A map of robots and coefficients; robots that deviate first."""

    place, title = 10, "Which robots deviate, and where"

    def read(self, subject: Fleet) -> dict[str, Any]:
        """Deviations in units of the scatter between robots."""
        return {"score": subject.comparison.score}

    def show(self, summary: Summary, canvas: Canvas) -> dict[str, Any]:
        """Rows of cells; those without a deviating robot are folded."""
        scores = summary["where"]["score"]
        marked = {row["robot"] for row in summary["report"]["deviating"]}
        rows = [
            {"robot": name, "cells": [_cell(value) for value in scores[k]]}
            for k, name in enumerate(summary["report"]["robots"])
        ]
        return {
            "first": [row for row in rows if row["robot"] in marked],
            "rest": [row for row in rows if row["robot"] not in marked],
        }


def _cell(value: float | None) -> dict[str, Any]:
    depth = 0.0 if value is None else (abs(value) - FAINT) / (DEEPEST - FAINT)
    return {"value": value, "depth": round(min(max(depth, 0.0), 1.0), 2)}
