# SPDX-License-Identifier: BSD-3-Clause
"""Every deviation in numbers."""

from __future__ import annotations

from skidyn.report._picture import Picture


class What(Picture):
    """Coefficient, common value, deviation and its significance."""

    place, title = 20, "Deviating effects"
