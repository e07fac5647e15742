# SPDX-License-Identifier: BSD-3-Clause
"""Coefficients of both with 95 % intervals."""

from __future__ import annotations

from typing import Any

from skidyn.report._picture import Canvas, Picture, Summary


class Coefficients(Picture):
    """Effects first: their names are short and their numbers have a direct meaning."""

    place, title = 50, "Coefficients"

    def show(self, summary: Summary, canvas: Canvas) -> dict[str, Any] | None:
        """Effects, and the rigid body folded; nothing for models without coefficients."""
        rows = summary["report"]["coefficients"]
        groups = [[row for row in rows if ("[" in row["name"]) == own] for own in (True, False)]
        return {"groups": groups} if rows else None
