# SPDX-License-Identifier: BSD-3-Clause
"""Largest undetected effects: the largest size of every effect that was not found."""

from __future__ import annotations

from skidyn.report._picture import Picture


class Limits(Picture):
    """The limits of the report, as a table."""

    place, title = 60, "Undetected effects"
