# SPDX-License-Identifier: BSD-3-Clause
"""Writing of files in one step, and never over inputs."""

from __future__ import annotations

import glob
import json
import os
import stat
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Any

from skidyn._exceptions import SkidynError
from skidyn._plain import plain

PathLike = str | os.PathLike[str]

#: Files that the running command reads; None outside a command, where they are unknown.
_INPUTS: ContextVar[set[tuple[int, int]] | None] = ContextVar("inputs", default=None)


@contextmanager
def keeping_inputs() -> Iterator[None]:
    """Refuse to write onto files protected by :func:`keep` inside the block."""
    token = _INPUTS.set(set())
    try:
        yield
    finally:
        _INPUTS.reset(token)


def keep(paths: Iterable[PathLike]) -> None:
    """Protect input files from being overwritten under any name.

    A folder means all files in it, and a pattern all its matches.
    """
    known = _INPUTS.get()
    if known is None:
        return
    for path in paths:
        for name in [path, *_inside(os.fspath(path))]:
            try:
                found = os.stat(name)
            except (OSError, ValueError):  # the reader reports the error
                continue
            known.add((found.st_dev, found.st_ino))


def _inside(path: str) -> Iterator[str]:
    if os.path.isdir(path):
        for folder, _, names in os.walk(path):
            yield from (os.path.join(folder, name) for name in names)
    elif not os.path.exists(path) and glob.has_magic(path):
        for match in glob.glob(path, recursive=True):
            yield match
            yield from _inside(match)


def writable(path: PathLike) -> Path:
    """Real path of a file to be written, without symbolic links; it need not exist.

    A SkidynError is raised if it is not a regular file (a folder, a device, a pipe), or is an input
    of the running command.
    """
    target = Path(os.path.realpath(path))
    try:
        found = os.stat(target)
    except FileNotFoundError:
        return target
    if not stat.S_ISREG(found.st_mode):
        raise SkidynError(
            f"{path} is not a regular file and would be replaced by one; give another path"
        )
    if (found.st_dev, found.st_ino) in (_INPUTS.get() or ()):
        raise SkidynError(
            f"{path} is read by this command and would be overwritten; give another path"
        )
    return target


@contextmanager
def replacing(path: PathLike) -> Iterator[Path]:
    """Write a file in one step: after a full disk or a killed process the old one remains.

    The block writes a file with the same ending in the same folder, which replaces the other, with
    the mode of a new file, when the block ends without an error. Missing folders are created.
    Errors are those of :func:`writable`, and an OSError that states the name of the file.
    """
    target = writable(path)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=target.parent, prefix=".skidyn-") as folder:
            part = Path(folder, target.name)
            yield part
            with part.open("rb+") as file:  # on the disk before the old file is replaced
                os.fsync(file.fileno())
            os.replace(part, target)
    except OSError as error:
        # An error during writing has no name, or that of a file unknown to the user.
        raise OSError(error.errno, error.strerror or str(error), os.fspath(path)) from error


def write_bytes(path: PathLike, content: bytes) -> Path:
    """Write a file in one step; returns its path."""
    with replacing(path) as part:
        part.write_bytes(content)
    return Path(path)


def write_text(path: PathLike, content: str) -> Path:
    """Write a text as UTF-8 in one step; returns its path."""
    return write_bytes(path, content.encode())


def write_json(path: PathLike, content: dict[str, Any]) -> Path:
    """Write a dictionary as JSON; numbers that are not finite become null.

    Parameters
    ----------
    path : path
        File to write; it is replaced in one step.
    content : dict
        For example ``diagnosis.to_dict()``.

    Returns
    -------
    path : Path
        The file.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from skidyn.report import write_json
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = write_json(pathlib.Path(folder, "a.json"), {"rmse": float("nan")})
    ...     print(file.read_text().strip())
    {
      "rmse": null
    }
    """
    return write_text(path, json.dumps(plain(content), indent=2, allow_nan=False) + "\n")
