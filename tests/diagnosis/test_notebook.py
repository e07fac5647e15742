# SPDX-License-Identifier: BSD-3-Clause
"""The first screen in a notebook."""

import dataclasses


def test_a_notebook_shows_it_escaped(missing):
    hostile = dataclasses.replace(missing, joint_names=("<script>", "elbow"))
    html = hostile._repr_html_()
    assert "Missing: spring" in html and "<script>" not in html
    assert "nan" not in html.lower()


def test_a_finding_shows_itself_in_a_notebook(missing):
    finding = dataclasses.replace(missing.findings[0], title="<b>Spring")
    html = finding._repr_html_()
    assert "&lt;b&gt;Spring" in html and "on joint 2" in html
    assert "k = " in html and "diagnosis.add(" in html
