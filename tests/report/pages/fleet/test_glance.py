# SPDX-License-Identifier: BSD-3-Clause
"""The first screen of a fleet."""


def test_who_deviates_and_who_has_changed(fleet_page):
    shown = fleet_page["verdict"]
    assert "1 of 20 robots deviates: robot 8; robot 3 has changed over time" in shown
