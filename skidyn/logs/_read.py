# SPDX-License-Identifier: BSD-3-Clause
"""Reading a log: one function for all formats."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from skidyn._checks import warn_about_log
from skidyn._exceptions import LogError
from skidyn._progress import track
from skidyn.logs._bounds import MAX_BYTES
from skidyn.logs._files import Channel
from skidyn.logs._folders import find_runs, read_runs
from skidyn.logs._formats import decode
from skidyn.logs._placeholders import Placeholder, refuse_absent
from skidyn.logs._quality import check_log
from skidyn.logs._remedies import REMEDIES, Remedies, turn_gravity
from skidyn.logs._table import ColumnMap, TableOptions, build_table

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
    drive_gains: float | Sequence[float] | None = None,
    topics: Sequence[str] | None = None,
    rate: float | None = None,
    resample_rate: float | None = None,
    missing: Literal["error", "drop"] = "error",
    placeholder: Placeholder | None = None,
    split_gaps: float | Literal["auto"] | None = "auto",
    split_dwells: float | None = None,
    order: Sequence[int] | Mapping[str, Sequence[int]] | None = None,
    flip: Sequence[str | int] = (),
    combine: Mapping[str, str] | None = None,
    gain: Mapping[str, float] | None = None,
    summed: Mapping[str, str] | None = None,
    zero: Mapping[str, float] | None = None,
    late: Mapping[str, float | tuple[float, float]] | None = None,
    lowpass: Mapping[str, float] | None = None,
    gravity: Sequence[float] | Literal["none"] | None = None,
    unwrap: bool = False,
    torque_sign: Literal["recorded", "command"] = "recorded",
    clock: Literal["recorded", "regular"] = "recorded",
    drop_repeated: bool = False,
    split_leaps: bool = False,
    restore_gravity: bool = False,
    derive: Sequence[str] = (),
    needs_torque: bool = True,
    check: bool = True,
    max_bytes: int = MAX_BYTES,
) -> pd.DataFrame:
    """Read recordings of a robot into one table in SI units.

    Parameters
    ----------
    path : path or sequence of paths
        CSV or text (``.csv .tsv .txt .dat``), Parquet (``.parquet``), Feather, NumPy (``.npz
        .npy``), HDF5 (``.h5 .hdf5``), MATLAB (``.mat``), MCAP (``.mcap``), ROS 1 bag (``.bag``),
        ROS 2 bag (its folder, or ``.db3``); text may be compressed (``.csv.gz``) and hold lists in
        columns. Several files become several trajectories. A pattern (``"runs/*.csv"``) or a folder
        means the logs in it; files of a folder with one signal each (``q.csv``, ``tau.csv``,
        ``commands.csv``) are one recording. A LeRobot data set is given by its folder.
    robot : Robot, optional
        Its joint names are searched in the column names and determine the order of the columns; the
        log is checked against its limits and its gravity.
    columns : mapping, optional
        Columns of the signals, if they do not have usual names: ``{"q1": "pos_a"}``, ``{"q":
        ["pos_a", "pos_b"]}``, ``{"tau": "effort_{joint}"}``, ``{"time": 0}``.
    units : mapping, optional
        Units that are not SI, per quantity or column: ``{"q": "deg", "time": "ms", "q3": "mm"}``.
        With a robot, that of a quantity applies to the joints that can have it: ``deg`` to turning
        joints, ``mm`` to sliders.
    drive_gains : float or sequence of float, N m/A or N/A, optional
        Torque per ampere and joint, to read a log of currents (``i1 .. in``) as torques.
    topics : sequence of str, optional
        Topics of a bag or groups of an HDF5 file to read; all that hold joint states if None.
    rate : float, Hz, optional
        Sampling rate of logs without a time column.
    resample_rate : float, Hz, optional
        Rate of a regular clock; None uses the recorded one, or that of the positions if signals of
        one file have several. Faster signals are averaged over one step of it.
    missing : {"error", "drop"}, default="error"
        Rows with NaN or infinite values: refuse the log, or leave them out with a warning.
    placeholder : float, sequence of float, or mapping, optional
        Values that stand for failed reads and are taken for missing ones: ``9999`` in any signal,
        ``{"q": -1, "tau3": [0, 65535]}`` by quantity or column. Only values that are exactly equal
        are missing, also those that were measured; they are compared as in the file, and where none
        is equal in SI units. Rows with missing values are left out with a warning, as with
        ``missing="drop"``.
    split_gaps : float, s, "auto" or None, default="auto"
        A time step longer than this begins a new trajectory; ``"auto"``: longer than 20 median
        steps and 0.2 s, in logs that have no trajectory column of their own.
    split_dwells : float, s, optional
        Cut a trajectory in the middle of each rest longer than this.
    order : sequence of int or mapping, optional
        For each joint of the robot the number, from 1, of its column: ``[2, 1, 3]``; of one
        quantity only: ``{"tau": [2, 1, 3]}``.
    flip : sequence of str or int, default=()
        Signals whose sign is changed: a joint, by name or number, means its torque; ``"q3"`` its
        position with velocity and acceleration; ``"dq3"`` or ``"tau3"`` one column.
    combine : mapping of str to str, optional
        Sums of recorded columns that replace columns: ``{"tau6": "tau6+tau7", "tau7":
        "tau6-tau7"}`` for the torques of the motors of a differential; terms may have factors,
        ``"0.5*tau6-0.5*tau7"``.
    gain : mapping, optional
        Factors of columns or quantities: ``{"tau3": 0.02}``.
    summed : mapping of str to str, optional
        Positions that include that of another joint, such as angles relative to the base; the
        latter is subtracted, with velocity and acceleration: ``{"q3": "q2"}``, or ``{"q3":
        "-q2"}``.
    zero : mapping of str to float, optional
        Recorded positions at the robot's zero (rad or m), or velocities at rest, which are
        subtracted: ``{"q2": 1.5708}``.
    late : mapping of str to float, s, or (float, float), s and s/s, optional
        Delays of columns or quantities, which are removed: ``{"tau": 0.008}``; where clocks run at
        different rates, the delay at the beginning of every recording and its growth: ``{"tau":
        (0.013, 0.0005)}``.
    lowpass : mapping of str to float, s, optional
        Time constants of first-order low-pass filters of columns or quantities, which are undone:
        ``{"tau": 0.04}``. Noise added after the filter, such as quantization in the file, is
        amplified by the factor by which the filter reduces noise.
    gravity : sequence of 3 floats, m/s^2, or "none", optional
        Gravity in the base frame, for a robot on a wall or on a ceiling; ``"none"`` if it was
        removed from the torque. The log is checked with it, and it is kept in ``attrs``: a model or
        a diagnosis of a robot with another gravity refuses the log
        (:meth:`skidyn.robots.Robot.with_gravity`).
    unwrap : bool, default=False
        Remove jumps by a full turn from positions, or by the range of a counter that overflows,
        which is measured; recordings are moved by whole turns to be near each other.
    torque_sign : {"recorded", "command"}, default="recorded"
        ``"command"``: torques that are never negative get the sign of commanded minus measured
        position.
    clock : {"recorded", "regular"}, default="recorded"
        ``"regular"``: samples were taken at even steps, and only the stamps jitter, or are rounded;
        rows stay in their order where stamps go back by a few steps.
    drop_repeated : bool, default=False
        Leave out rows that repeat all positions of the previous row while joints move, or all
        torques if they are reported less often.
    split_leaps : bool, default=False
        Begin a new trajectory where positions jump farther than any velocity implies, as for joined
        recordings.
    restore_gravity : bool, default=False
        Add the gravity torque of ``robot`` to torque from which a driver removed it.
    derive : sequence of str, default=()
        Velocities that are replaced by differentiated positions: ``["dq3"]``, or ``["dq"]`` for
        all.
    needs_torque : bool, default=True
        Refuse a log without torque. False also reads logs of commands and positions, for which the
        torque is computed from the servos (:func:`skidyn.simulation.servo_torque`).
    check : bool, default=True
        Check the quality of the log (:func:`check_log`) and warn about problems. A log without
        torque is not checked.
    max_bytes : int
        Largest size of one file once unpacked.

    Returns
    -------
    DataFrame
        ``time`` (s), ``trajectory``, ``q1 .. qn`` (rad or m), ``dq1 .. dqn``, ``ddq1 .. ddqn``
        where recorded, ``tau1 .. taun`` (N m or N), ``temp1 .. tempn`` (degrees Celsius) where
        recorded, commanded positions ``cmd1 .. cmdn`` (rad or m) where recorded, then further
        numeric columns under their own names. ``attrs`` holds
        ``joint_names``, ``files`` (one per trajectory) and ``notes``, and ``gravity`` (m/s^2) if
        it was given.

    Raises
    ------
    LogError
        The log cannot be used unchanged; the message states the reason and the remedy.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from skidyn.logs import read_log
    >>> folder = tempfile.TemporaryDirectory()
    >>> file = pathlib.Path(folder.name, "log.csv")
    >>> rows = ["t;pos 1;vel 1;torque 1", "0,0;0,1;1;2,0", "0,1;0,2;1;2,1"]
    >>> _ = file.write_text(chr(10).join(rows))
    >>> read_log(file, check=False).columns.tolist()
    ['time', 'trajectory', 'q1', 'dq1', 'tau1']
    >>> folder.cleanup()
    """
    paths = _paths(path)
    if missing not in ("error", "drop"):
        raise LogError(f"missing is {missing!r}; expected 'error' or 'drop'.")
    _check_mapping("columns", columns, (str, int))
    _check_mapping("units", units, (str,))
    said: list[str] = []
    if gravity is not None:
        robot = turn_gravity(robot, gravity, said)
    options = TableOptions(
        robot,
        columns,
        units,
        drive_gains,
        rate,
        resample_rate,
        missing,
        split_gaps,
        split_dwells,
        Remedies(
            order=order,
            flip=flip,
            combine=combine,
            gain=gain,
            summed=summed,
            zero=zero,
            unwrap=unwrap,
            torque_sign=torque_sign,
            clock=clock,
            drop_repeated=drop_repeated,
            late=late,
            lowpass=lowpass,
            split_leaps=split_leaps,
            restore_gravity=restore_gravity,
            derive=derive,
            placeholder=placeholder,
        ),
        needs_torque,
    )
    frame = _joined(paths, options, lambda file: decode(file, topics, max_bytes))
    notes = said + frame.attrs["notes"]
    refuse_absent(notes)
    frame.attrs["notes"] = notes
    if gravity is not None and robot is not None:
        frame.attrs["gravity"] = robot.gravity.tolist()
    for note in notes:
        warn_about_log(note)
    if check and "tau1" in frame:
        _warn_about_quality(frame, robot)
    return frame


def _joined(
    paths: Sequence[PathLike], options: TableOptions, channels_of: Callable[[Path], list[Channel]]
) -> pd.DataFrame:
    """The recordings at all paths as one table; ``attrs`` has its joints, files and notes."""
    import pandas

    tables: list[pd.DataFrame] = []
    files: list[str] = []
    notes: list[str] = []
    joints: list[str] = []
    found = [run for item in paths for run in find_runs(item)]
    recordings = (
        recording for run in track(found, "Reading") for recording in read_runs(run, channels_of)
    )
    for name, channels in recordings:
        file = Path(name)
        table, match = build_table(channels, name, options)
        if tables:
            _refuse_other_columns(table, match.joint_names, tables[0], joints, file)
        joints = match.joint_names
        notes += dict.fromkeys(note.removeprefix(f"{file}: ") for note in match.notes)
        _, number = np.unique(table["trajectory"], return_inverse=True)
        if tables or len(found) > 1 or found[0].files[1:]:
            table["trajectory"] = number + len(files) + 1
        files += [str(file)] * (int(number.max()) + 1)
        tables.append(table)
    frame = pandas.concat(tables, ignore_index=True) if len(tables) > 1 else tables[0]
    notes = _told_once(notes, len(tables))
    frame.attrs = {"joint_names": joints, "files": files, "notes": notes}
    return frame


def _warn_about_quality(frame: pd.DataFrame, robot: Robot | None) -> None:
    quality = check_log(frame, robot)
    # wrong bodies of the description are not an error of the log; diagnose reports them
    told = [str(check) for check in quality.checks if check.check != "bodies"]
    for message in (*quality.faults, *told):
        warn_about_log(message)


def _paths(path: Any) -> list[PathLike]:
    """One path or several as a list."""
    if isinstance(path, (str, os.PathLike)):
        return [path]
    if hasattr(path, "columns"):
        raise LogError(
            "read_log was given a table; expected the path of a log, or several. A table needs no "
            "reading: pass it as it is, for example to check_log, or save it to a file and read "
            "that if its columns have other names or units."
        )
    several = list(path) if isinstance(path, Iterable) else [path]
    if not all(isinstance(item, (str, os.PathLike)) for item in several):
        raise LogError(f"path={path!r}; expected the path of a log, or a list of paths.")
    if not several:
        raise LogError("no file to read: the list of paths is empty.")
    return several


def _check_mapping(name: str, value: Any, kinds: tuple[type, ...]) -> None:
    """Refuse anything but an object of names, since a report or an option may be any JSON."""
    example = '{"q": ["pos_a", "pos_b"]}' if name == "columns" else '{"q": "deg"}'
    expected = LogError(f"{name} is {value!r}; expected an object such as {example}.")
    if value is None:
        return
    if not isinstance(value, Mapping):
        raise expected
    for target, content in value.items():
        several = name == "columns" and isinstance(content, (list, tuple))
        parts = content if several else [content]
        good = [isinstance(part, kinds) and not isinstance(part, bool) for part in parts]
        if not isinstance(target, str) or not all(good):
            raise expected


#: Text "k of n", or "k rows in place of n", in the notes of remedies.
_OF = re.compile(r"(\d+)( of | rows in place of )(\d+)")


def _counted(notes: Sequence[str]) -> dict[str, int]:
    """Number of files with each note; notes of remedies that differ only by counts are summed.

    >>> _counted(["flip: 1 of 3 rows", "cut", "flip: 2 of 4 rows"])
    {'flip: 3 of 7 rows': 2, 'cut': 1}
    """
    alike: dict[str, list[str]] = {}
    for note in notes:
        summed = note.startswith(REMEDIES) and _OF.search(note)
        alike.setdefault(_OF.sub("\0", note, count=1) if summed else note, []).append(note)
    counts: dict[str, int] = {}
    for key, same in alike.items():
        told = [_OF.search(note) for note in same] if "\0" in key else []
        pairs = [(int(hit[1]), int(hit[3])) for hit in told if hit]
        if pairs and told[0]:
            key = key.replace("\0", told[0][2].join(str(sum(n)) for n in zip(*pairs, strict=True)))
        counts[key] = len(same)
    return counts


def _told_once(notes: Sequence[str], n_files: int) -> list[str]:
    """Each note once, with its number of files.

    >>> _told_once(["no velocities", "cut", "no velocities"], 3)
    ['no velocities (2 of 3 files)', 'cut (1 of 3 files)']
    """
    counts = _counted(notes)
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
    """Check that the files of one log have the same signals of the same joints."""
    if list(joints) != list(first_joints):
        raise LogError(
            f"{file}: its joints ({', '.join(joints)}) are not those of the first file "
            f"({', '.join(first_joints)}). Pass robot= or columns= to specify how they correspond."
        )
    differing = sorted(set(map(str, table.columns)) ^ set(map(str, first.columns)))
    if differing:
        raise LogError(
            f"{file}: {', '.join(differing)} is in this file or in the first one but not in both."
        )
