# SPDX-License-Identifier: BSD-3-Clause
"""Findings of both side by side."""

from __future__ import annotations

from skidyn.report._picture import Picture


class What(Picture):
    """Effects that are missing in either of the two, with their sizes."""

    place, title = 20, "What is missing"
