# SPDX-License-Identifier: BSD-3-Clause
"""Bodies that cannot exist are refused."""

from dataclasses import replace

import pytest

from skidyn.datasets import load_scara
from skidyn.export import write_urdf


def test_impossible_bodies_are_refused_by_name(tmp_path):
    robot = load_scara()
    for body, column, message in (
        (1, 0, "'link2' has a mass of -1"),
        (2, 4, "'quill' has the principal moments"),
    ):
        parameters = robot.inertial_parameters.copy()
        parameters[body, column] = -1.0
        with pytest.raises(ValueError, match=message):
            write_urdf(replace(robot, inertial_parameters=parameters), tmp_path / "x")
    assert not (tmp_path / "x").exists()
