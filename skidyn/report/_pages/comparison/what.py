# SPDX-License-Identifier: BSD-3-Clause
"""Findings of both side by side."""

from __future__ import annotations

from skidyn.report._picture import Picture


class What(Picture):
    """Which effect is missing in which of the two, and how large it is there."""

    place, title = 20, "What is missing"
