# SPDX-License-Identifier: BSD-3-Clause
"""Where the numbers of a comparison come from."""


def test_versions_are_named(comparison_page):
    assert "versions python" in comparison_page["provenance"]
