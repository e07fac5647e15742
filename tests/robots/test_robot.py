# SPDX-License-Identifier: BSD-3-Clause
"""What a user of Robot relies on beyond the numbers."""

import copy
import pickle
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from skidyn.datasets import load_panda, load_planar_arm, load_scara, load_srs_arm
from skidyn.robots import Robot


def states(robot, n_samples=50, seed=0):
    return np.random.default_rng(seed).normal(size=(3, n_samples, robot.n_joints))


@pytest.mark.parametrize("load", [load_panda, load_scara])
def test_torque_is_linear_in_the_parameters(load):
    robot = load()
    q, dq, ddq = states(robot)
    a, b = np.random.default_rng(1).normal(size=(2, robot.n_bodies, 10))
    torque = {
        name: robot.inverse_dynamics(q, dq, ddq, parameters=p)
        for name, p in (("a", a), ("b", b), ("mix", 2 * a - 3 * b))
    }
    np.testing.assert_allclose(torque["mix"], 2 * torque["a"] - 3 * torque["b"], atol=1e-10)
    Y = robot.torque_regressor(q, dq, ddq)
    np.testing.assert_allclose(Y @ a.ravel(), torque["a"], atol=1e-10)


@pytest.mark.parametrize("load", [load_panda, load_scara, load_srs_arm])
def test_mass_matrix_is_symmetric_positive_definite(load):
    robot = load()
    M = robot.mass_matrix(states(robot)[0])
    np.testing.assert_array_equal(M, M.transpose(0, 2, 1))
    assert np.linalg.eigvalsh(M).min() > 0


@pytest.mark.parametrize("n_samples", [0, 1, 8, 9, 63, 64, 65, 5000, 5121, 12000])
def test_any_number_of_samples_gives_the_same_torques(n_samples):
    robot = load_panda()
    q, dq, ddq = states(robot, n_samples)
    tau = robot.inverse_dynamics(q, dq, ddq)
    assert tau.shape == (n_samples, 7)
    for k in range(0, n_samples, max(1, n_samples // 7)):
        one = robot.inverse_dynamics(q[[k]], dq[[k]], ddq[[k]])
        np.testing.assert_allclose(tau[[k]], one, atol=1e-12)


@pytest.mark.parametrize("n_samples", [1, 3, 100, 6000])
def test_regressor_chunks_equal_the_whole(n_samples):
    robot = load_scara()
    q, dq, ddq = states(robot, n_samples)
    Y = robot.torque_regressor(q, dq, ddq)
    covered = 0
    for rows, part in robot.iter_torque_regressor(q, dq, ddq, chunk=64):
        assert part.shape == (4, 40, rows.stop - rows.start) and part.shape[-1] <= 64
        np.testing.assert_allclose(np.moveaxis(part, -1, 0), Y[rows], atol=1e-12)
        covered += part.shape[-1]
    assert covered == n_samples


def test_two_iterations_at_once_do_not_disturb_each_other():
    robot = load_scara()
    one, other = states(robot, 300, seed=1), states(robot, 300, seed=2)
    pairs = zip(
        robot.iter_torque_regressor(*one, chunk=100),
        robot.iter_torque_regressor(*other, chunk=100),
        strict=True,
    )
    expected_one, expected_other = robot.torque_regressor(*one), robot.torque_regressor(*other)
    for (rows, a), (_, b) in pairs:
        np.testing.assert_allclose(np.moveaxis(a, -1, 0), expected_one[rows], atol=1e-12)
        np.testing.assert_allclose(np.moveaxis(b, -1, 0), expected_other[rows], atol=1e-12)


def test_regressor_into_given_memory():
    robot = load_scara()
    q, dq, ddq = states(robot)
    out = np.full((4, 40, 50), np.nan)
    Y = robot.torque_regressor(q, dq, ddq, out=out)
    assert np.shares_memory(Y, out)
    np.testing.assert_array_equal(Y, robot.torque_regressor(q, dq, ddq))
    with pytest.raises(ValueError, match="out has shape"):
        robot.torque_regressor(q, dq, ddq, out=np.empty((4, 40, 51)))


def test_float32_error_is_as_stated():
    robot = load_panda()
    q, dq, ddq = states(robot, 500)
    exact, single = (robot.inverse_dynamics(q, dq, ddq, dtype=t) for t in (float, np.float32))
    assert single.dtype == np.float32
    assert np.abs(single - exact).max() < 2e-6 * np.abs(exact).max()


@pytest.mark.parametrize("n_samples", [1, 100, 7000])
def test_given_memory_of_full_chunks_and_a_remainder(n_samples):
    robot = load_panda()
    q, dq, ddq = states(robot, n_samples)
    Y = robot.torque_regressor(q, dq, ddq, out=np.full((7, 70, n_samples), np.nan))
    tau = robot.inverse_dynamics(q, dq, ddq)
    np.testing.assert_allclose(Y @ robot.inertial_parameters.ravel(), tau, atol=1e-10)


def test_other_gravity_is_felt_linearly():
    robot = load_panda()
    q = states(robot)[0]
    x, y, z = (robot.gravity_torque(q, gravity=g) for g in np.eye(3))
    np.testing.assert_allclose(
        robot.gravity_torque(q, gravity=(1.0, -2.0, 3.0)), x - 2 * y + 3 * z, atol=1e-12
    )
    np.testing.assert_allclose(robot.gravity_torque(q), -9.81 * z, atol=1e-12)


def test_power_balance():
    """Work of the torques is the change of kinetic and potential energy."""
    robot = load_srs_arm()
    q, dq, ddq = states(robot, 1)
    step = 1e-6

    def energy(t):
        position, velocity = q + t * dq + t * t / 2 * ddq, dq + t * ddq
        M = robot.mass_matrix(position)[0]
        return 0.5 * velocity[0] @ M @ velocity[0]

    power = (robot.inverse_dynamics(q, dq, ddq) - robot.gravity_torque(q))[0] @ dq[0]
    assert (energy(step) - energy(-step)) / (2 * step) == pytest.approx(power, rel=1e-6)


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


def test_torch_equals_numpy_and_has_gradients():
    torch = pytest.importorskip("torch")
    robot = load_scara()
    arrays = states(robot, 4)
    q, dq, ddq = (torch.tensor(a, requires_grad=True) for a in arrays)
    parameters = torch.tensor(robot.inertial_parameters.copy(), requires_grad=True)
    tau = robot.inverse_dynamics_torch(q, dq, ddq, parameters)
    np.testing.assert_allclose(tau.detach(), robot.inverse_dynamics(*arrays), atol=1e-12)
    np.testing.assert_allclose(
        robot.inverse_dynamics_torch(q, dq, ddq).detach(), tau.detach(), atol=1e-12
    )
    Y = robot.torque_regressor_torch(q, dq, ddq)
    np.testing.assert_allclose(Y.detach(), robot.torque_regressor(*arrays), atol=1e-12)
    assert torch.autograd.gradcheck(robot.inverse_dynamics_torch, (q, dq, ddq, parameters))
    (gradient,) = torch.autograd.grad(tau.sum(), parameters)
    np.testing.assert_allclose(gradient.ravel(), Y.sum((0, 1)).detach(), atol=1e-10)


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
    ],
)
def test_wrong_arguments_are_named(call, message):
    robot = load_planar_arm()
    with pytest.raises(ValueError, match=message):
        call(robot, states(robot)[0])


def test_long_chain():
    """A chain of 200 equal pendulums, each hanging on the one before."""
    parts = ['<robot name="chain"><link name="l0"/>']
    for i in range(200):
        parts.append(
            f'<link name="l{i + 1}"><inertial><mass value="1"/></inertial></link>'
            f'<joint name="j{i}" type="continuous"><parent link="l{i}"/><child link="l{i + 1}"/>'
            '<origin xyz="0 0.1 0"/></joint>'
        )
    robot = Robot.from_urdf("".join([*parts, "</robot>"]))
    torque = robot.gravity_torque(np.zeros((2, 200)))[0]
    # Bodies k, k+1, .. 199 hang 0, 0.1, .. m out from joint k; turning about x lifts them.
    expected = [9.81 * 0.1 * sum(range(200 - k)) for k in range(200)]
    np.testing.assert_allclose(torque, expected, rtol=1e-12)


def test_massless_joint_has_no_forward_dynamics():
    robot = Robot.from_urdf(
        '<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="continuous">'
        '<parent link="a"/><child link="b"/></joint></robot>'
    )
    with pytest.raises(ValueError, match="moves no mass"):
        robot.forward_dynamics([[0.0]], [[0.0]], [[1.0]])
