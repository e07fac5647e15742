# SPDX-License-Identifier: BSD-3-Clause
import re

import pytest

from skidyn.report import render_html, summarize
from skidyn.report._parameters import parameter_rows


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


def test_parameters_of_several_joints_get_a_row_each(fakes):
    page = render_html(summarize(fakes.make_diagnosis()))
    assert page.count('<th scope="row">Fc</th>') == 3


def test_numbers_of_the_page_are_those_of_the_report(fakes):
    summary = summarize(fakes.make_diagnosis())
    page = render_html(summary)
    before = [float(x) for x in re.findall(r'data-before="([^"]+)"', page)]
    after = [float(x) for x in re.findall(r'data-after="([^"]+)"', page)]
    assert sorted(before) == pytest.approx(sorted(summary["report"]["rmse_before"]))
    assert sorted(after) == pytest.approx(sorted(summary["report"]["rmse_after"]))


def test_non_finite_numbers_do_not_break_the_page(fakes):
    diagnosis = fakes.make_diagnosis()
    diagnosis.noise[0] = float("nan")
    diagnosis.findings[0].curves[0]["measured"][:3] = float("nan")
    page = render_html(summarize(diagnosis))
    assert "nan" not in page.partition("<script")[0].lower().replace("provenance", "")


def test_directions_and_trajectories_have_a_row_each_without_interval():
    finding = {
        "joints": [1, 2],
        "parameters": {
            "force": {"value": [3.0, 0.0, -4.0], "low": None, "high": None, "unit": "N"},
            "Fv": {"value": [0.3, 0.4], "low": [0.2, 0.3], "high": [0.4, 0.5], "unit": "N m s/rad"},
        },
    }

    rows = parameter_rows(finding)

    assert [row["value"] for row in rows] == [3.0, 0.0, -4.0, 0.3, 0.4]
    assert [row["low"] for row in rows] == [None, None, None, 0.2, 0.3]
    assert [row["joint"] for row in rows] == ["–", "–", "–", 1, 2]
