# SPDX-License-Identifier: BSD-3-Clause
"""Readers of HDF5 and MATLAB files."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from skidyn._exceptions import LogError
from skidyn._optional import import_optional
from skidyn.datasets._log_files import Channel, check_size, of_one_length, table_from_arrays
from skidyn.datasets._log_names import SPELLINGS


def read_hdf5_channels(path: Path, max_bytes: int, topics: Sequence[str] | None) -> list[Channel]:
    """Read an HDF5 file: each group with numeric datasets is a channel.

    A group without a clock uses the one of the root when lengths agree.
    """
    h5py = import_optional("h5py", extra="io")
    groups: dict[str, dict[str, np.ndarray]] = {}
    names: list[str] = []
    try:
        file = h5py.File(path, "r")
    except OSError as error:
        raise LogError(f"{path}: cannot be read as HDF5: {error}") from error
    with file:
        datasets: list[Any] = []
        file.visititems(lambda _, item: datasets.append(item) if hasattr(item, "shape") else None)
        check_size(path, sum(item.nbytes for item in datasets), max_bytes)
        for item in datasets:
            group, _, name = item.name.strip("/").rpartition("/")
            if name == "joint_names":
                names = [n.decode() if isinstance(n, bytes) else str(n) for n in item[()]]
            elif item.ndim in (1, 2) and item.dtype.kind in "fiub":
                groups.setdefault(group, {})[name] = _samples_first(item[()])
    root = groups.get("", {})
    clock = next((root[name] for name in root if name.lower() in SPELLINGS["time"]), None)
    channels = []
    for group, arrays in groups.items():
        if topics is not None and group not in topics and f"/{group}" not in topics:
            continue
        columns = of_one_length(arrays, f"{path}/{group}")
        if clock is not None and not any(name.lower() in SPELLINGS["time"] for name in columns):
            if len(clock) == len(next(iter(columns.values()))):
                columns["time"] = clock.reshape(-1)
        if group == "" and len(groups) > 1 and set(columns) <= set(SPELLINGS["time"]):
            continue  # nothing but the clock that the groups share
        attributes = {"joint_names": names} if names else {}
        channels.append(Channel(group or path.name, table_from_arrays(columns), attributes))
    if not channels:
        raise LogError(f"{path}: no numeric datasets{_asked(topics, list(groups))}.")
    return channels


def read_matlab_channels(path: Path, max_bytes: int, topics: Sequence[str] | None) -> list[Channel]:
    """Read a MATLAB file: variables of one length, also inside one level of structs."""
    check_size(path, path.stat().st_size, max_bytes)
    with path.open("rb") as file:
        head = file.read(128)
    if head.startswith(b"\x89HDF") or b"MATLAB 7.3" in head:
        return read_hdf5_channels(path, max_bytes, topics)
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    _refuse_crash(path)
    try:
        variables = loadmat(path, simplify_cells=True)
    except (MatReadError, ValueError, TypeError) as error:
        raise LogError(f"{path}: not a MATLAB file: {error}") from error
    arrays: dict[str, np.ndarray] = {}
    names: list[str] = []
    for name, value in variables.items():
        if name.startswith("__"):
            continue
        fields = value if isinstance(value, Mapping) else {name: value}
        for key, item in fields.items():
            array = np.asarray(item)
            if key == "joint_names":
                names = [str(n).strip() for n in np.atleast_1d(array)]
            elif array.ndim in (1, 2) and array.dtype.kind in "fiub":
                arrays[key] = _samples_first(array)
    columns = of_one_length(arrays, str(path))
    attributes = {"joint_names": names} if names else {}
    return [Channel(path.name, table_from_arrays(columns), attributes)]


def _refuse_crash(path: Path) -> None:
    """Read in another process first: scipy's compiled reader can crash on a damaged file."""
    trial = "import sys; from scipy.io import loadmat; loadmat(sys.argv[1], simplify_cells=True)"
    done = subprocess.run([sys.executable, "-c", trial, str(path)], capture_output=True, text=True)
    if done.returncode:
        lines = done.stderr.strip().splitlines()
        raise LogError(f"{path}: not a MATLAB file: {lines[-1] if lines else 'the reader crashed'}")


def _samples_first(values: np.ndarray) -> np.ndarray:
    """Blocks of (joints, samples), as MATLAB users keep them, the other way round."""
    if values.ndim == 2 and values.shape[0] < values.shape[1]:
        return values.T
    return values


def _asked(topics: Sequence[str] | None, present: Sequence[str]) -> str:
    if topics is None:
        return ""
    return f" in {', '.join(topics)}; it has {', '.join(present) or 'none'}"
