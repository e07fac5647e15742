# SPDX-License-Identifier: BSD-3-Clause
"""Error of the simulated motion, without and with the findings."""

from __future__ import annotations

from typing import Any

from skidyn.report._bars import scale_of
from skidyn.report._picture import Canvas, Picture, Summary


class Simulated(Picture):
    """Errors of position and velocity of every joint, if a simulation was requested."""

    place, title = 45, "Simulated motion"

    def show(self, summary: Summary, canvas: Canvas) -> dict[str, Any] | None:
        """Bars of the position error relative to that of the given model, and the numbers."""
        motion = summary["story"]["simulation"]
        if motion is None:
            return None
        return {
            "motion": motion,
            "scale": scale_of(row["ratio"] for row in motion["joints"]),
        }
