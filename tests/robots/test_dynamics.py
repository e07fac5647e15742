# SPDX-License-Identifier: BSD-3-Clause
"""Physics that must hold for any motion and any size of robot, and other implementations.

Kinematics and dynamics are those of pinocchio, which shares no code with skidyn.
"""

import re
from importlib.resources import files
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation

from skidyn.datasets import load_panda, load_planar_arm, load_scara, load_srs_arm
from skidyn.robots import Robot, find_base_parameters

ROBOTS = {
    "panda": load_panda(),
    "scara": load_scara(),
    "planar": load_planar_arm(),
    "srs": load_srs_arm(),
}
FILES = {"panda": "panda", "scara": "scara", "planar": "planar_arm", "srs": "srs_arm"}
seeds = st.integers(0, 2**31)
check = settings(max_examples=15, deadline=None)
TOLERANCE = 1e-9  # N m; N, m, kg m^2 alike
BRANCHED = """
<robot name="branched">
  <link name="base"/>
  <link name="trunk"><inertial><origin xyz="0.1 -0.02 0.3" rpy="0.3 -0.2 0.5"/><mass value="4"/>
    <inertia ixx="0.3" ixy="0.02" ixz="-0.01" iyy="0.25" iyz="0.03" izz="0.2"/></inertial></link>
  <link name="plate"><inertial><origin xyz="0 0.1 0.05" rpy="0.1 0 0"/><mass value="0.7"/>
    <inertia ixx="0.01" ixy="0" ixz="0.001" iyy="0.012" iyz="0" izz="0.011"/></inertial></link>
  <link name="left"><inertial><origin xyz="0.2 0 0"/><mass value="1.5"/>
    <inertia ixx="0.01" ixy="0.001" ixz="0" iyy="0.04" iyz="0.002" izz="0.04"/></inertial></link>
  <link name="slider"><inertial><origin xyz="0 0.03 -0.1"/><mass value="0.8"/>
    <inertia ixx="0.02" ixy="0" ixz="0.003" iyy="0.02" iyz="0" izz="0.01"/></inertial></link>
  <link name="wheel"><inertial><origin xyz="0.01 0 0"/><mass value="0.5"/>
    <inertia ixx="0.002" ixy="0" ixz="0" iyy="0.002" iyz="0" izz="0.003"/></inertial></link>
  <link name="right"><inertial><origin xyz="0 -0.2 0.02"/><mass value="1.1"/>
    <inertia ixx="0.03" ixy="0" ixz="0" iyy="0.01" iyz="0.001" izz="0.03"/></inertial></link>
  <link name="finger"><inertial><origin xyz="0.02 0 0.05"/><mass value="0.2"/>
    <inertia ixx="0.001" ixy="0" ixz="0" iyy="0.001" iyz="0" izz="0.0005"/></inertial></link>
  <joint name="turn" type="revolute"><parent link="base"/><child link="trunk"/>
    <origin xyz="0.1 0.2 0.3" rpy="0.2 0.1 -0.4"/><axis xyz="1 2 3"/>
    <limit lower="-2" upper="2" velocity="3" effort="50"/></joint>
  <joint name="bolt" type="fixed"><parent link="trunk"/><child link="plate"/>
    <origin xyz="0 0.1 0.2" rpy="0.3 1.0 -0.6"/></joint>
  <joint name="shoulder" type="revolute"><parent link="trunk"/><child link="left"/>
    <origin xyz="0 0.2 0.4" rpy="1.57079632679 0 3.14159"/>
    <limit lower="-2" upper="2" velocity="3" effort="50"/></joint>
  <joint name="slide" type="prismatic"><parent link="left"/><child link="slider"/>
    <origin xyz="0.4 0 0" rpy="0 0.5 0"/><axis xyz="0 1 -1"/>
    <limit lower="-1" upper="1" velocity="1" effort="50"/></joint>
  <joint name="spin" type="continuous"><parent link="slider"/><child link="wheel"/>
    <origin xyz="0 0 -0.2"/><axis xyz="0 -1 0"/></joint>
  <joint name="hip" type="revolute"><parent link="plate"/><child link="right"/>
    <origin xyz="0 -0.2 0.1" rpy="0 0 1.5707963267948966"/><axis xyz="0 0 -1"/>
    <limit lower="-2" upper="2" velocity="3" effort="50"/></joint>
  <joint name="follower" type="prismatic"><parent link="right"/><child link="finger"/>
    <origin xyz="0 -0.4 0" rpy="0 0.4 0"/><axis xyz="1 0 0"/>
    <limit lower="-1" upper="1" velocity="1" effort="5"/>
    <mimic joint="shoulder" multiplier="-0.3" offset="0.05"/></joint>
</robot>
"""
EMBEDDED = ("panda", "ur10e", "ur5", "srs_arm", "planar_arm", "scara")


def urdf_text(name):
    if name == "branched":
        return BRANCHED
    return (files("skidyn.datasets") / "robots" / f"{name}.urdf").read_text(encoding="utf-8")


def state(robot, seed, n=6):
    return np.random.default_rng(seed).uniform(-2, 2, (3, n, robot.n_joints))


@pytest.mark.parametrize("robot", ROBOTS.values(), ids=ROBOTS)
@check
@given(seed=seeds)
def test_mass_matrix_is_symmetric_and_positive_definite(robot, seed):
    m = robot.mass_matrix(state(robot, seed)[0])
    np.testing.assert_allclose(m, m.transpose(0, 2, 1), atol=1e-12 * np.abs(m).max())
    assert (np.linalg.eigvalsh(m) > 0).all()


@pytest.mark.parametrize("robot", ROBOTS.values(), ids=ROBOTS)
@check
@given(seed=seeds, factor=st.floats(-1e6, 1e6))
def test_torque_is_linear_in_the_parameters(robot, seed, factor):
    q, dq, ddq = state(robot, seed)
    one, two = np.random.default_rng(seed + 1).normal(size=(2, robot.n_bodies, 10))
    torque = [robot.inverse_dynamics(q, dq, ddq, parameters=p) for p in (one, two)]
    mixed = robot.inverse_dynamics(q, dq, ddq, parameters=one + factor * two)
    wanted = torque[0] + factor * torque[1]
    np.testing.assert_allclose(mixed, wanted, atol=1e-11 * (1 + np.abs(wanted).max()))


@pytest.mark.parametrize("robot", ROBOTS.values(), ids=ROBOTS)
@check
@given(seed=seeds)
def test_power_is_the_change_of_energy(robot, seed):
    """Without gravity, dq . tau = d/dt (dq' M dq / 2), by central differences along the motion."""
    q, dq, ddq = state(robot, seed)
    no_gravity = robot.inverse_dynamics(q, dq, ddq, gravity=(0, 0, 0))
    h = 1e-5

    def energy(t):
        v = dq + ddq * t
        m = robot.mass_matrix(q + dq * t + ddq * t**2 / 2)
        return 0.5 * np.einsum("ni,nij,nj->n", v, m, v)

    rate = (energy(h) - energy(-h)) / (2 * h)
    power = np.sum(dq * no_gravity, axis=1)
    np.testing.assert_allclose(power, rate, rtol=1e-6, atol=1e-5 * (1 + np.abs(power).max()))


@pytest.mark.parametrize("name", FILES)
@check
@given(seed=seeds)
def test_the_choice_of_the_base_frame_changes_nothing(name, seed):
    """A base turned and shifted anyhow, with gravity turned alike, gives the same torque."""
    rng = np.random.default_rng(seed)
    angles, place = rng.uniform(-np.pi, np.pi, 3), rng.uniform(-2, 2, 3)
    root = ElementTree.fromstring(urdf_text(FILES[name]))
    children = {joint.find("child").get("link") for joint in root.iter("joint")}
    base = next(link.get("name") for link in root.iter("link") if link.get("name") not in children)
    ElementTree.SubElement(root, "link", name="elsewhere")
    joint = ElementTree.SubElement(root, "joint", name="turned", type="fixed")
    ElementTree.SubElement(joint, "parent", link="elsewhere")
    ElementTree.SubElement(joint, "child", link=base)
    origin = {"rpy": angles, "xyz": place}
    ElementTree.SubElement(
        joint, "origin", {key: " ".join(map(repr, value.tolist())) for key, value in origin.items()}
    )
    gravity = Rotation.from_euler("xyz", angles).apply([0.0, 0.0, -9.81])
    turned = Robot.from_urdf(ElementTree.tostring(root, "unicode"), gravity=tuple(gravity))
    q, dq, ddq = state(turned, seed)
    torque = ROBOTS[name].inverse_dynamics(q, dq, ddq)
    np.testing.assert_allclose(
        turned.inverse_dynamics(q, dq, ddq), torque, atol=1e-12 * (1 + np.abs(torque).max())
    )
    n_base = [len(find_base_parameters(robot).index) for robot in (turned, ROBOTS[name])]
    assert n_base[0] == n_base[1]  # which of several equal choices is taken is up to rounding


@pytest.mark.parametrize("factor", [1e-6, 1e-3, 1e3, 1e6])
def test_mass_scales_torque_and_nothing_else(factor):
    """Robots from milligrams to thousands of tonnes: same base parameters, torque to scale."""
    robot = ROBOTS["planar"]
    text = re.sub(
        r'(mass value|i[xyz]{2})="([^"]+)"',
        lambda m: f'{m[1]}="{float(m[2]) * factor!r}"',
        urdf_text("planar_arm"),
    )
    scaled = Robot.from_urdf(text)
    q, dq, ddq = state(robot, 0)
    np.testing.assert_allclose(
        scaled.inverse_dynamics(q, dq, ddq), factor * robot.inverse_dynamics(q, dq, ddq), rtol=1e-9
    )
    np.testing.assert_array_equal(
        find_base_parameters(scaled).index, find_base_parameters(robot).index
    )


@pytest.mark.slow
def test_a_thousand_joints_move_exactly(chain):
    """All about one axis: every joint carries the inertia of what follows it."""
    n = 1000
    ddq = np.full((1, n), 0.1)
    torque = Robot.from_urdf(chain([f"j{k}" for k in range(n)])).inverse_dynamics(ddq, ddq, ddq)
    speed_up = 0.1 * np.arange(1, n + 1)  # of each link, its inertia is 1
    np.testing.assert_allclose(torque[0], speed_up[::-1].cumsum()[::-1], rtol=1e-10)


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**31))
def test_rigid_bodies_know_no_direction_of_time(seed):
    """Forces of inertia are even in the velocity; those of gravity have a potential."""
    robot = load_scara()
    q, dq, ddq = np.random.default_rng(seed).uniform(-2, 2, (3, 6, robot.n_joints))
    np.testing.assert_allclose(
        robot.inverse_dynamics(q, -dq, ddq), robot.inverse_dynamics(q, dq, ddq), atol=1e-10
    )
    # A torque field with a potential has a symmetric derivative.
    step, zero = 1e-6, np.zeros_like(q)
    slopes = np.stack(
        [
            robot.inverse_dynamics(q + step * e, zero, zero)
            - robot.inverse_dynamics(q - step * e, zero, zero)
            for e in np.eye(robot.n_joints)
        ],
        axis=-1,
    ) / (2 * step)
    np.testing.assert_allclose(slopes, slopes.transpose(0, 2, 1), atol=1e-5)


class Oracle:
    """pinocchio on a URDF, in the coordinates of skidyn (mimic joints tied to their leader)."""

    def __init__(self, text, robot):
        self.pin = pytest.importorskip("pinocchio")
        self.model = self.pin.buildModelFromXML(text)
        self.data = self.model.createData()
        self.joints = [self._of_body(robot, body) for body in range(robot.n_bodies)]
        tree = robot.tree
        self.ties = np.zeros((self.model.nv, robot.n_joints))
        self.offsets = np.zeros(self.model.nv)
        for body, joint in enumerate(self.joints):
            row = self.model.joints[joint].idx_v
            self.ties[row, tree.coordinates[body]] = tree.multipliers[body]
            self.offsets[row] = tree.offsets[body]

    def _of_body(self, robot, body):
        frame = self.model.frames[self.model.getFrameId(robot.body_names[body])]
        return frame.parentJoint

    def positions(self, q):
        moved = self.ties @ q + self.offsets
        full = self.pin.neutral(self.model)
        for joint in self.model.joints:
            if joint.nq == 1:
                full[joint.idx_q] = moved[joint.idx_v]
            elif joint.nq == 2:  # continuous: cosine and sine
                full[joint.idx_q : joint.idx_q + 2] = (
                    np.cos(moved[joint.idx_v]),
                    np.sin(moved[joint.idx_v]),
                )
        return full

    def inverse_dynamics(self, q, dq, ddq):
        full = self.positions(q), self.ties @ dq, self.ties @ ddq
        return self.ties.T @ self.pin.rnea(self.model, self.data, *full)

    def regressor(self, q, dq, ddq):
        full = self.positions(q), self.ties @ dq, self.ties @ ddq
        blocks = self.pin.computeJointTorqueRegressor(self.model, self.data, *full)
        blocks = (self.ties.T @ blocks).reshape(self.ties.shape[1], -1, 10)
        # pinocchio orders Ixx Ixy Iyy Ixz Iyz Izz.
        blocks = blocks[:, [joint - 1 for joint in self.joints]]
        return blocks[:, :, [0, 1, 2, 3, 4, 5, 7, 6, 8, 9]].reshape(len(blocks), -1)

    def mass_matrix(self, q):
        return self.ties.T @ self.pin.crba(self.model, self.data, self.positions(q)) @ self.ties

    def frame(self, q, name):
        full, frame = self.positions(q), self.model.getFrameId(name)
        self.pin.framesForwardKinematics(self.model, self.data, full)
        pose = self.data.oMf[frame]
        jacobian = self.pin.computeFrameJacobian(
            self.model, self.data, full, frame, self.pin.LOCAL_WORLD_ALIGNED
        )
        return pose.translation.copy(), pose.rotation.copy(), jacobian @ self.ties


@pytest.fixture(scope="module", params=[*EMBEDDED, "branched"])
def case(request):
    text = urdf_text(request.param)
    robot = Robot.from_urdf(text)
    states = np.random.default_rng(0).normal(scale=2.0, size=(3, 20, robot.n_joints))
    return robot, Oracle(text, robot), states


def close(actual, expected):
    np.testing.assert_allclose(actual, expected, rtol=0, atol=TOLERANCE)


def test_inverse_dynamics(case):
    robot, oracle, (q, dq, ddq) = case
    expected = [oracle.inverse_dynamics(*state) for state in zip(q, dq, ddq, strict=True)]
    close(robot.inverse_dynamics(q, dq, ddq), expected)


def test_regressor(case):
    robot, oracle, (q, dq, ddq) = case
    expected = [oracle.regressor(*state) for state in zip(q, dq, ddq, strict=True)]
    close(robot.torque_regressor(q, dq, ddq), expected)


def test_inverse_dynamics_with_random_parameters(case):
    robot, oracle, (q, dq, ddq) = case
    parameters = np.random.default_rng(1).normal(size=(robot.n_bodies, 10))
    states = zip(q, dq, ddq, strict=True)
    expected = [oracle.regressor(*state) @ parameters.ravel() for state in states]
    close(robot.inverse_dynamics(q, dq, ddq, parameters=parameters), expected)


def test_mass_matrix(case):
    robot, oracle, (q, _, _) = case
    close(robot.mass_matrix(q), [oracle.mass_matrix(row) for row in q])


def test_gravity_coriolis_and_inertia(case):
    robot, oracle, (q, dq, ddq) = case
    zero = np.zeros(robot.n_joints)
    gravity = np.array([oracle.inverse_dynamics(row, zero, zero) for row in q])
    bias = np.array([oracle.inverse_dynamics(*rows, zero) for rows in zip(q, dq, strict=True)])
    close(robot.gravity_torque(q), gravity)
    close(robot.coriolis_torque(q, dq), bias - gravity)
    close(robot.inertial_torque(q, ddq), robot.inverse_dynamics(q, 0 * dq, ddq) - gravity)


def test_forward_dynamics_inverts_inverse_dynamics(case):
    robot, _, (q, dq, ddq) = case
    tau = robot.inverse_dynamics(q, dq, ddq)
    np.testing.assert_allclose(robot.forward_dynamics(q, dq, tau), ddq, rtol=1e-9, atol=1e-9)


def test_pose_and_jacobian_of_every_link(case):
    robot, oracle, (q, _, _) = case
    for name in robot.links:
        expected = [oracle.frame(row, name) for row in q]
        position, rotation = robot.forward_kinematics(q, name)
        close(position, [pose[0] for pose in expected])
        close(rotation, [pose[1] for pose in expected])
        close(robot.jacobian(q, name), [pose[2] for pose in expected])


def test_locked_joints_equal_a_reduced_model():
    pin = pytest.importorskip("pinocchio")
    text = urdf_text("panda")
    names = [f"panda_joint{i}" for i in (1, 2, 4)]
    robot = Robot.from_urdf(text, joints=names)
    model = pin.buildModelFromXML(text)
    locked = [i for i in range(1, model.njoints) if model.names[i] not in names]
    model = pin.buildReducedModel(model, locked, pin.neutral(model))
    data = model.createData()
    q, dq, ddq = np.random.default_rng(0).normal(size=(3, 10, 3))
    expected = [pin.rnea(model, data, *state) for state in zip(q, dq, ddq, strict=True)]
    close(robot.inverse_dynamics(q, dq, ddq), expected)


def test_mujoco_agrees():
    """A second, unrelated implementation."""
    # torques of MuJoCo 3.3 for this description differ by a thousandth
    mujoco = pytest.importorskip("mujoco", minversion="4.0")
    text = urdf_text("ur10e")
    robot = Robot.from_urdf(text)
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    states = np.random.default_rng(0).normal(size=(3, 10, robot.n_joints))
    tau = robot.inverse_dynamics(*states)
    for q, dq, ddq, expected in zip(*states, tau, strict=True):
        data.qpos[:], data.qvel[:], data.qacc[:] = q, dq, ddq
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
        mujoco.mj_inverse(model, data)
        np.testing.assert_allclose(data.qfrc_inverse, expected, atol=1e-8)


@pytest.mark.parametrize("gravity", [[0, 0, -9.81, 1], [0, 0, np.nan], "down"])
def test_gravity_that_is_no_vector_is_refused(gravity):
    robot = load_planar_arm()
    with pytest.raises(ValueError, match="expected three finite numbers in m/s"):
        robot.gravity_torque([[0.0, 0.0]], gravity=gravity)
    with pytest.raises(ValueError, match="expected three finite numbers in m/s"):
        robot.inverse_dynamics([[0.0, 0.0]], [[0.0, 0.0]], [[0.0, 0.0]], gravity=gravity)
