# SPDX-License-Identifier: BSD-3-Clause
"""Reports: a diagnosis as a plain dictionary, and as one self-contained HTML page."""

from skidyn.report._html import render_html
from skidyn.report._summary import summarize
from skidyn.report._write import write_html, write_json

__all__ = ["render_html", "summarize", "write_html", "write_json"]
