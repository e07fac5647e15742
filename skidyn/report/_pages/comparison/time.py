# SPDX-License-Identifier: BSD-3-Clause
"""Residual and torque of both over time, one panel per joint."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from skidyn.report._figures import COLOURS
from skidyn.report._overlay import time_tables
from skidyn.report._picture import Canvas, Picture, Summary
from skidyn.report._traces import packed_table

if TYPE_CHECKING:
    from skidyn.report._compare import Pair


class Time(Picture):
    """Data for the script ``panels.js``."""

    place, title = 30, "Over time"

    def read(self, subject: Pair) -> dict[str, Any]:
        """Curves that are thinned without losing a peak."""
        return time_tables(subject.diagnoses, subject.report["same_log"])

    def show(self, summary: Summary, canvas: Canvas) -> dict[str, Any]:
        """Pass the panels to the script."""
        report, times = summary["report"], summary["time"]
        canvas.numbers["panels"] = {
            "joints": [_panel(report, j, tables) for j, tables in enumerate(times["joints"])],
            "starts": times["starts"],
            "end": times["end"],
            "shown": _shown(report),
        }
        return {}


def _panel(report: dict[str, Any], j: int, tables: list[dict[str, Any]]) -> dict[str, Any]:
    unit = report["units"][j]
    torque, residual = _series(report, len(tables))
    return {
        "name": f"{report['joints'][j]} ({j + 1})",
        "unit": unit,
        "tables": [packed_table(table, table["columns"]) for table in tables],
        "plots": [
            {"label": f"residual in {unit}", "height": 210, "series": residual},
            {"label": f"torque in {unit}", "height": 150, "series": torque},
        ],
    }


def _series(report: dict[str, Any], n_tables: int) -> tuple[list[Any], list[Any]]:
    """Lines of torque and residual: two models of one log, or two logs."""
    torque: list[dict[str, Any]] = []
    residual = []
    if n_tables == 1:
        torque.append(
            {"label": "measured", "colour": "measured", "wide": True, "of": [0, "measured"]}
        )
    for k, (name, colour) in enumerate(zip(report["names"], COLOURS, strict=True)):
        line = {"label": name, "colour": colour, "dash": k == 0}
        if n_tables == 1:
            model = ("first", "second")[k]
            torque.append({**line, "of": [0, model]})
            residual.append({**line, "dash": False, "of": [0, "measured", model]})
        else:
            torque.append({**line, "label": f"{name}, measured", "of": [k, "measured"]})
            residual.append({**line, "dash": False, "of": [k, "measured", "model"]})
    return torque, residual


def _shown(report: dict[str, Any]) -> list[int]:
    """The joints on which the two differ most."""
    ratios = [row["ratio"] for row in report["ratios"]]
    sizes = [max(r, 1 / r) if r else 0.0 for r in ratios]
    return sorted(range(len(sizes)), key=lambda j: -sizes[j])[:2]
