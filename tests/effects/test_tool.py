# SPDX-License-Identifier: BSD-3-Clause
"""Payload, force and contact at the tool against the dynamics of the robot."""

import numpy as np
import pytest

from skidyn.datasets import load_ur5, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.effects import Signals, Term, get_effect
from skidyn.identification import RBDRegressor
from skidyn.robots import Robot

GANTRY = """<robot name="gantry"><link name="base"/>
<link name="x"><inertial><mass value="5"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0"
izz="1"/></inertial></link>
<link name="z"><inertial><mass value="2"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0"
izz="1"/></inertial></link>
<joint name="1" type="prismatic"><parent link="base"/><child link="x"/><axis xyz="1 0 0"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<joint name="2" type="prismatic"><parent link="x"/><child link="z"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>"""


def test_payload_is_a_heavier_last_link(signals, robot):
    body = np.array([0.7, 0.1, 0.02, -0.05, 0.02, 0.001, 0.0, 0.03, 0.0, 0.04])
    heavier = robot.inertial_parameters.copy()
    heavier[-1] += body
    state = signals.q, signals.dq, signals.ddq
    change = robot.inverse_dynamics(*state, parameters=heavier) - robot.inverse_dynamics(*state)
    blocks = Term("payload", (1, 2), {"trajectories": (1,)}).torque_columns(signals)
    for j in range(2):
        np.testing.assert_allclose(blocks[j][300:] @ body, change[300:, j], atol=1e-10)
        assert not blocks[j][:300].any()


def test_a_payload_on_a_link_makes_this_link_heavier(signals, robot):
    body = np.array([0.7, 0.1, 0.02, -0.05, 0.02, 0.001, 0.0, 0.03, 0.0, 0.04])
    heavier = robot.inertial_parameters.copy()
    heavier[0] += body
    state = signals.q, signals.dq, signals.ddq
    change = robot.inverse_dynamics(*state, parameters=heavier) - robot.inverse_dynamics(*state)
    blocks = Term("payload", (1, 2), {"link": 0}).torque_columns(signals)
    for j in range(2):
        np.testing.assert_allclose(blocks[j] @ body, change[:, j], atol=1e-10)


def test_wrench_works_against_the_motion_of_the_tool(signals, robot):
    force, step = np.array([1.0, -2.0, 0.5]), 1e-6
    blocks = get_effect("external_wrench").torque_columns(signals, (0, 1))
    for j in range(2):
        moved = signals.q + step * np.eye(2)[j]
        before, after = (robot.forward_kinematics(q)[0] for q in (signals.q, moved))
        work = (after - before) @ force / step
        np.testing.assert_allclose(blocks[j][:, :3] @ force, -work, atol=1e-5)


def test_a_moment_works_against_the_turning_of_the_tool(signals):
    blocks = get_effect("external_wrench").torque_columns(signals, (0, 1))
    moment = np.array([0.3, -0.2, 1.5])
    for j in range(2):
        axis = signals.robot.jacobian(signals.q)[:, 3:, j]
        np.testing.assert_allclose(blocks[j][:, 3:] @ moment, -axis @ moment, atol=1e-12)


def test_a_force_that_turns_with_the_tool_is_one_in_its_frame(signals, robot):
    effect = get_effect("external_wrench")
    fixed = effect.torque_columns(signals, (0, 1))
    turning = effect.torque_columns(signals, (0, 1), on_tool=1.0)
    force = np.array([1.0, -2.0, 0.5])
    in_base = robot.forward_kinematics(signals.q)[1] @ force
    for j in range(2):
        expected = np.sum(fixed[j][:, :3] * in_base, axis=1)
        np.testing.assert_allclose(turning[j][:, :3] @ force, expected, atol=1e-12)


def test_a_tool_that_does_not_turn_has_one_frame():
    robot = Robot.from_urdf(GANTRY)
    q = np.random.default_rng(0).normal(size=(50, robot.n_joints))
    signals = Signals(q, q, q, np.zeros(50, dtype=int), robot=robot)
    assert get_effect("external_wrench").grid(signals, tuple(range(robot.n_joints))) == [{}]


def test_contact_only_below_its_plane(signals, robot):
    tool = robot.forward_kinematics(signals.q)[0][:, 2]
    plane = float(np.median(tool))
    contact = get_effect("environment_contact")
    blocks = contact.torque_columns(signals, (0, 1), z0=plane, side=1.0, axis=2)
    assert not blocks[0][tool > plane].any()
    expected = -np.maximum(0, plane - tool) * robot.jacobian(signals.q)[:, 2, 0]
    np.testing.assert_allclose(blocks[0][:, 0], expected)


def test_a_plane_that_faces_no_axis_pushes_along_its_normal(signals):
    effect = get_effect("environment_contact")
    faces_x = effect.torque_columns(signals, (0, 1), axis=0, side=1.0, z0=0.4)
    shape = {"azimuth": 0.0, "elevation": 0.0, "z0": 0.1, "x": 0.3, "y": 0.0, "z": 0.0}
    oblique = effect.torque_columns(signals, (0, 1), **shape)
    assert np.any(faces_x[0] != 0)
    for joint in (0, 1):
        np.testing.assert_allclose(oblique[joint], faces_x[joint], atol=1e-12)


def test_a_ball_pushes_away_from_its_center(signals, robot):
    effect = get_effect("environment_contact")
    tool, _ = robot.forward_kinematics(signals.q)
    center = tool.mean(axis=0) + [0.0, 0.3, 0.0]
    away = tool - center
    distance = np.linalg.norm(away, axis=1)
    radius = float(np.median(distance))
    shape = dict(zip(("center_x", "center_y", "center_z"), center, strict=True), radius=radius)
    force = np.maximum(0.0, radius - distance)[:, None] * away / distance[:, None]
    blocks = effect.torque_columns(signals, (0, 1), **shape)
    jacobian = robot.jacobian(signals.q)[:, :3]
    for joint in (0, 1):
        expected = -np.einsum("ia,ia->i", jacobian[:, :, joint], force)
        np.testing.assert_allclose(blocks[joint][:, 0], expected, atol=1e-12)


def test_what_is_pressed_between_round_bodies_stiffens(signals):
    effect = get_effect("environment_contact")
    plane = {"axis": 2, "side": 1.0, "z0": 0.4}
    plain = effect.torque_columns(signals, (0, 1), **plane)[0][:, 0]
    stiffening = effect.torque_columns(signals, (0, 1), power=1.5, **plane)[0][:, 0]
    depth = np.maximum(0.0, 0.4 - signals.robot.forward_kinematics(signals.q)[0][:, 2])
    np.testing.assert_allclose(stiffening, plain * np.sqrt(depth), atol=1e-12)


#: A link that is fixed to the last body of an arm of three joints, and its origin there.
TOOL, AT = "nozzle", (0.05, 0.0, 0.2)
BODY = """<link name="{n}"><inertial><origin xyz="0 0 0.2"/><mass value="3"/>
<inertia ixx="0.05" iyy="0.05" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="joint{n}" type="revolute"><parent link="{before}"/><child link="{n}"/>
<origin xyz="0 0 {length}"/><axis xyz="{axis}"/>
<limit lower="-2" upper="2" effort="200" velocity="3"/></joint>"""


def with_tool():
    bodies = (
        BODY.format(n=n, before=n - 1, length=length, axis=axis)
        for n, length, axis in ((1, 0.2, "0 0 1"), (2, 0.1, "0 1 0"), (3, 0.4, "0 1 0"))
    )
    tool = (
        f'<link name="{TOOL}"/><joint name="mount" type="fixed"><parent link="3"/>'
        f'<child link="{TOOL}"/><origin xyz="{AT[0]} {AT[1]} {AT[2]}"/></joint>'
    )
    return Robot.from_urdf(f'<robot name="arm"><link name="0"/>{"".join(bodies)}{tool}</robot>')


def test_a_force_on_a_point_that_turns_with_the_tool():
    robot, q = with_tool(), np.random.default_rng(0).uniform(-1.0, 1.0, (200, 3))
    signals = Signals(q, q, q, trajectory=np.zeros(200, dtype=int), robot=robot)
    effect, force = get_effect("external_wrench"), np.array([1.0, -2.0, 0.5])
    coefficients = np.concatenate([force, np.outer(AT, force).ravel()])

    anywhere = effect.torque_columns(signals, (0, 1, 2), arm=1.0)
    at_tool = effect.torque_columns(signals, (0, 1, 2), point=TOOL)

    for j in range(3):
        np.testing.assert_allclose(anywhere[j] @ coefficients, at_tool[j][:, :3] @ force, atol=1e-9)
    found = effect.parameters(coefficients, {"arm": 1.0})
    np.testing.assert_allclose([found[f"force_{a}"] for a in "xyz"], force)
    np.testing.assert_allclose([found[f"arm_{a}"] for a in "xyz"], AT)


def test_a_contact_acts_at_the_origin_of_the_last_body_or_at_the_tool_fixed_to_it():
    robot, q = with_tool(), np.random.default_rng(0).uniform(-1.0, 1.0, (200, 3))
    signals = Signals(q, q, q, trajectory=np.zeros(200, dtype=int), robot=robot)
    contact = get_effect("environment_contact")
    points = {shape.get("point") for shape in contact.grid(signals, (0, 1, 2))}
    assert points == {None, TOOL}
    plane = {"z0": 0.7, "side": 1.0, "axis": 2}
    for point, link in (({}, -1), ({"point": TOOL}, TOOL)):
        columns = contact.torque_columns(signals, (0, 1, 2), **plane, **point)
        depth = np.maximum(0.0, 0.7 - robot.forward_kinematics(q, link)[0][:, 2])
        push = depth[:, None] * robot.jacobian(q, link)[:, 2]
        np.testing.assert_allclose(np.hstack([columns[j] for j in range(3)]), -push, atol=1e-12)


def test_a_contact_of_the_tool_is_found_with_the_link_that_touches():
    robot = with_tool()
    log = make_hidden_effect_log(robot, None, n_trajectories=6, duration=5.0, random_state=1)
    q = log.X[["q1", "q2", "q3"]].to_numpy()
    height = robot.forward_kinematics(q, TOOL)[0][:, 2]
    floor = float(np.quantile(height, 0.15))
    force = 2000.0 * np.maximum(0.0, floor - height)
    torque = log.y - force[:, None] * robot.jacobian(q, TOOL)[:, 2]

    (finding,) = diagnose(RBDRegressor(robot), log.X, torque, checks=()).findings

    assert finding.kind == "environment_contact"
    assert finding.parameters["point"]["value"] == TOOL
    assert finding.parameters["z0"]["value"] == pytest.approx(floor, abs=0.02)
    assert f"link '{TOOL}'" in finding.sentence


@pytest.mark.slow
def test_a_ball_that_the_tool_presses_into_is_found_with_its_size():
    robot = with_tool()
    log = make_hidden_effect_log(robot, None, n_trajectories=6, duration=5.0, random_state=1)
    q = log.X[["q1", "q2", "q3"]].to_numpy()
    tool, _ = robot.forward_kinematics(q, TOOL)
    away = tool - (tool.mean(axis=0) + [0.3, 0.1, -0.2])
    distance = np.linalg.norm(away, axis=1)
    radius = float(np.quantile(distance, 0.2))
    force = 2000.0 * np.maximum(0.0, radius - distance)[:, None] * away / distance[:, None]
    torque = log.y + np.einsum("iaj,ia->ij", robot.jacobian(q, TOOL)[:, :3], -force)

    (finding,) = diagnose(RBDRegressor(robot), log.X, torque, checks=()).findings

    assert finding.kind == "environment_contact"
    assert finding.parameters["radius"]["value"] == pytest.approx(radius, rel=0.1)
    assert finding.parameters["k"]["value"] == pytest.approx(2000.0, rel=0.2)
    assert "The surface is a ball." in finding.sentence


def test_a_weight_on_a_point_that_turns_with_the_tool_is_a_payload_and_no_force():
    q = np.zeros((10, 3))
    signals = Signals(q, q, q, trajectory=np.zeros(10, dtype=int), robot=with_tool())
    effect = get_effect("external_wrench")

    def can_be(force, **shape):
        coefficients = np.concatenate([force, np.outer(AT, force).ravel()])
        return effect.can_have(coefficients, shape, signals)

    assert not can_be([0.1, 0.0, -4.0], arm=1.0)
    assert can_be([2.0, 0.0, -4.0], arm=1.0)
    assert can_be([0.1, 0.0, -4.0])

    def usually(force, **shape):
        return effect.usually(np.array(force), shape, signals, [0])

    assert usually([0.1, 0.0, -4.0]) == "payload"
    assert usually([0.1, 0.0, 4.0]) is usually([2.0, 0.0, -4.0]) is None
    assert usually([0.1, 0.0, -4.0], on_tool=1.0) is None


@pytest.mark.slow
def test_a_force_in_all_recordings_is_named():
    """The bodies cannot take it in, unlike a payload."""
    log = make_hidden_effect_log(load_ur5(), None, n_trajectories=6, duration=5.0, random_state=1)
    q = log.X[[f"q{k + 1}" for k in range(6)]].to_numpy()
    pull = np.einsum("naj,a->nj", log.robot.jacobian(q)[:, :3], [6.0, 9.0, 0.0])
    (finding,) = diagnose(RBDRegressor(log.robot), log.X, log.y - pull).findings
    assert (finding.kind, finding.trajectories) == ("external_wrench", None)
    force = [finding.parameters[f"force_{axis}"]["value"] for axis in "xy"]
    assert force == pytest.approx([6.0, 9.0], rel=0.02)
