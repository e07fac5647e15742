# SPDX-License-Identifier: BSD-3-Clause
"""Terms of the page and what they mean."""

from __future__ import annotations

from typing import Any

from skidyn.report._glossary import FLEET_MEANINGS, MEANINGS
from skidyn.report._picture import Canvas, Picture, Summary


class Glossary(Picture):
    """The words that are explained on hover too."""

    place, title = 90, "Terms"

    def show(self, summary: Summary, canvas: Canvas) -> dict[str, Any]:
        """All meanings; those of its own words on the page of a fleet."""
        of_fleet = summary["report"]["schema"].startswith("skidyn.fleet/")
        return {"glossary": FLEET_MEANINGS if of_fleet else MEANINGS}
