# SPDX-License-Identifier: BSD-3-Clause
"""Reports: a diagnosis, two compared, or a fleet, as dictionaries and as self-contained pages."""

from skidyn._writing import write_json
from skidyn.report._compare import summarize_comparison
from skidyn.report._fleet import summarize_fleet
from skidyn.report._summary import summarize
from skidyn.report._write import render_html, write_html

__all__ = [
    "render_html",
    "summarize",
    "summarize_comparison",
    "summarize_fleet",
    "write_html",
    "write_json",
]

# For other packages of skidyn; no part of the public interface.
from skidyn.report._decimate import rows_with_peaks as rows_with_peaks
