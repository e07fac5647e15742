# SPDX-License-Identifier: BSD-3-Clause
"""The chain of pytorch-kinematics against the NumPy engine."""

from importlib import resources

import numpy as np
import pytest

from skidyn.datasets import load_panda, load_scara, load_ur10e
from skidyn.exceptions import RobotDescriptionError
from skidyn.robots import Robot

torch = pytest.importorskip("torch")

BRANCHED = """
<robot name="branched"><link name="base"/><link name="plate"/><link name="a"/><link name="b"/>
  <link name="c"/><link name="tip"/>
  <joint name="mount" type="fixed"><parent link="base"/><child link="plate"/>
    <origin xyz="0 0 1" rpy="0.3 0 0.1"/></joint>
  <joint name="j1" type="revolute"><parent link="plate"/><child link="a"/><axis xyz="1 2 0"/>
    <origin xyz="0.1 0 0" rpy="0 0.2 0"/>
    <limit lower="-1" upper="2" velocity="1" effort="1"/></joint>
  <joint name="j2" type="prismatic"><parent link="a"/><child link="b"/>
    <limit lower="-1" upper="2" velocity="1" effort="1"/></joint>
  <joint name="j3" type="continuous"><parent link="plate"/><child link="c"/>
    <mimic joint="j1" multiplier="-2" offset="0.4"/></joint>
  <joint name="end" type="fixed"><parent link="b"/><child link="tip"/>
    <origin xyz="0 0.2 0" rpy="1 0 0"/></joint>
</robot>
"""
INERTIAL = "<inertial><mass>2</mass><pose>0.1 0 0.2 0 0.4 0</pose></inertial>"
SDF = f"""
<sdf version="1.9"><model name="arm"><link name="base"/>
 <link name="upper"><pose>0.1 0 0.5 0.2 0 0.3</pose>{INERTIAL}</link>
 <link name="rod"><pose relative_to="slide"/>{INERTIAL}</link>
 <joint name="turn" type="revolute"><pose>0 0.05 0 0 0 0.7</pose><parent>base</parent>
  <child>upper</child><axis><xyz>0 1 1</xyz></axis></joint>
 <joint name="slide" type="prismatic"><pose relative_to="upper">0.3 0 0 0 0 1</pose>
  <parent>upper</parent><child>rod</child><axis><xyz>0 0 1</xyz></axis></joint>
</model></sdf>
"""
MJCF = """
<mujoco model="arm"><compiler angle="radian"/><worldbody><body name="base" pos="0 0 0.2">
 <geom size="0.1" mass="1"/><body name="upper" pos="0.1 0 0.3" euler="0.4 0 0">
  <joint name="yaw" axis="0 0 1" pos="0.02 0 0.01"/><joint name="pitch" axis="0 1 1"/>
  <geom type="box" size="0.1 0.2 0.3" mass="2"/><body name="rod" pos="0.3 0.1 0">
   <joint name="slide" type="slide" axis="1 0 0.5"/><geom size="0.1" mass="1.5"/>
   <site name="tip" pos="0 0.3 0"/></body></body></body></worldbody></mujoco>
"""


def mjcf_robot():
    pytest.importorskip("mujoco")
    return Robot.from_mjcf(MJCF)


ROBOTS = {
    "panda": load_panda,
    "ur10e": load_ur10e,
    "scara": load_scara,
    "branched": lambda: Robot.from_urdf(BRANCHED),
    "sdf": lambda: Robot.from_sdf(SDF),
    "mjcf": lambda: mjcf_robot(),
    "locked": lambda: Robot.from_urdf(BRANCHED, joints=["j2"]),
}


def chain_positions(robot, q):
    tree = robot.tree
    return torch.tensor(q[:, tree.coordinates] * tree.multipliers + tree.offsets)


@pytest.mark.parametrize("name", ROBOTS)
def test_frames_agree_with_the_numpy_engine(name):
    robot = ROBOTS[name]()
    q = np.random.default_rng(0).uniform(-3, 3, (20, robot.n_joints))
    chain = robot.chain
    assert tuple(chain.get_joint_parameter_names()) == robot.body_joints
    poses = chain.forward_kinematics(chain_positions(robot, q))
    assert set(poses) == set(robot.links)
    for link, pose in poses.items():
        matrix = pose.get_matrix().numpy()
        position, rotation = np.zeros((1, 3)), np.eye(3)
        if robot.links[link].body >= 0:
            position, rotation = robot.forward_kinematics(q, link)
        else:
            position, rotation = robot.links[link].translation, robot.links[link].rotation
        assert np.abs(matrix[:, :3, 3] - position).max() < 1e-9
        assert np.abs(matrix[:, :3, :3] - rotation).max() < 1e-9


def test_frames_are_those_of_the_parser_of_pytorch_kinematics():
    from pytorch_kinematics import build_chain_from_urdf

    robot, q = load_panda(), np.random.default_rng(0).uniform(-2, 2, (20, 7))
    urdf = (resources.files("skidyn.datasets") / "robots" / "panda.urdf").read_bytes()
    theirs = build_chain_from_urdf(urdf).to(dtype=torch.float64)
    expected = theirs.forward_kinematics(torch.tensor(q))
    for link, pose in robot.chain.forward_kinematics(torch.tensor(q)).items():
        # Their parser carries offsets through float32.
        difference = pose.get_matrix() - expected[link].get_matrix()
        assert difference.abs().max() < 1e-6


def test_jacobian_of_the_serial_chain_agrees():
    from pytorch_kinematics.chain import SerialChain

    robot = load_panda()
    q = np.random.default_rng(0).uniform(-3, 3, (20, 7))
    serial = SerialChain(robot.chain, robot.body_names[-1], dtype=torch.float64)
    jacobian = serial.jacobian(torch.tensor(q)).numpy()
    np.testing.assert_allclose(jacobian, robot.jacobian(q), atol=1e-9)


def test_poses_are_differentiable():
    robot = load_panda()
    q = torch.zeros(3, 7, dtype=torch.float64, requires_grad=True)
    pose = robot.chain.forward_kinematics(q)[robot.body_names[-1]].get_matrix()
    pose[:, 2, 3].sum().backward()
    np.testing.assert_allclose(q.grad.numpy(), robot.jacobian(np.zeros((3, 7)))[:, 2], atol=1e-9)


def test_a_chain_that_was_moved_leaves_the_robot_alone():
    robot = load_scara()
    robot.chain.to(dtype=torch.float32)
    assert robot.chain.dtype == torch.float64


@pytest.mark.parametrize("name", ROBOTS)
def test_dynamics_on_the_chain_equal_those_of_numpy(name):
    robot = ROBOTS[name]()
    motion = np.random.default_rng(0).uniform(-1.5, 1.5, (3, 20, robot.n_joints))
    # Any number of batch dimensions.
    tensors = torch.tensor(motion.reshape(3, 4, 5, -1), requires_grad=True)
    torque, regressor = (
        robot.inverse_dynamics_torch(*tensors),
        robot.torque_regressor_torch(*tensors),
    )
    assert torque.shape == (4, 5, robot.n_joints) and torque.dtype == torch.float64
    np.testing.assert_allclose(
        torque.detach().reshape(20, -1), robot.inverse_dynamics(*motion), atol=1e-11
    )
    np.testing.assert_allclose(
        regressor.detach().reshape(20, robot.n_joints, -1),
        robot.torque_regressor(*motion),
        atol=1e-11,
    )
    few = [torch.tensor(x[:2], requires_grad=True) for x in motion]
    # Stiffness and inertia are derivatives of the torque; training on them needs second ones.
    loss = robot.torque_regressor_torch(*few).square().sum()
    first = torch.autograd.grad(loss, few, create_graph=True)
    second = torch.autograd.grad(sum(g.square().sum() for g in first), few)
    assert all(torch.isfinite(g).all() for g in second)


def urdf_of(name):
    return (resources.files("skidyn.datasets") / "robots" / f"{name}.urdf").read_bytes()


#: With all that the parser of pytorch-kinematics asks for, and poses without rotations.
PLAIN_SDF = """
<sdf version="1.9"><model name="arm"><link name="base"><pose>0 0 1 0 0 0</pose>{0}</link>
 <link name="upper"><pose>0.1 0 1.5 0 0 0</pose>{0}</link>
 <link name="rod"><pose>0.4 0 1.5 0 0 0</pose>{0}</link>
 <joint name="turn" type="revolute"><parent>base</parent><child>upper</child>
  <axis><xyz>0 1 1</xyz><limit><lower>-1</lower><upper>2</upper></limit></axis></joint>
 <joint name="slide" type="prismatic"><parent>upper</parent><child>rod</child>
  <axis><xyz>0 0 1</xyz><limit><lower>-1</lower><upper>2</upper></limit></axis></joint>
</model></sdf>
""".format(
    "<inertial><pose>0.1 0 0.2 0 0 0</pose><mass>2</mass><inertia><ixx>0.3</ixx><ixy>0</ixy>"
    "<ixz>0</ixz><iyy>0.3</iyy><iyz>0</iyz><izz>0.3</izz></inertia></inertial>"
)


#: One joint on a body, at its origin: what the parser of pytorch-kinematics places correctly.
PLAIN_MJCF = """
<mujoco model="arm"><compiler angle="radian"/><option gravity="0 0 -1.62"/><worldbody>
 <body name="base" pos="0 0 0.2"><geom size="0.1" mass="1"/>
  <body name="upper" pos="0.1 0 0.3" euler="0.4 0.2 0">
   <joint name="turn" axis="0 1 1" range="-2 2"/><geom type="box" size="0.1 0.2 0.3" mass="2"/>
   <body name="rod" pos="0.3 0.1 0" euler="0 0 1">
    <joint name="slide" type="slide" axis="1 0 0.5" range="-1 1" actuatorfrcrange="-9 9"/>
    <geom size="0.1" mass="1.5" pos="0.1 0 0.2"/><site name="tip" pos="0 0.3 0"/>
   </body></body></body></worldbody></mujoco>
"""


def chain_of_mjcf(monkeypatch):
    """As the user guide says: kinds of joints of MuJoCo 4.0 equal no numbers of NumPy."""
    pytest.importorskip("mujoco")
    mjcf = pytest.importorskip("pytorch_kinematics.mjcf")
    kinds = {int(kind): name for kind, name in mjcf.JOINT_TYPE_MAP.items()}
    monkeypatch.setattr(mjcf, "JOINT_TYPE_MAP", kinds)
    return mjcf.build_chain_from_mjcf(PLAIN_MJCF)


@pytest.mark.parametrize("name", ["panda", "ur10e", "scara", "srs_arm", "sdf", "mjcf"])
def test_a_robot_of_a_chain_of_pytorch_kinematics(name, monkeypatch):
    import pytorch_kinematics

    if name == "mjcf":
        data, chain = PLAIN_MJCF, chain_of_mjcf(monkeypatch)
    elif name == "sdf":
        data, chain = PLAIN_SDF, pytorch_kinematics.build_chain_from_sdf(PLAIN_SDF)
    else:
        data, chain = urdf_of(name), pytorch_kinematics.build_chain_from_urdf(urdf_of(name))
    robot, described = Robot.from_chain(chain, data), Robot.from_file(data)
    assert chain.dtype == torch.float32  # not changed
    assert robot.joint_names == tuple(chain.get_joint_parameter_names())
    assert robot.joint_types == described.joint_types and robot.name == described.name
    np.testing.assert_array_equal(robot.effort_limits, described.effort_limits)
    np.testing.assert_array_equal(robot.gravity, described.gravity)
    motion = np.random.default_rng(0).uniform(-1.5, 1.5, (3, 20, robot.n_joints))
    q = torch.tensor(motion[0])
    mine, theirs = robot.chain, chain.to(dtype=torch.float64)
    for link, pose in theirs.forward_kinematics(q).items():
        own = mine.forward_kinematics(q)[link].get_matrix()
        assert (own - pose.get_matrix()).abs().max() < 1e-6  # in single precision
        if robot.links[link].body >= 0:
            place, turn = robot.forward_kinematics(motion[0], link)
            assert np.abs(own[:, :3, 3].numpy() - place).max() < 1e-9
            assert np.abs(own[:, :3, :3].numpy() - turn).max() < 1e-9
    torque = robot.inverse_dynamics(*motion)
    in_torch = robot.inverse_dynamics_torch(*map(torch.tensor, motion)).numpy()
    np.testing.assert_allclose(in_torch, torque, atol=1e-9)
    np.testing.assert_allclose(torque, described.inverse_dynamics(*motion), atol=1e-4)


@pytest.mark.parametrize("name", ROBOTS)
def test_a_chain_in_double_precision_is_taken_as_it_is(name):
    robot = ROBOTS[name]()
    inertials = dict(zip(robot.body_names, robot.inertial_parameters, strict=True))
    motion = np.random.default_rng(0).uniform(-1.5, 1.5, (3, 20, robot.n_joints))
    again = Robot.from_chain(robot.chain, inertials, gravity=robot.gravity)
    place = [again.joint_names.index(joint) for joint in robot.body_joints]
    # Without a description nothing follows: every joint of the chain is one of its own.
    signals = [np.zeros((20, again.n_joints)) for _ in motion]
    factors = robot.tree.multipliers
    for signal, values, offset in zip(signals, motion, (robot.tree.offsets, 0.0, 0.0), strict=True):
        signal[:, place] = values[:, robot.tree.coordinates] * factors + offset
    torque = np.zeros((20, robot.n_joints))
    for body, column in enumerate(place):
        joint = robot.tree.coordinates[body]
        torque[:, joint] += factors[body] * again.inverse_dynamics(*signals)[:, column]
    np.testing.assert_allclose(torque, robot.inverse_dynamics(*motion), atol=1e-9)


def test_limits_and_followers_are_read_beside_a_chain():
    data = BRANCHED.encode()
    robot = Robot.from_urdf(data)
    again = Robot.from_chain(robot.chain, data)
    assert again.joint_names == robot.joint_names == ("j1", "j2")
    np.testing.assert_array_equal(again.position_limits, robot.position_limits)
    locked = Robot.from_chain(robot.chain, data, joints=["j2"], gravity=(0, 0, -1.62))
    expected = Robot.from_urdf(data, joints=["j2"], gravity=(0, 0, -1.62))
    np.testing.assert_allclose(
        locked.forward_kinematics([[0.3]], "tip")[0], expected.forward_kinematics([[0.3]], "tip")[0]
    )
    alone = Robot.from_chain(robot.chain, {"b": [2, 0, 0, 0, 1, 0, 0, 1, 0, 1]})
    assert alone.joint_types == ("revolute", "prismatic", "continuous")
    np.testing.assert_array_equal(alone.position_limits[:2], robot.position_limits)


def test_a_chain_that_is_not_its_description_is_refused():
    import pytorch_kinematics
    from pytorch_kinematics.chain import SerialChain

    data = BRANCHED.encode()
    with pytest.raises(RobotDescriptionError, match="'b' of the chain is up to 1.* missing <axis>"):
        Robot.from_chain(pytorch_kinematics.build_chain_from_urdf(data), data)
    robot = Robot.from_urdf(data)
    with pytest.raises(RobotDescriptionError, match="'wrong' has a mass.* no such frame"):
        Robot.from_chain(robot.chain, {"wrong": [1, 0, 0, 0, 1, 0, 0, 1, 0, 1]})
    with pytest.raises(RobotDescriptionError, match="'b' has to be ten finite numbers"):
        Robot.from_chain(robot.chain, {"b": [1, 0, 0, 0]})
    with pytest.raises(RobotDescriptionError, match="'j2' is prismatic in the chain and fixed in"):
        Robot.from_chain(robot.chain, data.replace(b'"prismatic"', b'"fixed"'))
    part = SerialChain(robot.chain, "a", dtype=torch.float64)
    with pytest.raises(RobotDescriptionError, match=r"has the joints \['j1'\], the description"):
        Robot.from_chain(part, data)
    assert Robot.from_chain(part, data, joints=["j1"]).n_joints == 1
    twice = robot.chain
    twice.find_frame("b").name = "a"
    with pytest.raises(RobotDescriptionError, match="two frames 'a'"):
        Robot.from_chain(twice, {})
