# SPDX-License-Identifier: BSD-3-Clause
"""The plotting library uPlot for the pages, with its licence."""

from __future__ import annotations

from importlib.resources import files


def bundled(name: str) -> str:
    """Text of a file in ``skidyn/static`` that skidyn ships for its pages."""
    return files("skidyn").joinpath("static", name).read_text("utf-8")
