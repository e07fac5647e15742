# SPDX-License-Identifier: BSD-3-Clause
"""Readers of tables: CSV, Parquet and NumPy archives. Each gives channels of named columns."""

from __future__ import annotations

import csv
import zipfile
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from skidyn._checks import refuse_duplicates
from skidyn._exceptions import LogError
from skidyn._optional import import_optional
from skidyn.datasets._log_names import PER_JOINT

if TYPE_CHECKING:
    import pandas as pd

#: Largest log that is read without being asked for, in bytes once unpacked.
MAX_BYTES = 8 * 2**30


@dataclass
class Channel:
    """Columns that share one clock, as a file holds them.

    Attributes
    ----------
    name : str
        Topic, group or file name, for messages.
    table : DataFrame
        The columns under the names of the source.
    attributes : dict
        What the file says about itself, such as ``joint_names``.
    """

    name: str
    table: pd.DataFrame
    attributes: dict[str, Any] = field(default_factory=dict)


def read_csv_channels(path: Path, max_bytes: int) -> list[Channel]:
    """Read a text table; the separator, a decimal comma and a missing header are recognised."""
    pandas = import_optional("pandas", extra="io")
    check_size(path, path.stat().st_size, max_bytes)
    with path.open(encoding="utf-8-sig", errors="replace", newline="") as file:
        lines = [line for _, line in zip(range(200), file, strict=False)]
    skip = next(
        (k for k, line in enumerate(lines) if line.strip() and not line.startswith(("#", "%"))), 0
    )
    if not lines or not lines[skip].strip():
        raise LogError(f"{path}: the file is empty.")
    separator = _separator(lines[skip])
    first_row = next(csv.reader([lines[skip]], delimiter=separator or " ", skipinitialspace=True))
    cells = [cell.strip() for cell in first_row if separator or cell]
    decimal = "," if separator == ";" and any("," in line for line in lines[skip + 1 :]) else "."
    headless = all(_is_number(cell.replace(decimal, ".")) for cell in cells if cell)
    if not headless:
        refuse_duplicates(cells, str(path))
    table = pandas.read_csv(
        path,
        sep=separator or r"\s+",
        decimal=decimal,
        header=None if headless else 0,
        names=None if headless else cells,
        skiprows=skip,
        skipinitialspace=True,
        comment="#",
        encoding="utf-8-sig",
        index_col=False,
        low_memory=False,
    )
    table.columns = [str(name) for name in table.columns]
    return [Channel(path.name, table)]


def read_parquet_channels(path: Path, max_bytes: int) -> list[Channel]:
    """Read a Parquet or Feather table; list columns become one column per joint."""
    parquet = import_optional("pyarrow.parquet", extra="io")
    import_optional("pandas", extra="io")
    arrow = import_optional("pyarrow", extra="io")
    try:
        if path.suffix.lower() == ".parquet":
            with parquet.ParquetFile(path) as file:
                groups = range(file.metadata.num_row_groups)
                size = sum(file.metadata.row_group(k).total_byte_size for k in groups)
                check_size(path, size, max_bytes)
                refuse_duplicates(file.schema_arrow.names, str(path))
                table = file.read().to_pandas()
        else:
            check_size(path, path.stat().st_size, max_bytes)
            feather = import_optional("pyarrow.feather", extra="io")
            table = feather.read_table(path)
            refuse_duplicates(table.column_names, str(path))
            table = table.to_pandas()
    except arrow.ArrowException as error:
        raise LogError(f"{path}: cannot be read as a table: {error}") from error
    columns: dict[str, Any] = {}
    for name in table.columns:
        values = table[name]
        if values.dtype == object and len(values) and np.ndim(values.iloc[0]) == 1:
            columns[str(name)] = stack_rows(values, str(name), str(path))
        else:
            columns[str(name)] = values.to_numpy()
    return [Channel(path.name, table_from_arrays(columns))]


def read_npz_channels(path: Path, max_bytes: int) -> list[Channel]:
    """Read a NumPy archive of columns ``(n,)`` and blocks ``(n, joints)``; never unpickles."""
    arrays = load_npz(path, max_bytes)
    attributes = {}
    if "joint_names" in arrays:
        attributes["joint_names"] = [str(name) for name in arrays.pop("joint_names")]
    return [Channel(path.name, table_from_arrays(of_one_length(arrays, str(path))), attributes)]


def of_one_length(arrays: Mapping[str, np.ndarray], source: str) -> dict[str, np.ndarray]:
    """Numeric arrays with one row per sample: those of the most common length.

    Raises
    ------
    LogError
        There is no numeric array of one or two dimensions.
    """
    numeric = {k: a for k, a in arrays.items() if a.ndim in (1, 2) and a.dtype.kind in "fiub"}
    lengths = Counter(len(a) for a in numeric.values())
    if not lengths:
        raise LogError(f"{source}: holds no numeric columns.")
    n = max(lengths, key=lambda length: (lengths[length], length))
    return {name: a for name, a in numeric.items() if len(a) == n}


def load_npz(path: Path, max_bytes: int = MAX_BYTES) -> dict[str, np.ndarray]:
    """All arrays of an npz file, refusing pickles and archives that unpack to too much.

    Raises
    ------
    LogError
        Not an archive, a pickled member, a header that promises other sizes than the member
        holds, or more than ``max_bytes`` once unpacked.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            members = archive.infolist()
            check_size(path, sum(member.file_size for member in members), max_bytes)
            for member in members:
                _check_npy_header(archive, member, path)
        with np.load(path, allow_pickle=False) as data:
            return {name: data[name] for name in data.files}
    except zipfile.BadZipFile as error:
        raise LogError(f"{path}: not a NumPy archive (.npz): {error}") from error
    except ValueError as error:
        if isinstance(error, LogError):
            raise
        raise LogError(
            f"{path}: {error}. Arrays of objects are pickles and are not read; store numbers and "
            "strings."
        ) from error


def _check_npy_header(archive: zipfile.ZipFile, member: zipfile.ZipInfo, path: Path) -> None:
    """Refuse a member whose header promises more than the member holds, before memory is taken."""
    if not member.filename.endswith(".npy"):
        return
    with archive.open(member) as file:
        version = np.lib.format.read_magic(file)
        read = np.lib.format.read_array_header_1_0
        if version != (1, 0):
            read = np.lib.format.read_array_header_2_0
        shape, _, dtype = read(file)
    if (
        not dtype.hasobject
        and int(np.prod(shape, dtype=object)) * dtype.itemsize > member.file_size
    ):
        raise LogError(
            f"{path}: {member.filename} promises an array of shape {shape} but is short."
        )


def table_from_arrays(columns: Mapping[str, np.ndarray]) -> pd.DataFrame:
    """Table of one-dimensional columns; a block ``q`` of shape (n, 3) becomes ``q1, q2, q3``.

    A single column ``q`` is the position of the only joint and becomes ``q1``.
    """
    pandas = import_optional("pandas", extra="io")
    flat: dict[str, np.ndarray] = {}
    for name, values in columns.items():
        single = values.ndim == 1 or values.shape[1] == 1
        if single and name not in PER_JOINT:
            flat[name] = values.reshape(len(values))
        else:
            block = values.reshape(len(values), -1)
            for k in range(block.shape[1]):
                flat[f"{name}{k + 1}"] = block[:, k]
    table: pd.DataFrame = pandas.DataFrame(flat)
    return table


def stack_rows(rows: Sequence[Any], name: str, source: str) -> np.ndarray:
    """Block (n, joints) of a column of lists, which must all be equally long."""
    lengths = Counter(len(row) for row in rows)
    if len(lengths) > 1:
        common = lengths.most_common(1)[0][0]
        row = next(k for k, values in enumerate(rows) if len(values) != common)
        raise LogError(
            f"{source}: {name} has {len(rows[row])} values in row {row}, {common} in most others."
        )
    return np.array([np.asarray(row, dtype=float) for row in rows])


def check_size(path: Path, size: int, max_bytes: int) -> None:
    if size > max_bytes:
        raise LogError(
            f"{path}: unpacks to {size / 2**20:.0f} MiB, more than max_bytes = "
            f"{max_bytes / 2**20:.0f} MiB. Split the log or raise max_bytes."
        )


def _separator(line: str) -> str | None:
    """The most frequent separator of a line; None for blanks."""
    counts = {mark: line.count(mark) for mark in (",", ";", "\t", "|")}
    best = max(counts, key=lambda mark: counts[mark])
    return best if counts[best] else None


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
