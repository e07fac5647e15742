# SPDX-License-Identifier: BSD-3-Clause
"""Where the numbers come from."""

from __future__ import annotations

from skidyn.report._picture import Picture


class Provenance(Picture):
    """Versions of the libraries."""

    place, title = 70, "Provenance"
