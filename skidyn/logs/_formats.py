# SPDX-License-Identifier: BSD-3-Clause
"""Table of log formats and their readers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from skidyn._exceptions import LogError
from skidyn.logs._arrow import read_parquet_channels
from skidyn.logs._containers import read_hdf5_channels, read_matlab_channels
from skidyn.logs._files import Channel, read_csv_channels, read_npy_channels, read_npz_channels
from skidyn.logs._ros import read_bag_channels, read_mcap_channels

#: Reader of a file up to an unpacked size, optionally of some channels only.
Reader = Callable[[Path, int, Sequence[str] | None], list[Channel]]

#: Beginning of a file that Git LFS has not fetched.
POINTER = b"version https://git-lfs"
#: Suffixes of text, the only files that may be compressed.
TEXT = (".csv", ".tsv", ".txt", ".dat")


def _whole(read: Callable[[Path, int], list[Channel]]) -> Reader:
    """Reader of a format with one clock and without options."""
    return lambda path, max_bytes, topics: read(path, max_bytes)


_READERS: dict[str, Reader] = {
    **dict.fromkeys(TEXT, _whole(read_csv_channels)),
    **dict.fromkeys((".parquet", ".feather", ".arrow"), _whole(read_parquet_channels)),
    ".npz": _whole(read_npz_channels),
    ".npy": _whole(read_npy_channels),
    **dict.fromkeys((".h5", ".hdf5"), read_hdf5_channels),
    ".mat": read_matlab_channels,
    ".mcap": read_mcap_channels,
    **dict.fromkeys((".bag", ".db3"), read_bag_channels),
}


def register_reader(suffix: str, reader: Reader | None) -> None:
    r"""Register a reader for :func:`read_log`.

    Parameters
    ----------
    suffix : str
        Ending of the files, in lower case, such as ``".tdms"``. An existing reader of the suffix is
        replaced.
    reader : callable or None
        ``reader(path, max_bytes, topics)`` returns a list of :class:`Channel`. It raises LogError
        if the file would unpack to more than ``max_bytes``; ``topics`` are the names of the
        requested channels, None for all. A reader of None removes the suffix.

    Raises
    ------
    LogError
        The suffix is invalid.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import pandas as pd
    >>> from skidyn.logs import Channel, read_log, register_reader
    >>> def read_stars(path, max_bytes, topics):
    ...     return [Channel("arm", pd.read_csv(path, sep="*"))]
    >>> register_reader(".stars", read_stars)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = pathlib.Path(folder, "log.stars")
    ...     _ = file.write_text("time*q1*dq1*tau1\n0.0*1.0*0.1*2.0\n0.1*1.1*0.1*2.0\n")
    ...     read_log(file, check=False)["q1"].tolist()
    [1.0, 1.1]
    >>> register_reader(".stars", None)
    """
    if not suffix.startswith(".") or suffix != suffix.lower() or len(suffix) < 2:
        raise LogError(f"suffix={suffix!r}; expected one in lower case, such as '.tdms'")
    _READERS.pop(suffix, None)
    if reader is not None:
        _READERS[suffix] = reader


def known_suffixes() -> list[str]:
    """Suffixes of all files that can be read."""
    return list(_READERS)


def suffix_of(path: Path) -> str:
    """Suffix in lower case, that before .gz of a compressed file."""
    return Path(path.name.lower().removesuffix(".gz")).suffix


def decode(path: Path, topics: Sequence[str] | None, max_bytes: int) -> list[Channel]:
    """Channels of a file or of the folder of a ROS 2 bag, of all topics by default.

    A LogError is raised if it does not exist, is of an unknown kind, damaged, or larger than
    ``max_bytes`` once unpacked.
    """
    try:
        return _decode(path, topics, max_bytes)
    except (LogError, ImportError):
        raise
    except Exception as error:  # decoders may raise any exception
        what = f"{type(error).__name__}: {error}"
        raise LogError(
            f"{path}: damaged, or its suffix does not match its content ({what})."
        ) from error


def _decode(path: Path, topics: Sequence[str] | None, max_bytes: int) -> list[Channel]:
    if not path.exists():
        raise LogError(f"{path}: no such file.")
    suffix = suffix_of(path)
    if path.is_file():
        with path.open("rb") as file:
            if file.read(len(POINTER)) == POINTER:
                raise LogError(
                    f"{path}: a Git LFS pointer instead of the file itself. Fetch it with: git "
                    f"lfs pull --include={path.name}"
                )
        if path.suffix.lower() == ".gz" and suffix not in TEXT:
            raise LogError(
                f"{path}: only compressed text is read; unpack the file with gunzip first."
            )
        if suffix in _READERS:
            return _READERS[suffix](path, max_bytes, topics)
    if (path / "metadata.yaml").exists():
        return read_bag_channels(path, max_bytes, topics)
    raise LogError(
        f"{path}: unknown kind of log {suffix or 'without suffix'!r}. Known are "
        f"{' '.join(_READERS)} and folders of ROS 2 bags."
    )
