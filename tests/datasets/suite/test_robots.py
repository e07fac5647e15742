# SPDX-License-Identifier: BSD-3-Clause
"""Robots of the suite."""

from collections import Counter

import numpy as np
import pytest

from skidyn.datasets import hidden_effect_suite, load_planar_arm
from skidyn.robots import Robot


def test_several_robots_are_drawn():
    drawn = Counter(case.robot for case in hidden_effect_suite(0, 200))
    assert set(drawn) == {"panda", "planar_arm", "scara", "srs_arm", "ur10e", "ur5"}
    assert min(drawn.values()) >= 10


@pytest.mark.slow
def test_the_description_of_a_case_is_that_of_its_robot(written):
    robot, own = Robot.from_urdf(written.case / "robot.urdf"), load_planar_arm()
    assert robot.joint_names == own.joint_names
    np.testing.assert_allclose(robot.inertial_parameters, own.inertial_parameters)
