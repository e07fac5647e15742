# SPDX-License-Identifier: BSD-3-Clause
"""A page loads nothing, and every text in it is escaped."""

import re

from skidyn.report import render_html, summarize


def test_markup_in_names_is_escaped(fakes):
    names = (fakes.HOSTILE, "</script><script>alert(2)</script>", 'it\'s "quoted"')
    diagnosis = fakes.make_diagnosis("unknown", names)
    diagnosis.warnings = [fakes.HOSTILE]
    page = render_html(summarize(diagnosis, title=fakes.HOSTILE, provenance={"x": fakes.HOSTILE}))
    assert "<img" not in page
    assert "<script>alert" not in page
    assert page.count("</script>") == 3


def test_page_loads_nothing(fakes):
    page = render_html(summarize(fakes.make_diagnosis()))
    assert not re.search(r"""(?:src|href)=["']?(?:https?:)?//""", page)
    assert "url(" not in page and "@import" not in page
    assert "default-src 'none'" in page


def test_non_finite_numbers_do_not_break_the_page(fakes):
    diagnosis = fakes.make_diagnosis()
    diagnosis.noise[0] = float("nan")
    diagnosis.findings[0].curves[0]["measured"][:3] = float("nan")
    page = render_html(summarize(diagnosis))
    assert "nan" not in page.partition("<script")[0].lower().replace("provenance", "")
