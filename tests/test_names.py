# SPDX-License-Identifier: BSD-3-Clause
"""Names of columns: what is recognised, and what is left alone."""

import sys
import warnings

import pytest

from skidyn.exceptions import LogError, LogWarning
from skidyn.logs import read_log
from skidyn.robots import Robot

JOINTS = ("shoulder_pan_joint", "elbow_joint")


@pytest.fixture
def match(tmp_path, chain):
    """Reads a log with these columns: the column of each signal, and the notes of the reader."""

    def read_columns(names, joints=(), **options):
        # each column has numbers of its own, and moves at one unit per second
        rows = [names, *([str(100 * k + row) for k in range(len(names))] for row in range(3))]
        (tmp_path / "log.csv").write_text("\n".join(map(";".join, rows)))
        robot = Robot.from_urdf(chain(joints)) if joints else None
        options = {"check": False, "needs_torque": False, "robot": robot, **options}
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", LogWarning)
            frame = read_log(tmp_path / "log.csv", **options)
        found = {
            c: int(frame[c].iloc[1]) // 100 for c in frame if frame[c].iloc[1] != 1 or c == "time"
        }
        return {c: names[k] for c, k in found.items()}, frame.attrs["notes"]

    return read_columns


def test_contract_names(match):
    names = ["time", "trajectory", "q1", "dq1", "ddq1", "tau1", "temp1"]
    assert match(names)[0] == {name: name for name in names}


@pytest.mark.parametrize("joints", [(), JOINTS])
def test_targets_and_commands_are_no_joints(match, joints):
    names = ["t", "q1", "q2", "tau1", "tau2", "q_target1", "tau_cmd1", "i_des1"]
    columns, _ = match(names, joints)
    assert {c: columns[c] for c in ("time", "q1", "q2", "tau1", "tau2")} == dict(
        zip(("time", "q1", "q2", "tau1", "tau2"), names, strict=False)
    )


def test_columns_follow_the_order_of_the_robot(match):
    columns, notes = match(["time", "q_elbow_joint", "q_shoulder_pan_joint"], JOINTS)
    assert (columns["q1"], columns["q2"]) == ("q_shoulder_pan_joint", "q_elbow_joint")
    assert all("velocities" in note for note in notes)


@pytest.mark.parametrize("name", ["target_q_{}", "goal_position_{}", "position_cmd_{}"])
def test_commands_of_all_joints_are_a_signal(match, name):
    names = ["t", "q1", "q2", name.format(0), name.format(1)]
    columns, _ = match(names)
    assert [columns["cmd1"], columns["cmd2"]] == names[3:]
    columns, notes = match(names[:4])
    assert columns[names[3]] == names[3] and "cmd1" not in columns
    assert any("are not those of all 2 joints" in note for note in notes)


def test_columns_beyond_the_chosen_ones_are_no_signals(match):
    names = ["time", "q1", "q2", "q3", "tau1", "tau2", "tau3"]
    columns, _ = match(names, JOINTS, columns={"q": ["q3", "q1"], "tau": ["tau3", "tau1"]})
    assert (columns["q1"], columns["q2"], columns["tau1"]) == ("q3", "q1", "tau3")
    assert "q3" not in columns and columns["q2 of the file"] == "q2"


def test_names_without_the_word_joint_are_taken_and_told(match):
    columns, notes = match(["time", "q_Elbow", "q_shoulder-pan", "q_gripper"], JOINTS)
    assert (columns["q1"], columns["q2"]) == ("q_shoulder-pan", "q_Elbow")
    assert any("q_Elbow taken for joint(s) shoulder_pan_joint, elbow_joint" in n for n in notes)
    assert any("q_gripper belong to no joint" in note for note in notes)


def test_actual_and_indexed_names(match):
    names = ["time", "actual_q_0", "actual_q_1", "Actual Torque 1", "Actual Torque 2"]
    columns, _ = match(names)
    assert [columns[c] for c in ("time", "q1", "q2", "tau1", "tau2")] == names


@pytest.mark.parametrize(
    "names",
    [
        ["time [s]", "q1 [rad]", "dq1 [rad/s]", "tau1 [Nm]"],
        ["Time (sec)", "Pos 1 (rad)", "Vel 1 (rad/s)", "Torque 1 (N m)"],
        ["time_from_start", "theta1", "omega1", "tau_meas_1"],
    ],
)
def test_headers_with_units_and_other_words(match, names):
    columns, _ = match(names)
    assert [columns[c] for c in ("time", "q1", "dq1", "tau1")] == names


def test_a_clock_in_two_columns_is_not_taken_for_one(match):
    with pytest.raises(LogError, match="no time column"):
        match(["sec", "nanosec", "q1", "tau1"])


def test_said_goes_before_guessed(match):
    columns, _ = match(["time", "clock", "alpha", "q1"], columns={"q1": "alpha", "time": "clock"})
    assert (columns["q1"], columns["time"]) == ("alpha", "clock")


@pytest.mark.parametrize(
    "columns, message",
    [
        ({"position": "alpha"}, "'position' is not a signal of a log"),
        ({"q": 9}, "column 9, but .* has 2"),
        ({"q": "pos_{joint}"}, "no column matches .pos_{joint}."),
        ({"time": ["a", "b"]}, "takes one column"),
    ],
)
def test_mappings_that_cannot_be_met(match, columns, message):
    with pytest.raises(LogError, match=message):
        match(["alpha", "beta"], columns=columns)


def test_a_damaged_number_makes_no_billions_of_joints(match):
    with pytest.raises(LogError, match="a column of joint 99999999991, but only 2 columns"):
        match(["time", "q99999999991"])


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


@pytest.mark.parametrize("piece", ["_", " ", "[", "1", "a_", "(a)", "/", "q", "]"])
def test_twice_the_columns_are_twice_the_work(tmp_path, piece):
    path = tmp_path / "log.csv"
    numbers = [counted(path, n, [f"{piece * 50}x{k}" for k in range(n)]) for n in (200, 400)]
    assert numbers[1] < 2.5 * numbers[0]


@pytest.mark.parametrize("alike", [True, False])
def test_twice_the_joints_are_twice_the_work(tmp_path, chain, alike):
    """Joints that are named almost as in the log, and joints that are not in it."""
    path, numbers = tmp_path / "log.csv", []
    for n in (200, 400):
        robot = Robot.from_urdf(chain([f"A{k}b" for k in range(n)]))
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


def test_one_column_is_never_two_joints(tmp_path, chain):
    (tmp_path / "log.csv").write_text("time,elbow_pos,elbow_effort\n0,1,2\n1,1,2\n2,1,2\n")
    with pytest.raises(LogError, match="no q of the joint"):
        read_log(
            tmp_path / "log.csv",
            robot=Robot.from_urdf(chain(["Elbow", "elbow_joint"])),
            check=False,
        )
