# SPDX-License-Identifier: BSD-3-Clause
"""Coefficients of two models side by side."""

import re

from skidyn.report import render_html, summarize_comparison


def side(value):
    return {"value": value, "std": 0.01, "low": value - 0.02, "high": value + 0.02}


def test_effects_come_first_and_what_differs_is_marked(fakes):
    summary = summarize_comparison(fakes.make_diagnosis(), fakes.make_diagnosis(n_samples=1500))
    summary["report"]["coefficients"] = [
        {"name": "m_link1", "sides": [side(2.0), None], "differs": None},
        {"name": "viscous.Fv[1]", "sides": [side(0.5), side(0.75)], "differs": True},
    ]
    page = render_html(summary)
    shown = re.search(r'<section id="coefficients">.*?</section>', page, re.S).group()
    assert shown.index("viscous.Fv[1]") < shown.index("m_link1")
    assert "1 base parameter of the rigid body" in shown
    assert shown.count('class="differs"') == 1


def test_models_without_coefficients_have_no_table(comparison_page):
    assert "coefficients" not in comparison_page
