# SPDX-License-Identifier: BSD-3-Clause
"""Embedded robots."""

import numpy as np
import pytest

from skidyn import datasets

LOADERS = {
    "panda": 7,
    "planar_arm": 2,
    "scara": 4,
    "srs_arm": 7,
    "ur10e": 6,
    "ur5": 6,
}


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(("name", "n_joints"), LOADERS.items())
def test_robot_is_complete(name, n_joints):
    robot = getattr(datasets, f"load_{name}")()
    assert robot.name == name and robot.n_joints == n_joints
    assert np.all(robot.inertial_parameters[:, 0] > 0)
    assert np.all(np.isfinite(robot.position_limits)) and np.all(robot.velocity_limits > 0)
    assert np.all(robot.effort_limits > 0)
    q = np.random.default_rng(0).uniform(*robot.position_limits.T, size=(50, n_joints))
    assert np.linalg.eigvalsh(robot.mass_matrix(q)).min() > 0
    # A robot must be able to hold itself.
    assert np.all(np.abs(robot.gravity_torque(q)).max(axis=0) <= robot.effort_limits)


@pytest.mark.parametrize(
    ("name", "link", "reach"),
    [
        ("panda", "panda_link8", (0.088, 0.0, 0.926)),
        ("ur10e", "tool0", (-1.18425, -0.2907, 0.06085)),
        ("ur5", "tool0", (-0.81725, -0.19145, -0.005491)),
        ("srs_arm", "flange", (0.0, 0.0, 1.306)),
        ("planar_arm", "link2", (0.0, 0.0, -0.26)),
        ("scara", "tool", (0.6, 0.0, 0.14)),
    ],
)
def test_tool_is_where_the_data_sheet_puts_it_at_zero(name, link, reach):
    robot = getattr(datasets, f"load_{name}")()
    position, _ = robot.forward_kinematics(np.zeros((1, robot.n_joints)), link)
    np.testing.assert_allclose(position[0], reach, atol=1e-9)


def test_pelican_hangs_and_weighs_as_in_the_book():
    """Gravity model of Kelly, Santibanez and Loria (2005), section 5.3.2."""
    robot = datasets.load_planar_arm()
    q = np.random.default_rng(0).uniform(-3, 3, size=(20, 2))
    s1, s12 = np.sin(q[:, 0]), np.sin(q.sum(axis=1))
    g2 = 2.0458 * 0.0229 * 9.81 * s12
    g1 = (6.5225 * 0.0983 + 2.0458 * 0.26) * 9.81 * s1 + g2
    np.testing.assert_allclose(robot.gravity_torque(q), np.column_stack([g1, g2]), atol=1e-12)
