# SPDX-License-Identifier: BSD-3-Clause
"""Small files that unpack to far more than they are: refused before the memory is taken."""

import bz2
import gzip
import json
import sqlite3
import struct
import subprocess
import sys
import zipfile

import numpy as np
import pytest

pytest.importorskip("pandas", reason="needs skidyn[io]")
pytest.importorskip("resource", reason="the memory of a process is known where there is this")

from skidyn.exceptions import LogError
from skidyn.logs import read_log

MIB = 2**20
#: The bound that the reader is given, what is promised beyond it, and what a bomb unpacks to.
BOUND, OVERHEAD, BOMB = 16 * MIB, 128 * MIB, 192 * MIB


def parquet(path):
    """Columns that name one value of a dictionary again and again."""
    pa, pq = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    rows = BOMB // 8 // 10
    pq.write_table(pa.table(dict.fromkeys(map(str, range(10)), pa.array(np.zeros(rows)))), path)


def text_in_parquet(path):
    """One long text, named again and again: text is numbered, and never repeated."""
    pa, pq = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    text = pa.DictionaryArray.from_arrays(np.zeros(4000, np.int32), ["x" * MIB])
    numbers = np.arange(4000.0)
    pq.write_table(pa.table({"time": numbers, "text": text, "q1": numbers, "tau1": numbers}), path)


def feather(path):
    pa, feather = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.feather")
    feather.write_feather(pa.table({"q1": np.zeros(BOMB // 8)}), path, compression="zstd")


def runs_of_feather(path):
    """One value that is there as often as it is said to be."""
    pa = pytest.importorskip("pyarrow")
    rows = BOMB // 8
    _arrow(path, pa.RunEndEncodedArray.from_arrays(pa.array([rows], pa.int32()), pa.array([1.0])))


def nothing_of_feather(path):
    """Values that are not there, of which a file needs to know the number only."""
    pa = pytest.importorskip("pyarrow")
    _arrow(path, pa.nulls(BOMB // 8))


def text_of_feather(path):
    """Short texts, of which Python makes objects ten times as large."""
    pa = pytest.importorskip("pyarrow")
    _arrow(path, pa.array([f"{k % 10:04d}" for k in range(BOMB // 256)]))


def _arrow(path, column):
    import pyarrow as pa

    table = pa.table({"q1": column})
    options = pa.ipc.IpcWriteOptions(compression="zstd")
    with (
        pa.OSFile(str(path), "wb") as file,
        pa.ipc.new_file(file, table.schema, options=options) as out,
    ):
        out.write_table(table)


def lists_of_feather(path):
    """One long list, named again and again."""
    pa = pytest.importorskip("pyarrow")
    lists = pa.array([np.zeros(MIB // 8)])
    places = pa.array(np.zeros(BOMB // MIB, np.int32))
    _arrow(path, pa.DictionaryArray.from_arrays(places, lists))


def npz(path):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        with archive.open("q1.npy", "w") as file:
            np.lib.format.write_array(file, np.zeros(BOMB // 8))


def hdf5(path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        file.create_dataset("q1", (BOMB // 8,), dtype="f8", chunks=(MIB,), compression="gzip")


def chunk_of_hdf5(path):
    """Eight numbers in use of a chunk that holds a hundred million."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        chunk = (BOMB // 8,)
        data = file.create_dataset(
            "q1", (8,), maxshape=(None,), chunks=chunk, compression="gzip", dtype="f8"
        )
        data[:] = 1.0


def references_of_hdf5(path):
    """One array, named again and again as the field of a struct array."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        array = file.create_dataset("#refs#/a", data=np.zeros(MIB), compression="gzip")
        file["s/q1"] = np.array([array.ref] * (BOMB // MIB // 8), dtype=h5py.ref_dtype)


def matlab(path):
    from scipy.io import savemat

    savemat(path, {"q1": np.zeros(2 * BOMB, np.int8)}, do_compression=True)


def mcap(path):
    writer = pytest.importorskip("mcap.writer")
    with open(path, "wb") as file:
        out = writer.Writer(file, compression=writer.CompressionType.ZSTD)
        out.start()
        schema = out.register_schema("JointState", "jsonschema", b"{}")
        channel = out.register_channel("/joint_states", "json", schema)
        for k in range(4):
            out.add_message(channel, k, b" " * (BOMB // 4), k)
        out.finish()


def bag(path):
    """A chunk that says it is small, of bzip2, which packs a million into one."""
    rosbag1 = pytest.importorskip("rosbags.rosbag1")
    typesys = pytest.importorskip("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.ROS1_NOETIC)
    with rosbag1.Writer(path) as out:
        connection = out.add_connection("/t", "std_msgs/msg/String", typestore=store)
        out.write(connection, 1, b"\x00\x00\x00\x00")
    data = path.read_bytes()
    packed = bz2.compress(b"\x00" * (BOMB // 4)) * 4
    fields = [b"op=\x05", b"compression=bz2", b"size=" + struct.pack("<L", 8)]
    header = b"".join(struct.pack("<L", len(f)) + f for f in fields)
    chunk = struct.pack("<L", len(header)) + header + struct.pack("<L", len(packed)) + packed
    path.write_bytes(data + chunk)


def folder_of_ros2(path):
    rosbag2 = pytest.importorskip("rosbags.rosbag2")
    typesys = pytest.importorskip("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.LATEST)
    out = rosbag2.Writer(path, version=8)
    out.set_compression(rosbag2.CompressionMode.MESSAGE, rosbag2.CompressionFormat.ZSTD)
    with out:
        connection = out.add_connection("/t", "sensor_msgs/msg/JointState", typestore=store)
        out.write(connection, 1, b"\x00" * (BOMB // 2))
        out.write(connection, 2, b"\x00" * (BOMB // 2))


def database(path):
    """Messages that the database makes up as it is asked for them."""
    with sqlite3.connect(path) as made:
        made.execute("CREATE TABLE topics (id INTEGER, name TEXT, type TEXT)")
        made.execute("INSERT INTO topics VALUES (1, '/j', 'sensor_msgs/msg/JointState')")
        made.execute(
            "CREATE VIEW messages AS "
            "WITH RECURSIVE n(k) AS (SELECT 1 UNION ALL SELECT k + 1 FROM n) "
            "SELECT 1 AS topic_id, k AS timestamp, zeroblob(1000000) AS data FROM n"
        )


def text(path):
    """Rows of one field below a header of very many, which pandas fills."""
    header = ",".join(f"c{k}" for k in range(2000))
    path.write_text(header + "\n1" * (BOMB // 8 // 2000))


def packed_text(path):
    with gzip.open(path, "wb", compresslevel=1) as file:
        file.write(b"time,q1,tau1\n")
        for _ in range(BOMB // MIB):
            file.write(b"0.0,0.0,0.0\n" * (MIB // 12))


BOMBS = {
    "a.parquet": parquet,
    "a.feather": feather,
    "runs.feather": runs_of_feather,
    "nothing.feather": nothing_of_feather,
    "text.feather": text_of_feather,
    "a.npz": npz,
    "a.h5": hdf5,
    "chunk.h5": chunk_of_hdf5,
    "references.h5": references_of_hdf5,
    "a.mat": matlab,
    "a.mcap": mcap,
    "a.bag": bag,
    "bag": folder_of_ros2,
    "a.db3": database,
    "a.csv": text,
    "packed.csv.gz": packed_text,
}

_READ = """
import json, resource, sys, warnings
import numpy, pandas
from skidyn.exceptions import LogError
from skidyn.logs import read_log
warnings.simplefilter("ignore")
resource.setrlimit(resource.RLIMIT_AS, (8 * 2**30, 8 * 2**30))
peak = lambda: resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
for path in sys.argv[2:]:
    before = peak()
    try:
        said = f"read {len(read_log(path, max_bytes=int(sys.argv[1]), check=False))}"
    except LogError as error:
        said = f"refused {error}"
    print(json.dumps([path, said, peak() - before]))
"""


def test_bombs_are_refused_within_the_bound(tmp_path):
    """One process reads them all; the most memory it ever took must hardly rise."""
    for name, make in BOMBS.items():
        make(tmp_path / name)
        size = sum(f.stat().st_size for f in [tmp_path / name, *(tmp_path / name).glob("*")])
        assert size < BOMB / 50
    text_in_parquet(tmp_path / "text.parquet")
    lists_of_feather(tmp_path / "lists.feather")
    names = [*BOMBS, "lists.feather", "text.parquet"]
    done = subprocess.run(
        [sys.executable, "-c", _READ, str(BOUND), *(str(tmp_path / name) for name in names)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    answers = [json.loads(line) for line in done.stdout.splitlines()]
    assert len(answers) == len(names)
    for path, said, taken in answers[:-2]:
        assert said.startswith(f"refused {path}"), said
        assert "unpacks to" in said or "fields" in said or "not a ROS 2 bag" in said, said
        assert taken < BOUND + OVERHEAD, path
    path, said, taken = answers[-2]  # no signal is made of dictionaries of lists
    assert said.startswith(f"refused {path}") and taken < BOUND + OVERHEAD
    path, said, taken = answers[-1]  # a text that is named again and again is kept once
    assert said == "read 4000"
    assert taken < BOUND + OVERHEAD


def test_groups_within_groups_without_end_are_refused(tmp_path):
    """The library takes the square of the depth for its names: minutes at 3000."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "deep.h5", "w") as file:
        group = file
        for _ in range(200):
            group = group.create_group("a")
        group["q1"] = np.zeros(3)
    with pytest.raises(LogError, match="more than 32 groups deep"):
        read_log(tmp_path / "deep.h5", check=False)


def test_groups_that_hold_themselves_are_read_once(tmp_path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "loop.h5", "w") as file:
        for name in ("time", "q1", "tau1"):
            file[name] = np.arange(3.0)
        file["again/root"], file["again/soft"] = file["/"], h5py.SoftLink("/")
    assert len(read_log(tmp_path / "loop.h5", check=False)) == 3


def test_a_message_of_json_without_end_is_refused(tmp_path):
    """Its objects take fifty times the text, so that it must be far smaller than the log may be."""
    writer = pytest.importorskip("mcap.writer")
    with (tmp_path / "log.mcap").open("wb") as file:
        out = writer.Writer(file, compression=writer.CompressionType.ZSTD)
        out.start()
        schema = out.register_schema("JointState", "jsonschema", b"{}")
        channel = out.register_channel("/joint_states", "json", schema)
        out.add_message(channel, 0, b'{"name": [' + b"{}," * MIB + b"0]}", 0)
        out.finish()
    with pytest.raises(LogError, match="too long for a joint state"):
        read_log(tmp_path / "log.mcap", check=False)
