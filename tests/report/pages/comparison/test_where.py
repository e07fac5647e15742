# SPDX-License-Identifier: BSD-3-Clause
"""Errors of both side by side."""


def test_errors_with_their_change(comparison_page):
    assert "slider (3) N 0.36 0.36 −1% 0.20 0.20" in comparison_page["where"]
    assert "worn, as given: held-out error" in comparison_page["where"]
