# SPDX-License-Identifier: BSD-3-Clause
"""Torques and residuals as log viewers read them."""

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm
from skidyn.exceptions import SkidynError
from skidyn.export import write_traces

pandas = pytest.importorskip("pandas", reason="needs pandas")


@pytest.fixture
def log():
    """Two trajectories whose clocks both start at 0, measured torque, predicted torque."""
    time = np.tile(np.arange(50) * 0.01, 2)
    q = np.column_stack([np.sin(time), np.cos(2 * time)])
    dq = np.column_stack([np.cos(time), -2 * np.sin(2 * time)])
    ddq = np.column_stack([-np.sin(time), -4 * np.cos(2 * time)])
    columns = {"time": time, "trajectory": np.repeat([1, 2], 50)}
    for name, values in (("q", q), ("dq", dq), ("ddq", ddq)):
        columns |= {f"{name}{j + 1}": values[:, j] for j in range(2)}
    torque = np.column_stack([3 * time, 1 - time])
    return pandas.DataFrame(columns), torque, torque + [0.5, -0.25]


def test_mcap_holds_joint_states_that_other_tools_read(log, tmp_path):
    reader = pytest.importorskip("mcap.reader", reason="needs skidyn[io]")
    decoder = pytest.importorskip("mcap_ros2.decoder", reason="needs skidyn[io]")
    X, y, told = log
    path = write_traces(tmp_path / "errors.mcap", X, y, told, load_planar_arm())
    found = {"/measured": [], "/predicted": [], "/residual": []}
    with path.open("rb") as file:
        source = reader.make_reader(file, decoder_factories=[decoder.DecoderFactory()])
        for schema, channel, message, state in source.iter_decoded_messages():
            assert schema.name == "sensor_msgs/msg/JointState"
            found[channel.topic].append((message.log_time, state))
    for topic, torque in (("/measured", y), ("/predicted", told), ("/residual", y - told)):
        np.testing.assert_array_equal([state.effort for _, state in found[topic]], torque)
    states = [state for _, state in found["/measured"]]
    assert list(states[0].name) == list(load_planar_arm().joint_names)
    np.testing.assert_array_equal([s.position for s in states], X[["q1", "q2"]])
    assert [s.header.frame_id for s in states[49:51]] == ["trajectory 1", "trajectory 2"]
    stamps = np.array([when for when, _ in found["/measured"]]) / 1e9
    assert (np.diff(stamps) > 0).all() and stamps[50] - stamps[49] == pytest.approx(1.0)


def test_skidyn_reads_its_own_mcap(log, tmp_path):
    pytest.importorskip("mcap_ros2.decoder", reason="needs skidyn[io]")
    from skidyn.logs import read_log

    X, y, told = log
    robot = load_planar_arm()
    path = write_traces(tmp_path / "errors.mcap", X, y, told, robot)
    again = read_log([str(path)], robot=robot, topics=["/measured"])
    np.testing.assert_allclose(again[["tau1", "tau2"]], y, atol=1e-12)
    np.testing.assert_allclose(again[["q1", "q2"]], X[["q1", "q2"]], atol=1e-12)


def test_rrd_holds_a_scalar_of_every_joint(log, tmp_path):
    pytest.importorskip("rerun", reason="needs skidyn[rerun]")
    X, y, told = log
    path = write_traces(tmp_path / "errors.rrd", X, y, told, load_planar_arm())
    content = path.read_bytes()
    assert content.startswith(b"RRF")
    for name in load_planar_arm().joint_names:
        assert f"torque/{name}/residual".encode() in content


def test_a_missing_viewer_names_the_extra(log, tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "rerun", None)
    X, y, told = log
    with pytest.raises(ImportError, match=r"skidyn\[rerun\]"):
        write_traces(tmp_path / "errors.rrd", X, y, told, load_planar_arm())
    assert not (tmp_path / "errors.rrd").exists()


def test_what_cannot_be_shown_is_refused(log, tmp_path):
    X, y, told = log
    robot = load_planar_arm()
    with pytest.raises(SkidynError, match=r"must end in \.mcap or \.rrd"):
        write_traces(tmp_path / "errors.csv", X, y, told, robot)
    with pytest.raises(SkidynError, match=r"shape \(100, 1\)"):
        write_traces(tmp_path / "errors.mcap", X, y, told[:, :1], robot)
    with pytest.raises(SkidynError, match="no time column"):
        write_traces(tmp_path / "errors.mcap", X.drop(columns="time"), y, told, robot)


def test_a_rate_stands_for_the_time(log, tmp_path):
    reader = pytest.importorskip("mcap.reader", reason="needs skidyn[io]")
    pytest.importorskip("mcap_ros2.writer", reason="needs skidyn[io]")
    X, y, told = log
    words = X.drop(columns="time"), y, told, load_planar_arm()
    path = write_traces(tmp_path / "errors.mcap", *words, rate=100.0)
    with path.open("rb") as file:
        summary = reader.make_reader(file).get_summary()
    assert summary.statistics.message_count == 3 * len(X)
    assert summary.statistics.message_end_time == pytest.approx(0.99e9)
