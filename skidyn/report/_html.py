# SPDX-License-Identifier: BSD-3-Clause
"""The report page: one self-contained HTML file made from the summary."""

from __future__ import annotations

import base64
from importlib import resources
from typing import Any

import numpy as np

from skidyn._optional import import_optional
from skidyn.report._charts import budget_bars, curve_chart, fall_chart, map_chart

_VERDICTS = {
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
        A whole page that loads nothing from anywhere: styles, script, pictures and numbers are
        inside. Every text of the summary is escaped.

    Raises
    ------
    ImportError
        Jinja2 is not installed (``pip install 'skidyn[report]'``).

    Examples
    --------
    >>> from skidyn.report import render_html, summarize
    >>> page = render_html(summarize(diagnosis))  # doctest: +SKIP
    """
    jinja2 = import_optional("jinja2", extra="report")
    # the safeguard against names of joints that hold markup; `tojson` does it inside the script
    environment = jinja2.Environment(
        autoescape=True, trim_blocks=True, lstrip_blocks=True, undefined=jinja2.StrictUndefined
    )
    environment.filters.update(
        number=_number, percent=_percent, change=_change, chance=_chance, words=_words
    )
    markup = environment.from_string(_resource("page.html.jinja"))
    report = summary["report"]
    causes = _causes(summary["budget"])
    mark, headline = _VERDICTS[report["verdict"]]
    return str(
        markup.render(
            s=summary,
            r=report,
            mark=mark,
            headline=headline,
            css=_resource("page.css"),
            js=_resource("page.js"),
            heat=_heat(summary["error_map"]),
            findings=[_finding(finding) for finding in summary["findings"]],
            falls=_falls(report),
            causes=causes,
            budget=budget_bars(summary["budget"], causes),
            plots=_plots(summary),
            parts=_parts(summary),
        )
    )


def _resource(name: str) -> str:
    return resources.files("skidyn.report").joinpath(name).read_text(encoding="utf-8")


def _number(value: Any) -> str:
    """Three or four digits; a dash where there is no number."""
    if value is None:
        return "–"
    return f"{value:.4g}" if isinstance(value, (int, float)) else str(value)


def _percent(value: float | None) -> str:
    return "–" if value is None else f"{100 * value:.0f} %"


def _change(ratio: float) -> str:
    """Relative change in per cent, with a sign only where something changed."""
    rounded = round(100 * ratio)
    return f"{rounded:+d} %".replace("-", "−") if rounded else "0 %"


def _words(kind: str) -> str:
    return "effect without a name" if kind == "unknown" else kind.replace("_", " ")


def _chance(q_value: float | None) -> str:
    """A q-value; digits far below what any model of the noise can promise are not shown."""
    return "below 1e-15" if q_value is not None and q_value < 1e-15 else _number(q_value)


def _parts(summary: dict[str, Any]) -> list[tuple[str, str]]:
    """Sections of the page that hold something: anchor and title, for the list of contents."""
    parts = [("where", "Where it fails")]
    if summary["findings"]:
        parts += [("what", "What is missing"), ("adding", "What adding it does")]
    parts += [("unexplained", "Unexplained"), ("limits", "Limits")]
    if summary["warnings"]:
        parts.append(("warnings", "Warnings"))
    return [*parts, ("provenance", "Provenance")]


def _heat(table: list[list[float | None]]) -> list[list[dict[str, Any]]]:
    """Cells of the error map; the colour is the squared error relative to the joint's largest."""
    rows = []
    for row in table:
        largest = max((v for v in row if v is not None), default=0.0) or 1.0
        rows.append(
            [
                {"value": v, "depth": None if v is None else round((v / largest) ** 2, 2)}
                for v in row
            ]
        )
    return rows


def _finding(finding: dict[str, Any]) -> dict[str, Any]:
    """A finding with its pictures, and one row per parameter and joint."""
    rows = []
    for name, p in finding["parameters"].items():
        several = isinstance(p["value"], list)
        values, lows, highs = (p[k] if several else [p[k]] for k in ("value", "low", "high"))
        for i, (value, low, high) in enumerate(zip(values, lows, highs, strict=True)):
            own = len(values) == len(finding["joints"])
            joint = finding["joints"][i] if own else "–"
            rows.append(
                {"name": name, "joint": joint, "value": value, "low": low, "high": high,
                 "unit": p["unit"]}
            )  # fmt: skip
    charts = [{**curve, **curve_chart(curve)} for curve in finding["curves"]]
    maps = [{**table, **map_chart(table)} for table in finding["maps"]]
    return {**finding, "rows": rows, "charts": charts, "maps": maps}


def _falls(report: dict[str, Any]) -> list[dict[str, Any]]:
    history, floor = report["history"], report["noise_floor"]
    return [
        fall_chart([step["rmse"][j] or 0.0 for step in history], floor[j])
        for j in range(len(report["joints"]))
    ]


def _causes(budget: list[dict[str, float]]) -> list[str]:
    """Causes in the order they were added; the unexplained and the noise last."""
    seen = list(dict.fromkeys(c for shares in budget for c in shares if (shares[c] or 0) >= 0.005))
    last = [cause for cause in ("unexplained", "noise") if cause in seen]
    return [cause for cause in seen if cause not in last] + last


def _plots(summary: dict[str, Any]) -> dict[str, Any]:
    """What the script draws; numbers as base64 of 32-bit floats, a fifth of their size as text."""
    joints = []
    for j, trace in enumerate(summary["traces"]):
        joints.append(
            {
                "name": summary["report"]["joints"][j],
                "unit": summary["units"][j],
                "breaks": trace["breaks"],
                **{key: _packed(trace[key]) for key in ("time", "measured", "before", "after")},
            }
        )
    starts = summary["traces"][0]["starts"]
    end = max(trace["time"][-1] for trace in summary["traces"])
    found = [joint - 1 for finding in summary["findings"] for joint in finding["joints"]]
    failing = [failure["joint"] - 1 for failure in summary["failures"]]
    # the first joints a reader wants to see
    shown = list(dict.fromkeys(found + failing))[:2] or [0]
    return {"joints": joints, "starts": starts, "end": end, "shown": shown, "added": bool(found)}


def _packed(values: list[float | None]) -> str:
    array = np.array([np.nan if v is None else v for v in values], dtype="<f4")
    return base64.b64encode(array.tobytes()).decode("ascii")
