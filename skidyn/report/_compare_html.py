# SPDX-License-Identifier: BSD-3-Clause
"""The page of a comparison: one self-contained HTML file made from its summary."""

from __future__ import annotations

from typing import Any

from skidyn.report._bars import scale_of
from skidyn.report._html import VERDICTS
from skidyn.report._page import heat, packed, render_page, short

#: Colours of the two, by their names in page.css.
COLOURS = ("before", "after")


def render_comparison(summary: dict[str, Any]) -> str:
    """Make the page of a comparison.

    Parameters
    ----------
    summary : dict
        From :func:`skidyn.report.summarize_comparison`.

    Returns
    -------
    html : str
        A whole page that loads nothing from anywhere. Every text of the summary is escaped.

    Raises
    ------
    ImportError
        Jinja2 is not installed (``pip install 'skidyn[report]'``).

    Examples
    --------
    >>> from skidyn.report import render_comparison, summarize_comparison
    >>> page = render_comparison(summarize_comparison(new, worn))  # doctest: +SKIP
    """
    report = summary["report"]
    figures = [_overlay(picture, report) for picture in summary["overlays"]]
    drawn = [{**picture, "figure": k} for k, picture in enumerate(summary["overlays"])]
    parts = [("time", "Torque over time"), ("errors", "Errors"), ("residuals", "Residuals"),
             ("findings", "Findings")]  # fmt: skip
    if report["coefficients"]:
        parts.append(("coefficients", "Coefficients"))
    return render_page(
        "comparison.html.jinja",
        s=summary,
        r=report,
        a=report["sides"][0],
        b=report["sides"][1],
        verdicts=VERDICTS,
        maps=_maps(report),
        ranked=_ranked(report),
        scale=scale_of(ratio for row in _ranked(report) for ratio in row["ratios"]),
        overlays=drawn,
        parts=[*parts, ("provenance", "Provenance")],
        numbers={"panels": _panels(summary), "figures": figures},
    )


def _ranked(report: dict[str, Any]) -> list[dict[str, Any]]:
    """Errors of both as given over their noise, the joint with the largest first."""
    rows = []
    for j, name in enumerate(report["joints"]):
        errors = [side["rmse_before"][j] for side in report["sides"]]
        noises = [side["noise"][j] for side in report["sides"]]
        ratios = [
            e / n if e is not None and n else 0.0 for e, n in zip(errors, noises, strict=True)
        ]
        text = ", ".join(
            f"{label} {short(error)}" for label, error in zip(report["names"], errors, strict=True)
        )
        rows.append(
            {"joint": j + 1, "name": name, "ratios": ratios, "text": f"{text} {report['units'][j]}"}
        )
    return sorted(rows, key=lambda row: -max(row["ratios"]))


def _overlay(picture: dict[str, Any], report: dict[str, Any]) -> dict[str, Any]:
    unit = report["units"][picture["joint"] - 1]
    return {
        "type": "lines",
        "x": picture["x"],
        "x_label": f"{picture['variable']} in {picture['unit']}",
        "y_label": f"residual in {unit}",
        "series": [
            {"label": name, "colour": colour, "style": "line", "dash": k == 0,
             "values": side["median"], "low": side["low"], "high": side["high"]}
            for k, (name, colour, side) in enumerate(
                zip(report["names"], COLOURS, picture["sides"], strict=True))
        ],
    }  # fmt: skip


def _maps(report: dict[str, Any]) -> list[list[list[dict[str, Any]]]]:
    """Error maps of both; a colour means the same on either side."""
    return [heat(side["error_map"], side["noise"], side["judged"]) for side in report["sides"]]


def _panels(summary: dict[str, Any]) -> dict[str, Any]:
    report, times = summary["report"], summary["times"]
    joints = []
    for j, tables in enumerate(times["joints"]):
        unit = report["units"][j]
        torque, residual = _series(report, len(tables))
        joints.append(
            {
                "name": f"{j + 1} {report['joints'][j]}",
                "unit": unit,
                "tables": [
                    {**table, "time": packed(table["time"]),
                     "columns": {k: packed(v) for k, v in table["columns"].items()}}
                    for table in tables
                ],
                "plots": [
                    {"label": f"torque in {unit}", "height": 210, "series": torque},
                    {"label": f"residual in {unit}", "height": 150, "series": residual},
                ],
            }
        )  # fmt: skip
    return {
        "joints": joints, "starts": times["starts"], "end": times["end"], "shown": _shown(report),
    }  # fmt: skip


def _series(report: dict[str, Any], n_tables: int) -> tuple[list[Any], list[Any]]:
    """Lines of the upper and the lower plot: two models of one log, or two logs."""
    torque: list[dict[str, Any]] = []
    residual = []
    if n_tables == 1:
        torque.append({"label": "measured", "colour": "measured", "of": [0, "measured"]})
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
