# SPDX-License-Identifier: BSD-3-Clause
"""Recordings of several files: folders, globs, one file per signal, LeRobot data sets."""

from __future__ import annotations

import glob
import json
import os
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from skidyn._checks import warn_about_log
from skidyn._exceptions import LogError
from skidyn._names import is_signal, quantity_of
from skidyn.logs._files import Channel
from skidyn.logs._formats import known_suffixes, suffix_of

#: A list of names beside the tables of a recording.
NAMES = re.compile(r".*joints?[_-]?(list|names?)?\.(txt|csv)", re.IGNORECASE)

#: Text beside the tables of a recording that is no table.
TEXTS = re.compile(r"(readme|licen[cs]e|changelog|citation)\b.*\.txt", re.IGNORECASE)


@dataclass(frozen=True)
class Run:
    """Files of one recording: a single one, or one per signal; with a name for messages.

    ``joints`` are names of the joints, if a file in the folder lists them.
    """

    name: str
    files: list[Path]
    joints: list[str] = field(default_factory=list)


def find_runs(path: str | os.PathLike[str]) -> list[Run]:
    """Recordings of a path: the file itself, the matches of a pattern, or the files of a folder.

    They are in the order of their names. A LogError is raised if there are none.
    """
    given = Path(path)
    if not given.exists() and glob.has_magic(str(path)):
        matches = sorted(glob.glob(str(path), recursive=True))
        if not matches:
            raise LogError(f"{path}: no file matches this pattern.")
        return [run for match in matches for run in find_runs(match)]
    if not given.is_dir() or (given / "metadata.yaml").exists():
        return [Run(str(given), [given])]
    if (given / "meta" / "info.json").exists():
        return _lerobot_runs(given)
    names = [f for f in sorted(given.iterdir()) if f.is_file() and NAMES.fullmatch(f.name)]
    files = [
        f
        for f in sorted(given.iterdir())
        if f.is_file()
        and f not in names
        and suffix_of(f) in known_suffixes()
        and not TEXTS.match(f.name)
    ]
    if files:
        joints = names[0].read_text(encoding="utf-8").split() if names else []
        return [Run(str(given), files, joints)]
    inside = [folder for folder in sorted(given.iterdir()) if folder.is_dir()]
    runs = [run for folder in inside if _holds_logs(folder) for run in find_runs(folder)]
    if not runs:
        raise LogError(
            f"{given}: the folder holds no log. Known are {' '.join(known_suffixes())}, "
            "LeRobot data sets and ROS 2 bags."
        )
    return runs


def files_of(path: str | os.PathLike[str]) -> list[Path]:
    """Files that :func:`find_runs` finds, those of bags one by one; none if it finds nothing."""
    try:
        files = [file for run in find_runs(path) for file in run.files]
    except LogError:
        return []
    inside = [sorted(file.rglob("*")) if file.is_dir() else [file] for file in files]
    return [file for part in inside for file in part if file.is_file()]


def _holds_logs(folder: Path) -> bool:
    files = [*folder.iterdir(), *folder.glob("*/*")]
    return any(suffix_of(f) in known_suffixes() or f.name == "metadata.yaml" for f in files)


def _lerobot_runs(folder: Path) -> list[Run]:
    """Files of a LeRobot data set, and the names of its motors."""
    try:
        info = json.loads((folder / "meta" / "info.json").read_text(encoding="utf-8"))
        names = info.get("features", {}).get("observation.state", {}).get("names") or []
    except (ValueError, AttributeError, RecursionError) as error:
        raise LogError(f"{folder / 'meta' / 'info.json'}: cannot be read: {error}") from None
    if isinstance(names, dict):  # {"motors": [...]} in older versions
        names = next(iter(names.values()), [])
    joints = [str(name).removesuffix(".pos") for name in names if isinstance(name, str)]
    files = sorted((folder / "data").rglob("*.parquet"))
    if not files:
        raise LogError(
            f"{folder}: a LeRobot data set without data/**/*.parquet; download its data too."
        )
    return [Run(str(file), [file], joints) for file in files]


def read_runs(run: Run, read: Callable[[Path], list[Channel]]) -> list[tuple[str, list[Channel]]]:
    """Name and channels of every recording in the files of a run, each read by ``read``.

    Files with both positions and torques, or with the same columns, are separate recordings; others
    are channels of one recording, and a file named after a signal contains that signal.
    """
    channels = [[_named(c, run) for c in read(file)] for file in run.files]
    if len(run.files) == 1:
        return [(run.name, channels[0])]
    pairs = _with_signals(list(zip(run.files, channels, strict=True)))
    if _are_recordings(pairs):
        return [(str(file), own) for file, own in pairs]
    pairs = _with_clocks(pairs)
    return [(run.name, _side_by_side([_as_signal(c, f) for f, own in pairs for c in own]))]


def _with_signals(pairs: list[tuple[Path, list[Channel]]]) -> list[tuple[Path, list[Channel]]]:
    """Files without those, as of parameters, that have no signal and another number of rows."""

    def has_signal(file: Path, own: list[Channel]) -> bool:
        names = [str(name) for c in own for name in c.table.columns]
        return _of_one_signal(file) is not None or any(quantity_of(name) for name in names)

    signals = [own for file, own in pairs if has_signal(file, own)]
    lengths = {len(c.table) for own in signals for c in own}
    kept = []
    for file, own in pairs:
        if not signals or has_signal(file, own) or lengths & {len(c.table) for c in own}:
            kept.append((file, own))
        else:
            warn_about_log(f"{file}: left out, since no column of it is a signal.")
    return kept


def _with_clocks(pairs: list[tuple[Path, list[Channel]]]) -> list[tuple[Path, list[Channel]]]:
    """The same; a first column that all files without a header share and that grows is the time."""
    tables = [c.table for _, own in pairs for c in own]
    first = [table.iloc[:, 0].to_numpy() for table in tables]
    if not all(
        list(map(str, table.columns)) == [str(k) for k in range(max(2, len(table.columns)))]
        and np.array_equal(clock, first[0])
        and np.all(np.diff(clock) > 0)
        for table, clock in zip(tables, first, strict=True)
    ):
        return pairs
    return [
        (file, [replace(c, table=c.table.rename(columns={"0": "time"})) for c in own])
        for file, own in pairs
    ]


def _are_recordings(pairs: Sequence[tuple[Path, list[Channel]]]) -> bool:
    """Whether each file is a recording, instead of a signal of one."""
    if all(_is_whole(own) and not is_signal(_stem(file)) for file, own in pairs):
        return True
    columns = [[list(map(str, c.table.columns)) for c in own] for _, own in pairs]
    alike = all(other == columns[0] for other in columns)  # the user names columns of all of them
    return alike and not all(_of_one_signal(file) for file, _ in pairs)


def _named(channel: Channel, run: Run) -> Channel:
    joints = run.joints or channel.attributes.get("joint_names", [])
    attributes = channel.attributes | ({"joint_names": joints} if joints else {})
    return replace(channel, attributes=attributes)


def _is_whole(channels: Sequence[Channel]) -> bool:
    """Whether positions and torques, or currents, are in these channels."""
    found = {quantity_of(str(name)) for c in channels for name in c.table.columns}
    return "q" in found and bool({"tau", "i"} & found)


def _of_one_signal(file: Path) -> str | None:
    """Quantity in the name of a file."""
    return quantity_of(_stem(file))


def _stem(file: Path) -> str:
    return file.name.partition(".")[0]


def _as_signal(channel: Channel, file: Path) -> Channel:
    """A channel of a file that is named after a signal, with columns of this name."""
    quantity = _of_one_signal(file)
    if quantity is None or quantity == "trajectory":
        return channel
    columns = list(channel.table.columns)
    found = {name: quantity_of(str(name)) for name in columns}
    # positions in "commands.csv" are commanded ones; every other column keeps its own name
    foreign = [n for n in columns if found[n] not in ("time", "trajectory", quantity)]
    if quantity == "time":
        return replace(channel, table=channel.table.rename(columns={columns[0]: "time"}))
    numeric = [n for n in foreign if channel.table[n].dtype.kind in "fiub"]
    if any(found[n] == quantity for n in columns):
        return channel
    ahead = numeric[0] if numeric and found.get(numeric[0]) is None else None
    if ahead is not None and str(ahead).lower() in ("", "index", "unnamed: 0"):
        numeric = numeric[1:]
    names = {name: f"{quantity}{k + 1}" for k, name in enumerate(numeric)}
    attributes = channel.attributes
    if not any(found[name] is not None or str(name).isdigit() for name in numeric):
        # the header names joints
        header = [str(name) for name in numeric]
        attributes = attributes | {"headers": dict.fromkeys(names.values(), header)}
    return replace(channel, table=channel.table.rename(columns=names), attributes=attributes)


def _side_by_side(channels: Sequence[Channel]) -> list[Channel]:
    """Merge channels without a clock with the one with a clock and equally many rows."""
    import pandas

    def has_clock(channel: Channel) -> bool:
        return any(quantity_of(str(name)) == "time" for name in channel.table.columns)

    clocked = [c for c in channels if has_clock(c)] or list(channels[:1])
    joined: dict[int, list[Any]] = {id(c): [c.table] for c in clocked}
    headers: dict[int, dict[str, list[str]]] = {
        id(c): dict(c.attributes.get("headers", {})) for c in clocked
    }
    for channel in channels:
        if channel in clocked:
            continue
        partner = next((c for c in clocked if len(c.table) == len(channel.table)), None)
        if partner is None:
            raise LogError(
                f"{channel.name} has no time column and {len(channel.table)} rows, other than "
                f"{', '.join(f'{c.name} ({len(c.table)})' for c in clocked)}: corresponding rows "
                "cannot be determined."
            )
        joined[id(partner)].append(channel.table.reset_index(drop=True))
        headers[id(partner)] |= channel.attributes.get("headers", {})
    return [
        replace(
            c,
            table=pandas.concat(joined[id(c)], axis=1) if len(joined[id(c)]) > 1 else c.table,
            attributes=c.attributes | {"headers": headers[id(c)]},
        )
        for c in clocked
    ]
