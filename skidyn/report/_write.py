# SPDX-License-Identifier: BSD-3-Clause
"""Make and write the page of a diagnosis, a comparison or a fleet; no file is left incomplete."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from skidyn._text import counted
from skidyn._writing import write_text
from skidyn.report._page import render_page


def render_html(summary: dict[str, Any]) -> str:
    """Make the page of a diagnosis, a comparison or a fleet.

    Parameters
    ----------
    summary : dict
        From :func:`skidyn.report.summarize`, :func:`skidyn.report.summarize_comparison` or
        :func:`skidyn.report.summarize_fleet`.

    Returns
    -------
    html : str
        A self-contained page without external resources: styles, scripts, the plotting library and
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
    report = summary["report"]
    page = report["schema"].removeprefix("skidyn.").partition("/")[0]
    if page == "fleet":
        columns = counted(len(report["columns"]), "coefficient")
        sub = f"{counted(len(report['robots']), 'robot')} · {columns}"
    elif page == "comparison":
        sides = (f"{side['name']} ({_size(side, ', ')})" for side in report["sides"])
        sub = f"{' against '.join(sides)} · {counted(len(report['joints']), 'joint')}"
    else:
        sub = f"{counted(len(report['joints']), 'joint')} · {_size(summary, ' · ')}"
    return render_page(page, summary, sub)


def write_html(path: str | os.PathLike[str], summary: dict[str, Any]) -> Path:
    """Write the page of a diagnosis, a comparison or a fleet.

    Parameters
    ----------
    path : path
        File to write; it is replaced in one step.
    summary : dict
        From :func:`skidyn.report.summarize`, :func:`skidyn.report.summarize_comparison` or
        :func:`skidyn.report.summarize_fleet`.

    Returns
    -------
    path : Path
        The file.

    Examples
    --------
    >>> from skidyn.report import summarize, write_html
    >>> write_html("report.html", summarize(diagnosis))  # doctest: +SKIP
    """
    return write_text(path, render_html(summary))


def _size(log: dict[str, Any], between: str) -> str:
    """Numbers of trajectories and samples of a log."""
    parts = counted(log["n_trajectories"], "trajectory"), counted(log["n_samples"], "sample")
    return between.join(parts)
