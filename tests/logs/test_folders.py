# SPDX-License-Identifier: BSD-3-Clause
"""Recordings of several files, and tables whose columns hold lists."""

import gzip
import json

import numpy as np
import pandas as pd
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.exceptions import LogError
from skidyn.logs import read_log

LOG = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=2, duration=3.0).frame
RUN = LOG[LOG["trajectory"] == 1].reset_index(drop=True)
pytestmark = pytest.mark.filterwarnings("ignore::UserWarning")


def lists(frame, quantity):
    return frame[[f"{quantity}1", f"{quantity}2"]].to_numpy().tolist()


def as_lists(frame):
    return pd.DataFrame(
        {
            "timestamp": frame["time"],
            "positions": [str(row) for row in lists(frame, "q")],
            "torques": [str(row) for row in lists(frame, "tau")],
        }
    )


def same(read, expected, names=("q1", "q2", "tau1", "tau2")):
    for name in names:
        np.testing.assert_allclose(read[name], expected[name], atol=1e-9)


def test_columns_that_hold_lists(tmp_path):
    as_lists(RUN).to_csv(tmp_path / "log.csv", index=False)
    same(read_log(tmp_path / "log.csv", check=False), RUN)


def test_lists_of_words_stay_text_and_empty_cells_are_missing_values(tmp_path):
    table = as_lists(RUN).assign(name=str(["left", "right"]))
    table.loc[[0, 7], "torques"] = None
    table["positions"] = [json.dumps([str(x) for x in row]) for row in lists(RUN, "q")]
    table.to_csv(tmp_path / "log.csv", index=False)
    with pytest.raises(
        LogError, match=r"2 of 300 rows hold NaN .*tau1: 2, tau2: 2; first in row 0"
    ):
        read_log(tmp_path / "log.csv", check=False)
    frame = read_log(tmp_path / "log.csv", missing="drop", check=False)
    same(frame, RUN.drop(index=[0, 7]))
    assert any("without numbers left out: name" in note for note in frame.attrs["notes"])


def test_a_column_of_lists_is_chosen_by_its_name(tmp_path):
    names = {"timestamp": "clock", "positions": "A", "torques": "B"}
    as_lists(RUN).rename(columns=names).to_csv(tmp_path / "log.csv", index=False)
    columns = {"time": "clock", "q": "A", "tau": "B"}
    same(read_log(tmp_path / "log.csv", columns=columns, check=False), RUN)


def test_a_cell_that_is_no_list_is_named(tmp_path):
    table = as_lists(RUN)
    table.loc[7, "torques"] = "stopped"
    table.to_csv(tmp_path / "log.csv", index=False)
    with pytest.raises(LogError, match=r"torques holds 'stopped' in row 7"):
        read_log(tmp_path / "log.csv", check=False)


def test_commands_beside_states_in_a_folder(tmp_path):
    (tmp_path / "run").mkdir()
    with gzip.open(tmp_path / "run" / "state.csv.gz", "wt") as file:
        as_lists(RUN).to_csv(file, index=False)
    command = as_lists(RUN.assign(q1=RUN["q1"] + 0.5)).drop(columns="torques")
    command.to_csv(tmp_path / "run" / "control.csv", index=False)
    (tmp_path / "run" / "joint_list.txt").write_text("shoulder\nelbow\n")
    frame = read_log(tmp_path / "run", check=False)
    same(frame, RUN)
    np.testing.assert_allclose(frame["cmd1"], RUN["q1"] + 0.5)
    assert frame.attrs["joint_names"] == ["shoulder", "elbow"]


def test_one_file_per_signal(tmp_path):
    RUN[["time"]].to_csv(tmp_path / "time.csv", index=False)
    for name, quantity in (("positions", "q"), ("velocities", "dq"), ("torque", "tau")):
        block = RUN[[f"{quantity}1", f"{quantity}2"]]
        block.columns = ["left", "right"]
        block.to_csv(tmp_path / f"{name}.csv", index=False)
    same(read_log(tmp_path, check=False), RUN, ("time", "q1", "dq2", "tau2"))


def test_listed_joints_determine_the_order_of_the_columns(tmp_path):
    robot = load_planar_arm()
    turned = RUN.rename(columns={f"{q}{k}": f"{q}{3 - k}" for q in ("q", "tau") for k in (1, 2)})
    (tmp_path / "lists").mkdir()
    as_lists(turned).to_csv(tmp_path / "lists" / "state.csv", index=False)
    names = tmp_path / "lists" / "joint_list.txt"
    names.write_text("joint2\njoint1\n")
    same(read_log(tmp_path / "lists", robot=robot, check=False), RUN)
    names.write_text("elbow\nshoulder\n")
    frame = read_log(tmp_path / "lists", robot=robot, check=False)
    same(frame, turned)
    assert any("other names in the description" in note for note in frame.attrs["notes"])
    names.write_text("joint2\nelbow\n")  # one name is known, at the place of another joint
    with pytest.raises(LogError, match=r"no q of the joint\(s\) joint1"):
        read_log(tmp_path / "lists", robot=robot, check=False)
    (tmp_path / "header").mkdir()
    RUN[["time"]].to_csv(tmp_path / "header" / "time.csv", index=False)
    for name, quantity, joints in (("positions", "q", (1, 2)), ("torques", "tau", (2, 1))):
        block = RUN[[f"{quantity}{k}" for k in joints]]
        block.columns = [f"joint{k}" for k in joints]
        block.to_csv(tmp_path / "header" / f"{name}.csv", index=False)
    for known in (robot, None):
        same(read_log(tmp_path / "header", robot=known, check=False), RUN)


def test_listed_joints_that_the_robot_lacks_are_left_aside(tmp_path):
    wide = RUN.assign(q3=0.0, tau3=0.0)
    np.savez(
        tmp_path / "log.npz",
        time=RUN["time"],
        joint_names=["gripper", "joint1", "joint2"],
        q=wide[["q3", "q1", "q2"]],
        tau=wide[["tau3", "tau1", "tau2"]],
    )
    frame = read_log(tmp_path / "log.npz", robot=load_planar_arm(), check=False)
    same(frame, RUN)
    assert any("belong to no joint of the robot" in note for note in frame.attrs["notes"])


@pytest.mark.parametrize("kind", ["csv", "npy"])
def test_signals_without_headers_and_the_time_in_front(tmp_path, kind):
    for name, quantity in (("q", "q"), ("qd", "dq"), ("tau", "tau")):
        block = RUN[["time", f"{quantity}1", f"{quantity}2"]].to_numpy()
        if kind == "npy":
            np.save(tmp_path / f"{name}.npy", block)
        else:
            np.savetxt(tmp_path / f"{name}.csv", block, delimiter=",")
    same(read_log(tmp_path, check=False), RUN, ("time", "q1", "dq2", "tau2"))


def test_texts_and_parameters_beside_recordings_are_left_out(tmp_path):
    for k, run in LOG.groupby("trajectory"):
        # named after what was recorded, not after a signal that the file contains
        run.drop(columns="trajectory").to_csv(tmp_path / f"torque_test_{k}.csv", index=False)
    (tmp_path / "README.txt").write_text("A log, of an arm, of an arm.\n")
    (tmp_path / "gains.csv").write_text("name,value\nkp,3\n")
    with pytest.warns(UserWarning, match="gains.csv: left out, since no column of it is a signal"):
        same(read_log(tmp_path, check=False), LOG)


@pytest.mark.parametrize("header", [False, True])
def test_recordings_of_a_folder_whose_columns_are_chosen(tmp_path, header):
    for k, run in LOG.groupby("trajectory"):
        run = run[["time", "q1", "q2", "tau1", "tau2"]].set_axis(list("tabcd"), axis=1)
        run.to_csv(tmp_path / f"run{k}.csv", index=False, header=header)
    columns = {"q": ["a", "b"], "tau": ["c", "d"]}
    if not header:
        columns = {"time": 0, "q": [1, 2], "tau": [3, 4]}
    same(read_log(tmp_path, columns=columns, check=False), LOG)


def test_files_of_differing_length_are_refused(tmp_path):
    RUN[["time", "q1", "q2"]].to_csv(tmp_path / "positions.csv", index=False)
    RUN[["tau1", "tau2"]].iloc[:-5].to_csv(tmp_path / "torques.csv", index=False)
    with pytest.raises(LogError, match=r"torques.csv has no time column and 295 rows"):
        read_log(tmp_path, check=False)


def test_folders_and_patterns_of_whole_logs(tmp_path):
    for k, run in LOG.groupby("trajectory"):
        run.drop(columns="trajectory").to_csv(tmp_path / f"run{k}.csv", index=False)
    for path in (tmp_path, tmp_path / "run*.csv"):
        frame = read_log(path, check=False)
        assert frame["trajectory"].nunique() == 2
        same(frame, LOG)
    notes = read_log(tmp_path, resample_rate=50.0, check=False).attrs["notes"]
    assert any("300 rows in place of 600 (2 of 2 files)" in note for note in notes)
    with pytest.raises(LogError, match="no file matches"):
        read_log(tmp_path / "none*.csv")
    (tmp_path / "empty").mkdir()
    with pytest.raises(LogError, match="the folder holds no log"):
        read_log(tmp_path / "empty")


def test_lerobot_data_set(tmp_path):
    folder = tmp_path / "data" / "chunk-000"
    folder.mkdir(parents=True)
    (tmp_path / "meta").mkdir()
    names = {"observation.state": {"names": ["shoulder.pos", "elbow.pos"]}}
    (tmp_path / "meta" / "info.json").write_text(json.dumps({"fps": 100, "features": names}))
    for k, run in LOG.groupby("trajectory"):
        pd.DataFrame(
            {
                "observation.state": lists(run, "q"),
                "observation.effort": lists(run, "tau"),
                "action": lists(run, "q"),
                "timestamp": run["time"].to_numpy() - run["time"].iloc[0],
                "frame_index": np.arange(len(run)),
                "episode_index": k,
            }
        ).to_parquet(folder / f"episode_{k:06d}.parquet")
    frame = read_log(tmp_path, check=False)
    same(frame, LOG)
    np.testing.assert_allclose(frame["cmd2"], LOG["q2"])
    assert frame["trajectory"].nunique() == 2
    assert frame.attrs["joint_names"] == ["shoulder", "elbow"]


@pytest.mark.parametrize("unit", ["ms", "us", "ns"])
def test_dates_and_durations_in_any_unit(tmp_path, unit):
    for kind in ("timedelta64", "datetime64"):
        stamps = np.round(RUN["time"].to_numpy() * 1e3).astype("timedelta64[ms]")
        if kind == "datetime64":
            stamps = np.datetime64("2026-01-01") + stamps
        table = RUN.drop(columns=["time", "trajectory"]).assign(
            time=stamps.astype(f"{kind}[{unit}]")
        )
        table.to_parquet(tmp_path / "log.parquet")
        frame = read_log(tmp_path / "log.parquet", check=False)
        assert np.diff(frame["time"]).mean() == pytest.approx(0.01, rel=1e-3)


def test_patterns_name_columns_without_a_robot(tmp_path):
    names = {"q1": "a_angle_x", "q2": "b_angle_x", "tau1": "m0_load", "tau2": "m1_load"}
    RUN[["time", *names]].rename(columns=names).to_csv(tmp_path / "log.csv", index=False)
    columns = {"q": "{joint}_angle_x", "tau": "m{i}_load"}
    same(read_log(tmp_path / "log.csv", columns=columns, check=False), RUN)
    order = {"q1": "b_angle", "q2": "a_angle", "tau2": "a_load", "tau1": "b_load"}
    RUN[["time", *order]].rename(columns=order).to_csv(tmp_path / "turned.csv", index=False)
    columns = {"q": "{joint}_angle", "tau": "{joint}_load"}
    same(read_log(tmp_path / "turned.csv", columns=columns, check=False), RUN)
    with pytest.raises(LogError, match="no column matches"):
        read_log(tmp_path / "log.csv", columns={"q": "{joint}_none", "tau": "m{i}_load"})


def test_names_of_simulators(tmp_path):
    names = {f"{ours}{k}": f"{theirs}{k}" for k in (1, 2) for ours, theirs in SIMULATOR.items()}
    RUN[["time", *names]].rename(columns=names).to_csv(tmp_path / "log.csv", index=False)
    same(read_log(tmp_path / "log.csv", check=False), RUN, ("q1", "dq2", "tau2"))


SIMULATOR = {"q": "qpos", "dq": "qvel", "tau": "qtorque"}


def test_a_git_lfs_pointer_is_recognised(tmp_path):
    pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 10\n"
    (tmp_path / "log.csv").write_text(pointer)
    with pytest.raises(LogError, match="git lfs pull"):
        read_log(tmp_path / "log.csv")
