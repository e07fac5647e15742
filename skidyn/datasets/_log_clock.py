# SPDX-License-Identifier: BSD-3-Clause
"""Time in logs: clocks, alignment of channels, and where one trajectory ends."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal

import numpy as np

from skidyn._exceptions import LogError
from skidyn._optional import import_optional
from skidyn._signals import GAP_STEPS, find_segments

if TYPE_CHECKING:
    import pandas as pd


def seconds(table: pd.DataFrame, rate: float | None, source: str) -> np.ndarray:
    """Clock of a table as float64: its time column, or row number over rate.

    Parameters
    ----------
    table : DataFrame
        Columns of one channel; ``time`` may hold numbers, dates or text of either.
    rate : float or None, Hz
        Sampling rate where there is no time column.
    source : str
        Name for messages.

    Returns
    -------
    ndarray of shape (n_samples,)
        Numbers in the unit of the source; dates become seconds from the first row.

    Raises
    ------
    LogError
        No clock at all, or one that cannot be read.
    """
    pd = import_optional("pandas", extra="io")
    if "time" not in table.columns:
        if rate is None:
            raise LogError(
                f"{source} has no time column. Name it with columns={{'time': ...}}, or pass rate= "
                f"(Hz) if sampling is regular. It has: {', '.join(map(str, table.columns))}."
            )
        return np.arange(len(table)) / rate
    column = table["time"]
    if column.dtype.kind in "iu" and len(column) and abs(int(column.iloc[0])) > 2**53:
        # nanoseconds since 1970 do not fit a float64 to the nanosecond; differences do
        return (column.to_numpy() - column.iloc[0]).astype(np.float64)
    if column.dtype.kind in "fiu":
        return column.to_numpy(dtype=np.float64)
    try:
        return pd.to_numeric(column).to_numpy(dtype=np.float64)
    except (TypeError, ValueError):
        pass
    try:
        stamps = pd.to_datetime(column, utc=True, format=None if _is_date(column) else "ISO8601")
    except (TypeError, ValueError) as error:
        raise LogError(
            f"{source}: the time column holds neither numbers nor dates: {error}"
        ) from None
    return (stamps - stamps.iloc[0]).dt.total_seconds().to_numpy(dtype=np.float64)


def _is_date(column: pd.Series) -> bool:
    return column.dtype.kind == "M"


def align_channels(
    tables: Sequence[pd.DataFrame],
    names: Sequence[str],
    rate: float | None,
    notes: list[str],
) -> pd.DataFrame:
    """Bring channels with clocks of their own to one clock.

    The clock is that of the channel with the positions, or regular at ``rate``; other signals are
    interpolated linearly, never beyond their first and last sample and never across a gap.

    Parameters
    ----------
    tables : sequence of DataFrame
        Channels with a ``time`` column in seconds.
    names : sequence of str
        Names of the channels for messages.
    rate : float or None, Hz
        Rate of the common clock.
    notes : list of str
        What was done is appended here.

    Returns
    -------
    DataFrame
        One table; values that a channel does not cover are NaN.

    Raises
    ------
    LogError
        A signal occurs in two channels, or the channels do not overlap in time.
    """
    pd = import_optional("pandas", extra="io")
    if len(tables) == 1 and rate is None:
        return tables[0]
    owner: dict[str, str] = {}
    for table, name in zip(tables, names, strict=True):
        for column in table.columns:
            if column != "time" and owner.setdefault(column, name) != name:
                raise LogError(
                    f"{column} is in {owner[column]} and in {name}; choose one with topics=[...]."
                )
    begin = max(table["time"].min() for table in tables)
    end = min(table["time"].max() for table in tables)
    if not end > begin:
        spans = ", ".join(
            f"{name}: {t['time'].min():.3f}..{t['time'].max():.3f} s"
            for t, name in zip(tables, names, strict=True)
        )
        raise LogError(f"the channels do not overlap in time ({spans}).")
    base = next((k for k, table in enumerate(tables) if "q1" in table.columns), 0)
    clock = tables[base]["time"].to_numpy()
    if rate is not None:
        clock = np.arange(begin, end, 1 / rate)
    inside = (clock >= begin) & (clock <= end)
    outside = int((~inside).sum())
    clock = clock[inside]
    parts = [pd.DataFrame({"time": clock})]
    for k, table in enumerate(tables):
        if k == base and rate is None:
            parts.append(table.loc[inside].drop(columns="time").reset_index(drop=True))
        else:
            parts.append(_interpolate(table, clock))
    if len(tables) > 1:
        grid = f"{rate:g} Hz" if rate is not None else names[base]
        told = f"channels {', '.join(names)} interpolated to the clock of {grid}"
        notes.append(f"{told}; {outside} row(s) outside their common time left out")
    return pd.concat(parts, axis=1)


def _interpolate(table: pd.DataFrame, clock: np.ndarray) -> pd.DataFrame:
    """Columns of a channel at other times; NaN where the channel has a gap."""
    pd = import_optional("pandas", extra="io")
    time = table["time"].to_numpy()
    order = np.argsort(time, kind="stable")
    time = time[order]
    steps = np.diff(time)
    right = np.clip(np.searchsorted(time, clock), 1, max(len(time) - 1, 1))
    hole = np.zeros(len(clock), dtype=bool)
    if len(steps):
        moving = steps[steps > 0]
        longest = GAP_STEPS * float(np.median(moving)) if len(moving) else np.inf
        near = np.minimum(np.abs(clock - time[right]), np.abs(clock - time[right - 1]))
        hole = (steps[right - 1] > longest) & (near > 1e-6 * longest)
    columns = {}
    for name in table.columns:
        if name == "time":
            continue
        values = np.interp(clock, time, table[name].to_numpy(dtype=float)[order])
        columns[name] = np.where(hole, np.nan, values)
    return pd.DataFrame(columns)


def split_at_restarts(time: np.ndarray) -> tuple[np.ndarray, int]:
    """Trajectory numbers for a log whose clock starts anew with every run.

    A step back to the beginning (within 5 % of what has passed) is a new run; a smaller step back
    is left for :func:`skidyn._checks.check_time_order` to refuse.

    Returns
    -------
    trajectory : ndarray of shape (n_samples,)
    restarts : int
        Number of times the clock started anew.
    """
    number = np.zeros(len(time), dtype=np.int64)
    begin = 0
    for row in np.flatnonzero(np.diff(time) < 0) + 1:
        passed = time[row - 1] - time[begin]
        if time[row] <= time[begin] + 0.05 * passed:
            number[row:] += 1
            begin = int(row)
    return number, int(number[-1]) if len(number) else 0


def split_trajectories(
    time: np.ndarray,
    trajectory: np.ndarray,
    position: np.ndarray,
    gap: float | Literal["auto"] | None,
    dwell: float | None,
) -> np.ndarray:
    """Cut trajectories at gaps in time and in the middle of long rests.

    Parameters
    ----------
    time : ndarray of shape (n_samples,), s
        Strictly increasing within each trajectory.
    trajectory : ndarray of shape (n_samples,)
        Numbers so far.
    position : ndarray of shape (n_samples, n_joints)
        Joint positions.
    gap : float, s, "auto" or None
        Longest step within a trajectory; ``"auto"``: 20 median steps, at least 0.2 s.
    dwell : float, s, or None
        Shortest rest that is cut.

    Returns
    -------
    ndarray of shape (n_samples,)
        New numbers from 0 in row order.
    """
    n = len(time)
    cut = np.zeros(n, dtype=bool)
    cut[1:] = trajectory[1:] != trajectory[:-1]
    steps = np.diff(time)
    if gap is not None and n > 1:
        inside = steps[~cut[1:]]
        longest = max(20 * float(np.median(inside)), 0.2) if gap == "auto" and len(inside) else gap
        if longest != "auto":
            cut[1:] |= steps > longest
    if dwell is not None:
        cut[_rest_middles(time, np.cumsum(cut), position, dwell)] = True
    return np.cumsum(cut)


def _rest_middles(
    time: np.ndarray, trajectory: np.ndarray, position: np.ndarray, dwell: float
) -> list[int]:
    """Rows in the middle of rests: no joint moves by more than 1e-4 of its range per step."""
    span = np.ptp(position, axis=0)
    still = np.all(np.abs(np.diff(position, axis=0)) <= 1e-4 * span + 1e-12, axis=1)
    still &= trajectory[1:] == trajectory[:-1]
    edges = np.flatnonzero(np.diff(np.r_[0, still.astype(int), 0]))
    middles = []
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        touches_border = first == 0 or last == len(time) - 1
        if time[last] - time[first] >= dwell and not touches_border:
            middles.append(int(first + last + 1) // 2)
    return middles


def derive_velocity(position: np.ndarray, time: np.ndarray, trajectory: np.ndarray) -> np.ndarray:
    """Central differences of the positions, within each segment.

    Raises
    ------
    LogError
        A segment of a single row, which has no velocity.
    """
    velocity = np.empty_like(position)
    for rows in find_segments(trajectory, time):
        if rows.stop - rows.start < 2:
            raise LogError(
                f"row {rows.start} stands alone between gaps, so no velocity can be derived for "
                "it; remove it or supply dq."
            )
        velocity[rows] = np.gradient(position[rows], time[rows], axis=0)
    return velocity
