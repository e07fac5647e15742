# SPDX-License-Identifier: BSD-3-Clause
"""The error that falls step by step."""

from skidyn.report import render_html, summarize


def test_errors_fall_with_every_step(diagnosis_page):
    shown = diagnosis_page["adding"]
    assert "shoulder (1) N m 3.004 0.211 0.211 0.2" in shown
    assert "Dahl friction (pre-sliding) 60%, spring 10%, noise 30%" in shown


def test_without_findings_nothing_falls(fakes):
    page = render_html(summarize(fakes.make_diagnosis("complete")))
    assert 'id="adding"' not in page
