# SPDX-License-Identifier: BSD-3-Clause
"""Parameters as rows of a table."""

from skidyn.report import render_html, summarize
from skidyn.report._parameters import parameter_rows


def test_parameters_of_several_joints_get_a_row_each(fakes):
    page = render_html(summarize(fakes.make_diagnosis()))
    assert page.count('<th scope="row">Fc</th>') == 3


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
