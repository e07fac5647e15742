# SPDX-License-Identifier: BSD-3-Clause
"""Limits of motions."""

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm
from skidyn.exceptions import SkidynError
from skidyn.excitation import MotionLimits

ROBOT = load_planar_arm()


def test_limits_that_leave_no_room_are_refused_by_joint():
    for given, message in (
        ({"position": [[-1, 1], [1, -1]]}, r"joint 2 \(joint2\) leave no room"),
        ({"velocity": [0, 1]}, r"joint 1 \(joint1\) leave no room"),
        ({"velocity": [1, 1, 1]}, r"velocity limits have shape \(3,\); \(2,\)"),
        ({"torque": [np.nan, 1]}, "torque limits hold NaN"),
        ({"workspace": [[-1, 1]]}, r"workspace limits have shape \(1, 2\)"),
        ({"workspace": [[-1, 1], [1, 0], [0, 1]]}, "workspace leaves no room"),
    ):
        with pytest.raises(SkidynError, match=message):
            MotionLimits(**given).resolved(ROBOT)


def test_clearance_of_a_box_and_of_a_function():
    box = MotionLimits(workspace=[[0, 1], [0, 1], [0, 1]])
    np.testing.assert_allclose(box.clearance(np.array([[0.5, 0.2, 0.9], [0, 0, 2]])), [0.1, -1])
    floor = MotionLimits(workspace=lambda p: p[:, 2])
    np.testing.assert_allclose(floor.clearance(np.array([[0, 0, 0.3]])), [0.3])
    yes = MotionLimits(workspace=lambda p: p[:, 2] > 0)
    with pytest.raises(SkidynError, match="returned bool .* clearance of each position in m"):
        yes.clearance(np.zeros((4, 3)))
