# SPDX-License-Identifier: BSD-3-Clause
"""Signs, scales and zeros that change for a third to half of the recordings."""

import pytest

from skidyn.datasets import load_planar_arm, load_ur5, make_hidden_effect_log
from skidyn.logs import check_log
from skidyn.robots import Robot

ROBOT = load_ur5()
OPTIONS = {"n_trajectories": 6, "duration": 5.0, "random_state": 1}
GANTRY = Robot.from_urdf(
    '<robot name="gantry"><link name="rails"/>'
    + "".join(
        f'<link name="{link}"><inertial><origin xyz="0 0 0.1"/><mass value="{mass}"/>'
        '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        f'<joint name="{link}_axis" type="prismatic"><parent link="{parent}"/>'
        f'<child link="{link}"/><axis xyz="{axis}"/>'
        '<limit lower="-0.4" upper="0.4" velocity="0.5" effort="900"/></joint>'
        for link, parent, axis, mass in (
            ("bridge", "rails", "1 0 0", 60),
            ("carriage", "bridge", "0 1 0", 25),
            ("quill", "carriage", "0 0 1", 8),
        )
    )
    + "</robot>"
)
FRAME = make_hidden_effect_log(ROBOT, "stribeck", joints=[2], **OPTIONS).frame


def told(frame):
    return [s for s in check_log(frame, ROBOT).checks if s.certainty != "noted"]


@pytest.mark.parametrize(
    "name, change, what, count",
    [
        ("tau3", lambda x: -x, "opposite sign", 2),
        pytest.param("tau6", lambda x: -x, "opposite sign", 3, marks=pytest.mark.slow),
        pytest.param("tau2", lambda x: 10 * x, " is 10", 3, marks=pytest.mark.slow),
        pytest.param("q3", lambda x: x + 0.7, "the zero of", 2, marks=pytest.mark.slow),
    ],
)
def test_recordings_of_two_kinds_are_told_alone(name, change, what, count):
    frame = FRAME.copy()
    runs = FRAME["trajectory"].unique()[1 : 1 + count]
    rows = FRAME["trajectory"].isin(runs)
    frame.loc[rows, name] = change(FRAME.loc[rows, name])
    (one,) = told(frame)
    assert one.check == "divided_recordings" and one.joints == (int(name[-1]),)
    assert what in one.suspicion
    *early, last = map(str, runs)
    assert f"in trajectories {', '.join(early)} and {last} " in one.suspicion


@pytest.mark.slow
@pytest.mark.parametrize("effect", ["payload", "external_wrench", "environment_contact"])
def test_effects_of_some_recordings_are_no_mistake(effect, checked):
    told = checked(effect, **OPTIONS).checks
    assert "divided_recordings" not in {s.check for s in told if s.certainty != "noted"}


@pytest.mark.slow
def test_a_payload_that_multiplies_the_load_of_a_wrist_is_no_mistake():
    frame = make_hidden_effect_log(ROBOT, "payload", random_state=7411957).frame
    assert "divided_recordings" not in {s.check for s in told(frame)}


def test_a_robot_of_sliders_alone_has_no_zeros_to_divide():
    frame = make_hidden_effect_log(GANTRY, "friction_drift", **OPTIONS).frame
    assert not [s for s in check_log(frame, GANTRY).checks if s.certainty != "noted"]


@pytest.mark.parametrize("factor, what", [(-1, "opposite sign"), (10, " times that of")])
def test_a_spring_that_is_missing_does_not_hide_them(factor, what):
    arm = load_planar_arm()
    options = {"n_trajectories": 5, "duration": 6.0, "random_state": 7319357}
    frame = make_hidden_effect_log(arm, "spring", **options).frame
    frame.loc[frame["trajectory"] > 3, "tau2"] *= factor
    (one,) = [s for s in check_log(frame, arm).checks if s.certainty != "noted"]
    assert one.check == "divided_recordings" and one.joints == (2,)
    assert "in trajectories 4 and 5 " in one.suspicion and what in one.suspicion


def test_zeros_of_two_of_many_recordings_are_told_from_those_of_one():
    arm = load_planar_arm()
    options = {"n_trajectories": 10, "duration": 3.0, "random_state": 5}
    frame = make_hidden_effect_log(arm, None, **options).frame
    out = [2, 5, 6, 9]
    frame.loc[frame["trajectory"].isin(out), "q2"] += 0.7
    (one,) = [s for s in check_log(frame, arm).checks if s.certainty != "noted"]
    assert one.check == "divided_recordings" and one.joints == (2,)
    assert "in trajectories 2, 5, 6 and 9 the zero" in one.suspicion
