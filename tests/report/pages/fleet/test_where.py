# SPDX-License-Identifier: BSD-3-Clause
"""Every robot in every coefficient."""


def test_robots_that_deviate_come_first(fleet_page):
    first, _, rest = fleet_page["where"].partition("The other 19 robots")
    assert "robot 8 12 −0.39" in first and "robot 8 " not in rest
