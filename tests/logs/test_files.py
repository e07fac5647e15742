# SPDX-License-Identifier: BSD-3-Clause
"""What readers used to lose without a word: each is read as it is meant, or refused."""

import io
import os
import zipfile
from contextlib import suppress

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.exceptions import LogError, LogWarning, SkidynError
from skidyn.logs import read_log

ROWS = "1,0.1,0.2\n2,0.2,0.3\n3,0.3,0.4\n"
HEADER = "time,q1,tau1\n"


def read(path, text):
    path.write_text(text)
    return read_log(path, check=False)


def test_row_names_of_r_shift_no_column(tmp_path):
    rows = "".join(f"{k},{row}\n" for k, row in enumerate(ROWS.split(), 1))
    with pytest.warns(LogWarning, match="row names, as written by R"):
        frame = read(tmp_path / "log.csv", HEADER + rows)
    np.testing.assert_array_equal(frame[["time", "q1", "tau1"]].iloc[1], [2, 0.2, 0.3])


def test_quoted_row_names_of_r_separated_by_blanks(tmp_path):
    rows = "".join(f'"{k}" {row}\n' for k, row in enumerate(ROWS.replace(",", " ").splitlines()))
    with pytest.warns(LogWarning, match="as written by R"):
        frame = read(tmp_path / "log.txt", '"time" "q1" "tau1"\n' + rows)
    np.testing.assert_array_equal(frame["q1"], [0.1, 0.2, 0.3])


def test_the_nameless_index_of_pandas_is_no_signal(tmp_path):
    rows = "".join(f"{k},{row}\n" for k, row in enumerate(ROWS.split()))
    with pytest.warns(LogWarning, match="field 1 of the header has no name.*by pandas"):
        frame = read(tmp_path / "log.csv", "," + HEADER + rows)
    assert "" not in frame.columns and frame["tau1"].tolist() == [0.2, 0.3, 0.4]
    with pytest.raises(LogError, match="missing is 'foo'; expected 'error' or 'drop'"):
        read_log(tmp_path / "log.csv", missing="foo")


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
    told = r"left out because their length is not 9 rows: gains \(3\), q0 \(2\)"
    with pytest.warns(LogWarning, match=told):
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


def test_an_array_with_names_and_arrays_that_are_no_table(tmp_path):
    names = ["time", "q1", "tau1"]
    table = np.zeros(9, dtype=[(name, float) for name in names])
    table["time"] = np.arange(9) * 0.01
    np.save(tmp_path / "log.npy", table)
    assert len(read_log(tmp_path / "log.npy", check=False)) == 9
    for content in (np.zeros((3, 3, 3)), np.array(["a", "b"])):
        np.save(tmp_path / "log.npy", content)
        with pytest.raises(LogError, match="expected numbers with one row per sample"):
            read_log(tmp_path / "log.npy")
    np.save(tmp_path / "log.npy", np.array([{}]), allow_pickle=True)
    with pytest.raises(LogError, match="cannot be read as an array of numbers"):
        read_log(tmp_path / "log.npy")


def test_pickles_in_npz_are_refused(tmp_path):
    objects = np.array([{"a": 1}, None], dtype=object)
    np.savez(tmp_path / "log.npz", t=np.arange(2), q=objects)
    with pytest.raises(LogError, match="pickles"):
        read_log(tmp_path / "log.npz")


def test_archives_that_unpack_to_too_much_are_refused(tmp_path):
    np.savez_compressed(tmp_path / "bomb.npz", t=np.zeros(2_000_000))
    with pytest.raises(LogError, match="more than max_bytes"):
        read_log(tmp_path / "bomb.npz", max_bytes=2**20)
    header = io.BytesIO()
    shape = {"descr": "<f8", "fortran_order": False, "shape": (10**12,)}
    np.lib.format.write_array_header_1_0(header, shape)
    with zipfile.ZipFile(tmp_path / "lie.npz", "w") as archive:
        archive.writestr("t.npy", header.getvalue() + b"\0" * 80)
    with pytest.raises(LogError, match="declares an array of shape"):
        read_log(tmp_path / "lie.npz")
    (tmp_path / "no.npz").write_bytes(b"no archive")
    with pytest.raises(LogError, match="not a NumPy archive"):
        read_log(tmp_path / "no.npz")


@pytest.mark.parametrize("suffix", ["mat", "feather"])
def test_modules_that_come_with_a_log_are_not_imported(secret, suffix):
    """These formats are decoded in another process first."""
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=1, duration=1.0).frame
    if suffix == "mat":
        from scipy.io import savemat

        savemat("log.mat", {name: log[name].to_numpy() for name in log})
    else:
        pytest.importorskip("pyarrow")
        log.to_feather("log.feather")
    for name in ("numpy", "scipy", "pyarrow", "resource"):
        with open(f"{name}.py", "w") as file:
            file.write("open('harm', 'w').close()\n")
    assert len(read_log(f"log.{suffix}", check=False)) == len(log)
    assert not os.path.exists("harm")


def test_names_inside_an_archive_lead_nowhere(secret):
    secret, names = secret
    arrays = {"time": np.arange(10.0), "q1": np.arange(10.0)}
    np.savez("log.npz", **arrays)
    with zipfile.ZipFile("log.npz", "a") as archive:
        for name in names:
            archive.writestr(f"{name}.npy", b"evil")
    with suppress(SkidynError):
        read_log("log.npz", check=False)
    assert secret.read_text() == "the secret"
    assert [f.name for f in secret.parent.iterdir()] == ["secret.stl"]
    assert [f.name for f in secret.parents[1].joinpath("work").glob("*.*")] == ["log.npz"]
