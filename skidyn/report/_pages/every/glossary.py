# SPDX-License-Identifier: BSD-3-Clause
"""Terms of the page with their meanings."""

from __future__ import annotations

from typing import Any

from skidyn.report._glossary import FLEET_MEANINGS, MEANINGS
from skidyn.report._picture import Canvas, Picture, Summary


class Glossary(Picture):
    """The terms that are also explained on hover."""

    place, title = 90, "Terms"

    def show(self, summary: Summary, canvas: Canvas) -> dict[str, Any]:
        """All meanings; for the page of a fleet, those of its own terms."""
        of_fleet = summary["report"]["schema"].startswith("skidyn.fleet/")
        return {"glossary": FLEET_MEANINGS if of_fleet else MEANINGS}
