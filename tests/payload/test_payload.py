# SPDX-License-Identifier: BSD-3-Clause
"""Payloads: found with their intervals, possible as bodies, and honest about what stays open."""

from __future__ import annotations

import json
import warnings
from importlib import resources

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.exceptions import SkidynError
from skidyn.identification import RBDRegressor, is_consistent
from skidyn.logs import load_recording
from skidyn.payload import identify_payload
from skidyn.robots import Robot

FRICTION = ("viscous", "coulomb")
TOOL = """<link name="tool"/><joint name="tool_joint" type="fixed">
<parent link="{last}"/><child link="tool"/><origin xyz="0.01 0.02 0.08" rpy="0.3 -0.2 0.5"/></joint>
</robot>"""


def test_mass_and_centre_of_mass(runs, found):
    truth = runs[0].parameters
    assert found.mass == pytest.approx(truth["mass"], rel=0.02)
    np.testing.assert_allclose(found.com, truth["com"], atol=0.003)
    assert np.all(found.rmse_after[:3] < found.rmse_before[:3])


def test_body_that_can_exist(found):
    assert is_consistent(found.inertial_parameters[None])
    inertia = np.linalg.eigvalsh(found.inertia)
    assert inertia[0] > 0 and inertia[2] < inertia[0] + inertia[1]


def test_says_what_cannot_be_told_apart(found):
    assert "Mass and drive gains scale alike" in found.text
    assert found.text.startswith("payload at wrist_3_link")
    assert " → " in found.text and found.text.count(" N m\n") >= 6  # errors of the six joints
    again = json.loads(json.dumps(found.to_dict()))
    assert again["mass"] == found.mass and again["text"] == str(found)


def test_mass_scales_with_the_drive_gains(runs, found):
    log, loaded, unloaded = runs
    torques = [f"tau{j}" for j in range(1, 7)]
    scaled = [
        frame.assign(**{name: 1.1 * frame[name] for name in torques})
        for frame in (loaded, unloaded)
    ]
    other = identify_payload(log.robot, *scaled, effects=FRICTION)
    assert other.mass == pytest.approx(1.1 * found.mass, rel=1e-3)


def test_in_the_frame_of_a_link(runs, found):
    log, loaded, unloaded = runs
    text = resources.files("skidyn.datasets").joinpath("robots", "ur5.urdf").read_text("utf-8")
    text = text.replace("</robot>", TOOL.format(last=log.robot.body_names[-1]))
    robot = Robot.from_urdf(text)
    other = identify_payload(robot, loaded, unloaded, link="tool", effects=FRICTION)
    placement = robot.links["tool"]
    assert other.mass == pytest.approx(found.mass, rel=1e-3)
    back = placement.rotation @ other.com + placement.translation
    np.testing.assert_allclose(back, found.com, atol=1e-4)


def test_a_fitted_model_stands_for_unloaded_runs(runs, found):
    log, loaded, unloaded = runs
    columns = [c for c in loaded if not c.startswith("tau")]
    model = RBDRegressor(log.robot, FRICTION).fit(
        unloaded[columns], unloaded[[f"tau{j}" for j in range(1, 7)]]
    )
    other = identify_payload(model, loaded)
    assert other.mass == pytest.approx(found.mass, rel=0.02)
    assert any("assumed to be exact" in note for note in other.notes)
    with pytest.raises(SkidynError, match="a fitted RBDRegressor is needed"):
        identify_payload(log.robot, loaded)


def test_joints_that_feel_no_payload_contradict_it_together():
    robot = load_planar_arm()
    log = make_hidden_effect_log(robot, None, n_trajectories=6, duration=6.0, random_state=0)
    carried = log.frame["trajectory"] < 3
    # the shoulder is loaded, and the elbow is not: no body at the last link does that
    pull = 0.5 * np.cos(log.frame["q1"]) * carried
    frame = log.frame.assign(tau1=log.frame["tau1"] + pull)
    found = identify_payload(robot, frame[carried], frame[~carried], effects=FRICTION)
    assert "and whether there is a payload at all" in found.text


def test_what_the_motion_leaves_open_is_said():
    log = make_hidden_effect_log(
        load_planar_arm(), "payload", n_trajectories=4, duration=6.0, random_state=0
    )
    carries = log.frame["trajectory"].isin(log.parameters["trajectories"])
    found = identify_payload(log.robot, log.frame[carries], log.frame[~carries], effects=())
    assert "does not determine" in found.text
    assert np.isnan(found.std[6])  # Ixz: a planar arm never turns about another axis


def test_real_payload(data_dir):
    """2.805 kg at the flange of a UR10e, with the calibrated drive gains."""
    gains = 0.91 * np.array([14.87, 13.26, 11.13, 10.62, 11.03, 11.47])
    file = data_dir / "ur10e" / "ur10e_excitation.npz"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        loaded, unloaded = (
            load_recording(file, run=run, drive_gains=gains).frame
            for run in ("ur-20_02_19_14harm50secLoad", "ur-20_02_19_14harm50sec")
        )
    found = identify_payload(
        Robot.from_urdf(data_dir / "ur10e" / "ur10e_min.urdf"), loaded, unloaded
    )
    assert found.mass == pytest.approx(2.805, rel=0.02)
    assert found.mass_interval[0] < 2.805 < found.mass_interval[1]


PENDULUM = """<robot name="pendulum"><link name="base"/><link name="rod"><inertial>
<origin xyz="0 0 -0.1"/><mass value="0.2"/>
<inertia ixx="0.002" iyy="0.002" izz="0.0001" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="swing" type="revolute"><axis xyz="0 1 0"/><parent link="base"/><child link="rod"/>
<limit effort="9" velocity="9" lower="-3" upper="3"/></joint></robot>"""


def pendulum_runs(seed=0):
    """Runs of one joint without a load, and with 0.5 kg at 0.2 m below it."""
    log = make_hidden_effect_log(
        Robot.from_urdf(PENDULUM), None, base=FRICTION, n_trajectories=6, random_state=seed
    )
    loaded = log.frame["trajectory"] <= 3
    q, ddq = log.frame["q1"].to_numpy(), np.gradient(log.frame["dq1"], log.frame["time"])
    moved = log.frame.assign(tau1=log.frame["tau1"] + 0.5 * 0.2 * (9.81 * np.sin(q) + 0.2 * ddq))
    return log.robot, moved[loaded], log.frame[~loaded]


def test_mass_that_does_not_show_is_told_by_its_first_moment_and_weighed_by_it():
    robot, loaded, unloaded = pendulum_runs()
    found = identify_payload(robot, loaded, unloaded, effects=FRICTION)
    assert np.isnan(found.mass) and "its first moment" in found.text
    assert found.first_moment[2] == pytest.approx(-0.1, rel=0.02)
    low, high = found.first_moment_interval[2]
    assert low < -0.1 < high
    weighed = identify_payload(robot, loaded, unloaded, effects=FRICTION, com=[0, 0, -0.2])
    assert weighed.mass == pytest.approx(0.5, rel=0.02)
    assert weighed.mass_interval[0] < 0.5 < weighed.mass_interval[1]
    json.dumps(weighed.to_dict())
    with pytest.raises(SkidynError, match="com is"):
        identify_payload(robot, loaded, unloaded, com=[0.1])


def test_joint_with_another_drive_gain_is_named(runs, found):
    log, loaded, unloaded = runs
    felt = np.isfinite(found.by_joint) & (found.by_joint_std < 0.05)
    assert felt.sum() >= 2
    np.testing.assert_allclose(found.by_joint[felt], 1.0, atol=0.1)
    assert not any("drive gain before" in note for note in found.notes)
    loaded, unloaded = (frame.assign(tau2=frame["tau2"] * 1.3) for frame in (loaded, unloaded))
    wrong = identify_payload(log.robot, loaded, unloaded, effects=FRICTION)
    assert "estimated from single joints" in wrong.text
    assert any("drive gain" in note and "Joint" in note for note in wrong.notes)


def test_loads_that_are_lighter_than_none_are_exchanged(runs):
    log = runs[0]
    loaded = log.frame["trajectory"].isin(log.parameters["trajectories"])
    with pytest.raises(SkidynError, match="kg less at"):
        identify_payload(log.robot, log.frame[~loaded], log.frame[loaded])
