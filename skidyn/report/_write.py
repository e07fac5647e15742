# SPDX-License-Identifier: BSD-3-Clause
"""Writing reports to disk: whole or not at all."""

from __future__ import annotations

import json
import os
import tempfile
from pathlib import Path
from typing import Any

from skidyn._exceptions import SkidynError
from skidyn.report._compare_html import render_comparison
from skidyn.report._html import render_html
from skidyn.report._plain import plain

PathLike = str | os.PathLike[str]


def write_text(path: PathLike, text: str) -> Path:
    """Write a file in one step, so that an interrupted run leaves no half of it."""
    target = Path(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    handle, temporary = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.")
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.write(text)
        # mkstemp makes private files; a report has the mode of any other new file
        umask = os.umask(0)
        os.umask(umask)
        os.chmod(temporary, 0o666 & ~umask)
        os.replace(temporary, target)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise
    return target


def write_json(path: PathLike, content: dict[str, Any]) -> Path:
    """Write a dictionary as JSON; numbers that are not finite become null.

    Parameters
    ----------
    path : path
        File to write; it is replaced in one step.
    content : dict
        For example ``diagnosis.to_dict()``.

    Returns
    -------
    path : Path
        The file.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from skidyn.report import write_json
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = write_json(pathlib.Path(folder, "a.json"), {"rmse": float("nan")})
    ...     print(file.read_text().strip())
    {
      "rmse": null
    }
    """
    return write_text(path, json.dumps(plain(content), indent=2, allow_nan=False) + "\n")


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
    page = write_text(path, render_comparison(summary))
    return page, write_json(beside, summary["report"])
