# SPDX-License-Identifier: BSD-3-Clause
import pytest

from skidyn.report._charts import Scale, budget_bars, curve_chart, fall_chart


def test_ticks_are_round_and_inside():
    scale = Scale(-3.2, 7.9, 0, 100)
    assert [tick["label"] for tick in scale.ticks(5)] == ["-2.5", "0", "2.5", "5", "7.5"]
    assert all(0 <= tick["at"] <= 100 for tick in scale.ticks(5))


@pytest.mark.parametrize("value", [0.0, 4.0, -1e-9])
def test_constant_values_have_an_axis(value):
    scale = Scale(value, value, 0, 100)
    assert scale(value) == 50
    assert scale.ticks()


def test_missing_values_interrupt_the_line():
    curve = {
        "x": [0.0, 1.0, 2.0, 3.0], "effect": [0.0, None, 1.0, 1.0],
        "measured": [0.0, None, 1.0, 1.0], "low": [None] * 4, "high": [None] * 4,
    }  # fmt: skip
    chart = curve_chart(curve)
    assert chart["effect"].count("M") == 2
    assert chart["band"] == ""
    assert len(chart["points"]) == 3


def test_bars_fall_with_the_error():
    chart = fall_chart([4.0, 2.0, 1.0], 1.0)
    heights = [bar["height"] for bar in chart["bars"]]
    assert heights[0] == pytest.approx(2 * heights[1], abs=0.3)
    assert chart["floor"] == pytest.approx(chart["bars"][2]["y"])


def test_budget_fills_the_bar_although_a_step_raised_the_error():
    (row,) = budget_bars([{"dahl": 0.5, "spring": -0.1, "noise": 0.5}], ["dahl", "spring", "noise"])
    assert [piece["width"] for piece in row] == [50, 0, 50]
    assert row[2]["x"] == 50
