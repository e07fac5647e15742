# SPDX-License-Identifier: BSD-3-Clause
"""The plotting library uPlot for the pages, with its licence."""

from __future__ import annotations

from importlib.resources import files


def bundled(name: str) -> str:
    """Text of a file that skidyn ships for its pages.

    Parameters
    ----------
    name : {"uPlot.js", "uPlot.css", "uPlot.LICENSE.txt"}
        File in ``skidyn/static``.
    """
    return files("skidyn").joinpath("static", name).read_text("utf-8")
