# SPDX-License-Identifier: BSD-3-Clause
"""Every deviation in numbers."""


def test_common_value_deviation_and_distance(fleet_page):
    told = "robot 8 Fv of viscous friction on joint 1 1 1.2 12 1e−09"
    assert told in fleet_page["what"]
