# SPDX-License-Identifier: BSD-3-Clause
"""Residuals of both over the motion of each joint."""


def test_first_the_joints_that_part_most_then_the_others(comparison_page):
    first, _, rest = comparison_page["residuals"].partition("Other joints")
    assert "shoulder (1)" in first and "over its velocity" in first
    assert "slider (3)" in rest and "shoulder (1)" not in rest
