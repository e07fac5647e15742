# SPDX-License-Identifier: BSD-3-Clause
"""Downloads, from a local server in place of the network."""

import functools
import hashlib
import http.server
import json
import sqlite3
import threading

import numpy as np
import pytest
from scipy.io import savemat

from skidyn.datasets import fetch_recording
from skidyn.exceptions import LogError

pytest.importorskip("pooch")


@pytest.fixture
def site(tmp_path):
    """Folder that is served on this machine, and its address."""

    class Quiet(http.server.SimpleHTTPRequestHandler):
        def log_message(self, *args):
            pass

    folder = tmp_path / "site"
    folder.mkdir()
    handler = functools.partial(Quiet, directory=folder)
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        thread = threading.Thread(target=server.serve_forever, daemon=True)
        thread.start()
        yield folder, f"http://127.0.0.1:{server.server_port}"
        server.shutdown()
        thread.join()


def emps_like(path):
    t = np.arange(200)[:, None] / 1000
    data = {"t": t, "qm": 0.1 * np.sin(9 * t), "vir": np.cos(9 * t), "gtau": 35.15}
    savemat(path, data)


def test_emps_is_read_and_kept(site, tmp_path):
    folder, address = site
    emps_like(folder / "DATA_EMPS.mat")
    options = {"data_home": tmp_path / "home", "url": address}
    with pytest.warns(UserWarning, match="derived by central differences"):
        emps = fetch_recording("emps", **options)
    assert emps.licence == "Apache-2.0"
    assert emps.frame["tau1"].iloc[0] == pytest.approx(35.15065, abs=1e-4)
    (folder / "DATA_EMPS.mat").unlink()  # the second call must not need the source
    with pytest.warns(UserWarning):
        assert fetch_recording("emps", **options).frame.equals(emps.frame)


def test_checksum_is_held(site, tmp_path):
    folder, address = site
    emps_like(folder / "DATA_EMPS.mat")
    options = {"data_home": tmp_path / "home", "url": address}
    with pytest.raises(LogError, match="SHA-256 checksum .* not abc"):
        fetch_recording("emps", **options, sha256=["abc"])
    right = hashlib.sha256((folder / "DATA_EMPS.mat").read_bytes()).hexdigest()
    with pytest.warns(UserWarning):
        emps = fetch_recording("emps", **options, sha256=[right])
    with open(emps.paths[0], "ab") as file:
        file.write(b"spoiled")
    with pytest.raises(LogError, match="SHA-256 checksum"):
        fetch_recording("emps", **options)


def test_panda_bag_is_read(site, tmp_path):
    pytest.importorskip("rosbags")
    from rosbags.typesys import Stores, get_typestore

    folder, address = site
    store = get_typestore(Stores.LATEST)
    state = store.types["sensor_msgs/msg/JointState"]
    header, time = store.types["std_msgs/msg/Header"], store.types["builtin_interfaces/msg/Time"]
    names = [f"fer_joint{k}" for k in range(1, 8)]
    with sqlite3.connect(folder / "panda_exciting_trajectory.db3") as bag:
        bag.execute("CREATE TABLE topics (id INTEGER, name TEXT, type TEXT)")
        bag.execute("CREATE TABLE messages (topic_id INTEGER, timestamp INTEGER, data BLOB)")
        bag.execute("INSERT INTO topics VALUES (1, '/joint_states', 'sensor_msgs/msg/JointState')")
        for k in range(30):
            blocks = (np.full(7, value, dtype=float) for value in (0.1 * k, 3.0, 5.0))
            message = state(header(time(1, k * 33_000_000), ""), names, *blocks)
            raw = bytes(store.serialize_cdr(message, "sensor_msgs/msg/JointState"))
            bag.execute("INSERT INTO messages VALUES (1, ?, ?)", (k, raw))
    bag.close()
    panda = fetch_recording("panda_exciting", data_home=tmp_path / "home", url=address)
    assert panda.licence == "BSD-3-Clause"
    assert panda.frame.shape == (30, 23) and panda.frame.attrs["joint_names"] == names


def test_runs_of_the_double_pendulum_become_trajectories(site, tmp_path):
    folder, address = site
    names = [f"{s}_{k}{j}" for s in ("pos", "vel", "tau") for k in ("meas", "filt") for j in (1, 2)]
    table = np.column_stack(
        [np.arange(300) / 400, np.sin(np.arange(300)[:, None] / np.arange(3, 15))]
    )
    runs = ("trajectory_00.csv", "trajectory_01.csv")
    for run in runs:
        header = ",".join(["time", *names])
        np.savetxt(folder / run, table, delimiter=",", header=header, comments="")

    pendulum = fetch_recording(
        "double_pendulum", data_home=tmp_path / "home", url=address, files=runs
    )

    frame = pendulum.frame
    assert pendulum.licence == "BSD-3-Clause"
    assert list(frame["trajectory"].unique()) == [1, 2]
    for name, source in {"q2": "pos_meas2", "dq1": "vel_meas1", "tau2": "tau_meas2"}.items():
        column = table[:, 1 + names.index(source)]
        np.testing.assert_allclose(frame[name][:300], column)


def test_currents_of_the_servo_get_their_sign_back(site, tmp_path):
    folder, address = site
    entry = {"position": 0.1, "speed": -0.2, "input_volts": 7.4, "temp": 28, "torque_enable": True}
    entries = [entry | {"timestamp": k / 200, "load": load} for k, load in enumerate((5, 65531))]
    (folder / "run.json").write_text(json.dumps({"mass": 0.49, "entries": entries}))

    servo = fetch_recording("xl330", data_home=tmp_path / "home", url=address, files=("run.json",))

    assert servo.frame["i1"].tolist() == [0.005, -0.005]
    assert servo.load == pytest.approx(0.481, abs=1e-3)
    (folder / "other.json").write_text("{}")
    with pytest.raises(LogError, match="other.json is not a recording"):
        fetch_recording("xl330", data_home=tmp_path / "home", url=address, files=("other.json",))


def test_runs_of_the_worm_drive_come_in_si_units(site, tmp_path):
    folder, address = site
    head = "Date:;2020-07-10\n;Velocity actual value averaged;Torque actual value averaged\n"
    text = head + "ms;rpm;%\n0.000;0;0.0\n40.000;-30;-10.0 start\n80.000;-30;-10.0\n"
    (folder / "start_stop").mkdir()
    (folder / "start_stop" / "10.csv").write_text(text)

    drive = fetch_recording(
        "screw_drive", data_home=tmp_path / "home", url=address, files=("start_stop/10.csv",)
    )

    frame = drive.frame
    assert drive.licence == "MIT"
    np.testing.assert_allclose(frame["dq1"], [0, -np.pi, -np.pi])
    np.testing.assert_allclose(frame["q1"], [0, -0.02 * np.pi, -0.06 * np.pi])
    np.testing.assert_allclose(frame["tau1"], [0, -0.984e-3, -0.984e-3])
    (folder / "start_stop" / "bad.csv").write_text("a;b;c")
    with pytest.raises(LogError, match="not a recording"):
        fetch_recording(
            "screw_drive", data_home=tmp_path, url=address, files=("start_stop/bad.csv",)
        )


def test_the_panda_of_gaz_is_put_together_from_its_files(site, tmp_path):
    folder, address = site
    rng = np.random.default_rng(0)
    blocks = {name: rng.normal(size=(20, 7)) for name in ("positions", "velocity", "torques")}
    for name, values in blocks.items():
        np.savetxt(folder / f"exciting_traj_{name}.txt", values)
    np.savetxt(folder / "exciting_traj_time.txt", np.arange(20) / 1000)

    panda = fetch_recording("panda_gaz", data_home=tmp_path / "home", url=address)

    np.testing.assert_allclose(panda.frame["tau7"], blocks["torques"][:, 6])
    assert panda.frame.shape == (20, 23)
    np.savetxt(folder / "exciting_traj_velocity.txt", blocks["velocity"][:5])
    with pytest.raises(LogError, match=r"dq has shape \(5, 7\); \(20, 7\) is expected"):
        fetch_recording("panda_gaz", data_home=tmp_path / "other", url=address)


def test_an_unknown_recording_is_refused():
    with pytest.raises(LogError, match="no recording 'empss'; there are emps, "):
        fetch_recording("empss")
