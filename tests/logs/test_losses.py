# SPDX-License-Identifier: BSD-3-Clause
"""What readers used to lose without a word: each is read as it is meant, or refused."""

import sys

import numpy as np
import pytest

pandas = pytest.importorskip("pandas", reason="needs skidyn[io]")

from skidyn.exceptions import LogError, LogWarning  # noqa: E402
from skidyn.logs import read_log  # noqa: E402
from skidyn.robots import Robot  # noqa: E402

ROWS = "1,0.1,0.2\n2,0.2,0.3\n3,0.3,0.4\n"
HEADER = "time,q1,tau1\n"


def read(path, text):
    path.write_text(text)
    return read_log(path, check=False)


@pytest.mark.parametrize("unit", ["s", "ms", "us", "ns"])
@pytest.mark.parametrize("kind", ["timestamp", "duration"])
@pytest.mark.parametrize("suffix", ["parquet", "feather"])
def test_dates_and_durations_of_arrow_are_seconds(tmp_path, unit, kind, suffix):
    pa = pytest.importorskip("pyarrow")
    from pyarrow import feather, parquet

    steps = (
        1_700_000_000 * {"s": 1, "ms": 10**3, "us": 10**6, "ns": 10**9}[unit]
        + np.array([0, 1, 2]) * {"s": 1, "ms": 10**3, "us": 10**6, "ns": 10**9}[unit]
    )
    table = pa.table(
        {
            "time": pa.array(steps, getattr(pa, kind)(unit)),
            "q1": [0.1, 0.2, 0.3],
            "tau1": [1.0, 2.0, 3.0],
        }
    )
    path = tmp_path / f"log.{suffix}"
    {"parquet": parquet.write_table, "feather": feather.write_feather}[suffix](table, path)
    frame = read_log(path, check=False)
    np.testing.assert_array_equal(frame["time"], [0.0, 1.0, 2.0])


def test_the_index_of_pandas_is_a_column_like_others(tmp_path):
    pytest.importorskip("pyarrow")
    frame = pandas.DataFrame({"q1": [0.1, 0.2, 0.3], "tau1": [1.0, 2.0, 3.0]})
    frame.index = pandas.Index([0.0, 0.5, 1.0], name="time")
    frame.to_parquet(tmp_path / "log.parquet")
    read = read_log(tmp_path / "log.parquet", check=False)
    np.testing.assert_array_equal(read["time"], [0.0, 0.5, 1.0])


def test_row_names_of_r_shift_no_column(tmp_path):
    rows = "".join(f"{k},{row}\n" for k, row in enumerate(ROWS.split(), 1))
    with pytest.warns(LogWarning, match="names of rows, as R writes them"):
        frame = read(tmp_path / "log.csv", HEADER + rows)
    np.testing.assert_array_equal(frame[["time", "q1", "tau1"]].iloc[1], [2, 0.2, 0.3])


def test_quoted_row_names_of_r_separated_by_blanks(tmp_path):
    rows = "".join(f'"{k}" {row}\n' for k, row in enumerate(ROWS.replace(",", " ").splitlines()))
    with pytest.warns(LogWarning, match="as R writes them"):
        frame = read(tmp_path / "log.txt", '"time" "q1" "tau1"\n' + rows)
    np.testing.assert_array_equal(frame["q1"], [0.1, 0.2, 0.3])


def test_a_separator_at_the_end_of_rows_is_no_field(tmp_path):
    frame = read(tmp_path / "log.csv", HEADER + ROWS.replace("\n", ",\n"))
    np.testing.assert_array_equal(frame["tau1"], [0.2, 0.3, 0.4])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (HEADER + ROWS + "4,0.4\n", "line 5 has 2 fields, the lines before 3"),
        (HEADER + ROWS + "4,0.4,0.5,0.6\n", "line 5 has 4 fields"),
        (HEADER + ROWS.replace("\n", ",8,9\n"), "rows have 5 fields, the header 3"),
        ("time,q1,position_1,tau1\n1,2,3,4\n2,3,4,5\n", "'?q1'?, '?position_1'? are all q"),
        ("time,elbow_q,q_elbow,elbow_tau\n1,2,3,4\n2,3,4,5\n", "elbow_q.*are all q of joint"),
        ("time,trajectory,q1,tau1\n1,0,3,4\n2,1e300,4,5\n", "trajectory column holds 1e\\+300"),
    ],
)
def test_what_cannot_be_told_is_refused(tmp_path, text, message):
    with pytest.raises(LogError, match=message):
        read(tmp_path / "log.csv", text)


def test_a_choice_of_columns_settles_it(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("time,q1,position_1,tau1\n1,2,3,4\n2,3,4,5\n3,4,5,6\n")
    frame = read_log(path, columns={"q": ["position_1"]}, check=False)
    np.testing.assert_array_equal(frame["q1"], [3.0, 4.0, 5.0])


def test_two_clocks_and_which_was_taken_is_said(tmp_path):
    with pytest.warns(LogWarning, match="time is taken from 'time', not from stamp"):
        read(tmp_path / "log.csv", "time,stamp,q1,tau1\n1,2,3,4\n2,3,4,5\n")


@pytest.mark.parametrize("suffix", ["npz", "mat", "h5"])
def test_a_signal_that_is_one_row_short_is_refused(tmp_path, suffix):
    path = tmp_path / f"log.{suffix}"
    arrays = {"time": np.arange(9.0), "q": np.ones((9, 2)), "tau": np.ones((9, 2))}
    arrays["dq"] = np.ones((8, 2))
    write(path, arrays)
    with pytest.raises(LogError, match="dq has 8 rows, .* has 9"):
        read_log(path, check=False)


def test_constants_of_other_lengths_are_left_out_with_a_word(tmp_path):
    path = tmp_path / "log.npz"
    arrays = {"time": np.arange(9.0), "q": np.ones((9, 2)), "tau": np.ones((9, 2))}
    write(path, {**arrays, "gains": np.ones(3), "q0": np.zeros(2)})
    with pytest.warns(LogWarning, match=r"left out: gains \(3\), q0 \(2\)"):
        assert len(read_log(path, check=False)) == 9


def write(path, arrays):
    if path.suffix == ".npz":
        np.savez(path, **arrays)
    elif path.suffix == ".mat":
        from scipy.io import savemat

        savemat(path, arrays)
    else:
        h5py = pytest.importorskip("h5py")
        with h5py.File(path, "w") as file:
            for name, array in arrays.items():
                file[name] = array


def test_columns_and_names_without_end_are_refused(tmp_path):
    many = ",".join(f"c{k}" for k in range(20_000))
    with pytest.raises(LogError, match="20003 columns; at most 10000 are read"):
        read(tmp_path / "log.csv", f"time,q1,tau1,{many}\n" + "1," * 20_002 + "1\n")
    with pytest.raises(LogError, match="name has 16000 letters; at most 250"):
        read(tmp_path / "log.csv", f"time,q1,tau1,{'a_' * 8000}\n1,2,3,4\n2,3,4,5\n")


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
