# SPDX-License-Identifier: BSD-3-Clause
"""Joint states as robots publish them: in JSON, in changing order, beside a gripper."""

import json
import warnings
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm
from skidyn.exceptions import LogError, LogWarning, SkidynError
from skidyn.logs import read_log

writer = pytest.importorskip("mcap.writer")
N = 60
T = np.arange(N) / 100
Q = np.c_[np.sin(3 * T), np.cos(2 * T)]


def quiet_read(*args, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", LogWarning)
        return read_log(*args, **options)


def state(names, values, k, velocity=True):
    stamp = {"sec": 5, "nanosec": round(T[k] * 1e9)}
    return {
        "header": {"stamp": stamp},
        "name": names,
        "position": values,
        "velocity": values if velocity else [],
        "effort": [v + 1 for v in values],
    }


def write(path, topics):
    """An MCAP file with messages in JSON, topics given as lists of messages."""
    with path.open("wb") as file:
        target = writer.Writer(file)
        target.start()
        schema = target.register_schema("sensor_msgs/msg/JointState", "jsonschema", b"{}")
        for topic, messages in topics.items():
            channel = target.register_channel(topic, "json", schema)
            for k, message in enumerate(messages):
                data = json.dumps(message).encode()
                target.add_message(channel, round(T[k % N] * 1e9), data, round(T[k % N] * 1e9))
        target.finish()
    return path


def test_messages_in_json_and_joints_in_changing_order(tmp_path):
    names = ["joint1", "joint2"]
    messages = [
        state(names[:: 1 - 2 * (k % 2)], Q[k, :: 1 - 2 * (k % 2)].tolist(), k) for k in range(N)
    ]
    file = write(tmp_path / "log.mcap", {"/joint_states": messages})
    frame = quiet_read(file, robot=load_planar_arm())
    np.testing.assert_allclose(frame[["q1", "q2"]], Q)
    np.testing.assert_allclose(frame["time"], T, atol=1e-9)


def test_a_gripper_on_the_same_topic_is_kept_apart(tmp_path):
    arm = [state(["joint1", "joint2"], Q[k].tolist(), k) for k in range(N)]
    finger = [state(["finger"], [0.01], k) for k in range(N)]
    file = write(tmp_path / "log.mcap", {"/joint_states": arm + finger})
    with pytest.warns(LogWarning, match="finger/position belong to no joint of the robot"):
        frame = read_log(file, robot=load_planar_arm(), check=False)
    np.testing.assert_allclose(frame[["tau1", "tau2"]], Q + 1)
    assert (frame["finger/position"] == 0.01).all()


def test_velocities_that_nobody_publishes_are_derived(tmp_path):
    messages = [state(["joint1", "joint2"], Q[k].tolist(), k, velocity=False) for k in range(N)]
    file = write(tmp_path / "log.mcap", {"/joint_states": messages})
    with pytest.warns(LogWarning, match="derived by central differences"):
        frame = read_log(file, robot=load_planar_arm(), check=False)
    np.testing.assert_allclose(frame["dq1"][1:-1], 3 * np.cos(3 * T)[1:-1], atol=1e-2)


def test_the_same_joints_on_two_topics(tmp_path):
    messages = [state(["joint1", "joint2"], Q[k].tolist(), k) for k in range(N)]
    file = write(tmp_path / "log.mcap", {"/joint_states": messages, "/filtered": messages})
    with pytest.raises(LogError, match=r"choose one with topics=\[...\]"):
        read_log(file, robot=load_planar_arm())
    assert len(quiet_read(file, robot=load_planar_arm(), topics=["/filtered"])) == N


def protobuf_types():
    """Schema and class of a JointState, and of a type that holds itself."""
    descriptor_pb2 = pytest.importorskip("google.protobuf.descriptor_pb2")
    factory = pytest.importorskip("google.protobuf.message_factory")
    pytest.importorskip("mcap_protobuf")
    file = descriptor_pb2.FileDescriptorProto(name="s.proto", package="robot", syntax="proto3")
    state = file.message_type.add(name="JointState")
    for number, (name, kind) in enumerate(
        [("name", 9), ("position", 1), ("velocity", 1), ("effort", 1)], start=1
    ):
        state.field.add(name=name, number=number, type=kind, label=3)
    node = file.message_type.add(name="Node")
    node.field.add(name="q1", number=1, type=1, label=1)
    node.field.add(name="child", number=2, type=11, label=1, type_name=".robot.Node")
    described = descriptor_pb2.FileDescriptorSet(file=[file])
    return described.SerializeToString(), factory.GetMessages([file])


def write_protobuf(path, schema, name, messages):
    with path.open("wb") as file:
        target = writer.Writer(file)
        target.start()
        kind = target.register_schema(name, "protobuf", schema)
        channel = target.register_channel("/joints", "protobuf", kind)
        for k, message in enumerate(messages):
            at = round(T[k] * 1e9)
            target.add_message(channel, at, message.SerializeToString(), at)
        target.finish()
    return path


def test_messages_in_protobuf(tmp_path):
    schema, classes = protobuf_types()
    make = classes["robot.JointState"]
    messages = [
        make(name=["joint1", "joint2"], position=q, velocity=q, effort=[v + 1 for v in q])
        for q in Q.tolist()
    ]
    file = write_protobuf(tmp_path / "log.mcap", schema, "robot.JointState", messages)
    frame = quiet_read(file, robot=load_planar_arm())
    np.testing.assert_allclose(frame[["q1", "q2"]], Q)
    np.testing.assert_allclose(frame["tau2"], Q[:, 1] + 1)
    np.testing.assert_allclose(frame["time"], T, atol=1e-9)


def test_other_types_in_protobuf_by_their_fields(tmp_path):
    schema, classes = protobuf_types()
    make = classes["robot.Node"]
    messages = [make(q1=q, child=make(q1=q + 1)) for q in Q[:, 0]]
    file = write_protobuf(tmp_path / "log.mcap", schema, "robot.Node", messages)
    with pytest.raises(LogError, match=r"It holds /joints \(robot.Node\)"):
        read_log(file)
    columns = {"q": ["q1"], "tau": ["child.q1"]}
    frame = quiet_read(file, topics=["/joints"], columns=columns)
    np.testing.assert_allclose(frame[["q1", "tau1"]], np.c_[Q[:, 0], Q[:, 0] + 1])


def messages_of(n=N):
    return [state(["joint1", "joint2"], Q[k].tolist(), k) for k in range(n)]


def test_a_chunk_whose_checksum_is_wrong_is_refused(tmp_path):
    file = write(tmp_path / "log.mcap", {"/joint_states": messages_of()})
    file_of_chunks = tmp_path / "chunks.mcap"
    with file_of_chunks.open("wb") as out:
        target = writer.Writer(out, compression=writer.CompressionType.NONE)
        target.start()
        schema = target.register_schema("sensor_msgs/msg/JointState", "jsonschema", b"{}")
        channel = target.register_channel("/joint_states", "json", schema)
        for k, message in enumerate(messages_of()):
            target.add_message(channel, k, json.dumps(message).encode(), k)
        target.finish()
    data = file_of_chunks.read_bytes()
    # one digit of one position is another: the file is whole, and says something else
    at = data.index(b'"position": [0.') + len(b'"position": [0.')
    damaged = data[:at] + (b"7" if data[at : at + 1] != b"7" else b"3") + data[at + 1 :]
    file.write_bytes(damaged)
    assert len(quiet_read(file_of_chunks, robot=load_planar_arm())) == N
    with pytest.raises(LogError, match="crc|CRC"):
        quiet_read(file, robot=load_planar_arm())


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_a_truncated_mcap_is_read_up_to_there_or_refused(tmp_path, share):
    file = write(tmp_path / "log.mcap", {"/joint_states": messages_of()})
    data = file.read_bytes()
    file.write_bytes(data[: int(share * len(data))])
    with pytest.raises(LogError, match=r"log\.mcap"):
        quiet_read(file, robot=load_planar_arm())


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
@pytest.mark.parametrize("kind", ["bag", "db3"])
def test_truncated_bags_are_refused_by_name(tmp_path, kind, share):
    typesys = pytest.importorskip("rosbags.typesys")
    store = typesys.get_typestore(
        typesys.Stores.ROS1_NOETIC if kind == "bag" else typesys.Stores.LATEST
    )
    kinds = store.types
    header = kinds["std_msgs/msg/Header"]
    extra = {"seq": 0} if kind == "bag" else {}
    stamps = [kinds["builtin_interfaces/msg/Time"](5, round(t * 1e9)) for t in T]
    states = [
        kinds["sensor_msgs/msg/JointState"](
            header=header(stamp=stamps[k], frame_id="", **extra),
            name=["joint1", "joint2"],
            position=Q[k],
            velocity=Q[k],
            effort=Q[k],
        )
        for k in range(N)
    ]
    rosbag = pytest.importorskip("rosbags.rosbag1" if kind == "bag" else "rosbags.rosbag2")
    path = tmp_path / ("log.bag" if kind == "bag" else "log")
    options = {} if kind == "bag" else {"version": 8}
    with rosbag.Writer(path, **options) as out:
        connection = out.add_connection("/j", "sensor_msgs/msg/JointState", typestore=store)
        serialize = store.serialize_ros1 if kind == "bag" else store.serialize_cdr
        for k, message in enumerate(states):
            out.write(connection, k + 1, serialize(message, "sensor_msgs/msg/JointState"))
    assert len(quiet_read(path, robot=load_planar_arm())) == N
    file = path if kind == "bag" else next(path.glob("*.db3"))
    file.write_bytes(file.read_bytes()[: int(share * file.stat().st_size)])
    with pytest.raises(LogError, match="log"):
        quiet_read(path, robot=load_planar_arm())


def test_broken_bags(tmp_path):
    pytest.importorskip("mcap_ros2")
    pytest.importorskip("rosbags")
    for name in ("log.mcap", "log.bag", "log.db3"):
        (tmp_path / name).write_bytes(b"nothing of the kind" * 10)
        with pytest.raises(LogError, match=name):
            read_log(tmp_path / name)


def test_a_bag_reads_no_database_outside_its_folder(secret, opened):
    rosbags = pytest.importorskip("rosbags.rosbag2")
    secret, _ = secret
    with rosbags.Writer("bag", version=9):
        pass
    database = next(Path("bag").glob("*.db3"))
    database.rename(secret.parent / database.name)
    metadata = Path("bag/metadata.yaml")
    text = metadata.read_text()
    metadata.write_text(text.replace(database.name, f"../../secret/{database.name}"))

    def read():
        with suppress(SkidynError):
            read_log("bag")

    heard = opened(read)
    assert not {f for f in heard if f.startswith(str(secret.parent))}
