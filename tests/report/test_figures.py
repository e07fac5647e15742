# SPDX-License-Identifier: BSD-3-Clause
"""Figures of a page, as numbers that its script draws."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from skidyn.report import render_html, summarize


def figures(summary):
    """A page, and the figures in it."""
    page = render_html(summary)
    (numbers,) = re.findall(r'<script type="application/json"[^>]*>(.*?)</script>', page, re.DOTALL)
    return page, json.loads(numbers)["figures"]


def test_points_without_a_place_are_left_out(fakes):
    diagnosis = fakes.make_diagnosis()
    nan = np.nan
    curve = {
        "x": [0.0, nan, 2.0], "effect": [0.0, 1.0, 2.0], "measured": [0.1, nan, nan],
        "low": [nan] * 3, "high": [1.0, 1.0, 1.0], "variable": "dq2", "unit": "rad/s", "joint": 2,
    }  # fmt: skip
    diagnosis.findings[0] = replace(diagnosis.findings[0], curves=[curve])
    (figure,) = [f for f in figures(summarize(diagnosis))[1] if f.get("x_label") == "dq2 in rad/s"]
    residual, effect = figure["series"]
    assert figure["x"] == [0.0, 2.0] and effect["values"] == [0.0, 2.0]
    assert residual["values"] == [0.1, None] and residual["low"] == [None, None]
    assert figure["y_label"] == "residual in N m"


@pytest.mark.parametrize(("value", "largest"), [(-3.0, 3.0), (None, 1.0)])
def test_largest_value_of_a_map_scales_its_colours(fakes, value, largest):
    summary = summarize(fakes.make_diagnosis())
    table = {
        "x": [0.0, 1.0, 2.0], "y": [0.0, 1.0], "variables": ["q1", "q2"], "units": ["rad", "m"],
        "table": [[None, value]], "joint": 1,
    }  # fmt: skip
    summary["what"][0]["maps"] = [table]
    (figure,) = [f for f in figures(summary)[1] if f["type"] == "map"]
    assert figure["largest"] == largest and figure["y_label"] == "q2 in m"


def test_errors_fall_to_a_floor_that_may_be_unknown(fakes):
    diagnosis = fakes.make_diagnosis()
    diagnosis.noise[0] = np.nan
    falls = [f for f in figures(summarize(diagnosis))[1] if f["type"] == "bars"]
    assert falls[0]["floor"] is None
    assert falls[0]["values"] == [step["rmse"][0] for step in diagnosis.history]


def test_budget_fills_the_bar_although_a_step_raised_the_error(fakes):
    diagnosis = fakes.make_diagnosis()
    diagnosis.budget = [{"dahl": 0.5, "spring": -0.1, "noise": 0.5}] * 3
    page, _ = figures(summarize(diagnosis))
    (first, *_) = re.findall(r'aria-label="Error budget of joint 1">(.*?)</div>', page)
    assert [float(x) for x in re.findall(r"flex-grow:([\d.]+)", first)] == [0.5, 0.5]
