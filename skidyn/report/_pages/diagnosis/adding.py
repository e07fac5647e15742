# SPDX-License-Identifier: BSD-3-Clause
"""The error after each step, and the causes of the squared error."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from skidyn.report._figures import budget_bars, fall_figure
from skidyn.report._picture import Canvas, Picture, Summary

if TYPE_CHECKING:
    from skidyn.diagnosis import Diagnosis


class Adding(Picture):
    """Held-out errors of the given model and after every step."""

    place, title = 40, "Error by step"

    def read(self, subject: Diagnosis) -> list[dict[str, float]]:
        """Shares of every joint's squared error by cause."""
        return subject.budget

    def show(self, summary: Summary, canvas: Canvas) -> dict[str, Any] | None:
        """Bars of the joints that are not at their noise; nothing without findings."""
        if not summary["what"]:
            return None
        history, units, falls = summary["report"]["history"], summary["units"], []
        for row in summary["story"]["joints"]:
            if row["speaks"]:
                j = row["joint"] - 1
                errors = [step["rmse"][j] for step in history]
                drawn = fall_figure(errors, summary["noise"][j], units[j])
                falls.append({"joint": j + 1, "figure": canvas.figure(drawn)})
        causes = _causes(summary["adding"])
        return {
            "falls": falls,
            "causes": causes,
            "budget": budget_bars(summary["adding"], causes),
        }


def _causes(budget: list[dict[str, float]]) -> list[str]:
    """Causes in the order they were added; the unexplained and the noise last."""
    seen = list(dict.fromkeys(c for shares in budget for c in shares if (shares[c] or 0) >= 0.005))
    last = [cause for cause in ("unexplained", "noise") if cause in seen]
    return [cause for cause in seen if cause not in last] + last
