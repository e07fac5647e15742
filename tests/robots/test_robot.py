# SPDX-License-Identifier: BSD-3-Clause
"""What a user of Robot relies on beyond the numbers."""

import copy
import pickle
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from skidyn.datasets import load_panda, load_planar_arm
from skidyn.robots import Robot


def states(robot, n_samples=50, seed=0):
    return np.random.default_rng(seed).normal(size=(3, n_samples, robot.n_joints))


def test_other_gravity_is_felt_linearly():
    robot = load_panda()
    q = states(robot)[0]
    x, y, z = (robot.gravity_torque(q, gravity=g) for g in np.eye(3))
    np.testing.assert_allclose(
        robot.gravity_torque(q, gravity=(1.0, -2.0, 3.0)), x - 2 * y + 3 * z, atol=1e-12
    )
    np.testing.assert_allclose(robot.gravity_torque(q), -9.81 * z, atol=1e-12)


def test_pickle_copy_and_threads():
    robot = load_panda()
    q, dq, ddq = states(robot)
    before = pickle.dumps(robot)
    expected = robot.inverse_dynamics(q, dq, ddq)
    assert pickle.dumps(robot) == before, "calls must not change the pickle (joblib hashes it)"
    np.testing.assert_array_equal(pickle.loads(before).inverse_dynamics(q, dq, ddq), expected)
    assert copy.deepcopy(robot) is robot
    with ThreadPoolExecutor(4) as pool:
        for tau in pool.map(lambda _: robot.inverse_dynamics(q, dq, ddq), range(16)):
            np.testing.assert_array_equal(tau, expected)


def test_robot_is_immutable():
    robot = load_planar_arm()
    for immutable in (robot, pickle.loads(pickle.dumps(robot))):
        with pytest.raises(AttributeError):
            immutable.name = "other"
        with pytest.raises(ValueError, match="read-only"):
            immutable.inertial_parameters[0, 0] = 1.0
    with pytest.raises(ValueError, match="read-only"):
        robot.tree.axes[0] = 1.0


def test_representations():
    robot = load_planar_arm()
    assert repr(robot) == "Robot('planar_arm', n_joints=2)"
    assert "joint2" in robot._repr_html_()
    assert robot.parameter_names[:2] == ("m_link1", "mcx_link1")
    assert len(robot.parameter_names) == 20
    assert robot.joint_dynamics["damping"].tolist() == [0.2741, 0.1713]


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda r, q: r.inverse_dynamics(q[:, :1], q, q), r"q has shape \(50, 1\); expected"),
        (lambda r, q: r.inverse_dynamics(q, q, q[:3]), "ddq has 3 samples"),
        (lambda r, q: r.inverse_dynamics(q[0], q[0], q[0]), r"shape \(2,\)"),
        (lambda r, q: r.mass_matrix(q, parameters=np.ones(3)), "parameters has shape"),
        (lambda r, q: r.jacobian(q, 2), "body is 2"),
        (lambda r, q: r.forward_kinematics(q, "hand"), "no link 'hand'"),
        (lambda r, q: list(r.iter_torque_regressor(q, q, q, chunk=0)), "chunk is 0"),
        (lambda r, q: list(r.iter_torque_regressor(q, q, q, body=99)), "body is 99"),
    ],
)
def test_wrong_arguments_are_named(call, message):
    robot = load_planar_arm()
    with pytest.raises(ValueError, match=message):
        call(robot, states(robot)[0])


def test_massless_joint_has_no_forward_dynamics():
    robot = Robot.from_urdf(
        '<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="continuous">'
        '<parent link="a"/><child link="b"/></joint></robot>'
    )
    with pytest.raises(ValueError, match="moves no mass"):
        robot.forward_dynamics([[0.0]], [[0.0]], [[1.0]])
