# SPDX-License-Identifier: BSD-3-Clause
"""Findings of both side by side."""


def test_what_only_one_has_and_what_both_have(comparison_page):
    shown = comparison_page["what"]
    assert "Spring slider (3) only new Fc = 0.6 (0.5 to 0.7) N m" in shown
    assert "Dahl friction shoulder (1) both" in shown
