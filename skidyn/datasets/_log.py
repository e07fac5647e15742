# SPDX-License-Identifier: BSD-3-Clause
"""Reading a log: one function for all formats."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from skidyn._checks import warn_about_log
from skidyn._exceptions import LogError
from skidyn._optional import import_optional
from skidyn._progress import track
from skidyn.datasets._log_containers import read_hdf5_channels, read_matlab_channels
from skidyn.datasets._log_files import (
    MAX_BYTES,
    Channel,
    read_csv_channels,
    read_npz_channels,
    read_parquet_channels,
)
from skidyn.datasets._log_quality import check_log
from skidyn.datasets._log_ros import read_bag_channels, read_mcap_channels
from skidyn.datasets._log_table import ColumnMap, TableOptions, build_table

if TYPE_CHECKING:
    import pandas as pd

    from skidyn.robots import Robot

PathLike = str | os.PathLike[str]


def read_log(
    path: PathLike | Sequence[PathLike],
    *,
    robot: Robot | None = None,
    columns: ColumnMap | None = None,
    units: Mapping[str, str] | None = None,
    drive_gains: Sequence[float] | None = None,
    topics: Sequence[str] | None = None,
    rate: float | None = None,
    resample_rate: float | None = None,
    missing: Literal["error", "drop"] = "error",
    split_gaps: float | Literal["auto"] | None = "auto",
    split_dwells: float | None = None,
    check: bool = True,
    max_bytes: int = MAX_BYTES,
) -> pd.DataFrame:
    """Read recordings of a robot into one table in SI units.

    Parameters
    ----------
    path : path or sequence of paths
        CSV or text (``.csv .tsv .txt .dat``), Parquet (``.parquet``), Feather, NumPy (``.npz``),
        HDF5 (``.h5 .hdf5``), MATLAB (``.mat``), MCAP (``.mcap``), ROS 1 bag (``.bag``), ROS 2 bag
        (its folder, or ``.db3``). Several files become several trajectories.
    robot : Robot, optional
        Its joint names are looked for and order the columns; the log is checked against its
        limits and its gravity.
    columns : mapping, optional
        Which columns hold which signals, where names do not tell: ``{"q1": "pos_a"}``,
        ``{"q": ["pos_a", "pos_b"]}``, ``{"tau": "effort_{joint}"}``, ``{"time": 0}``.
    units : mapping, optional
        Units that are not SI, per quantity or column: ``{"q": "deg", "time": "ms", "q3": "mm"}``.
    drive_gains : sequence of float, N m/A or N/A, optional
        Torque per ampere and joint, to read a log of currents (``i1 .. in``) as torques.
    topics : sequence of str, optional
        Topics of a bag or groups of an HDF5 file to read; all that hold joint states if None.
    rate : float, Hz, optional
        Sampling rate of logs without a time column.
    resample_rate : float, Hz, optional
        Rate of a regular clock; None takes the recorded one, that of the positions where signals of
        one file have several. Signals that are faster are averaged over one step of it.
    missing : {"error", "drop"}, default="error"
        Rows with NaN or infinite values: refuse the log, or leave them out with a warning.
    split_gaps : float, s, "auto" or None, default="auto"
        A time step longer than this begins a new trajectory; ``"auto"``: longer than 20 median
        steps and 0.2 s, in logs that have no trajectory column of their own.
    split_dwells : float, s, optional
        Cut a trajectory in the middle of each rest longer than this.
    check : bool, default=True
        Judge the quality of the log (:func:`check_log`) and warn of what looks wrong.
    max_bytes : int
        Largest size of one file once unpacked.

    Returns
    -------
    DataFrame
        ``time`` (s), ``trajectory``, ``q1 .. qn`` (rad or m), ``dq1 .. dqn``, ``ddq1 .. ddqn``
        where recorded, ``tau1 .. taun`` (N m or N), ``temp1 .. tempn`` (degrees Celsius) where
        recorded, then further numeric columns under their own names. ``attrs`` holds
        ``joint_names``, ``files`` (one per trajectory) and ``notes``.

    Raises
    ------
    LogError
        The log cannot be used as it is; the message says why and what to do.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from skidyn.datasets import read_log
    >>> folder = tempfile.TemporaryDirectory()
    >>> file = pathlib.Path(folder.name, "log.csv")
    >>> rows = ["t;pos 1;vel 1;torque 1", "0,0;0,1;1;2,0", "0,1;0,2;1;2,1"]
    >>> _ = file.write_text(chr(10).join(rows))
    >>> read_log(file, check=False).columns.tolist()
    ['time', 'trajectory', 'q1', 'dq1', 'tau1']
    >>> folder.cleanup()
    """
    pandas = import_optional("pandas", extra="io")
    paths = [path] if isinstance(path, (str, os.PathLike)) else list(path)
    if not paths:
        raise LogError("no file to read: the list of paths is empty.")
    options = TableOptions(
        robot, columns, units, drive_gains, rate, resample_rate, missing, split_gaps, split_dwells
    )
    tables: list[pd.DataFrame] = []
    files: list[str] = []
    notes: list[str] = []
    joints: list[str] = []
    for file in track([Path(item) for item in paths], "Reading"):
        table, match = build_table(_read_channels(file, topics, max_bytes), str(file), options)
        if tables:
            _refuse_other_columns(table, match.joint_names, tables[0], joints, file)
        joints = match.joint_names
        notes += [note.removeprefix(f"{file}: ") for note in match.notes]
        _, number = np.unique(table["trajectory"], return_inverse=True)
        if len(paths) > 1:
            table["trajectory"] = number + len(files)
        files += [str(file)] * (int(number.max()) + 1)
        tables.append(table)
    frame = pandas.concat(tables, ignore_index=True) if len(tables) > 1 else tables[0]
    notes = _told_once(notes, len(paths))
    frame.attrs = {"joint_names": joints, "files": files, "notes": notes}
    for note in notes:
        warn_about_log(note)
    if check:
        for message in check_log(frame, robot).warnings:
            warn_about_log(message)
    return frame


def _told_once(notes: Sequence[str], n_files: int) -> list[str]:
    """Each note once, with the number of files that it holds for.

    >>> _told_once(["no velocities", "cut", "no velocities"], 3)
    ['no velocities (2 of 3 files)', 'cut (1 of 3 files)']
    """
    counts = Counter(notes)
    if n_files == 1:
        return list(counts)
    return [f"{note} ({count} of {n_files} files)" for note, count in counts.items()]


def _refuse_other_columns(
    table: pd.DataFrame,
    joints: Sequence[str],
    first: pd.DataFrame,
    first_joints: Sequence[str],
    file: Path,
) -> None:
    """Files of one log must hold the same signals of the same joints."""
    if list(joints) != list(first_joints):
        raise LogError(
            f"{file}: its joints ({', '.join(joints)}) are not those of the first file "
            f"({', '.join(first_joints)}). Pass robot= or columns= to say which belong together."
        )
    differing = sorted(set(map(str, table.columns)) ^ set(map(str, first.columns)))
    if differing:
        raise LogError(
            f"{file}: {', '.join(differing)} is in this file or in the first one but not in both."
        )


def _read_channels(path: Path, topics: Sequence[str] | None, max_bytes: int) -> list[Channel]:
    """Channels of a file; whatever a decoder says about a damaged one becomes a LogError."""
    try:
        return _decode(path, topics, max_bytes)
    except (LogError, ImportError):
        raise
    except Exception as error:  # decoders raise whatever the bytes lead them to
        what = f"{type(error).__name__}: {error}"
        raise LogError(f"{path}: damaged, or not what its suffix says ({what}).") from error


def _decode(path: Path, topics: Sequence[str] | None, max_bytes: int) -> list[Channel]:
    if not path.exists():
        raise LogError(f"{path}: no such file.")
    suffix = path.suffix.lower()
    tables: dict[str, Callable[[Path, int], list[Channel]]] = {
        **dict.fromkeys((".csv", ".tsv", ".txt", ".dat"), read_csv_channels),
        **dict.fromkeys((".parquet", ".feather", ".arrow"), read_parquet_channels),
        ".npz": read_npz_channels,
    }
    containers: dict[str, Callable[[Path, int, Sequence[str] | None], list[Channel]]] = {
        **dict.fromkeys((".h5", ".hdf5"), read_hdf5_channels),
        ".mat": read_matlab_channels,
        ".mcap": read_mcap_channels,
        **dict.fromkeys((".bag", ".db3"), read_bag_channels),
    }
    if suffix in tables and path.is_file():
        return tables[suffix](path, max_bytes)
    if suffix in containers and path.is_file():
        return containers[suffix](path, max_bytes, topics)
    if (path / "metadata.yaml").exists():
        return read_bag_channels(path, max_bytes, topics)
    raise LogError(
        f"{path}: unknown kind of log {suffix or 'without suffix'!r}. Known are .csv .tsv .txt "
        ".dat .parquet .feather .npz .h5 .hdf5 .mat .mcap .bag .db3 and folders of ROS 2 bags."
    )
