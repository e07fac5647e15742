# SPDX-License-Identifier: BSD-3-Clause
"""Writing reports to disk: whole or not at all."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from skidyn._exceptions import SkidynError
from skidyn._writing import writable, write_json, write_text
from skidyn.report._compare_html import render_comparison
from skidyn.report._html import render_html

PathLike = str | os.PathLike[str]


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
    """Write the page of a comparison, and its numbers as JSON beside it.

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
        raise SkidynError(f"{path}: the page needs another ending, such as .html")
    writable(beside)  # neither without the other
    page = write_text(path, render_comparison(summary))
    return page, write_json(beside, summary["report"])
