# SPDX-License-Identifier: BSD-3-Clause
"""The page of a comparison: one self-contained HTML file made from its summary."""

from __future__ import annotations

from typing import Any

from skidyn.report._page import render_page


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
    sides = (
        f"{side['name']} ({side['n_trajectories']} "
        f"trajector{'y' if side['n_trajectories'] == 1 else 'ies'}, {side['n_samples']:,} samples)"
        for side in report["sides"]
    )
    return render_page(
        "comparison", summary, f"{' against '.join(sides)} · {len(report['joints'])} joints"
    )
