# SPDX-License-Identifier: BSD-3-Clause
"""Conversion of the channels of one file to a clean table of signals in SI units."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from skidyn._checks import (
    SIGNAL_COLUMN,
    as_numbers,
    check_time_order,
    count_joints,
    handle_missing,
    require_columns,
)
from skidyn._exceptions import LogError
from skidyn._names import NameMatch, match_names
from skidyn._text import counted
from skidyn._units import convert_units, refuse_stated_units, units_of_joints
from skidyn.logs._clock import (
    align_channels,
    clocks,
    derive_velocity,
    order_stamps,
    put_together,
    split_at_restarts,
    split_trajectories,
)
from skidyn.logs._files import Channel
from skidyn.logs._placeholders import Placeholders
from skidyn.logs._remedies import Remedies, mend_columns, mend_rows, restore_gravity

if TYPE_CHECKING:
    import pandas as pd

    from skidyn.robots import Robot

ColumnMap = Mapping[str, str | int | Sequence[str | int]]
ORDER = ("q", "dq", "ddq", "tau", "temp", "cmd")
#: Beyond this, floating point cannot represent all whole numbers.
LARGEST_NUMBER = 2**53


@dataclass(frozen=True)
class TableOptions:
    """Options of ``read_log`` for the table."""

    robot: Robot | None = None
    columns: ColumnMap | None = None
    units: Mapping[str, str] | None = None
    drive_gains: float | Sequence[float] | None = None
    rate: float | None = None
    resample_rate: float | None = None
    missing: Literal["error", "drop"] = "error"
    split_gaps: float | Literal["auto"] | None = "auto"
    split_dwells: float | None = None
    remedies: Remedies = Remedies()
    needs_torque: bool = True

    @property
    def needed(self) -> tuple[str, ...]:
        """Required quantities of the log."""
        return ("q", "tau") if self.needs_torque else ("q",)


def build_table(
    channels: Sequence[Channel], source: str, options: TableOptions
) -> tuple[pd.DataFrame, NameMatch]:
    """Signals of one file, with the names of joints and notes that were matched on the way.

    The columns are ``time, trajectory, q1 .., dq1 .., [ddq1 ..], tau1 .., [temp1 ..]`` and further
    ones. ``source`` is the file in the LogError for a log that cannot be used unchanged.
    """
    failed = Placeholders(options.remedies.placeholder)
    match = match_names(
        list(dict.fromkeys(str(name) for c in channels for name in c.table.columns)),
        robot_joints=None if options.robot is None else options.robot.joint_names,
        columns=options.columns,
        source=source,
        listed=_listed_joints(channels),
    )
    refuse_stated_units(match.units, options.units or {}, source)
    tables = [_renamed(channel, match) for channel in channels]
    times = clocks(tables, options.rate, [_named(source, c) for c in channels])
    tables = [
        _in_si(table.assign(time=time), match, source, options, failed)
        for table, time in zip(tables, times, strict=True)
    ]
    _refuse_unused_units(tables, options.units or {}, source, match.notes)
    table = align_channels(tables, [c.name for c in channels], options.resample_rate, match.notes)
    lost = [told for told in match.notes if "without numbers" in told]
    n = count_joints(table, "; ".join([*lost, source]) if lost else source)
    if options.needs_torque or options.drive_gains is not None:
        table = _torque_from_current(table, n, options.drive_gains, source)
    require_columns(table, n, options.needed, source)
    stated = [c.attributes["joint_names"] for c in channels if "joint_names" in c.attributes]
    by_number = match.joint_names == [str(k + 1) for k in range(n)]
    if options.robot is None and by_number and stated and len(stated[0]) == n:
        match.joint_names = list(stated[0])
    table = mend_columns(table, n, match.joint_names, options.remedies, match.notes)
    if failed:
        table = failed.remove_rest(table)
        match.notes += failed.notes()
    return _in_order(_clean(table, n, match, source, options), n), match


def _named(source: str, channel: Channel) -> str:
    """A channel of a log for a message; the only one of a file has the name of the file."""
    name = str(channel.name)
    return source if name in source else f"{source} ({name})"


def _listed_joints(channels: Sequence[Channel]) -> dict[str, Sequence[str]]:
    """Joints that files list for their numbered columns, in their order, by column."""
    listed: dict[str, Sequence[str]] = {}
    for channel in channels:
        if names := channel.attributes.get("joint_names"):
            listed |= dict.fromkeys(map(str, channel.table.columns), names)
        listed |= channel.attributes.get("headers", {})
    return listed


def _renamed(channel: Channel, match: NameMatch) -> pd.DataFrame:
    """The columns of a channel under the names of a log."""
    new_name = {old: new for new, old in match.columns.items()}
    # a column that was not chosen must not have the name of a signal
    new_name |= {
        str(n): f"{n} of the file"
        for n in channel.table.columns
        if str(n) not in new_name and _quantity(str(n)) is not None
    }
    return channel.table.rename(columns=lambda name: new_name.get(str(name), str(name)))


def _in_si(
    table: pd.DataFrame,
    match: NameMatch,
    source: str,
    options: TableOptions,
    failed: Placeholders,
) -> pd.DataFrame:
    """The numeric columns of a table, in SI units."""
    signals = [name for name in table.columns if _quantity(name) is not None]
    table = as_numbers(table, signals, source)
    kept = [name for name in table.columns if table[name].dtype.kind in "fiub"]
    lost = [name for name in table.columns if name not in kept]
    if lost:
        match.notes.append(f"{source}: column(s) without numbers left out: {', '.join(lost)}")
    names = {name: _quantity(name) for name in kept}
    mine = {
        target: unit
        for target, unit in (options.units or {}).items()
        if target in names or target in names.values()
    }
    if options.robot is not None and options.remedies.order is None:
        mine = units_of_joints(mine, kept, options.robot, match.notes)
    return convert_units(failed.remove(table[kept]), mine)


def _quantity(name: str) -> str | None:
    """Quantity of a column of a log; None for further columns.

    >>> _quantity("dq3"), _quantity("time"), _quantity("volts")
    ('dq', 'time', None)
    """
    if name in ("time", "trajectory"):
        return name
    hit = re.fullmatch(r"(q|dq|ddq|tau|temp|i|cmd)\d+", name)
    return hit[1] if hit else None


def _refuse_unused_units(
    tables: Sequence[pd.DataFrame], units: Mapping[str, str], source: str, notes: list[str]
) -> None:
    """Refuse units of a missing quantity; those of derived velocities follow from the positions."""
    names = {str(name) for table in tables for name in table.columns}
    quantities = {_quantity(name) for name in names}
    if "q" in units and "cmd" in quantities and "cmd" not in units:
        notes.append(
            f"{source}: positions were converted from {units['q']}, commanded positions were not; "
            f"if these are in {units['q']} too: --units cmd={units['q']} (in Python: "
            f"units={{'cmd': '{units['q']}'}})"
        )
    for target in units:
        if target == "dq" and "dq" not in quantities:
            continue
        if target not in names and target not in quantities:
            raise LogError(f"units: {source} has no {target}; it has {', '.join(sorted(names))}.")


def _torque_from_current(
    table: pd.DataFrame, n: int, gains: float | Sequence[float] | None, source: str
) -> pd.DataFrame:
    """Torque columns from currents and gains; currents alone are never used as torques.

    The gains are one for each joint; that of a single joint may be a number.
    """
    import pandas as pd

    currents = [f"i{k + 1}" for k in range(n)]
    has_current = all(name in table.columns for name in currents)
    if gains is None:
        if has_current and "tau1" not in table.columns:
            raise LogError(
                f"{source} holds motor currents ({_first_to_last('i', n)}) and no torques. Pass "
                "drive_gains=[...] (--drive-gains on the command line), "
                "the torque per ampere of each joint at the joint (N m/A: torque constant times "
                "gear ratio)."
            )
        return table
    if not has_current:
        raise LogError(
            f"drive_gains is given, but {source} has no currents {_first_to_last('i', n)}. If its "
            "torque columns are currents, say so with columns={'i': [...]} (--columns 'i=name{i}' "
            "on the command line)."
        )
    try:
        factors = np.atleast_1d(np.asarray(gains, dtype=float))
    except (TypeError, ValueError):
        factors = np.zeros(0)
    if factors.shape != (n,) or not np.isfinite(factors).all():
        form = ", ".join(["0.62", "0.5", "..."][:n]) if n > 1 else "0.62"
        raise LogError(
            f"drive_gains is {gains!r}; expected {counted(n, 'finite number')}, one for each "
            f"joint: --drive-gains '[{form}]' (in Python: drive_gains=[{form}])."
        )
    torques = {f"tau{k + 1}": factors[k] * table[name] for k, name in enumerate(currents)}
    others = table.drop(columns=[name for name in torques if name in table.columns])
    return pd.concat([others, pd.DataFrame(torques, index=table.index)], axis=1)


def _first_to_last(quantity: str, n: int) -> str:
    """Names of the columns of a quantity.

    >>> _first_to_last("i", 1), _first_to_last("i", 6)
    ('i1', 'i1..i6')
    """
    return f"{quantity}1" if n == 1 else f"{quantity}1..{quantity}{n}"


def _clean(
    table: pd.DataFrame, n: int, match: NameMatch, source: str, options: TableOptions
) -> pd.DataFrame:
    """Rows in order of time, finite, cut into trajectories, with velocities."""
    import pandas as pd

    own_trajectories = "trajectory" in table.columns
    signals = [name for name in table.columns if SIGNAL_COLUMN.fullmatch(name)]
    keys = ["time", "trajectory"] if own_trajectories else ["time"]
    missing = "drop" if options.remedies.placeholder is not None else options.missing
    table = handle_missing(table, [*keys, *signals], missing, match.notes, source)
    if len(table) < 2:
        raise LogError(f"{source} has {len(table)} row(s); a log needs at least two.")
    if own_trajectories:
        number = _own_numbers(table["trajectory"].to_numpy(), source)
        together = put_together(number)
        if together is not None:
            table, number = table.iloc[together].reset_index(drop=True), number[together]
            match.notes.append(
                f"{source}: the rows of {len(np.unique(number))} trajectories alternate; those of "
                "each were put together"
            )
    else:
        number = _numbers_of_runs(table["time"].to_numpy(), match.notes, source)
    time = table["time"].to_numpy()
    table["trajectory"] = number
    if options.remedies.clock == "regular":
        time, back = order_stamps(time, number)
        if back:
            table["time"] = time
            match.notes.append(
                f"{source}: stamps of {back} row(s) were earlier than those of the row before; the "
                "order of the rows was kept"
            )
    keep = check_time_order(time, number, source)
    if not keep.all() and not _same_stamps(table, n, number, source, options):
        first = int(np.argmin(keep))
        match.notes.append(
            f"{source}: {int((~keep).sum())} of {len(keep)} rows repeat the time of the previous "
            f"row (first in row {first}); the first of each is kept."
        )
        table = table[keep].reset_index(drop=True)
    _split(table, n, own_trajectories, match, source, options)
    table = mend_rows(table, n, options.remedies, match.notes)
    if options.remedies.restore_gravity:
        table = restore_gravity(table, options.robot, match.notes)
    if not any(f"dq{k + 1}" in table.columns for k in range(n)):
        q = table[[f"q{k + 1}" for k in range(n)]].to_numpy()
        dq = derive_velocity(q, table["time"].to_numpy(), table["trajectory"].to_numpy())
        velocities = {f"dq{k + 1}": dq[:, k] for k in range(n)}
        table = pd.concat([table, pd.DataFrame(velocities, index=table.index)], axis=1)
        match.notes.append(f"{source}: no velocities recorded; derived by central differences of q")
    require_columns(table, n, ("dq", *options.needed), source)
    return table


def _own_numbers(number: np.ndarray, source: str) -> np.ndarray:
    """Trajectory numbers that the log has, as integers."""
    if np.any(number != np.round(number)):
        raise LogError(f"{source}: the trajectory column must hold whole numbers.")
    if len(number) and np.abs(number).max() > LARGEST_NUMBER:
        raise LogError(
            f"{source}: the trajectory column holds {number[np.abs(number).argmax()]:g}; only "
            f"numbers up to {LARGEST_NUMBER} are distinct. Number the trajectories from 1."
        )
    return number.astype(np.int64)


def _numbers_of_runs(time: np.ndarray, notes: list[str], source: str) -> np.ndarray:
    """Trajectory numbers by the restarts of the clock."""
    number, restarts = split_at_restarts(time)
    number += 1  # as files and joints are counted
    if restarts > len(time) / 2:
        raise LogError(
            f"{source}: time goes back in {restarts} of {len(time) - 1} steps (from "
            f"{time[0]:.6g} to {time[-1]:.6g}): the rows are in reverse order. Sort them by "
            "time."
        )
    if restarts:
        notes.append(
            f"{source}: the clock restarts {restarts} time(s); each run becomes a trajectory"
        )
    return number


def _same_stamps(
    table: pd.DataFrame, n: int, number: np.ndarray, source: str, options: TableOptions
) -> int:
    """Rows that seem to repeat the previous one only because of coarse stamps."""
    from skidyn.measurement import count_same_stamps, find_interleaved

    q = table[[f"q{k + 1}" for k in range(n)]].to_numpy()
    time = table["time"].to_numpy()
    same = count_same_stamps(time, q, number)
    merged = find_interleaved(time, q, number) if same else None
    if merged is not None:
        raise LogError(
            f"{source}: about {merged.rows:.0f} rows share each time, and from one row to the next "
            f"positions leap by {100 * merged.leap:.0f} % of their spread: recordings whose clock "
            "restarts were merged and sorted by time. Give the rows a column that names the "
            "recording (trajectory), or store every recording in a separate file."
        )
    if same and options.remedies.clock != "regular":
        raise LogError(
            f"{source}: {same} of {len(table)} rows have the time of the previous row although "
            "joints have moved: the time stamps are too coarse for the samples. If samples were "
            "taken at even steps: --clock regular (in Python: clock='regular')."
        )
    return same


def _split(
    table: pd.DataFrame,
    n: int,
    own_trajectories: bool,
    match: NameMatch,
    source: str,
    options: TableOptions,
) -> None:
    """Cut at gaps and rests in place, and note the number of pieces."""
    for name in ("split_gaps", "split_dwells"):
        if isinstance(value := getattr(options, name), bool):
            raise LogError(
                f"{name} is {value}; expected the time in s beyond which rows are split."
            )
    gap = options.split_gaps
    if own_trajectories and gap == "auto":
        gap = None
    if gap is None and options.split_dwells is None:
        return
    before = table["trajectory"].to_numpy()
    after = split_trajectories(
        table["time"].to_numpy(),
        before,
        table[[f"q{k + 1}" for k in range(n)]].to_numpy(),
        gap,
        options.split_dwells,
    )
    pieces = after[-1] + 1 - len(np.unique(before))
    if pieces > 0:
        table["trajectory"] = after + 1
        match.notes.append(
            f"{source}: cut at {pieces} gap(s) or rest(s) into {after[-1] + 1} trajectories"
        )


def _in_order(table: pd.DataFrame, n: int) -> pd.DataFrame:
    signals = [f"{quantity}{k + 1}" for quantity in ORDER for k in range(n)]
    first = ["time", "trajectory", *(name for name in signals if name in table.columns)]
    return table[[*first, *(name for name in table.columns if name not in first)]]
