# SPDX-License-Identifier: BSD-3-Clause
"""The first screen of a comparison: differences, both errors over noise, the clearest curve."""

from __future__ import annotations

from typing import Any

from skidyn.report._bars import scale_of
from skidyn.report._figures import overlay_figure
from skidyn.report._picture import Canvas, Picture, Summary


class Glance(Picture):
    """Differences, and the joint that shows them best."""

    place = 0

    def show(self, summary: Summary, canvas: Canvas) -> dict[str, Any]:
        """Bars of both, and the residuals of the joint on which they differ most."""
        rows = summary["joints"]
        pictures = summary["residuals"]
        hero = None
        if pictures:
            hero = max(pictures, key=lambda picture: picture["apart"])
            drawn = overlay_figure(hero, summary["report"])
            hero = {**hero, "figure": canvas.figure(drawn)}
        return {
            "ranked": sorted(rows, key=lambda row: -max(r or 0.0 for r in row["ratios"])),
            "scale": scale_of(ratio for row in rows for ratio in row["ratios"]),
            "quiet": _quiet(rows),
            "hero": hero,
        }


def _quiet(rows: list[dict[str, Any]]) -> str:
    """One sentence on the joints without a difference."""
    silent = [row for row in rows if not row["speaks"]]
    if not silent:
        return ""
    every = "The joint has" if len(rows) == 1 else "All joints have"
    others = f"The other joint{' has' if len(silent) == 1 else 's have'}"
    which = every if len(silent) == len(rows) else others
    return f"{which} the same error in both, and it is like the noise."
