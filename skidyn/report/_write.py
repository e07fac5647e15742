# SPDX-License-Identifier: BSD-3-Clause
"""Make and write pages of a diagnosis, a comparison and a fleet; no file is left incomplete."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from skidyn._exceptions import SkidynError
from skidyn._writing import writable, write_json, write_text
from skidyn.report._page import render_page

PathLike = str | os.PathLike[str]


def render_html(summary: dict[str, Any]) -> str:
    """Make the report page.

    Parameters
    ----------
    summary : dict
        From :func:`skidyn.report.summarize`.

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
    n_joints = len(summary["report"]["joints"])
    return render_page("diagnosis", summary, f"{n_joints} joints · {_size(summary, ' · ')}")


def render_comparison(summary: dict[str, Any]) -> str:
    """Make the page of a comparison.

    Parameters
    ----------
    summary : dict
        From :func:`skidyn.report.summarize_comparison`.

    Returns
    -------
    html : str
        A self-contained page without external resources. Every text of the summary is escaped.

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
    sides = (f"{side['name']} ({_size(side, ', ')})" for side in report["sides"])
    return render_page(
        "comparison", summary, f"{' against '.join(sides)} · {len(report['joints'])} joints"
    )


def render_fleet(summary: dict[str, Any]) -> str:
    """Make the page of a fleet.

    Parameters
    ----------
    summary : dict
        From :func:`skidyn.report.summarize_fleet`.

    Returns
    -------
    html : str
        A self-contained page without external resources. Every text of the summary is escaped.

    Raises
    ------
    ImportError
        Jinja2 is not installed (``pip install 'skidyn[report]'``).

    Examples
    --------
    >>> from skidyn.report import render_fleet, summarize_fleet
    >>> page = render_fleet(summarize_fleet(compare_fleet(evidence)))  # doctest: +SKIP
    """
    report = summary["report"]
    return render_page(
        "fleet", summary, f"{len(report['robots'])} robots · {len(report['columns'])} coefficients"
    )


def write_html(path: PathLike, summary: dict[str, Any]) -> Path:
    """Write the report page.

    Parameters
    ----------
    path : path
        File to write; it is replaced in one step.
    summary : dict
        From :func:`skidyn.report.summarize`.

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


def write_comparison(path: PathLike, summary: dict[str, Any]) -> tuple[Path, Path]:
    """Write the page of a comparison, and its numbers as JSON in the same folder.

    Parameters
    ----------
    path : path
        Page to write; the numbers go to the same name with the ending ``.json``. Both are replaced
        in one step each.
    summary : dict
        From :func:`skidyn.report.summarize_comparison`.

    Returns
    -------
    page, numbers : Path
        The files.

    Raises
    ------
    SkidynError
        The page's own name ends in ``.json``.

    Examples
    --------
    >>> from skidyn.report import summarize_comparison, write_comparison
    >>> write_comparison("wear.html", summarize_comparison(new, worn))  # doctest: +SKIP
    (PosixPath('wear.html'), PosixPath('wear.json'))
    """
    beside = Path(path).with_suffix(".json")
    if beside == Path(path):
        raise SkidynError(f"{path}: the name of the page needs another suffix, such as .html")
    writable(beside)  # both or neither
    page = write_text(path, render_comparison(summary))
    return page, write_json(beside, summary["report"])


def write_fleet(path: PathLike, summary: dict[str, Any]) -> Path:
    """Write the page of a fleet.

    Parameters
    ----------
    path : path
        File to write; it is replaced in one step.
    summary : dict
        From :func:`skidyn.report.summarize_fleet`.

    Returns
    -------
    path : Path
        The file.

    Examples
    --------
    >>> from skidyn.report import summarize_fleet, write_fleet
    >>> write_fleet("fleet.html", summarize_fleet(compare_fleet(evidence)))  # doctest: +SKIP
    """
    return write_text(path, render_fleet(summary))


def _size(log: dict[str, Any], between: str) -> str:
    """Numbers of trajectories and samples of a log."""
    n = log["n_trajectories"]
    return f"{n} trajector{'y' if n == 1 else 'ies'}{between}{log['n_samples']:,} samples"
