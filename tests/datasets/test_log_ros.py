# SPDX-License-Identifier: BSD-3-Clause
"""Joint states as robots publish them: in JSON, in changing order, beside a gripper."""

import json
import warnings

import numpy as np
import pytest

from skidyn._exceptions import LogError, LogWarning
from skidyn.datasets import load_planar_arm, read_log

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
    with pytest.warns(LogWarning, match="'finger/position' belongs to no joint of the robot"):
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
