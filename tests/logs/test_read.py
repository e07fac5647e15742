# SPDX-License-Identifier: BSD-3-Clause
"""Reading logs from files that the usual libraries write."""

import warnings

import numpy as np
import pandas as pd
import pytest

from skidyn.datasets import load_panda, load_planar_arm, make_hidden_effect_log
from skidyn.exceptions import LogError, LogWarning
from skidyn.logs import check_log, read_log

ROBOT = load_planar_arm()
N = 200
LOG = make_hidden_effect_log(ROBOT, None, n_trajectories=3, duration=4.0).frame


def table(n=N, names="q{k} dq{k} tau{k}", rate=100.0):
    """Two joints that swing, with torques of the order of the planar arm's."""
    t = np.arange(n) / rate
    columns = {"time": t}
    q, dq, tau = names.split()
    for k in range(2):
        phase = 2 * np.pi * (0.7 + 0.4 * k)
        columns[q.format(k=k + 1, j=ROBOT.joint_names[k])] = 0.5 * np.sin(phase * t)
        columns[dq.format(k=k + 1, j=ROBOT.joint_names[k])] = 0.5 * phase * np.cos(phase * t)
        columns[tau.format(k=k + 1, j=ROBOT.joint_names[k])] = np.cos(phase * t) + k
    return pd.DataFrame(columns)


def quiet_read(*args, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", LogWarning)
        return read_log(*args, **options)


def assert_same(frame, source):
    for name in ("time", "q1", "q2", "dq1", "dq2", "tau1", "tau2"):
        np.testing.assert_allclose(frame[name], source[name], rtol=0, atol=1e-9, err_msg=name)


@pytest.mark.parametrize("separator", [",", ";", "\t", " "])
def test_csv_with_any_separator(tmp_path, separator):
    source = table()
    source.to_csv(tmp_path / "log.csv", sep=separator, index=False)
    frame = quiet_read(tmp_path / "log.csv")
    assert_same(frame, source)
    assert frame["trajectory"].unique().tolist() == [1]


def test_csv_with_decimal_comma_and_comment(tmp_path):
    source = table().round(6)
    text = source.to_csv(sep=";", decimal=",", index=False)
    (tmp_path / "log.csv").write_text("# recorded in spring\n" + text)
    assert_same(quiet_read(tmp_path / "log.csv"), source)


def test_csv_without_header_by_position(tmp_path):
    source = table()
    source.to_csv(tmp_path / "log.txt", index=False, header=False)
    columns = {"time": 0, "q": [1, 4], "dq": [2, 5], "tau": [3, 6]}
    assert_same(quiet_read(tmp_path / "log.txt", columns=columns), source)


def test_parquet_and_npz(tmp_path):
    source = table()
    source.to_parquet(tmp_path / "log.parquet")
    assert_same(quiet_read(tmp_path / "log.parquet"), source)
    blocks = {name: source[[f"{name}1", f"{name}2"]].to_numpy() for name in ("q", "dq", "tau")}
    np.savez(tmp_path / "log.npz", t=source["time"], joint_names=["a", "b"], **blocks)
    frame = quiet_read(tmp_path / "log.npz")
    assert_same(frame, source)
    assert frame.attrs["joint_names"] == ["a", "b"]


def test_parquet_with_list_columns(tmp_path):
    source = table()
    pd.DataFrame(
        {
            "timestamp": source["time"],
            "position": source[["q1", "q2"]].to_numpy().tolist(),
            "velocity": source[["dq1", "dq2"]].to_numpy().tolist(),
            "effort": source[["tau1", "tau2"]].to_numpy().tolist(),
        }
    ).to_parquet(tmp_path / "states.parquet")
    assert_same(quiet_read(tmp_path / "states.parquet"), source)


@pytest.mark.parametrize("layout", ["rows", "columns", "struct"])
def test_matlab(tmp_path, layout):
    from scipy.io import savemat

    source = table()
    blocks = {name: source[[f"{name}1", f"{name}2"]].to_numpy() for name in ("q", "dq", "tau")}
    data = {"t": source["time"].to_numpy(), **blocks}
    if layout == "columns":
        data = {name: values.T for name, values in data.items()}
    savemat(tmp_path / "log.mat", {"log": data} if layout == "struct" else data)
    assert_same(quiet_read(tmp_path / "log.mat"), source)


def test_hdf5_groups_with_clocks_of_their_own(tmp_path):
    h5py = pytest.importorskip("h5py")
    source = table()
    slow = np.arange(0, 2, 0.05)
    with h5py.File(tmp_path / "log.h5", "w") as file:
        state = file.create_group("state")
        state["time"] = source["time"]
        state["q"] = source[["q1", "q2"]]
        state["dq"] = source[["dq1", "dq2"]]
        drive = file.create_group("drive")
        drive["time"] = slow
        drive["torque"] = np.column_stack([slow, 2 * slow])
    with pytest.warns(LogWarning, match="interpolated to the clock of state"):
        frame = read_log(tmp_path / "log.h5", check=False)
    assert frame["time"].max() <= slow.max()
    np.testing.assert_allclose(frame["tau2"], 2 * frame["time"], atol=1e-9)


def joint_states(source):
    for row in source.itertuples():
        yield round(row.time * 1e9), [row.q1, row.q2], [row.dq1, row.dq2], [row.tau1, row.tau2]


def test_mcap(tmp_path):
    writer = pytest.importorskip("mcap_ros2.writer")
    definition = """std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
    source = table(60)
    with (tmp_path / "log.mcap").open("wb") as file:
        target = writer.Writer(file)
        schema = target.register_msgdef("sensor_msgs/msg/JointState", definition)
        for ns, q, dq, tau in joint_states(source):
            message = {
                "header": {"stamp": {"sec": 7, "nanosec": ns}, "frame_id": ""},
                "name": ["joint2", "joint1"],
                "position": q[::-1],
                "velocity": dq[::-1],
                "effort": tau[::-1],
            }
            target.write_message("/joint_states", schema, message, log_time=ns, publish_time=ns)
        target.finish()
    frame = quiet_read(tmp_path / "log.mcap", robot=ROBOT)
    assert_same(frame, source)


@pytest.mark.parametrize("kind", ["ros1", "ros2", "bare"])
def test_bags(tmp_path, kind):
    pytest.importorskip("rosbags")
    from rosbags.rosbag1 import Writer as Writer1
    from rosbags.rosbag2 import Writer as Writer2
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC if kind == "ros1" else Stores.LATEST)
    types = store.types
    state = types["sensor_msgs/msg/JointState"]
    header, time = types["std_msgs/msg/Header"], types["builtin_interfaces/msg/Time"]
    source = table(60)
    path = tmp_path / ("log.bag" if kind == "ros1" else "bag")
    target = Writer1(path) if kind == "ros1" else Writer2(path, version=9)
    with target as bag:
        connection = bag.add_connection("/joint_states", state.__msgtype__, typestore=store)
        for ns, *blocks in joint_states(source):
            stamp = time(sec=5, nanosec=ns)
            first = {"seq": 0} if kind == "ros1" else {}
            message = state(
                header(**first, stamp=stamp, frame_id=""),
                list(ROBOT.joint_names),
                *(np.array(block) for block in blocks),
            )
            pack = store.serialize_ros1 if kind == "ros1" else store.serialize_cdr
            bag.write(connection, ns + 5 * 10**9, pack(message, state.__msgtype__))
    if kind == "bare":
        path = next(path.glob("*.db3")).rename(tmp_path / "lonely.db3")
    assert_same(quiet_read(path, robot=ROBOT), source)


def test_several_files_are_trajectories(tmp_path):
    for k in range(3):
        table(50).to_csv(tmp_path / f"{k}.csv", index=False)
    frame = quiet_read([tmp_path / f"{k}.csv" for k in range(3)])
    assert frame["trajectory"].value_counts().to_dict() == {1: 50, 2: 50, 3: 50}
    assert [file[-5:] for file in frame.attrs["files"]] == ["0.csv", "1.csv", "2.csv"]


def test_files_with_other_columns_are_refused(tmp_path):
    table(50).to_csv(tmp_path / "a.csv", index=False)
    table(50).assign(volts=1.0).to_csv(tmp_path / "b.csv", index=False)
    with pytest.raises(LogError, match="volts is in this file or in the first one"):
        quiet_read([tmp_path / "a.csv", tmp_path / "b.csv"])


def test_long_gap_begins_a_trajectory(tmp_path):
    source = table()
    source.loc[100:, "time"] += 30.0
    source.to_csv(tmp_path / "log.csv", index=False)
    with pytest.warns(LogWarning, match="cut at 1 gap"):
        frame = read_log(tmp_path / "log.csv", check=False)
    assert frame["trajectory"].tolist() == [1] * 100 + [2] * 100
    assert quiet_read(tmp_path / "log.csv", split_gaps=None)["trajectory"].nunique() == 1


def test_clock_that_starts_anew_begins_a_trajectory(tmp_path):
    pd.concat([table(80), table(80)]).to_csv(tmp_path / "log.csv", index=False)
    with pytest.warns(LogWarning, match="the clock restarts 1 time"):
        frame = read_log(tmp_path / "log.csv", check=False)
    assert frame["trajectory"].nunique() == 2


def test_rests_can_be_cut(tmp_path):
    move, rest = table(100), table(100)
    rest[["q1", "q2"]] = move[["q1", "q2"]].iloc[-1].to_numpy()
    rest[["dq1", "dq2"]] = 0.0
    log = pd.concat([move, rest, move], ignore_index=True)
    log["time"] = np.arange(300) / 100
    log.to_csv(tmp_path / "log.csv", index=False)
    frame = quiet_read(tmp_path / "log.csv", split_dwells=0.5)
    assert frame["trajectory"].nunique() == 2
    assert 140 < int(np.argmax(frame["trajectory"] == 2)) < 160


@pytest.mark.parametrize(
    "names",
    [
        "position_{k} velocity_{k} effort_{k}",
        "q_{j} dq_{j} tau_{j}",
        "{j}_pos {j}_vel {j}_torque",
        "/joint_states/{j}/position /joint_states/{j}/velocity /joint_states/{j}/effort",
        "Q[{k}] QD[{k}] TAU_J[{k}]",
    ],
)
def test_usual_names_are_recognised(tmp_path, names):
    table(names=names).to_csv(tmp_path / "log.csv", index=False)
    assert_same(quiet_read(tmp_path / "log.csv", robot=ROBOT), table())


def test_counting_from_zero_is_recognised(tmp_path):
    source = table()
    zero = source.rename(columns=lambda n: n.replace("1", "0").replace("2", "1"))
    zero.to_csv(tmp_path / "log.csv", index=False)
    assert_same(quiet_read(tmp_path / "log.csv"), source)


def test_patterns_with_joint_and_index(tmp_path):
    table(names="a.{j} b.{k} c.{k}").to_csv(tmp_path / "log.csv", index=False)
    columns = {"q": "a.{joint}", "dq": "b.{index}", "tau": "c.{index}"}
    assert_same(quiet_read(tmp_path / "log.csv", robot=ROBOT, columns=columns), table())


def test_dates_become_seconds(tmp_path):
    source = table()
    dated = source.assign(time=pd.to_datetime(source["time"] + 1.6e9, unit="s"))
    dated.to_csv(tmp_path / "log.csv", index=False)
    np.testing.assert_allclose(quiet_read(tmp_path / "log.csv")["time"], source["time"], atol=1e-6)


def test_other_messages_by_topic_and_mapping(tmp_path):
    pytest.importorskip("rosbags")
    from rosbags.rosbag2 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.LATEST)
    array, layout = (
        store.types[f"std_msgs/msg/{n}"] for n in ("Float64MultiArray", "MultiArrayLayout")
    )
    source = table(60)
    with Writer(tmp_path / "bag", version=9) as bag:
        connection = bag.add_connection("/drive", array.__msgtype__, typestore=store)
        for row in source.itertuples(index=False):
            message = array(layout([], 0), np.array(row[1:]))
            raw = store.serialize_cdr(message, array.__msgtype__)
            bag.write(connection, round(row.time * 1e9), raw)
    with pytest.raises(LogError, match=r"no sensor_msgs/JointState. It holds /drive \(std_msgs"):
        read_log(tmp_path / "bag")
    columns = {
        "q": ["data[0]", "data[3]"],
        "dq": ["data[1]", "data[4]"],
        "tau": ["data[2]", "data[5]"],
    }
    frame = quiet_read(tmp_path / "bag", topics=["/drive"], columns=columns)
    assert_same(frame, source)


#: File, and a word of what is known to be wrong with it; None where nothing is.
KNOWN = {
    "bam/bam_pendulum.npz": "extreme value",
    "dfki/simple_pendulum.npz": "polled faster",
    "dvrk/dvrk_mtm.npz": "polled faster",
    "dvrk/dvrk_psm.npz": None,
    "emps/emps.npz": "single trajectory",
    "kuka_lwr4/kuka_lwr4.npz": "time stamps jitter",
    "lbr_med7/lbr_med7.npz": "polled faster",
    "panda/panda_gaz.npz": "taken at uneven steps",
    "polydoros/kuka_iiwa.npz": None,
    "rokae/rokae_xmate.npz": "single trajectory",
    "screw_drive/screw_drives.npz": "gap(s) in time",
    "tiago/tiago.npz": "single trajectory",
    "tx40/staubli_tx40.npz": "single trajectory",
    "ur10e/ur10e_excitation.npz": "gap(s) in time",
    "ur10e/ur10e_validation.npz": None,
}


@pytest.mark.slow
@pytest.mark.parametrize("name", KNOWN)
def test_recording_is_read_and_judged(name, data_dir):
    file = data_dir / name
    if not file.exists():
        pytest.skip(f"{file} is not here")
    with np.load(file) as archive:
        rows, n = archive["q"].shape
        gains = None if "tau" in archive else [1.0] * n
        unreadable = int(np.isnan(archive["t"]).sum())
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        log = read_log(file, drive_gains=gains, missing="drop", check=False)
    assert len(log) == rows - unreadable
    quality = check_log(log)
    assert all(0.95 < joint.velocity_slope < 1.2 for joint in quality.joints if joint.excited)
    if KNOWN[name] is None:
        assert quality.warnings == ()
    else:
        assert any(KNOWN[name] in message for message in quality.warnings + quality.notes)


def test_rows_without_order_in_time_are_refused(data_dir):
    file = data_dir / "sarcos/sarcos_test.npz"
    if not file.exists():
        pytest.skip(f"{file} is not here")
    with pytest.raises(LogError, match="4449 of 4449 rows"):
        read_log(file)


def test_absent_unknown_and_empty_files(tmp_path):
    with pytest.raises(LogError, match="no such file"):
        read_log(tmp_path / "log.csv")
    (tmp_path / "log.xyz").write_text("1")
    with pytest.raises(LogError, match="unknown kind of log '.xyz'"):
        read_log(tmp_path / "log.xyz")
    (tmp_path / "log.csv").write_text("")
    with pytest.raises(LogError, match="empty"):
        read_log(tmp_path / "log.csv")
    with pytest.raises(LogError, match="list of paths is empty"):
        read_log([])


@pytest.mark.parametrize("given", [pd.DataFrame({"time": [0.0]}), 5, [5]])
def test_only_paths_are_read(given):
    with pytest.raises(LogError, match="expected the path"):
        read_log(given)


def test_rows_in_reverse_order(saved):
    one = LOG[LOG["trajectory"] == 1].drop(columns="trajectory")
    with pytest.raises(LogError, match=r"reverse order. Sort them by time"):
        read_log(saved(one[::-1]))


def test_repeated_times_are_counted(saved):
    repeated = pd.concat([LOG, LOG.iloc[[10, 20]]]).sort_values("time", kind="stable")
    with pytest.warns(LogWarning, match="2 of 1202 rows repeat the time.*first in row 11"):
        frame = read_log(saved(repeated), check=False)
    assert len(frame) == len(LOG)


def test_joint_counts_that_differ(saved):
    with pytest.raises(LogError, match=r"has 2 joints.*robot has 7.*joints=\[...\]"):
        read_log(saved(LOG), robot=load_panda())
    with pytest.raises(LogError, match="the log has 2 joints, the robot has 7"):
        check_log(LOG, load_panda())
    with pytest.raises(LogError, match=r"tau3, but positions of 2 joint"):
        read_log(saved(LOG.assign(tau3=0.0)))


def test_joint_names_that_differ_are_suggested(saved):
    renamed = LOG.rename(columns=lambda name: name.replace("q1", "q_jiont1").replace("q2", "q_x"))
    with pytest.raises(LogError, match=r"joint1, joint2 \(did you mean 'jiont1'\?\)"):
        read_log(saved(renamed), robot=ROBOT)
    with pytest.raises(LogError, match="'speed', .*did you mean 'speed1'"):
        read_log(saved(LOG.rename(columns={"q1": "speed1"})), columns={"q": ["speed", "q2"]})


def test_suspicions_are_issued_as_warnings(saved):
    first = LOG[LOG["trajectory"] == 1].reset_index(drop=True)
    with pytest.warns(LogWarning, match="1 gap") as caught:
        read_log(saved(first.drop(index=range(100, 200))), robot=ROBOT)
    assert caught[0].filename == __file__  # at the caller's line, not inside skidyn


def test_a_time_to_split_at_is_no_yes_or_no(saved):
    with pytest.raises(LogError, match="split_gaps is True; expected the time in s"):
        read_log(saved(LOG), split_gaps=True)


def test_one_broken_log_among_fifty_is_named(tmp_path):
    files = []
    for k in range(50):
        rows = "".join(f"{t / 10},{t * 0.1},{t * 0.2}\n" for t in range(5))
        broken = "0.5,0.1\n" if k == 37 else ""
        files.append(tmp_path / f"robot_{k}.csv")
        files[-1].write_text("time,q1,tau1\n" + rows + broken)
    with pytest.raises(LogError, match=r"robot_37\.csv: line 7 has 2 fields"):
        read_log(files, check=False)
