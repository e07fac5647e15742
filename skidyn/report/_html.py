# SPDX-License-Identifier: BSD-3-Clause
"""The report page: one self-contained HTML file made from the summary."""

from __future__ import annotations

from typing import Any

from skidyn.report._page import render_page


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
    n = summary["n_trajectories"]
    return render_page(
        "diagnosis",
        summary,
        f"{len(summary['report']['joints'])} joints · {n} trajector{'y' if n == 1 else 'ies'} · "
        f"{summary['n_samples']:,} samples",
    )
