# SPDX-License-Identifier: BSD-3-Clause
"""HDF5 and MATLAB files as people keep them: settings beside signals, tables, cells, runs."""

import warnings

import numpy as np
import pytest

from skidyn.exceptions import LogError, LogWarning
from skidyn.logs import read_log

h5py = pytest.importorskip("h5py")
N = 100
T = np.arange(N) / 50
Q = np.c_[np.sin(3 * T), np.cos(2 * T)]
SIGNALS = {"t": T, "q": Q, "dq": np.c_[3 * np.cos(3 * T), -2 * np.sin(2 * T)], "tau": Q + 1}


def quiet_read(*args, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", LogWarning)
        return read_log(*args, **options)


def assert_read(frame, runs=1):
    for name, values in (("time", T), ("q2", Q[:, 1]), ("tau1", Q[:, 0] + 1)):
        np.testing.assert_allclose(frame[name], np.tile(values, runs), atol=1e-12)
    assert frame["trajectory"].tolist() == [k for k in range(1, runs + 1) for _ in range(N)]


def fill(group, signals=SIGNALS):
    for name, values in signals.items():
        group[name] = values


def matlab73(path, fill_file):
    """A file as MATLAB writes it with -v7.3: columns first, text as numbers, cells by reference."""
    with h5py.File(path, "w", userblock_size=512) as file:
        fill_file(file)
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")


def numbers(group, name, values):
    group[name] = np.atleast_2d(values) if np.ndim(values) == 1 else np.transpose(values)
    group[name].attrs["MATLAB_class"] = np.bytes_("double")


def text(group, name, value):
    group[name] = np.array([[ord(c)] for c in value], dtype=np.uint16)
    group[name].attrs["MATLAB_class"] = np.bytes_("char")
    return group[name].ref


def test_settings_beside_signals(tmp_path):
    with h5py.File(tmp_path / "log.h5", "w") as file:
        fill(file)
        file["fs"] = 50.0
        file["joint_names"] = np.array(["hip", "knee"], dtype="S8")
        file["settings/gains"] = np.array([1.0, 2.0])
    with pytest.warns(LogWarning, match="without a clock and left out: settings"):
        frame = read_log(tmp_path / "log.h5", check=False)
    assert_read(frame)
    assert frame.attrs["joint_names"] == ["hip", "knee"]


def test_a_table_of_records(tmp_path):
    pd = pytest.importorskip("pandas")
    table = pd.DataFrame({"t": T, **{f"q{k + 1}": Q[:, k] for k in (0, 1)}})
    table[["tau1", "tau2"]] = Q + 1
    with h5py.File(tmp_path / "log.h5", "w") as file:
        file["arm/log"] = table.to_records(index=False)
    assert_read(quiet_read(tmp_path / "log.h5"))


def test_groups_with_the_same_columns_are_trajectories(tmp_path):
    with h5py.File(tmp_path / "log.h5", "w") as file:
        for k in (2, 10):
            fill(file.create_group(f"run_{k}"))
            file[f"run_{k}"]["q"][...] += k
    with pytest.warns(LogWarning, match="run_2, run_10 have the same columns; each becomes a traj"):
        frame = read_log(tmp_path / "log.h5", check=False)
    assert frame["trajectory"].nunique() == 2
    assert frame["q1"][0] == pytest.approx(2) and frame["q1"][N] == pytest.approx(10)
    assert_read(quiet_read(tmp_path / "log.h5", topics=["run_2"]).assign(q2=Q[:, 1]))


def test_a_clock_in_the_header(tmp_path):
    with h5py.File(tmp_path / "log.h5", "w") as file:
        file["joint_states/header/stamp"] = T
        fill(file["joint_states"], {"position": Q, "velocity": Q, "effort": Q + 1})
    assert_read(quiet_read(tmp_path / "log.h5"))


@pytest.mark.parametrize("inside", ["", "log"])
def test_matlab_73_with_text_constants_and_cells(tmp_path, inside):
    def fill_file(file):
        group = file.create_group(inside) if inside else file
        for name, values in SIGNALS.items():
            numbers(group, name, values)
        numbers(file, "fs", [50.0])
        text(file, "robot", "arm")
        names = [text(file.create_group(f"#refs#/{k}"), "x", n) for k, n in enumerate(["hip", "b"])]
        group.create_dataset("joint_names", (2, 1), dtype=h5py.ref_dtype)[:, 0] = names
        group["joint_names"].attrs["MATLAB_class"] = np.bytes_("cell")

    matlab73(tmp_path / "log.mat", fill_file)
    frame = quiet_read(tmp_path / "log.mat")
    assert_read(frame)
    assert frame.attrs["joint_names"] == ["hip", "b"]


def test_runs_in_a_struct_array_of_matlab_73(tmp_path):
    def fill_file(file):
        runs = file.create_group("runs")
        for name, values in SIGNALS.items():
            fields = runs.create_dataset(name, (1, 2), dtype=h5py.ref_dtype)
            for k in (0, 1):
                place = file.require_group(f"#refs#/{k}")
                numbers(place, name, values)
                fields[0, k] = place[name].ref

    matlab73(tmp_path / "log.mat", fill_file)
    assert_read(quiet_read(tmp_path / "log.mat"), runs=2)


def test_runs_in_a_cell_array_of_matlab_5(tmp_path):
    from scipy.io import savemat

    runs = np.empty(2, dtype=object)
    runs[:] = [SIGNALS, SIGNALS]
    savemat(tmp_path / "log.mat", {"runs": runs, "robot": "arm", "fs": 50.0})
    assert_read(quiet_read(tmp_path / "log.mat"), runs=2)


def test_matlab_without_numbers(tmp_path):
    from scipy.io import savemat

    savemat(tmp_path / "log.mat", {"robot": "arm"})
    with pytest.raises(LogError, match="no numeric columns.*use table2struct"):
        read_log(tmp_path / "log.mat")


def test_channels_without_common_time(tmp_path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "log.h5", "w") as file:
        for name, start in (("q", 0.0), ("tau", 100.0)):
            file[f"{name}_group/time"] = start + np.arange(50) / 100
            file[f"{name}_group/{name}"] = np.ones((50, 2))
    with pytest.raises(LogError, match="do not overlap in time"):
        read_log(tmp_path / "log.h5")


def test_broken_containers(tmp_path):
    pytest.importorskip("h5py")
    for name in ("log.h5", "log.mat", "log.parquet"):
        (tmp_path / name).write_bytes(b"nothing of the kind" * 10)
        with pytest.raises(LogError, match=name):
            read_log(tmp_path / name)


def test_numbers_of_an_hdf5_log_do_not_lie_in_other_files(secret):
    secret, _ = secret
    time = np.arange(10.0)
    with h5py.File("external.h5", "w") as file:
        file["time"] = time
        file.create_dataset("q1", (10,), "u1", external=[(str(secret), 0, 10)])
    with h5py.File("virtual.h5", "w") as file:
        file["time"] = time
        layout = h5py.VirtualLayout((10,), "f8")
        layout[:] = h5py.VirtualSource("../secret/other.h5", "q1", shape=(10,))
        file.create_virtual_dataset("q1", layout)
    for name in ("external.h5", "virtual.h5"):
        told = f"{name}: the numbers of /q1 are stored in another file"
        with pytest.raises(LogError, match=told):
            read_log(name)
    with h5py.File("link.h5", "w") as file:
        file["time"], file["q1"], file["tau1"] = time, time, time
        file["dq1"] = h5py.ExternalLink("../secret/other.h5", "/q1")
    with h5py.File("../secret/other.h5", "w") as file:
        file["q1"] = np.full(10, 7.0)
    np.testing.assert_allclose(read_log("link.h5", check=False)["dq1"], 1.0)  # derived from q1
