# SPDX-License-Identifier: BSD-3-Clause
"""Files are written whole or not at all, and never over what they were made from."""

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

#: Files that the running command reads; None outside a command, where they are not known.
_INPUTS: ContextVar[set[tuple[int, int]] | None] = ContextVar("inputs", default=None)


@contextmanager
def keeping_inputs() -> Iterator[None]:
    """Refuse to write onto what :func:`keep` names meanwhile."""
    token = _INPUTS.set(set())
    try:
        yield
    finally:
        _INPUTS.reset(token)


def keep(paths: Iterable[PathLike]) -> None:
    """Protect files that are read, under whatever name they may be written.

    A folder stands for all files in it, and a pattern for all that it matches.
    """
    known = _INPUTS.get()
    if known is None:
        return
    for path in paths:
        for name in [path, *_inside(os.fspath(path))]:
            try:
                found = os.stat(name)
            except (OSError, ValueError):  # the reader says what is wrong with it
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
    """Where a file that is to be written really lies.

    Parameters
    ----------
    path : path
        Name of the file. A symbolic link stands for its target.

    Returns
    -------
    Path
        The file without symbolic links; it need not exist.

    Raises
    ------
    SkidynError
        There is something else than a regular file (a folder, a device, a pipe), or an input of
        the running command.
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
    """Write a file in one step: a full disk, an error or a killed process leave the old one.

    Parameters
    ----------
    path : path
        File to write; see :func:`writable`. Folders that are missing are made.

    Yields
    ------
    Path
        File with the same ending in the same folder, to be written instead; it takes the place of
        the other when the block ends well. Its mode is that of any new file.

    Raises
    ------
    SkidynError
        See :func:`writable`.
    OSError
        The file cannot be written; the error names it.
    """
    target = writable(path)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=target.parent, prefix=".skidyn-") as folder:
            part = Path(folder, target.name)
            yield part
            with part.open("rb+") as file:  # on the disk before the old file is given up
                os.fsync(file.fileno())
            os.replace(part, target)
    except OSError as error:
        # What fails amid the writing has no name, or that of a file the user has never seen.
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
