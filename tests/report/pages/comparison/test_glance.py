# SPDX-License-Identifier: BSD-3-Clause
"""The first screen of a comparison."""


def test_both_are_named(comparison_page):
    assert "new" in comparison_page["verdict"] and "worn" in comparison_page["verdict"]
