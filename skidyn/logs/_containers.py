# SPDX-License-Identifier: BSD-3-Clause
"""Readers of HDF5 and MATLAB files."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from skidyn._checks import warn_about_log
from skidyn._exceptions import LogError
from skidyn._names import SPELLINGS
from skidyn._optional import import_optional
from skidyn.logs._bounds import Budget, check_size, try_in_another_process
from skidyn.logs._files import Channel, of_one_length, table_from_arrays

#: Largest depth of groups; the time to process names grows as its square.
DEEPEST = 32


def read_hdf5_channels(path: Path, max_bytes: int, topics: Sequence[str] | None) -> list[Channel]:
    """Read an HDF5 file: each group with numeric datasets, and each table, is a channel.

    A group without a clock uses that of a group within, or of the root, when lengths agree. Groups
    with the same columns, and the elements of a struct array of MATLAB, are trajectories.
    """
    h5py = import_optional("h5py", extra="io")
    try:
        file = h5py.File(path, "r")
    except OSError as error:
        raise LogError(f"{path}: cannot be read as HDF5: {error}") from error
    with file:
        datasets = list(_datasets(file, path, set()))
        budget = Budget(path, max_bytes)
        for item in datasets:
            budget.take(item.nbytes)
            # a chunk is decoded as a whole, and may be larger than its used part
            check_size(path, int(np.prod(item.chunks or 0)) * item.dtype.itemsize, max_bytes)
        _refuse_other_files(path, datasets)
        groups, names = _numeric_groups(file, datasets, budget)
    clocks = {g: arrays[n] for g, arrays in groups.items() for n in arrays if _is_clock(n)}
    channels = []
    for group, arrays in groups.items():
        if topics is not None and group not in topics and f"/{group}" not in topics:
            continue
        columns = of_one_length(arrays, f"{path}/{group}")
        if not any(map(_is_clock, columns)):
            # that of a group within, such as "header", or that of the root
            length = len(next(iter(columns.values())))
            near = [c for g, c in clocks.items() if g == "" or g.startswith(f"{group}/")]
            if fitting := [c for c in near if len(c) == length]:
                columns["time"] = fitting[-1].reshape(-1)
        attributes = {"joint_names": names} if names else {}
        channels.append(Channel(group or path.name, table_from_arrays(columns), attributes))
    if not channels:
        raise LogError(f"{path}: no numeric datasets{_asked(topics, list(groups))}.")
    return _runs(_with_clock(channels, path), path)


def _datasets(group: Any, path: Path, seen: set[Any], depth: int = 0) -> Iterator[Any]:
    """Datasets of a group and of those within, each once; links to other files are not followed."""
    h5py = import_optional("h5py", extra="io")
    if depth > DEEPEST:
        raise LogError(f"{path}: {group.name[:60]} lies more than {DEEPEST} groups deep")
    for name in group:
        if not isinstance(group.get(name, getlink=True), h5py.HardLink):
            continue
        item = group[name]
        address = h5py.h5o.get_info(item.id).addr
        if address in seen:
            continue
        seen.add(address)
        if isinstance(item, h5py.Dataset):
            yield item
        elif isinstance(item, h5py.Group):
            yield from _datasets(item, path, seen, depth + 1)


def _refuse_other_files(path: Path, datasets: Sequence[Any]) -> None:
    """Refuse an HDF5 file with numbers in other files, which may be anywhere."""
    for item in datasets:
        if item.is_virtual or item.external:
            other = item.virtual_sources()[0].file_name if item.is_virtual else item.external[0][0]
            raise LogError(
                f"{path}: the numbers of {item.name} are stored in another file, {other}; files "
                "referenced by a log are not opened. Copy them into the log."
            )


def read_matlab_channels(path: Path, max_bytes: int, topics: Sequence[str] | None) -> list[Channel]:
    """Read a MATLAB file: variables of one length, also inside one level of structs.

    The elements of a struct array, or of a cell array of structs, are trajectories.
    """
    check_size(path, path.stat().st_size, max_bytes)
    with path.open("rb") as file:
        head = file.read(128)
    if head.startswith(b"\x89HDF") or b"MATLAB 7.3" in head:
        return read_hdf5_channels(path, max_bytes, topics)
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    try_in_another_process(
        path,
        max_bytes,
        "from scipy.io import loadmat",
        "loadmat(sys.argv[1], simplify_cells=True)",
    )
    try:
        variables = loadmat(path, simplify_cells=True)
    except (MatReadError, ValueError, TypeError) as error:
        raise LogError(f"{path}: not a MATLAB file: {error}") from error
    budget = Budget(path, max_bytes)
    own: dict[str, np.ndarray] = {}
    groups: dict[str, dict[str, np.ndarray]] = {"": own}
    names: list[str] = []
    for name, value in variables.items():
        if name.startswith("__"):
            continue
        for k, fields in enumerate(_structs(value) or [{name: value}]):
            runs = len(_structs(value)) > 1
            arrays = groups.setdefault(f"{name}({k + 1})", {}) if runs else own
            for key, item in fields.items():
                array = np.asarray(item)
                budget.take(array.nbytes)
                if key == "joint_names":
                    names = [str(n).strip() for n in np.atleast_1d(array)]
                elif array.ndim in (1, 2) and array.dtype.kind in "fiub":
                    arrays[key] = _samples_first(array)
    filled = {name: arrays for name, arrays in groups.items() if arrays}
    if not filled:
        raise LogError(
            f"{path}: holds no numeric columns. Variables, structs of one level and arrays of such "
            "structs are read; tables and objects of MATLAB are not (use table2struct)."
        )
    attributes = {"joint_names": names} if names else {}
    channels = [
        Channel(name or path.name, table_from_arrays(of_one_length(arrays, str(path))), attributes)
        for name, arrays in filled.items()
    ]
    return _runs(_with_clock(channels, path), path)


def _structs(value: Any) -> list[Mapping[str, Any]]:
    """Structs of a variable of MATLAB: itself, or its elements; none for numbers."""
    if isinstance(value, Mapping):
        return [value]
    if isinstance(value, np.ndarray) and value.dtype == object:
        value = list(value.reshape(-1))
    if isinstance(value, list) and value and all(isinstance(v, Mapping) for v in value):
        return value
    return []


def _numeric_groups(
    file: Any, datasets: Sequence[Any], budget: Budget
) -> tuple[dict[str, dict[str, np.ndarray]], list[str]]:
    """Numeric arrays of an HDF5 file by group, and the names of joints."""
    h5py = import_optional("h5py", extra="io")
    groups: dict[str, dict[str, np.ndarray]] = {}
    names: list[str] = []
    for item in datasets:
        group, _, name = item.name.strip("/").rpartition("/")
        if group.startswith("#") or item.attrs.get("MATLAB_class", b"") == b"char":
            continue  # where MATLAB keeps the contents of cells; text
        if name == "joint_names":
            names = _names(file, item, budget)
        elif item.dtype.names is not None and item.ndim == 1:
            # field by field: text of any length is not decoded
            groups[item.name.strip("/")] = {
                field: item.fields(field)[()]
                for field in item.dtype.names
                if item.dtype[field].kind in "fiub"
            }
        elif (
            h5py.check_ref_dtype(item.dtype) is h5py.Reference and "MATLAB_class" not in item.attrs
        ):
            for k, reference in enumerate(np.ravel(item[()])):  # a field of a struct array
                part = file[reference] if reference else None
                if part is not None and hasattr(part, "dtype") and part.dtype.kind in "fiub":
                    budget.take(part.nbytes)  # one may be referenced many times
                    run = groups.setdefault(f"{group}({k + 1})", {})
                    run[name] = _samples_first(part[()])
        elif item.ndim in (1, 2) and item.dtype.kind in "fiub":
            groups.setdefault(group, {})[name] = _samples_first(item[()])
    return {name: arrays for name, arrays in groups.items() if arrays}, names


def _names(file: Any, item: Any, budget: Budget) -> list[str]:
    """Names of joints, one by one, since a small file may repeat a long text many times."""
    names = []
    for place in np.ndindex(item.shape):
        text = _text(file, item[place])
        budget.take(len(text))
        names.append(text)
    return names


def _text(file: Any, value: Any) -> str:
    """Text of an element: bytes, text, or the content of a cell of MATLAB."""
    if isinstance(value, bytes):
        return value.decode()
    if hasattr(value, "typecode") or type(value).__name__ == "Reference":
        return "".join(chr(int(c)) for c in np.ravel(file[value][()]))
    return str(value)


def _is_clock(name: str) -> bool:
    return name.lower() in SPELLINGS["time"]


def _with_clock(channels: list[Channel], path: Path) -> list[Channel]:
    """Channels with a clock, if there are any; constants and settings have none."""
    timed = [c for c in channels if any(_is_clock(str(name)) for name in c.table.columns)]
    # a clock alone is no signal
    timed = [c for c in timed if len(c.table.columns) > 1] or timed
    left = [c.name for c in channels if c not in timed]
    if not timed or not left:
        return channels
    signals = [
        c.name
        for c in channels
        if c.name in left and len(c.table) > 1 and not all(map(_is_clock, c.table.columns))
    ]
    if signals:
        warn_about_log(f"{path}: without a clock and left out: {', '.join(signals)}")
    return timed


def _runs(channels: list[Channel], path: Path) -> list[Channel]:
    """Merge channels with the same columns; each is a trajectory."""
    columns = {frozenset(c.table.columns) for c in channels}
    if len(channels) == 1 or len(columns) > 1 or "trajectory" in next(iter(columns)):
        return channels
    import pandas as pd

    ordered = sorted(channels, key=lambda c: [int(n) for n in re.findall(r"\d+", c.name)])
    tables = [c.table.assign(trajectory=k) for k, c in enumerate(ordered, 1)]
    warn_about_log(
        f"{path}: {', '.join(c.name for c in ordered)} have the same columns; each becomes a "
        "trajectory"
    )
    table = pd.concat(tables, ignore_index=True)
    return [Channel(path.name, table, ordered[0].attributes)]


def _samples_first(values: np.ndarray) -> np.ndarray:
    """Transpose blocks of (joints, samples), which are usual in MATLAB."""
    if values.ndim == 2 and values.shape[0] < values.shape[1]:
        return values.T
    return values


def _asked(topics: Sequence[str] | None, present: Sequence[str]) -> str:
    if topics is None:
        return ""
    return f" in {', '.join(topics)}; it has {', '.join(present) or 'none'}"
