# SPDX-License-Identifier: BSD-3-Clause
"""Parameters as rows of a table."""

import re
from dataclasses import replace

from skidyn.report import render_html, summarize


def test_parameters_of_several_joints_get_a_row_each(fakes):
    page = render_html(summarize(fakes.make_diagnosis()))
    assert page.count('<th scope="row">Fc</th>') == 3


def test_directions_and_trajectories_have_a_row_each_without_interval(fakes):
    diagnosis = fakes.make_diagnosis()
    diagnosis.findings[0] = replace(
        diagnosis.findings[0],
        parameters={
            "force": {"value": [3.0, 0.0, -4.0], "low": None, "high": None, "unit": "N"},
            "Fv": {"value": [0.3, 0.4], "low": [0.2, 0.3], "high": [0.4, 0.5], "unit": "N m s/rad"},
        },
    )
    page = render_html(summarize(diagnosis))
    rows = re.findall(r'<th scope="row">(force|Fv)</th>(.*?)</tr>', page, re.DOTALL)
    told = [[name, *re.sub(r"<[^>]+>", " ", cells).split()] for name, cells in rows]
    assert [row[:3] for row in told[:3]] == [["force", "–", x] for x in ("3", "0", "−4")]
    assert [row[:3] for row in told[3:]] == [["Fv", "1", "0.3"], ["Fv", "2", "0.4"]]
