# SPDX-License-Identifier: BSD-3-Clause
"""Residual and torque over time, one panel per joint."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from skidyn._text import digits
from skidyn.report._picture import Canvas, Picture, Summary
from skidyn.report._traces import packed_table, traces

if TYPE_CHECKING:
    from skidyn.diagnosis import Diagnosis


class Time(Picture):
    """Data for the script ``panels.js``, and the errors of every trajectory as numbers."""

    place, title = 20, "Over time"

    def read(self, subject: Diagnosis) -> dict[str, Any]:
        """Curves that are thinned without losing a peak."""
        return {"traces": traces(subject), "errors": subject.comparison.table()}

    def show(self, summary: Summary, canvas: Canvas) -> dict[str, Any]:
        """Pass the panels to the script."""
        lines = [row["joints"] for row in summary["story"]["findings"]]
        found = [joint - 1 for joints in lines for joint in joints]
        failing = [failure["joint"] - 1 for failure in summary["where"]["failures"]]
        own = summary["time"]
        canvas.numbers["panels"] = {
            "joints": [
                _panel(summary, j, trace, bool(found)) for j, trace in enumerate(own["traces"])
            ],
            "starts": own["traces"][0]["starts"],
            "end": max(trace["time"][-1] for trace in own["traces"]),
            # the most important joints for a reader
            "shown": list(dict.fromkeys(failing + found))[:2] or [0],
        }
        return {"errors": own["errors"]}


def _panel(summary: Summary, j: int, trace: dict[str, Any], added: bool) -> dict[str, Any]:
    """Residual above torque for one joint."""
    unit = summary["units"][j]
    torque = [
        {"label": "measured", "colour": "measured", "wide": True, "of": [0, "measured"]},
        {"label": "as given", "colour": "before", "dash": True, "of": [0, "before"]},
    ]
    residual = [{"label": "as given", "colour": "before", "of": [0, "measured", "before"]}]
    if added:
        label = {"label": "with the findings", "colour": "after"}
        torque.append({**label, "of": [0, "after"]})
        residual.append({**label, "of": [0, "measured", "after"]})
    reach = trace["frame"]["reach"]
    drawn = {k: v for k, v in trace["columns"].items() if added or k != "after"}
    return {
        "name": f"{summary['report']['joints'][j]} ({j + 1})",
        "unit": unit,
        "tables": [packed_table(trace, drawn)],
        "plots": [
            {"label": f"residual in {unit}", "height": 210, "series": residual,
             "range": [-reach, reach], "note": _cut(trace["frame"], unit)},
            {"label": f"torque in {unit}", "height": 150, "series": torque},
        ],
        "apart": trace["apart"],
    }  # fmt: skip


def _cut(frame: dict[str, Any], unit: str) -> str:
    """A note on the peaks outside the axis of the residual."""
    if not frame["cut"]:
        return ""
    peaks = "One sample lies" if frame["cut"] == 1 else f"{frame['cut']:,} samples lie"
    return f"{peaks} outside this frame; the largest is {digits(frame['largest'])} {unit}."
