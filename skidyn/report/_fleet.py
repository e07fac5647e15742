# SPDX-License-Identifier: BSD-3-Clause
"""Data of the page of a fleet: robots that deviate, in which effect, and since when."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from skidyn._plain import plain
from skidyn._text import listed
from skidyn._version import versions
from skidyn.report._picture import read_all
from skidyn.report._words import coefficient_told, since_told

if TYPE_CHECKING:
    from skidyn.fleet import DriftReport, FleetComparison

#: Number of robots that are listed in the headline.
NAMED = 3


@dataclass(frozen=True)
class Fleet:
    """Subject of the page of a fleet: deviations, and drift of the robots that were monitored."""

    comparison: FleetComparison
    drift: Mapping[str, DriftReport]


def summarize_fleet(
    comparison: FleetComparison,
    *,
    drift: Mapping[str, DriftReport] | None = None,
    title: str = "Fleet",
    false_discovery_rate: float = 0.05,
) -> dict[str, Any]:
    """Summarize a fleet for its page, as a dictionary of JSON values.

    Parameters
    ----------
    comparison : FleetComparison
        From :func:`skidyn.fleet.compare_fleet`.
    drift : mapping of str to DriftReport, optional
        From :func:`skidyn.fleet.monitor_drift`, by the name of the robot.
    title : str, default="Fleet"
        Heading of the page.
    false_discovery_rate : float, default=0.05
        Expected share of false rows among those reported.

    Returns
    -------
    summary : dict
        ``report`` is machine-readable (schema ``skidyn.fleet/1``): robots, coefficients, common
        values and deviations, SI units; the rest is the data of the figures.

    Examples
    --------
    >>> from skidyn.report import summarize_fleet
    >>> summary = summarize_fleet(compare_fleet(evidence))  # doctest: +SKIP
    >>> summary["headline"]  # doctest: +SKIP
    '1 of 20 robots deviates: robot 7'
    """
    deviating = [
        {**row, "told": coefficient_told(row["column"])}
        for row in comparison.table(false_discovery_rate)
    ]
    watched = dict(drift or {})
    alarms = [
        {
            "robot": name,
            "told": coefficient_told(alarm["column"]),
            "since": since_told(alarm["date"]),
            **alarm,
            "date": str(alarm["date"]),
        }
        for name, report in watched.items()
        for alarm in report.alarms()
    ]
    report = {
        "schema": "skidyn.fleet/1",
        "robots": list(comparison.robots),
        "columns": list(comparison.columns),
        "common": comparison.common,
        "deviating": deviating,
        "alarms": alarms,
        "false_discovery_rate": false_discovery_rate,
        "versions": versions(),
    }
    document: dict[str, Any] = plain(
        {
            "report": report,
            "title": title,
            "headline": _headline(report),
            **read_all("fleet", Fleet(comparison, watched)),
        }
    )
    return document


def _headline(report: dict[str, Any]) -> str:
    """Number and names of the robots that deviate."""
    names = list(dict.fromkeys(row["robot"] for row in report["deviating"]))
    drifting = list(dict.fromkeys(row["robot"] for row in report["alarms"]))
    n = len(report["robots"])
    if not names and not drifting:
        return f"None of the {n} robots deviates from the others"
    parts = []
    if names:
        verb = "deviates" if len(names) == 1 else "deviate"
        parts.append(f"{len(names)} of {n} robots {verb}: {_some(names)}")
    if drifting:
        verb = "has" if len(drifting) == 1 else "have"
        parts.append(f"{_some(drifting)} {verb} changed over time")
    return "; ".join(parts)


def _some(names: list[str]) -> str:
    more = [f"{len(names) - NAMED} more"] if len(names) > NAMED else []
    return listed([*names[:NAMED], *more])
