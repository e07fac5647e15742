# SPDX-License-Identifier: BSD-3-Clause
"""A joint about another axis than the description says."""

from dataclasses import replace
from importlib.resources import files

import numpy as np
import pytest
from scipy.signal import savgol_filter

from skidyn.datasets import load_panda, load_planar_arm, load_ur5, make_hidden_effect_log
from skidyn.logs import check_log
from skidyn.robots import Robot


@pytest.fixture(scope="module")
def log():
    return make_hidden_effect_log(load_panda(), "payload", n_trajectories=4, duration=5.0)


def turned(robot, joint, direction):
    """The robot with a joint, from 1, about another axis of its frame."""
    axes = np.array(robot.tree.axes)
    axes[joint - 1] = direction
    return replace(robot, tree=replace(robot.tree, axes=axes))


@pytest.mark.slow
@pytest.mark.parametrize("joint, direction", [(2, (0, 1, 0)), (4, (-1, 0, 0))])
def test_another_axis_of_a_joint_is_told_alone(log, joint, direction):
    claimed = turned(log.robot, joint, direction)
    told = [s for s in check_log(log.frame, claimed).checks if s.certainty != "noted"]
    assert [s.check for s in told] == ["axes"]
    assert told[0].certainty == "certain" and told[0].joints == (joint,)
    own = " ".join(f"{x:g}" for x in log.robot.tree.axes[joint - 1])
    assert f'<axis xyz="{own}"/>' in told[0].evidence


@pytest.mark.slow
def test_the_right_axes_are_left_alone(log):
    assert "axes" not in {s.check for s in check_log(log.frame, log.robot).checks}


@pytest.mark.slow
def test_a_sign_is_no_axis(log):
    told = check_log(log.frame.assign(tau2=-log.frame["tau2"]), log.robot).checks
    assert "axes" not in {s.check for s in told}


@pytest.mark.slow
def test_bodies_that_mimic_others_are_left_out(log):
    """They have no columns of their own, so that nothing is said of any axis."""
    finger = (
        '<link name="finger"><inertial><mass value="1e-3"/>'
        '<inertia ixx="1e-6" iyy="1e-6" izz="1e-6" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        '<joint name="grip" type="prismatic"><parent link="panda_link7"/><child link="finger"/>'
        '<axis xyz="1 0 0"/><mimic joint="panda_joint7"/><limit effort="9" velocity="9"/></joint>'
    )
    text = (files("skidyn.datasets") / "robots" / "panda.urdf").read_text()
    robot = Robot.from_urdf(text.replace("</robot>", f"{finger}</robot>"))
    assert (robot.n_joints, robot.n_bodies) == (7, 8)
    told = check_log(log.frame, turned(robot, 2, (0, 1, 0))).checks
    assert "axes" not in {s.check for s in told}


def test_an_axis_of_a_wrist_is_told_though_friction_is_most_of_its_torque():
    log = make_hidden_effect_log(load_ur5(), None, n_trajectories=5, duration=6.0, random_state=3)
    claimed = turned(log.robot, 5, (0, 1, 0))
    (told,) = [s for s in check_log(log.frame, claimed).checks if s.certainty != "noted"]
    assert told.check == "axes" and told.joints == (5,)


@pytest.mark.parametrize("joint", [1, 2])
def test_of_two_equal_axes_the_usual_one_is_told_with_the_other(joint):
    """Two joints that are parallel about x are the same arm as about z."""
    arm = load_planar_arm()
    log = make_hidden_effect_log(arm, None, n_trajectories=5, duration=6.0, random_state=3)
    claimed = turned(arm, joint, (-1, 0, 0))
    (told,) = [s for s in check_log(log.frame, claimed).checks if s.certainty != "noted"]
    assert told.check == "axes" and told.joints == (joint,)
    assert '<axis xyz="0 0 1"/>' in told.evidence and "equally well" in told.evidence


def test_an_axis_about_which_a_weight_would_be_chance_is_not_told():
    """A motor on the carriage of another one couples two sliders, as an axis along both would."""

    def slider(k, axis, mass):
        return (
            f'<link name="l{k}"><inertial><origin xyz="0.01 0.02 0.03"/><mass value="{mass}"/>'
            '<inertia ixx="0.1" iyy="0.1" izz="0.05" ixy="0" ixz="0" iyz="0"/></inertial></link>'
            f'<joint name="joint{k}" type="prismatic"><parent link="l{k - 1}"/><child link="l{k}"/>'
            f'<axis xyz="{axis}"/><limit lower="-1" upper="1" effort="1000" velocity="3"/></joint>'
        )

    sliders = slider(1, "1 0 0", 20), slider(2, "0 1 0", 13), slider(3, "0 0 -1", 8.5)
    text = f'<robot name="gantry"><link name="l0"/>{"".join(sliders)}</robot>'
    gantry = Robot.from_urdf(text)
    log = make_hidden_effect_log(gantry, None, n_trajectories=8, duration=6.0, random_state=1)
    frame = log.frame.copy()
    for _, rows in frame.groupby("trajectory"):
        q = rows[["q2", "q3"]].to_numpy()
        acceleration = savgol_filter(q, 21, 3, deriv=2, delta=0.01, axis=0)
        frame.loc[rows.index, ["tau3", "tau2"]] += 5.6 * acceleration
    assert "axes" not in {s.check for s in check_log(frame, gantry).checks}
