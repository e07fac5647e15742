# SPDX-License-Identifier: BSD-3-Clause
"""Where the numbers come from."""

from __future__ import annotations

from skidyn.report._picture import Picture


class Provenance(Picture):
    """Versions, files and options of the report."""

    place, title = 80, "Provenance"
