# SPDX-License-Identifier: BSD-3-Clause
"""Where the numbers of a fleet come from."""


def test_versions_are_named(fleet_page):
    assert "Versions python" in fleet_page["provenance"]
