# SPDX-License-Identifier: BSD-3-Clause
"""Names of columns: what is recognised, and what is left alone."""

import sys

import pytest

from skidyn._names import match_names
from skidyn.exceptions import LogError
from skidyn.logs import read_log
from skidyn.robots import Robot

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
        ({"position": "alpha"}, "'position' is not a signal of a log"),
        ({"q": 9}, "column 9, but the log has 2"),
        ({"q": "pos_{joint}"}, "no column matches .pos_{joint}."),
        ({"time": ["a", "b"]}, "takes one column"),
    ],
)
def test_mappings_that_cannot_be_met(columns, message):
    with pytest.raises(LogError, match=message):
        match_names(["alpha", "beta"], columns=columns)


def test_a_damaged_number_makes_no_billions_of_joints():
    with pytest.raises(LogError, match="a column of joint 99999999991, but only 2 columns"):
        match_names(["time", "q99999999991"])


def read(path, text):
    path.write_text(text)
    return read_log(path, check=False)


def calls(function):
    """How often Python calls something meanwhile: no clock decides."""
    count = 0

    def note(frame, event, argument):
        nonlocal count
        count += 1

    sys.setprofile(note)
    try:
        function()
    except LogError:
        pass
    finally:
        sys.setprofile(None)
    return count


def counted(path, number, names, **options):
    """Calls for a log of so many columns."""
    columns = ["time", "q1", "tau1", *names] if "robot" not in options else ["time", *names]
    rows = [",".join(str(k) for _ in columns) for k in range(3)]
    path.write_text("\n".join([",".join(columns), *rows]))
    return calls(lambda: read_log(path, check=False, **options))


def robot_with(joints):
    link = '<link name="{}"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" '
    link += 'ixz="0" iyz="0"/></inertial></link>'
    text = "<robot name='r'>" + link.format("l0")
    for k, name in enumerate(joints):
        text += link.format(f"l{k + 1}") + (
            f'<joint name="{name}" type="continuous"><parent link="l{k}"/>'
            f'<child link="l{k + 1}"/><axis xyz="0 1 0"/></joint>'
        )
    return Robot.from_urdf(text + "</robot>")


@pytest.mark.parametrize("piece", ["_", " ", "[", "1", "a_", "(a)", "/", "q", "]"])
def test_twice_the_columns_are_twice_the_work(tmp_path, piece):
    path = tmp_path / "log.csv"
    numbers = [counted(path, n, [f"{piece * 50}x{k}" for k in range(n)]) for n in (200, 400)]
    assert numbers[1] < 2.5 * numbers[0]


@pytest.mark.parametrize("alike", [True, False])
def test_twice_the_joints_are_twice_the_work(tmp_path, alike):
    """Joints that are named almost as in the log, and joints that are not in it."""
    path, numbers = tmp_path / "log.csv", []
    for n in (200, 400):
        robot = robot_with([f"A{k}b" for k in range(n)])
        own = [f"{'a' if alike else 'c'}{k}B" for k in range(n)]
        names = [f"{joint}_{word}" for word in ("position", "effort") for joint in own]
        numbers.append(counted(path, n, names, robot=robot))
    assert numbers[1] < 2.5 * numbers[0]


def test_what_was_meant_is_looked_for_among_some_short_names(tmp_path):
    """Names of the same letters in another order are the slowest to compare."""
    path, letters = tmp_path / "log.csv", list("ab" * 100)
    few, many = (
        counted(path, n, names, columns={"q": ["ab" * 100]})
        for n in (50, 100)
        for names in [["".join(letters[k:] + letters[:k]) + f"x{k}" for k in range(n)]]
    )
    assert many < few + 20_000  # one such comparison takes about 40,000 calls


def test_one_column_is_never_two_joints(tmp_path):
    (tmp_path / "log.csv").write_text("time,elbow_pos,elbow_effort\n0,1,2\n1,1,2\n2,1,2\n")
    with pytest.raises(LogError, match="no q of the joint"):
        read_log(tmp_path / "log.csv", robot=robot_with(["Elbow", "elbow_joint"]), check=False)
