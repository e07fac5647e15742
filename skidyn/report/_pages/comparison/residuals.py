# SPDX-License-Identifier: BSD-3-Clause
"""Residuals of both over each joint's own motion."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from skidyn.report._figures import overlay_figure
from skidyn.report._overlay import overlays
from skidyn.report._picture import Canvas, Picture, Summary

if TYPE_CHECKING:
    from skidyn.report._compare import Pair

#: Joints whose curves are unfolded.
FIRST = 2


class Residuals(Picture):
    """Medians and quartiles; the joints with the largest difference are first."""

    place, title = 40, "Residuals"

    def read(self, subject: Pair) -> list[dict[str, Any]]:
        """Both residuals against velocity and position of every joint."""
        return overlays(subject.diagnoses)

    def show(self, summary: Summary, canvas: Canvas) -> dict[str, Any] | None:
        """Figures by joint."""
        joints: dict[int, list[dict[str, Any]]] = {}
        for picture in summary["residuals"]:
            figure = canvas.figure(overlay_figure(picture, summary["report"]))
            joints.setdefault(picture["joint"], []).append({**picture, "figure": figure})
        ranked = sorted(joints.values(), key=lambda part: -max(p["apart"] for p in part))
        first, rest = (
            [picture for part in some for picture in part]
            for some in (ranked[:FIRST], ranked[FIRST:])
        )
        return {"first": first, "rest": rest} if first else None
