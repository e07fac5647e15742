# SPDX-License-Identifier: BSD-3-Clause
"""Errors of both side by side: by joint, and by joint and regime."""

from __future__ import annotations

from typing import Any

from skidyn.report._heat import heat
from skidyn.report._picture import Canvas, Picture, Summary


class Where(Picture):
    """Errors with their change; a colour of the maps means the same on either side."""

    place, title = 10, "Where they differ"

    def show(self, summary: Summary, canvas: Canvas) -> dict[str, Any]:
        """The maps in colours."""
        sides = summary["report"]["sides"]
        maps = [heat(side["error_map"], side["noise"], side["judged"]) for side in sides]
        return {"maps": maps, "a": sides[0], "b": sides[1]}
