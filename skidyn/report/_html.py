# SPDX-License-Identifier: BSD-3-Clause
"""The report page: one self-contained HTML file made from the summary."""

from __future__ import annotations

from typing import Any

from skidyn._text import digits
from skidyn.report._bars import scale_of
from skidyn.report._figures import budget_bars, curve_figure, fall_figure, map_figure
from skidyn.report._glossary import MEANINGS
from skidyn.report._page import heat, packed, render_page

VERDICTS = {
    "complete": ("✓", "The model is complete"),
    "missing": ("!", "The model lacks a known effect"),
    "unknown": ("?", "The model lacks something without a name"),
}


def render_html(summary: dict[str, Any]) -> str:
    """Make the report page.

    Parameters
    ----------
    summary : dict
        From :func:`skidyn.report.summarize`.

    Returns
    -------
    html : str
        A whole page that loads nothing from anywhere: styles, scripts, the plotting library and
        numbers are inside. Every text of the summary is escaped.

    Raises
    ------
    ImportError
        Jinja2 is not installed (``pip install 'skidyn[report]'``).

    Examples
    --------
    >>> from skidyn.report import render_html, summarize
    >>> page = render_html(summarize(diagnosis))  # doctest: +SKIP
    """
    report, units = summary["report"], summary["units"]
    causes = _causes(summary["budget"])
    figures: list[dict[str, Any]] = []
    findings = [_finding(finding, units, figures) for finding in summary["findings"]]
    told = summary["story"]
    falls = []
    if findings:
        for row in told["joints"]:
            if not row["speaks"]:
                continue
            j = row["joint"] - 1
            errors = [step["rmse"][j] for step in report["history"]]
            falls.append({"joint": j + 1, "figure": len(figures)})
            figures.append(fall_figure(errors, summary["noise"][j], units[j]))
    return render_page(
        "diagnosis.html.jinja",
        s=summary,
        r=report,
        t=told,
        ranked=sorted(told["joints"], key=lambda row: -(row["ratios"][0] or 0.0)),
        scale=scale_of(ratio for row in told["joints"] for ratio in row["ratios"]),
        hero=_hero(findings, told["joints"]),
        heat=heat(summary["error_map"], summary["noise"], summary["judged"]),
        remainder=summary["remainder"],
        glossary=MEANINGS,
        findings=findings,
        falls=falls,
        causes=causes,
        budget=budget_bars(summary["budget"], causes),
        parts=_parts(summary),
        numbers={"panels": _panels(summary), "figures": figures},
    )


def _parts(summary: dict[str, Any]) -> list[tuple[str, str]]:
    """Sections of the page that hold something: anchor and title, for the list of contents."""
    parts = [("where", "Where it fails")]
    if summary["findings"]:
        parts += [("what", "What is missing"), ("adding", "The error falling")]
    return [
        *parts,
        ("left", "What is left"),
        ("limits", "What could hide"),
        ("glossary", "Terms"),
        ("provenance", "Provenance"),
    ]


def _hero(findings: list[dict[str, Any]], rows: list[dict[str, Any]]) -> dict[str, Any] | None:
    """The picture of the first screen: the effect on the joint whose error is worst."""
    charts = [
        {**chart, "title": finding["title"], "map": bool(finding["map_figures"])}
        for finding in findings
        for chart in (finding["map_figures"] or finding["charts"])
    ]

    def worst(chart: dict[str, Any]) -> float:
        return rows[chart["joint"] - 1]["ratios"][0] or 0.0

    return max(charts, key=worst, default=None)


def _finding(
    finding: dict[str, Any], units: list[str], figures: list[dict[str, Any]]
) -> dict[str, Any]:
    """A finding with one row per parameter and joint; its pictures are added to the figures."""
    maps, charts = [], []
    for table in finding["maps"]:
        maps.append({**table, "figure": len(figures)})
        figures.append(map_figure(table))
    for curve in finding["curves"]:
        charts.append({**curve, "figure": len(figures)})
        figures.append(curve_figure(curve, units[curve["joint"] - 1]))
    return {**finding, "rows": parameter_rows(finding), "charts": charts, "map_figures": maps}


def parameter_rows(finding: dict[str, Any]) -> list[dict[str, Any]]:
    """One row per parameter and joint.

    Parameters
    ----------
    finding : dict
        One of ``summary["findings"]``.

    Returns
    -------
    list of dict
        ``name, joint, value, low, high, unit``; the joint is a dash for a common parameter.
    """
    rows = []
    for name, p in finding["parameters"].items():
        values = p["value"] if isinstance(p["value"], list) else [p["value"]]
        # Directions and numbers of trajectories have no interval.
        lows, highs = (
            p[k] if isinstance(p[k], list) else [p[k]] * len(values) for k in ("low", "high")
        )
        for i, (value, low, high) in enumerate(zip(values, lows, highs, strict=True)):
            own = len(values) == len(finding["joints"])
            joint = finding["joints"][i] if own else "–"
            rows.append(
                {"name": name, "joint": joint, "value": value, "low": low, "high": high,
                 "unit": p["unit"]}
            )  # fmt: skip
    return rows


def _causes(budget: list[dict[str, float]]) -> list[str]:
    """Causes in the order they were added; the unexplained and the noise last."""
    seen = list(dict.fromkeys(c for shares in budget for c in shares if (shares[c] or 0) >= 0.005))
    last = [cause for cause in ("unexplained", "noise") if cause in seen]
    return [cause for cause in seen if cause not in last] + last


def _panels(summary: dict[str, Any]) -> dict[str, Any]:
    """Torque and residual over time for each joint."""
    found = [joint - 1 for finding in summary["findings"] for joint in finding["joints"]]
    failing = [failure["joint"] - 1 for failure in summary["failures"]]
    torque = [
        {"label": "measured", "colour": "measured", "wide": True, "of": [0, "measured"]},
        {"label": "as given", "colour": "before", "dash": True, "of": [0, "before"]},
    ]
    residual = [{"label": "as given", "colour": "before", "of": [0, "measured", "before"]}]
    keys = ["measured", "before"]
    if found:
        keys.append("after")
        torque.append({"label": "with the findings", "colour": "after", "of": [0, "after"]})
        residual.append(
            {"label": "with the findings", "colour": "after", "of": [0, "measured", "after"]}
        )
    joints = []
    for j, trace in enumerate(summary["traces"]):
        unit = summary["units"][j]
        table = {
            "time": packed(trace["time"]),
            "breaks": trace["breaks"],
            "columns": {key: packed(trace[key]) for key in keys},
        }
        reach = trace["frame"]["reach"]
        plots = [
            {"label": f"residual in {unit}", "height": 210, "series": residual,
             "range": [-reach, reach], "note": _cut(trace["frame"], unit)},
            {"label": f"torque in {unit}", "height": 150, "series": torque},
        ]  # fmt: skip
        name = f"{j + 1} {summary['report']['joints'][j]}"
        joints.append(
            {"name": name, "unit": unit, "tables": [table], "plots": plots,
             "apart": trace["apart"]}
        )  # fmt: skip
    return {
        "joints": joints,
        "starts": summary["traces"][0]["starts"],
        "end": max(trace["time"][-1] for trace in summary["traces"]),
        # the first joints a reader wants to see
        "shown": list(dict.fromkeys(failing + found))[:2] or [0],
    }


def _cut(frame: dict[str, Any], unit: str) -> str:
    """A note on the peaks that the axis of the residual leaves out."""
    if not frame["cut"]:
        return ""
    peaks = "One sample lies" if frame["cut"] == 1 else f"{frame['cut']:,} samples lie"
    return f"{peaks} outside this frame; the largest is {digits(frame['largest'])} {unit}."
