# SPDX-License-Identifier: BSD-3-Clause
"""An exported URDF, read again, is the fitted model."""

import numpy as np
import pytest

from skidyn.datasets import load_scara
from skidyn.export import write_urdf
from skidyn.robots import Robot

NAMES = ["tree", "scara", "planar_arm", "ur5", "panda"]


@pytest.mark.parametrize("name", NAMES)
def test_nominal_parameters_of_the_urdf_give_the_torque_of_the_model(
    consistent, name, states, tmp_path
):
    model = consistent[name]
    path = tmp_path / "robot.urdf"
    left = write_urdf(model, path)
    assert left == tuple(f"rotor_inertia of {j}" for j in model.robot_.joint_names)
    again = Robot.from_urdf(path)
    q, dq, ddq = states(again)
    friction = again.joint_dynamics
    rotor = [c[0] for t, c in model.effect_coefficients_.items() if t.kind == "rotor_inertia"]
    torque = again.inverse_dynamics(q, dq, ddq) + friction["damping"] * dq + rotor * ddq
    unit = np.where([kind == "prismatic" for kind in again.joint_types], 0.1, 1.0)
    torque += friction["friction"] * np.tanh(dq / (0.003 * unit))
    np.testing.assert_allclose(torque, model.predict(np.hstack([q, dq, ddq])), atol=1e-9)


@pytest.mark.parametrize("name", NAMES)
def test_joints_limits_and_frames_stay(name, load, states, tmp_path):
    robot = load(name)
    write_urdf(robot, tmp_path / "robot.urdf")
    again = Robot.from_urdf(tmp_path / "robot.urdf")
    assert again.joint_names == robot.joint_names and again.joint_types == robot.joint_types
    np.testing.assert_array_equal(again.position_limits, robot.position_limits)
    np.testing.assert_array_equal(again.velocity_limits, robot.velocity_limits)
    np.testing.assert_array_equal(again.joint_dynamics["damping"], robot.joint_dynamics["damping"])
    q = states(robot)[0]
    for link in robot.links:
        poses = zip(
            again.forward_kinematics(q, link), robot.forward_kinematics(q, link), strict=True
        )
        for a, b in poses:
            np.testing.assert_allclose(a, b, atol=1e-12)


def test_a_payload_that_is_always_there_is_part_of_the_last_body(fit, states, tmp_path):
    robot = load_scara()
    model = fit(robot, ["payload"], parameters="nominal")
    (term,) = model.effect_terms_
    model.effect_coefficients_[term] = np.array([2, 0, 0, 0.1, 0.02, 0, 0, 0.02, 0, 0.01])
    assert write_urdf(model, tmp_path / "robot.urdf") == ()
    again = Robot.from_urdf(tmp_path / "robot.urdf")
    motion = states(robot)
    expected = model.predict(np.hstack(motion))
    np.testing.assert_allclose(again.inverse_dynamics(*motion), expected, atol=1e-9)
