# SPDX-License-Identifier: BSD-3-Clause
"""Bounds on decoded data: files may unpack to a thousand times their size."""

from __future__ import annotations

import bz2
import os
import sqlite3
import struct
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any

from skidyn._exceptions import LogError
from skidyn._optional import import_optional

#: Default bound of the unpacked size of a log, in bytes.
MAX_BYTES = 8 * 2**30
#: Bytes of a stream that are unpacked at a time if only their number is needed.
_STEP = 2**20
#: What a process of another reader takes beyond the numbers themselves: decoders keep up to two
#: copies of what they unpack.
_COPIES, _OVERHEAD = 3, 256 * 2**20


def check_size(path: Path, size: int, max_bytes: int) -> None:
    """Refuse a file that unpacks to more than the user allows."""
    if size > max_bytes:
        raise LogError(
            f"{path}: unpacks to {size / 2**20:.0f} MiB, more than max_bytes = "
            f"{max_bytes / 2**20:.0f} MiB. Split the log or raise max_bytes."
        )


class Budget:
    """Number of bytes of one file that may still be unpacked."""

    def __init__(self, path: Path, max_bytes: int) -> None:
        self.path, self.max_bytes, self.used = path, max_bytes, 0

    def take(self, size: int) -> None:
        """Count bytes before, or while, they are unpacked."""
        self.used += size
        check_size(self.path, self.used, self.max_bytes)

    def unpack(self, data: bytes | IO[bytes], compression: str) -> None:
        """Count the bytes in compressed data without storing them, since headers may be wrong.

        Of a file, everything from its position on is counted.
        """
        if compression == "zstd":
            zstandard = import_optional("zstandard", extra="io")
            reader = zstandard.ZstdDecompressor(max_window_size=2**27).stream_reader(
                data, read_across_frames=True
            )
            while part := reader.read(_STEP):
                self.take(len(part))
        elif compression in ("bz2", "lz4"):
            if compression == "bz2":
                make: Any = bz2.BZ2Decompressor
            else:
                make = import_optional("lz4.frame", extra="io").LZ4FrameDecompressor
            rest: bytes = data if isinstance(data, bytes) else data.read()
            while rest:  # a stream may follow another
                decoder = make()
                while not decoder.eof:
                    part = decoder.decompress(rest, _STEP)
                    rest = b""
                    if not part and decoder.needs_input:
                        return  # cut off; the reader reports it
                    self.take(len(part))
                rest = decoder.unused_data or b""
        else:
            self.take(len(data) if isinstance(data, bytes) else os.fstat(data.fileno()).st_size)


def mcap_chunks(path: Path, budget: Budget) -> None:
    """Count what the chunks of an MCAP file hold."""
    streams = import_optional("mcap.stream_reader", extra="io")
    records = import_optional("mcap.records", extra="io")
    with path.open("rb") as file:
        for record in streams.StreamReader(
            file, emit_chunks=True, record_size_limit=budget.max_bytes
        ).records:
            if isinstance(record, records.Chunk):
                budget.unpack(record.data, record.compression)


def bag_chunks(path: Path, budget: Budget) -> None:
    """Count what the chunks of a ROS 1 bag hold."""
    with path.open("rb") as file:
        file.readline()
        for header, size in _bag_records(file, path.stat().st_size):
            if header.get(b"op") == b"\x05":
                compression = header.get(b"compression", b"none").decode("latin-1")
                budget.unpack(file.read(size), compression)
            else:
                file.seek(size, os.SEEK_CUR)


def _bag_records(file: IO[bytes], end: int) -> Iterator[tuple[dict[bytes, bytes], int]]:
    """Header of every record and the size of its data, at which the file then stands."""
    while len(head := file.read(4)) == 4:
        (size,) = struct.unpack("<L", head)
        text = file.read(min(size, end))
        header, at = {}, 0
        while at + 4 <= len(text):
            (length,) = struct.unpack_from("<L", text, at)
            name, _, value = text[at + 4 : at + 4 + length].partition(b"=")
            header[name] = value
            at += 4 + length
        if len(tail := file.read(4)) < 4:
            return  # cut off; the reader reports it
        yield header, struct.unpack("<L", tail)[0]


def bag_folder(folder: Path, budget: Budget) -> None:
    """Count what the files of a ROS 2 bag hold, and the messages in them."""
    for path in sorted(folder.iterdir()):
        if path.suffix in (".zstd", ".zst"):
            with path.open("rb") as file:
                budget.unpack(file, "zstd")
        elif path.suffix == ".mcap":
            mcap_chunks(path, budget)
        elif path.suffix == ".db3":
            database_messages(path, budget)


def database_messages(path: Path, budget: Budget) -> None:
    """Count the messages of a database, which must be what it seems.

    A LogError is raised if they are computed by the database (a view, a generated column), and may
    be without end, or are too large.
    """
    with sqlite3.connect(f"file:{path}?mode=ro", uri=True) as database:
        try:
            for name in ("messages", "topics"):
                columns = database.execute(f"PRAGMA table_xinfo({name})").fetchall()
                made = database.execute(
                    "SELECT sql FROM sqlite_master WHERE type = 'table' AND name = ?", (name,)
                ).fetchall()
                virtual = any("virtual" in str(sql).lower().split()[:3] for (sql,) in made)
                if not made or virtual or any(column[6] for column in columns):
                    raise LogError(
                        f"{path}: not a ROS 2 bag: {name} is not a table of stored values"
                    )
            for (data,) in database.execute("SELECT data FROM messages"):
                compressed = isinstance(data, bytes) and data[:4] == b"\x28\xb5\x2f\xfd"
                if isinstance(data, bytes):
                    budget.unpack(data, "zstd" if compressed else "")
        except sqlite3.DatabaseError as error:
            raise LogError(f"{path}: not a ROS 2 bag: {error}") from error


_TRIAL = """\
import sys
{imports}
try:
    import resource
    with open("/proc/self/statm") as file:
        now = int(file.read().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (now + int(sys.argv[2]),) * 2)
except (ImportError, OSError, ValueError):
    pass  # a system without such limits
try:
    {statement}
except MemoryError:
    sys.exit("MemoryError")
"""


def try_in_another_process(path: Path, max_bytes: int, imports: str, statement: str) -> None:
    """Decode a file in another process, since compiled readers may crash or fill the memory.

    ``imports`` and ``statement`` are Python; the file is ``sys.argv[1]``. Unpacked it may have
    ``max_bytes``; three times as much and 256 MiB may be used during reading. A LogError is raised
    if the reader failed, crashed or needed more memory.
    """
    code = _TRIAL.format(imports=imports, statement=statement)
    few = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    done = subprocess.run(
        # -P: no modules of the working directory, which may have come with the file
        [sys.executable, "-P", "-c", code, str(path), str(_COPIES * max_bytes + _OVERHEAD)],
        capture_output=True,
        text=True,
        errors="replace",
        env=os.environ | few,
        check=False,
    )
    if done.returncode:
        lines = done.stderr.strip().splitlines()
        what = lines[-1] if lines else "the reader crashed"
        if "MemoryError" in what or "malloc" in what or "realloc" in what:
            raise LogError(
                f"{path}: unpacks to more than max_bytes = {max_bytes / 2**20:.0f} MiB. Split the "
                "log or raise max_bytes."
            )
        raise LogError(f"{path}: cannot be read: {what}")
