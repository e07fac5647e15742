# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn report``."""

from skidyn import cli


def test_report_makes_the_page_anew(diagnosed, run):
    page = diagnosed / "again.html"
    code, content = run("report", "--from", diagnosed / "report.json", "--html", page)
    assert (code, content) == (cli.DONE, {"html": str(page)})
    assert "Stribeck" in page.read_text("utf-8")
