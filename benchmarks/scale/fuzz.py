# SPDX-License-Identifier: BSD-3-Clause
"""Damaged and hostile inputs for every reader, which must read them or raise an error of skidyn.

Usage: python benchmarks/scale/fuzz.py [--inputs 2000] [--seed 0] [--only urdf csv ...]
       python benchmarks/scale/fuzz.py --seconds 600       ten minutes for every reader
       python benchmarks/scale/fuzz.py --atheris --only formula --seconds 300

With ``--atheris``, the coverage of skidyn's own code guides the damage. The run ends at the first
crash or after ``--seconds``, and libFuzzer prints the number of inputs.

An input counts as a crash if an error is raised that is not skidyn's, or if it takes more than 10 s
of processor time or 10 min of wall time.
"""

from __future__ import annotations

import argparse
import gzip
import io
import itertools
import json
import os
import random
import signal
import sys
import tempfile
import time
import traceback
import warnings
import zipfile
from pathlib import Path

import numpy as np

from skidyn.exceptions import SkidynError

SECONDS, PATIENCE = 10, 600
#: Pieces that break parsers more often than random bytes do.
PIECES = [
    b"nan", b"1e999", b"-1", b"0", b"<", b">", b"&lt;", b"\x00", b"\xff\xfe", b"\n", b",", b'"',
    b"9999999999", b"../../etc/passwd", b"<!DOCTYPE a>", b"[", b"]", b"{", b"}", b"**9", b"(",
    b")",
    b"\xc3\x28", b"1", b"/", b"q1", b";", b"__import__", b"-", b"inf", b"\x80" * 8, b"\x00" * 64,
]  # fmt: skip


def _robot(constructor: str):
    def read(data: bytes, folder: Path) -> None:
        from skidyn.robots import Robot

        getattr(Robot, constructor)(data)

    return read


def _log(suffix: str):
    def read(data: bytes, folder: Path) -> None:
        from skidyn.logs import read_log

        file = folder / f"log{suffix}"
        file.write_bytes(data)
        read_log(file, max_bytes=2**26)

    return read


def _report(data: bytes, folder: Path) -> None:
    from skidyn._commands._input import recorded_options

    file = folder / "report.json"
    file.write_bytes(data)
    recorded_options(argparse.Namespace(report=str(file)))


def _formula(data: bytes, folder: Path) -> None:
    from skidyn._signals import Signals
    from skidyn.effects import formula, get_effect

    term = formula(data.decode("utf-8", errors="replace"), 1)
    q = np.random.default_rng(0).normal(size=(5, 3))
    signals = Signals(q, q + 1, q + 2, np.zeros(5, int), np.arange(5.0))
    get_effect("formula").torque_columns(signals, term.joints, **term.shape)


def _model(data: bytes, folder: Path) -> None:
    from skidyn import load_model

    file = folder / "model.skops"
    file.write_bytes(data)
    load_model(file)


def _stream(data: bytes, folder: Path) -> None:
    from skidyn.datasets import load_planar_arm
    from skidyn.evidence import evidence_from_parquet

    file = folder / "stream.parquet"
    file.write_bytes(data)
    evidence_from_parquet(file, load_planar_arm(), max_rows=10_000)


TARGETS = {
    "urdf": _robot("from_urdf"),
    "sdf": _robot("from_sdf"),
    "mjcf": _robot("from_mjcf"),
    "csv": _log(".csv"),
    "gz": _log(".csv.gz"),
    "parquet": _log(".parquet"),
    "feather": _log(".feather"),
    "npz": _log(".npz"),
    "mat": _log(".mat"),
    "hdf5": _log(".h5"),
    "mcap": _log(".mcap"),
    "bag": _log(".bag"),
    "db3": _log(".db3"),
    "report": _report,
    "formula": _formula,
    "model": _model,
    "stream": _stream,
}


def _mcap_of(frame) -> bytes:
    from mcap.writer import Writer

    out = io.BytesIO()
    writer = Writer(out)
    writer.start()
    schema = writer.register_schema("sensor_msgs/msg/JointState", "jsonschema", b"{}")
    channel = writer.register_channel("/joint_states", "json", schema)
    for row in frame.to_dict("records"):
        names = ["joint1", "joint2"]
        values = {"position": "q", "velocity": "dq", "effort": "tau"}
        state = {field: [row[f"{s}{j}"] for j in (1, 2)] for field, s in values.items()}
        stamp = round(1e9 * (row["time"] + 100 * row["trajectory"]))
        writer.add_message(channel, stamp, json.dumps({"name": names, **state}).encode(), stamp)
    writer.finish()
    return out.getvalue()


def _bag_of(frame, version: int) -> bytes:
    """A ROS 1 bag, or the database of a ROS 2 bag."""
    from rosbags import rosbag1, rosbag2
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC if version == 1 else Stores.LATEST)
    kinds, kind = store.types, "sensor_msgs/msg/JointState"
    serialize = store.serialize_ros1 if version == 1 else store.serialize_cdr
    number = {"seq": 0} if version == 1 else {}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "a.bag")
        with rosbag1.Writer(path) if version == 1 else rosbag2.Writer(path, version=9) as writer:
            connection = writer.add_connection("/joint_states", kind, typestore=store)
            for row in frame.to_dict("records"):
                now = round(1e9 * (1 + row["time"] + 100 * row["trajectory"]))
                stamp = kinds["builtin_interfaces/msg/Time"](now // 10**9, now % 10**9)
                header = kinds["std_msgs/msg/Header"](stamp=stamp, frame_id="", **number)
                values = [np.array([row[f"{s}{j}"] for j in (1, 2)]) for s in ("q", "dq", "tau")]
                state = kinds[kind](header, ["joint1", "joint2"], *values)
                writer.write(connection, now, serialize(state, kind))
        return (path if version == 1 else next(path.glob("*.db3"))).read_bytes()


_INERTIA = "<ixx>1</ixx><ixy>0</ixy><ixz>0</ixz><iyy>1</iyy><iyz>0</iyz><izz>1</izz>"
_SDF = f"""<?xml version="1.0"?>
<sdf version="1.9"><model name="arm"><link name="base"/>
<link name="a"><pose>0 0 1 0 0 0</pose><inertial><pose>0.1 0 0 0 0 0</pose><mass>2</mass>
<inertia>{_INERTIA}</inertia></inertial></link>
<joint name="foot" type="fixed"><parent>world</parent><child>base</child></joint>
<joint name="j" type="revolute"><parent>base</parent><child>a</child><axis><xyz>0 1 0</xyz>
<limit><lower>-1</lower><upper>1</upper></limit></axis></joint></model></sdf>"""
_MJCF = """<mujoco><worldbody><body name="a"><joint name="j1" axis="0 1 0" armature="0.1"/>
<geom size="0.1" mass="1"/><body name="b" pos="0 0 1"><joint name="j2" type="slide" axis="1 0 0"/>
<inertial pos="0 0 0.1" mass="2" diaginertia="1 1 1"/></body></body></worldbody>
<equality><joint joint1="j2" joint2="j1" polycoef="0 1 0 0 0"/></equality></mujoco>"""


def seeds(name: str) -> list[bytes]:
    """Correct inputs that are then damaged."""
    from skidyn.datasets import load_planar_arm, make_hidden_effect_log

    if name == "urdf":
        import skidyn.datasets as datasets

        folder = Path(datasets.__file__).parent / "robots"
        return [file.read_bytes() for file in sorted(folder.glob("*.urdf"))[:4]]
    if name in ("sdf", "mjcf"):
        return [(_SDF if name == "sdf" else _MJCF).encode()]
    if name == "formula":
        return [b"sin(q1 - q3)", b"abs(dq2)**1.5*sign(dq2)", b"-(q1*q2)/(1+exp(-t))", b"9**9"]
    if name == "report":
        options = {"logs": ["a.csv"], "urdf": "a.urdf", "model": "rigid_body"}
        provenance = {"options": options, "sha256": {"a.csv": "0"}}
        return [json.dumps({"verdict": "complete", "provenance": provenance}).encode()]
    if name == "model":
        import skops.io
        from sklearn.linear_model import Ridge
        from sklearn.pipeline import make_pipeline

        from skidyn.identification import RBDRegressor
        from skidyn.preprocessing import SmoothDerivatives

        own = make_pipeline(SmoothDerivatives(), RBDRegressor(load_planar_arm()))
        return [skops.io.dumps(model) for model in (Ridge().fit(np.eye(3), np.ones(3)), own)]
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=2, duration=1.0)
    frame, buffer = log.frame, io.BytesIO()
    arrays = {column: frame[column].to_numpy() for column in frame}
    if name == "csv":
        return [frame.head(30).to_csv(index=False).encode(), b"time;q1\n0,1;2\n0,2;3\n"]
    if name == "gz":
        return [gzip.compress(frame.head(30).to_csv(index=False).encode())]
    if name in ("parquet", "stream"):
        frame.to_parquet(buffer)
    elif name == "feather":
        frame.to_feather(buffer)
    elif name == "npz":
        np.savez(buffer, **arrays)
    elif name == "mat":
        from scipy.io import savemat

        savemat(buffer, arrays)
    elif name == "hdf5":
        import h5py

        with h5py.File(buffer, "w") as file:
            for column, values in arrays.items():
                file[column] = values
    elif name == "mcap":
        return [_mcap_of(frame), b"\x89MCAP0\r\n" + bytes(200) + b"\x89MCAP0\r\n"]
    elif name in ("bag", "db3"):
        return [_bag_of(frame, 1 if name == "bag" else 2)]
    return [buffer.getvalue()]


def damage(data: bytes, rng: random.Random) -> bytes:
    """Damage an input, or the content of an archive if its checksum would reveal the damage."""
    if data.startswith(b"PK") and rng.random() < 0.7:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = {name: archive.read(name) for name in archive.namelist()}
        hit = rng.choice(list(members))
        members[hit] = _damaged(members[hit], rng)
        with zipfile.ZipFile(out := io.BytesIO(), "w") as archive:
            for name, content in members.items():
                archive.writestr(name, content)
        return out.getvalue()
    if data.startswith(b"\x1f\x8b") and rng.random() < 0.7:
        return gzip.compress(_damaged(gzip.decompress(data), rng))
    return _damaged(data, rng)


def _damaged(data: bytes, rng: random.Random) -> bytes:
    """Apply one to six changes: flipped, inserted, removed or repeated bytes, or a lost end."""
    out = bytearray(data)
    for _ in range(rng.randint(1, 6)):
        at = rng.randrange(len(out) + 1)
        kind = rng.randrange(6)
        if kind == 0 and at < len(out):
            out[at] = rng.randrange(256)
        elif kind == 1:
            out[at:at] = rng.choice(PIECES)
        elif kind == 2:
            del out[at : at + rng.randint(1, 40)]
        elif kind == 3:
            piece = out[at : at + rng.randint(1, 60)]
            out[at:at] = piece * rng.randint(1, 4)
        elif kind == 4:
            piece = rng.choice(PIECES)
            out[at : at + len(piece)] = piece
        elif rng.random() < 0.2:
            del out[at:]
    return bytes(out)


class _TooSlow(BaseException):
    """Not an Exception, because readers report exceptions of their decoders as damage."""


def _alarm(*_):
    raise _TooSlow(f"more than {SECONDS} s of processor time, or {PATIENCE} s")


def try_inputs(
    name: str, count: int, seed: int = 0, seconds: float = 0.0
) -> tuple[int, int, list[tuple[bytes, str]]]:
    """Number of damaged inputs, number of those that were read, and the inputs that crashed."""
    rng, crashes, accepted = random.Random(f"{name} {seed}"), [], 0
    good = seeds(name)
    end = time.monotonic() + seconds if seconds else None
    for each in (signal.SIGALRM, signal.SIGPROF):
        signal.signal(each, _alarm)
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for k in itertools.count():
            if k >= count if end is None else time.monotonic() > end:
                break
            data = good[k] if k < len(good) else damage(rng.choice(good), rng)
            signal.setitimer(signal.ITIMER_PROF, SECONDS)
            signal.alarm(PATIENCE)
            try:
                TARGETS[name](data, Path(folder))
                accepted += 1
            except SkidynError:
                pass
            except (Exception, _TooSlow):
                crashes.append((data, traceback.format_exc()))
            finally:
                signal.setitimer(signal.ITIMER_PROF, 0)
                signal.alarm(0)
    return k, accepted, crashes


def guided(name: str, seconds: int) -> None:
    """Fuzz one reader with atheris; does not return."""
    import atheris

    folder = Path(tempfile.mkdtemp())
    corpus = folder / "corpus"
    corpus.mkdir()
    for k, data in enumerate(seeds(name)):
        (corpus / f"{k}").write_bytes(data)
    for module in [m for m in sys.modules if m.startswith("skidyn")]:
        del sys.modules[module]  # imported again, instrumented for coverage
    with atheris.instrument_imports(include=["skidyn"]):
        for data in seeds(name):
            try:
                TARGETS[name](data, folder)
            except Exception as error:
                print(f"seed refused: {error}")
    from skidyn.exceptions import SkidynError as Refused

    def once(data: bytes) -> None:
        try:
            TARGETS[name](data, folder)
        except Refused:
            pass

    warnings.simplefilter("ignore")
    limits = [f"-max_total_time={seconds}", f"-timeout={SECONDS}", "-rss_limit_mb=8192"]
    atheris.Setup(
        [sys.argv[0], *limits, "-max_len=65536", "-print_final_stats=1", str(corpus)], once
    )
    atheris.Fuzz()


def _processor_time() -> float:
    """Processor time of this process and its children, s."""
    times = os.times()
    return sum(times[:4])


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--inputs", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", nargs="+", default=list(TARGETS), choices=list(TARGETS))
    parser.add_argument("--atheris", action="store_true")
    parser.add_argument("--seconds", type=int, default=0)
    options = parser.parse_args()
    if options.atheris:
        guided(options.only[0], options.seconds)
    total = 0
    print("reader inputs read refused crashes processor_seconds")
    for name in options.only:
        start = _processor_time()
        tried, accepted, crashes = try_inputs(name, options.inputs, options.seed, options.seconds)
        took = _processor_time() - start
        total += len(crashes)
        refused = tried - accepted - len(crashes)
        print(name, tried, accepted, refused, len(crashes), round(took), flush=True)
        seen = set()
        for data, text in crashes:
            place = [line for line in text.splitlines() if line.startswith("  File ")][-1]
            if place not in seen:
                seen.add(place)
                print(f"--- {data[:120]!r}\n{text[-900:]}")
    return int(total > 0)


if __name__ == "__main__":
    sys.exit(main())
