# SPDX-License-Identifier: BSD-3-Clause
"""Names of columns: what is recognised, and what is left alone."""

import pytest

from skidyn._names import match_names
from skidyn.exceptions import LogError

JOINTS = ("shoulder_pan_joint", "elbow_joint")


def matched(names, **options):
    return match_names(names, **options).columns


def test_contract_names():
    names = ["time", "trajectory", "q1", "dq1", "ddq1", "tau1", "temp1"]
    assert matched(names) == {name: name for name in names}


def test_targets_and_commands_are_no_joints():
    names = ["t", "q1", "q2", "q_target1", "tau1", "tau2", "tau_cmd1", "i_des1"]
    assert set(matched(names)) == {"time", "q1", "q2", "tau1", "tau2"}
    assert set(matched(names, robot_joints=JOINTS)) == {"time", "q1", "q2", "tau1", "tau2"}


def test_columns_follow_the_order_of_the_robot():
    names = ["q_elbow_joint", "q_shoulder_pan_joint"]
    match = match_names(names, robot_joints=JOINTS)
    assert match.columns == {"q1": "q_shoulder_pan_joint", "q2": "q_elbow_joint"}
    assert not match.notes


def test_names_without_the_word_joint_are_taken_and_told():
    match = match_names(["q_Elbow", "q_shoulder-pan", "q_gripper"], robot_joints=JOINTS)
    assert match.columns == {"q1": "q_shoulder-pan", "q2": "q_Elbow"}
    assert any(
        "q_Elbow taken for joint(s) shoulder_pan_joint, elbow_joint" in note for note in match.notes
    )
    assert any("q_gripper belong to no joint" in note for note in match.notes)


def test_actual_and_indexed_names():
    assert matched(["actual_q_0", "actual_q_1"]) == {"q1": "actual_q_0", "q2": "actual_q_1"}
    assert matched(["Actual Torque 1"]) == {"tau1": "Actual Torque 1"}


@pytest.mark.parametrize(
    "names",
    [
        ["time [s]", "q1 [rad]", "dq1 [rad/s]", "tau1 [Nm]"],
        ["Time (sec)", "Pos 1 (rad)", "Vel 1 (rad/s)", "Torque 1 (N m)"],
        ["time_from_start", "theta1", "omega1", "tau_meas_1"],
    ],
)
def test_headers_with_units_and_other_words(names):
    assert matched(names) == dict(zip(["time", "q1", "dq1", "tau1"], names, strict=True))


def test_a_clock_in_two_columns_is_not_taken_for_one():
    assert "time" not in matched(["sec", "nanosec", "q1"])


def test_said_goes_before_guessed():
    columns = {"q1": "alpha", "time": "clock"}
    assert matched(["time", "clock", "alpha", "q1"], columns=columns) == {
        "q1": "alpha",
        "time": "clock",
    }


@pytest.mark.parametrize(
    "columns, message",
    [
        ({"position": "alpha"}, "'position' is no signal of a log"),
        ({"q": 9}, "column 9, but the log has 2"),
        ({"q": "pos_{joint}"}, "no column is like .pos_{joint}."),
        ({"time": ["a", "b"]}, "takes one column"),
    ],
)
def test_mappings_that_cannot_be_met(columns, message):
    with pytest.raises(LogError, match=message):
        match_names(["alpha", "beta"], columns=columns)


def test_a_damaged_number_makes_no_billions_of_joints():
    with pytest.raises(LogError, match="a column of joint 99999999991, but only 2 columns"):
        match_names(["time", "q99999999991"])
