# SPDX-License-Identifier: BSD-3-Clause
"""Answers that are stored in the folder of a log, for repeated identical commands.

The name of an answer is the digest of everything on which it depends: the contents of log and
robot, the options, and the code of skidyn with the versions of its dependencies. Another log or
version has another name, so no answer can be out of date. An answer that cannot be read or written,
or is damaged, is ignored.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import warnings
import zlib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from skidyn._exceptions import LogWarning, SkidynError
from skidyn._version import versions
from skidyn._writing import write_bytes

#: Folder next to the log, and most answers in it; the oldest are removed.
FOLDER, MOST = ".skidyn", 16
#: Logs and robots that are one file each, independent of other files.
LOGS, ROBOTS = (".csv", ".parquet"), (".urdf",)
#: Options that do not change the results, only the outputs.
ELSEWHERE = {"command", "run", "words", "out", "html", "json", "jobs", "no_cache"}


@contextmanager
def noting() -> Iterator[list[str]]:
    """Messages about the log during the computation, also if it ends with an error."""
    noted: list[str] = []
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            yield noted
    except BaseException:
        for note in _of_the_log(caught):
            warnings.warn(note, LogWarning, stacklevel=2)
        raise
    noted += _of_the_log(caught)


def _of_the_log(caught: Iterable[warnings.WarningMessage]) -> list[str]:
    ours = (str(w.message) for w in caught if issubclass(w.category, LogWarning))
    return list(dict.fromkeys(ours))


class Kept:
    """The stored file of one answer; with the option ``no_cache`` nothing is stored."""

    def __init__(self, options: argparse.Namespace) -> None:
        self._options = options
        self._name = None if options.no_cache else _name(options)

    def read(self) -> dict[str, Any] | None:
        """The answer; None if there is no complete one."""
        if self._name is None:
            return None
        try:
            content = self._path.read_bytes()
            digest, body = content[:32], content[32:]
            if hashlib.sha256(body).digest() != digest:
                return None
            answer = json.loads(zlib.decompress(body))
        except (OSError, ValueError, zlib.error):
            return None
        return answer if isinstance(answer, dict) else None

    def write(self, answer: dict[str, Any]) -> None:
        """Store an answer, unless a file has changed since the command began."""
        if self._name is None or _name(self._options) != self._name:
            return
        # arrays and numbers of NumPy in JSON types; numbers that are not finite are kept
        text = json.dumps(answer, default=lambda found: found.tolist())
        body = zlib.compress(text.encode(), 1)
        with suppress(OSError, SkidynError):
            write_bytes(self._path, hashlib.sha256(body).digest() + body)
            kept = sorted(self._path.parent.iterdir(), key=lambda path: path.stat().st_mtime)
            for old in kept[:-MOST]:
                old.unlink()

    @property
    def _path(self) -> Path:
        return Path(self._options.logs[0]).parent / FOLDER / f"{self._name}.answer"


def _name(options: argparse.Namespace) -> str | None:
    """Digest of everything on which an answer depends; None if other files may matter."""
    logs, robot = [Path(log) for log in options.logs], Path(options.urdf)
    model = [Path(options.model)] if options.model.endswith(".skops") else []
    if robot.suffix not in ROBOTS or any(log.suffix not in LOGS for log in logs):
        return None
    said = {k: v for k, v in vars(options).items() if k not in ELSEWHERE}
    said |= {"folder": os.getcwd(), "versions": versions()}
    digest = hashlib.sha256(json.dumps(said, sort_keys=True, default=str).encode())
    try:
        for file in [*logs, robot, *model, *_code()]:
            with file.open("rb") as content:
                digest.update(hashlib.file_digest(content, "sha256").digest())
    except OSError:  # the reader reports the error
        return None
    return digest.hexdigest()


def _code() -> Iterator[Path]:
    """The files of skidyn, by name."""
    for folder, inside, names in os.walk(Path(__file__).parents[1]):
        inside[:] = sorted(name for name in inside if name != "__pycache__")
        yield from (Path(folder, name) for name in sorted(names))
