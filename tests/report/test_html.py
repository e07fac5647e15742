# SPDX-License-Identifier: BSD-3-Clause
import re

import pytest

from skidyn.report import render_html, summarize


def test_story_is_told_in_order(fakes):
    page = render_html(summarize(fakes.make_diagnosis()))
    order = [
        "Missing: ", "Where it fails", "What is missing", "The error falling", "What is left",
        "What this data could still hide", "Terms", "Provenance",
    ]  # fmt: skip
    places = [page.index(f"<h2>{title}") for title in order]
    assert places == sorted(places)
    assert "diagnosis.add(&#34;dahl&#34;, joints=[1, 2])" in page


def test_a_complete_model_has_no_findings_to_show(fakes):
    page = render_html(summarize(fakes.make_diagnosis("complete")))
    assert "<h2>Nothing significant is missing" in page
    assert "<h2>What is missing" not in page and "<h2>The error falling" not in page


def test_numbers_of_the_page_are_those_of_the_report(fakes):
    summary = summarize(fakes.make_diagnosis())
    page = render_html(summary)
    before = [float(x) for x in re.findall(r'data-before="([^"]+)"', page)]
    after = [float(x) for x in re.findall(r'data-after="([^"]+)"', page)]
    assert sorted(before) == pytest.approx(sorted(summary["report"]["rmse_before"]))
    assert sorted(after) == pytest.approx(sorted(summary["report"]["rmse_after"]))
