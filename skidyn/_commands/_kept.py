# SPDX-License-Identifier: BSD-3-Clause
"""Answers that are kept beside a log, for the same question asked again.

The name of an answer is the digest of all that it depends on: the contents of log and robot, the
options, and the code of skidyn itself with the versions of what it computes with. Another log, or
another version, has another name, so that no answer can be out of date. What cannot be read, was
damaged, or cannot be written is as if it had never been kept.
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

#: Folder beside the log, and answers in it at most: the oldest go.
FOLDER, MOST = ".skidyn", 16
#: Logs and robots that are one file each, whatever lies beside them.
LOGS, ROBOTS = (".csv", ".parquet"), (".urdf",)
#: Options that do not change what is found, only where it goes.
ELSEWHERE = {"command", "run", "words", "out", "html", "json", "jobs", "no_cache"}


@contextmanager
def noting() -> Iterator[list[str]]:
    """What is said about the log meanwhile; where an error ends it, it is said all the same."""
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
    """The place of one answer.

    Parameters
    ----------
    options : argparse.Namespace
        The question; its ``no_cache`` keeps nothing.
    """

    def __init__(self, options: argparse.Namespace) -> None:
        self._options = options
        self._name = None if options.no_cache else _name(options)

    def read(self) -> dict[str, Any] | None:
        """The answer; None where there is none that is whole."""
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
        """Keep an answer, unless a file has changed since the question was asked."""
        if self._name is None or _name(self._options) != self._name:
            return
        body = zlib.compress(json.dumps(answer, default=_value).encode(), 1)
        with suppress(OSError, SkidynError):
            write_bytes(self._path, hashlib.sha256(body).digest() + body)
            kept = sorted(self._path.parent.iterdir(), key=lambda path: path.stat().st_mtime)
            for old in kept[:-MOST]:
                old.unlink()

    @property
    def _path(self) -> Path:
        return Path(self._options.logs[0]).parent / FOLDER / f"{self._name}.answer"


def _value(found: Any) -> Any:
    """Arrays and numbers of NumPy as JSON takes them; what is not finite stays so."""
    return found.tolist()


def _name(options: argparse.Namespace) -> str | None:
    """Digest of all that an answer depends on; None where more than these files may matter."""
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
    except OSError:  # the reader says what is wrong with it
        return None
    return digest.hexdigest()


def _code() -> Iterator[Path]:
    """The files of skidyn, by name."""
    for folder, inside, names in os.walk(Path(__file__).parents[1]):
        inside[:] = sorted(name for name in inside if name != "__pycache__")
        yield from (Path(folder, name) for name in sorted(names))
