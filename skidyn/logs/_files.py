# SPDX-License-Identifier: BSD-3-Clause
"""Readers of tables (text and NumPy archives), which return channels of named columns."""

from __future__ import annotations

import csv
import gzip
import zipfile
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from skidyn._checks import refuse_duplicates, warn_about_log
from skidyn._exceptions import LogError
from skidyn._names import PER_JOINT, quantity_of
from skidyn.logs._bounds import MAX_BYTES, check_size

if TYPE_CHECKING:
    import pandas as pd


#: Names of fields that are left out: row names, and the empty field after the last separator.
_ROW_NAMES, _NOTHING = "names of rows", "behind the last separator"


@dataclass
class Channel:
    """Columns that share one clock, as stored in a file.

    Parameters
    ----------
    name : str
        Topic, group or file name, for messages.
    table : DataFrame
        The columns under the names of the source.
    attributes : dict
        Metadata of the file, such as ``joint_names``.

    Examples
    --------
    >>> import pandas as pd
    >>> from skidyn.logs import Channel
    >>> Channel("arm", pd.DataFrame({"q1": [0.0]}), {"joint_names": ["elbow"]}).name
    'arm'
    """

    name: str
    table: pd.DataFrame
    attributes: dict[str, Any] = field(default_factory=dict)


def read_csv_channels(path: Path, max_bytes: int) -> list[Channel]:
    """Read a text table; the separator, a decimal comma and a missing header are recognised."""
    import pandas

    check_size(path, _unpacked(path, max_bytes), max_bytes)
    with _open_text(path) as file:
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
    shape = _shape_of_rows(path, separator, skip + (not headless), max_bytes)
    names = _names_of_fields(path, cells, headless, shape)
    table = pandas.read_csv(
        path,
        sep=separator or r"\s+",
        decimal=decimal,
        header=None,
        names=names,
        usecols=[name for name in names if name not in (_ROW_NAMES, _NOTHING)],
        skiprows=skip + (not headless),
        skipinitialspace=True,
        comment="#",
        encoding="utf-8-sig",
        index_col=False,
        low_memory=False,
    )
    table.columns = [str(name) for name in table.columns]
    lists = {str(name): list_cells(table[name], str(name), str(path)) for name in table.columns}
    if any(block is not None for block in lists.values()):
        pieces = [
            table[[name]] if block is None else table_from_arrays({name: block})
            for name, block in lists.items()
        ]
        table = pandas.concat(pieces, axis=1)
    return [Channel(path.name, table)]


@dataclass
class _Shape:
    """Number of fields in the rows of a text, and whether the last is always empty."""

    width: int = 0
    n_rows: int = 0
    open_end: bool = True


def _shape_of_rows(path: Path, separator: str | None, skip: int, max_bytes: int) -> _Shape:
    """Refuse rows of different lengths, which pandas would fill or cut, and too many of them."""
    shape = _Shape()
    for number, width, last in _rows_of_text(path, separator, skip):
        if shape.n_rows and width != shape.width:
            raise LogError(
                f"{path}: line {number} has {width} fields, the lines before {shape.width}. The "
                "recording may be truncated, or a field may contain the separator. Fix or remove "
                "the line."
            )
        shape.width = width
        shape.n_rows += 1
        shape.open_end &= not last.strip()
        if not shape.n_rows % 1000:
            check_size(path, 8 * shape.width * shape.n_rows, max_bytes)
    check_size(path, 8 * shape.width * shape.n_rows, max_bytes)
    return shape


def _rows_of_text(
    path: Path, separator: str | None, skip: int
) -> Iterator[tuple[int, int, bytes | str]]:
    """Number of the line, of its fields, and the last, without comments and empty lines."""
    mark = None if separator is None else separator.encode()
    with gzip.open(path) if path.suffix.lower() == ".gz" else path.open("rb") as file:
        lines = enumerate(file, 1)
        for number, line in lines:
            if number <= skip:
                continue
            while line.count(b'"') % 2 and (more := next(lines, None)):  # a line end in quotes
                line += more[1]
            quoted = b'"' in line
            line = line.rstrip(b"\r\n") if quoted else line.partition(b"#")[0].rstrip(b"\r\n")
            if not line.strip():
                continue
            if not quoted and mark is None:
                yield number, len(line.split()), b"1"
            elif not quoted and mark is not None:
                yield number, line.count(mark) + 1, line[line.rfind(mark) + 1 :]
            else:
                text = [line.decode("utf-8", errors="replace")]
                (row,) = csv.reader(text, delimiter=separator or " ", skipinitialspace=True)
                row = row if separator else [cell for cell in row if cell]
                yield number, len(row), row[-1]


def _names_of_fields(path: Path, cells: Sequence[str], headless: bool, shape: _Shape) -> list[str]:
    """A name for every field of a row."""
    if headless:
        return [str(k) for k in range(len(cells))]
    if not shape.n_rows or shape.width == len(cells):
        return _without_nameless(path, cells, shape)
    if shape.width == len(cells) + 1 and shape.open_end:
        return [*cells, _NOTHING]
    if shape.width == len(cells) + 1:
        warn_about_log(
            f"{path}: rows have one field more than the header. The first field is interpreted as "
            "row names, as written by R, and left out."
        )
        return [_ROW_NAMES, *cells]
    raise LogError(
        f"{path}: rows have {shape.width} fields, the header {len(cells)} "
        f"({', '.join(cells[:6])}{', ...' if len(cells) > 6 else ''}). Give each column a name."
    )


def _without_nameless(path: Path, cells: Sequence[str], shape: _Shape) -> list[str]:
    """The names of a header, of which one field without a name is left out."""
    names = list(cells)
    empty = [k for k, name in enumerate(names) if not name]
    if len(empty) > 1:
        raise LogError(
            f"{path}: fields {', '.join(str(k + 1) for k in empty)} of the header have no name. "
            "Give each column a name."
        )
    for k in empty:
        names[k] = _NOTHING if shape.open_end and k == len(names) - 1 else _ROW_NAMES
        if names[k] == _ROW_NAMES:
            like = "row names, as written by pandas (to_csv(index=False) writes none)"
            warn_about_log(
                f"{path}: field {k + 1} of the header has no name. The field is interpreted as "
                f"{like if k == 0 else 'no signal'}, and left out."
            )
    return names


def _open_text(path: Path) -> Any:
    """A text file, or one that is compressed, for reading."""
    if path.suffix.lower() == ".gz":
        return gzip.open(path, "rt", encoding="utf-8-sig", errors="replace", newline="")
    return path.open(encoding="utf-8-sig", errors="replace", newline="")


def _unpacked(path: Path, most: int) -> int:
    """Unpacked bytes of a file, up to the permitted number."""
    if path.suffix.lower() != ".gz":
        return path.stat().st_size
    size = 0
    with gzip.open(path, "rb") as file:
        while size <= most and (block := file.read(2**20)):
            size += len(block)
    return size


def list_cells(column: Any, name: str, source: str) -> np.ndarray | None:
    """Block (n, joints) of a text column of lists such as ``"[0.1, 0.2]"``, or None.

    Empty cells are rows of NaN; lists of words, such as joint names, stay text. A LogError is
    raised if a cell is not a list or lists differ in length.
    """
    if column.dtype.kind not in "OUT":
        return None
    empty = column.isna().to_numpy()
    if empty.all():
        return None
    first = str(column.iloc[int(np.argmin(empty))]).strip()
    like = _numbers_of(first)
    if like is None:
        return None
    rows = []
    for k, cell in enumerate(column):
        row = [np.nan] * len(like) if empty[k] else _numbers_of(str(cell).strip())
        if row is None:
            raise LogError(
                f"{source}: {name} holds {str(cell).strip()[:40]!r} in row {k}, where a list of "
                f"numbers such as {first[:40]} is expected."
            )
        rows.append(row)
    return stack_rows(rows, name, source)


def _numbers_of(text: str) -> list[float] | None:
    """Numbers of a list such as ``[0.1, 0.2]``, ``(0.1 0.2)`` or ``["0.1"]``; None for other text.

    >>> _numbers_of("[0.1, 2]"), _numbers_of("['elbow']"), _numbers_of("0.1")
    ([0.1, 2.0], None, None)
    """
    if text[:1] + text[-1:] not in ("[]", "()"):
        return None
    try:
        return [float(word.strip("'\"")) for word in text[1:-1].replace(",", " ").split()]
    except ValueError:
        return None


def read_npz_channels(path: Path, max_bytes: int) -> list[Channel]:
    """Read a NumPy archive of columns ``(n,)`` and blocks ``(n, joints)``; never unpickles."""
    arrays = load_npz(path, max_bytes)
    attributes = {}
    if "joint_names" in arrays:
        attributes["joint_names"] = [str(name) for name in arrays.pop("joint_names")]
    return [Channel(path.name, table_from_arrays(of_one_length(arrays, str(path))), attributes)]


def read_npy_channels(path: Path, max_bytes: int) -> list[Channel]:
    """Read a NumPy array of columns without names, or with those of a structured array."""
    check_size(path, path.stat().st_size, max_bytes)
    try:
        array = np.load(path, mmap_mode="r", allow_pickle=False)
    except ValueError as error:
        raise LogError(f"{path}: cannot be read as an array of numbers: {error}") from error
    if array.dtype.names:
        columns = {name: np.asarray(array[name]) for name in array.dtype.names}
        return [Channel(path.name, table_from_arrays(of_one_length(columns, str(path))))]
    if array.ndim not in (1, 2) or array.dtype.kind not in "fiub":
        raise LogError(
            f"{path}: holds an array of shape {array.shape} and type {array.dtype}; expected "
            "numbers with one row per sample."
        )
    block = np.array(array.reshape(len(array), -1))
    return [
        Channel(path.name, table_from_arrays({str(k): block[:, k] for k in range(block.shape[1])}))
    ]


def of_one_length(arrays: Mapping[str, np.ndarray], source: str) -> dict[str, np.ndarray]:
    """Numeric arrays with one row per sample: those of the most common length.

    Others are constants and settings, and are left out with a warning. A LogError is raised if
    there is no array of one or two dimensions, or a signal has another length.
    """
    numeric = {k: a for k, a in arrays.items() if a.ndim in (1, 2) and a.dtype.kind in "fiub"}
    lengths = Counter(len(a) for a in numeric.values())
    if not lengths:
        raise LogError(f"{source}: holds no numeric columns.")
    n = max(lengths, key=lambda length: (lengths[length], length))
    others = {name: len(a) for name, a in numeric.items() if len(a) != n}
    for name, length in others.items():
        # a vector such as q0 with one number per joint is not a signal
        if 2 * length > n and quantity_of(name) is not None:
            like = next(name for name, a in numeric.items() if len(a) == n)
            raise LogError(
                f"{source}: {name} has {length} rows, {like} has {n}. Corresponding rows cannot "
                "be determined; store signals of equal length."
            )
    if left := [f"{name} ({length})" for name, length in others.items() if length > 1]:
        names = ", ".join(left)
        warn_about_log(f"{source}: left out because their length is not {n} rows: {names}")
    return {name: a for name, a in numeric.items() if len(a) == n}


def load_npz(path: Path, max_bytes: int = MAX_BYTES) -> dict[str, np.ndarray]:
    """All arrays of an npz file, refusing pickles and archives that unpack to too much.

    A LogError is raised for what is not an archive, a pickled member, and a header that promises
    other sizes than the member holds.
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
            f"{path}: {member.filename} declares an array of shape {shape} but is truncated."
        )


def table_from_arrays(columns: Mapping[str, np.ndarray]) -> pd.DataFrame:
    """Table of one-dimensional columns; a block ``q`` of shape (n, 3) becomes ``q1, q2, q3``.

    A single column ``q`` is the position of the only joint and becomes ``q1``.
    """
    import pandas

    flat: dict[str, Any] = {}
    for name, values in columns.items():
        single = values.ndim == 1 or values.shape[1] == 1
        if single and name not in PER_JOINT:
            column = values.reshape(len(values))
            # as objects: pandas would store each text at every repetition
            text = column.dtype == object
            flat[name] = pandas.Series(column, dtype=object) if text else column
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
