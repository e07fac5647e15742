# SPDX-License-Identifier: BSD-3-Clause
import pytest

from skidyn.report._figures import budget_bars, curve_figure, fall_figure, map_figure


def test_points_without_a_place_are_left_out():
    curve = {
        "x": [0.0, None, 2.0], "effect": [0.0, 1.0, 2.0], "measured": [0.1, None, None],
        "low": [None] * 3, "high": [1.0, 1.0, 1.0], "variable": "dq2", "unit": "rad/s",
    }  # fmt: skip
    figure = curve_figure(curve, "N m")
    residual, effect = figure["series"]
    assert figure["x"] == [0.0, 2.0] and effect["values"] == [0.0, 2.0]
    assert residual["values"] == [0.1, None] and residual["low"] == [None, None]
    assert figure["x_label"] == "dq2 in rad/s" and figure["y_label"] == "residual in N m"


def test_errors_fall_to_a_floor_that_may_be_unknown():
    assert fall_figure([4.0, None, 1.0], None, "N")["values"] == [4.0, None, 1.0]


def test_largest_value_of_a_map_scales_its_colours():
    table = {"x": [0, 1, 2], "y": [0, 1], "variables": ["q1", "q2"], "units": ["rad", "m"]}
    figure = map_figure({**table, "table": [[None, -3.0]]})
    assert figure["largest"] == 3.0 and figure["y_label"] == "q2 in m"
    assert map_figure({**table, "table": [[None, None]]})["largest"] == 1.0


def test_budget_fills_the_bar_although_a_step_raised_the_error():
    (row,) = budget_bars([{"dahl": 0.5, "spring": -0.1, "noise": 0.5}], ["dahl", "spring", "noise"])
    assert [piece["share"] for piece in row] == pytest.approx([0.5, 0.0, 0.5])
