# SPDX-License-Identifier: BSD-3-Clause
"""Provenance of the numbers."""

from __future__ import annotations

from typing import Any

from skidyn.report._picture import Canvas, Picture, Summary


class Provenance(Picture):
    """Versions, and files and options of the diagnosis or of both sides of a comparison."""

    place, title = 100, "Provenance"

    def show(self, summary: Summary, canvas: Canvas) -> dict[str, Any]:
        """Groups of names and values."""
        report = summary["report"]
        groups = {"versions": report.get("versions"), **report.get("provenance", {})}
        for side in report.get("sides", ()):
            own = side["provenance"].items()
            groups |= {f"{side['name']}: {name}": told for name, told in own if name != "versions"}
        return {"groups": groups}
