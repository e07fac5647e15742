# SPDX-License-Identifier: BSD-3-Clause
"""Effects identified from the motion of position servos, each joint simulated alone."""

from __future__ import annotations

from typing import Any

from skidyn.report._picture import Canvas, Picture, Summary


class Servos(Picture):
    """Effects without which the motion of a servo cannot be simulated."""

    place, title = 46, "Motion of the servos"

    def show(self, summary: Summary, canvas: Canvas) -> dict[str, Any] | None:
        """The error of the simulated position without each effect, with it, and with its rival."""
        motion = summary["story"]["servo_motion"]
        if motion is None:
            return None
        errors = [[row["error"] for row in f["errors"]] for f in motion["findings"]]
        widths = [[round(100 * error / max(own), 1) for error in own] for own in errors]
        return {"motion": motion, "widths": widths}
