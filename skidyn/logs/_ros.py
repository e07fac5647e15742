# SPDX-License-Identifier: BSD-3-Clause
"""Readers of MCAP files and of ROS 1 and ROS 2 bags; no ROS installation is needed."""

from __future__ import annotations

import json
import re
import sqlite3
from array import array
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from skidyn._exceptions import LogError
from skidyn._optional import import_optional
from skidyn.logs._bounds import (
    Budget,
    bag_chunks,
    bag_folder,
    check_size,
    database_messages,
    mcap_chunks,
)
from skidyn.logs._files import Channel, table_from_arrays

#: Largest message in JSON, bytes: joint states take some hundred, and a parsed message takes up to
#: fifty times the memory of its text.
LARGEST_MESSAGE = 2**20
#: Topic, message type, time of recording in ns, message.
Message = tuple[str, str, int, Any]


def read_mcap_channels(path: Path, max_bytes: int, topics: Sequence[str] | None) -> list[Channel]:
    """Read the joint states of an MCAP file with messages of ROS 2, in JSON or in protobuf."""
    reader = import_optional("mcap.reader", extra="io")
    decoder = import_optional("mcap_ros2.decoder", extra="io")
    exceptions = import_optional("mcap.exceptions", extra="io")
    check_size(path, path.stat().st_size, max_bytes)
    budget = Budget(path, max_bytes)
    try:
        mcap_chunks(path, budget)
        with path.open("rb") as file:
            decoders = [decoder.DecoderFactory(), _JsonDecoders(), _ProtobufDecoders()]
            source = reader.make_reader(file, validate_crcs=True, decoder_factories=decoders)
            summary = source.get_summary()
            held = {}
            if summary is not None:  # an incomplete file has none; then every message is decoded
                schemas = {k: schema.name for k, schema in summary.schemas.items()}
                held = {c.topic: schemas.get(c.schema_id, "") for c in summary.channels.values()}
            wanted = _wanted(held, topics, path) if held else topics
            messages = (
                (channel.topic, schema.name, message.log_time, decoded)
                for schema, channel, message, decoded in source.iter_decoded_messages(topics=wanted)
            )
            return _channels(messages, path, topics)
    except (exceptions.McapError, json.JSONDecodeError) as error:
        raise LogError(f"{path}: cannot be read as MCAP: {error}") from error


class _JsonDecoders:
    """Messages in JSON as objects with attributes, like those of ROS."""

    def decoder_for(self, encoding: str, schema: Any) -> Any:
        """Decoder of an encoding, None for others than JSON."""
        if encoding != "json":
            return None
        return _read_json


def _read_json(data: bytes) -> Any:
    if len(data) > LARGEST_MESSAGE:
        raise LogError(f"a JSON message has {len(data)} bytes, which is too long for a joint state")
    return json.loads(data, object_hook=lambda fields: SimpleNamespace(**fields))


class _ProtobufDecoders:
    """Messages in protobuf; their library is needed only if there are any."""

    def __init__(self) -> None:
        self._decoders: Any = None

    def decoder_for(self, encoding: str, schema: Any) -> Any:
        """Decoder of an encoding, None for others than protobuf."""
        if encoding != "protobuf":
            return None
        if self._decoders is None:
            self._decoders = import_optional("mcap_protobuf.decoder", extra="io").DecoderFactory()
        return self._decoders.decoder_for(encoding, schema)


def read_bag_channels(path: Path, max_bytes: int, topics: Sequence[str] | None) -> list[Channel]:
    """Read the joint states of a ROS 1 bag (a file) or a ROS 2 bag (a folder or its .db3 file)."""
    budget = Budget(path, max_bytes)
    if path.suffix.lower() == ".db3" and not (path.parent / "metadata.yaml").exists():
        database_messages(path, budget)
        return _channels(_bare_database(path), path, topics)
    highlevel = import_optional("rosbags.highlevel", extra="io")
    folder = path.parent if path.suffix.lower() == ".db3" else path
    if folder.is_dir():
        bag_folder(folder, budget)
    else:
        bag_chunks(path, budget)
    try:
        with highlevel.AnyReader([folder], default_typestore=_typestore()) as reader:
            held = {c.topic: c.msgtype for c in reader.connections}
            wanted = _wanted(held, topics, path)
            chosen = [c for c in reader.connections if c.topic in wanted]
            messages = (
                (c.topic, c.msgtype, stamp, reader.deserialize(raw, c.msgtype))
                for c, stamp, raw in reader.messages(connections=chosen)
            )
            return _channels(messages, path, topics)
    except highlevel.AnyReaderError as error:
        raise LogError(f"{path}: cannot be read as a bag: {error}") from error


def _bare_database(path: Path) -> Iterator[Message]:
    """Messages of a ROS 2 database whose metadata file is missing."""
    typestore = _typestore()
    with sqlite3.connect(f"file:{path}?mode=ro", uri=True) as database:
        try:
            rows = database.execute(
                "SELECT name, type, timestamp, data FROM messages "
                "JOIN topics ON topics.id = messages.topic_id ORDER BY timestamp"
            )
            for topic, kind, stamp, data in rows:
                if _is_joint_state(kind):
                    yield topic, kind, stamp, typestore.deserialize_cdr(data, kind)
        except sqlite3.DatabaseError as error:
            raise LogError(f"{path}: not a ROS 2 bag: {error}") from error


def _wanted(held: Mapping[str, str], topics: Sequence[str] | None, path: Path) -> list[str]:
    """Topics to read: the requested ones, or all with joint states."""
    wanted = [
        topic
        for topic, kind in held.items()
        if (topic in topics if topics is not None else _is_joint_state(kind))
    ]
    if not wanted:
        asked = "sensor_msgs/JointState" if topics is None else f"topic {', '.join(topics)}"
        kinds = ", ".join(f"{topic} ({kind})" for topic, kind in held.items()) or "nothing"
        raise LogError(
            f"{path} holds no {asked}. It holds {kinds}. Choose with topics=[...] (--topics on "
            "the command line) and name the fields of other messages in columns."
        )
    return wanted


def _typestore() -> Any:
    typesys = import_optional("rosbags.typesys", extra="io")
    return typesys.get_typestore(typesys.Stores.LATEST)


def _is_joint_state(kind: str) -> bool:
    """Whether a type, by its name in ROS, protobuf or JSON, has the fields of JointState."""
    return re.split(r"[./]", kind)[-1] == "JointState"


def _channels(
    messages: Iterator[Message], path: Path, topics: Sequence[str] | None
) -> list[Channel]:
    """One channel per topic and set of joints; times in s from the first message."""
    rows: dict[tuple[str, frozenset[str]], _Samples] = {}
    for topic, kind, recorded, message in messages:
        if topics is not None and topic not in topics:
            continue
        if _is_joint_state(kind):
            values = _joint_state(message)
        elif topics is not None:
            values = dict(_numbers(message, ""))
        else:
            continue
        key = topic, frozenset(values)  # the order of joints may differ between messages
        if key not in rows:
            rows[key] = _Samples(tuple(values))
        rows[key].append(_stamp(message, recorded), values)
    if not rows:
        raise LogError(f"{path} holds no messages to read.")
    start = min(samples.stamps[0] for samples in rows.values())
    return [
        Channel(topic, table_from_arrays(samples.columns(start)))
        for (topic, _), samples in rows.items()
    ]


class _Samples:
    """Numbers of the messages of one topic; as objects they would take ten times the memory."""

    def __init__(self, names: tuple[str, ...]) -> None:
        self.names = names
        self.stamps = array("q")
        self._values = array("d")

    def append(self, stamp: int, values: Mapping[str, float]) -> None:
        """Add a message with its fields in any order."""
        self.stamps.append(stamp)
        self._values.extend([values[name] for name in self.names])

    def columns(self, start: int) -> dict[str, np.ndarray]:
        """Columns in the order of time, in s from the start."""
        stamps = np.array(self.stamps, dtype=np.int64)
        order = np.argsort(stamps, kind="stable")
        table = np.array(self._values, dtype=float).reshape(len(stamps), len(self.names))[order]
        columns = {name: table[:, k] for k, name in enumerate(self.names)}
        columns["time"] = (stamps[order] - start) * 1e-9
        return columns


def _stamp(message: Any, recorded: int) -> int:
    """Time of the header in ns, or of the recording if the header has none."""
    header = getattr(message, "header", None)
    stamp = getattr(header, "stamp", None)
    if stamp is None:
        return recorded
    nanoseconds = getattr(stamp, "nanosec", getattr(stamp, "nsec", getattr(stamp, "nsecs", 0)))
    seconds = getattr(stamp, "sec", getattr(stamp, "secs", 0))
    total = int(seconds) * 1_000_000_000 + int(nanoseconds)
    return total or recorded


def _joint_state(message: Any) -> dict[str, float]:
    """``joint/position``, ``joint/velocity``, ``joint/effort`` of one message."""
    values = {}
    for quantity in ("position", "velocity", "effort"):
        for name, value in zip(message.name, getattr(message, quantity), strict=False):
            values[f"{name}/{quantity}"] = float(value)
    return values


def _numbers(message: Any, prefix: str) -> Iterator[tuple[str, float]]:
    """Numeric fields of any message under names such as ``data[0]`` or ``wrench.force.x``."""
    if isinstance(message, (bool, int, float, np.number)):
        yield prefix, float(message)
    elif isinstance(message, (str, bytes)):
        return
    elif isinstance(message, (Sequence, np.ndarray)):
        for k, item in enumerate(message):
            yield from _numbers(item, f"{prefix}[{k}]")
    else:
        for name in _fields(message):
            if not name.startswith("_") and name not in ("header", "layout"):
                dotted = f"{prefix}.{name}" if prefix else name
                yield from _numbers(getattr(message, name), dotted)


def _fields(message: Any) -> tuple[str, ...]:
    """Names of the fields of a message of ROS, JSON or protobuf."""
    if isinstance(message, SimpleNamespace):
        return tuple(vars(message))
    described = getattr(message, "DESCRIPTOR", None)
    if described is not None:  # an absent part is left out, since types may contain themselves
        absent = {
            field.name
            for field in described.fields
            if field.message_type and field.has_presence and not message.HasField(field.name)
        }
        return tuple(field.name for field in described.fields if field.name not in absent)
    return tuple(getattr(message, "__dataclass_fields__", getattr(message, "__slots__", ())))
