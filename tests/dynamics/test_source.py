# SPDX-License-Identifier: BSD-3-Clause
"""A tape as program text."""

from skidyn.datasets import load_planar_arm
from skidyn.dynamics import C, renumber
from skidyn.export import c_source, python_source


def test_the_same_statements_in_two_languages():
    one, other = c_source(load_planar_arm()), python_source(load_planar_arm())
    assert one.count("sin(") == other.count("sin(") > 0
    assert "import" not in one and "#include" not in other


def test_names_are_numbered_in_the_order_in_which_they_are_used():
    lines = renumber(["v7 = q[0];", "v9 = v7 * v7;", "tau[0] = v9;"])
    assert lines == ["v0 = q[0];", "v1 = v0 * v0;", "tau[0] = v1;"]


def test_signs_in_c_need_no_branch():
    sign = C["sign"].format("x")
    assert [eval(sign, {"x": x}) for x in (-2.0, 0.0, 3.0)] == [-1, 0, 1]
