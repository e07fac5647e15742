# SPDX-License-Identifier: BSD-3-Clause
"""Time in logs: clocks, alignment of channels, and borders of trajectories."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from skidyn._checks import stamps_jitter
from skidyn._exceptions import LogError
from skidyn._signals import GAP_STEPS, find_segments, rates_of, runs_of
from skidyn.logs._bounds import MAX_BYTES

if TYPE_CHECKING:
    import pandas as pd


#: A clock is slower than a channel if its step is longer than this many of the channel's.
SLOWER = 1.75
#: Mean number of rows of a trajectory after which another follows, if they alternate.
ALTERNATE = 5


def clocks(
    tables: Sequence[pd.DataFrame], rate: float | None, sources: Sequence[str]
) -> list[np.ndarray]:
    """Clocks of the channels of a file as float64: their time columns, or row number over rate.

    ``time`` may hold numbers, in the unit of the source, or dates, which become seconds from the
    first row of the earliest channel, or text of either. ``sources`` are the names in the LogError
    for a clock that is missing or cannot be read, or an invalid rate.
    """
    read = [_clock(table, rate, source) for table, source in zip(tables, sources, strict=True)]
    begins = [begin for _, begin in read if begin is not None]
    if len(begins) < 2 or len({type(begin) for begin in begins}) > 1:
        return [since for since, _ in read]
    return [since if begin is None else since + _apart(begin, min(begins)) for since, begin in read]


def _by_position(table: pd.DataFrame) -> str:
    """How columns of a file without a header are chosen; empty for one with a header."""
    if not all(str(name).isdigit() for name in table.columns):
        return ""
    return (
        " The file has no header: give the positions of columns, from 0, as in --columns "
        "time=0,q=1-6,tau=13-18 (in Python: columns={'time': 0, 'q': [1, ...]})."
    )


def _apart(begin: Any, earliest: Any) -> float:
    """Time from the earliest first stamp to another one."""
    apart = begin - earliest
    return float(apart) if isinstance(apart, int) else float(apart.total_seconds())


def _clock(table: pd.DataFrame, rate: float | None, source: str) -> tuple[np.ndarray, Any]:
    """Clock of one table, and the stamp from which it counts; None if it begins at its own zero."""
    import pandas

    empty = "time" in table.columns and bool(table["time"].isna().all()) and len(table) > 0
    if "time" not in table.columns or (empty and rate is not None):
        if rate is None:
            raise LogError(
                f"{source} has no time column. Name it with --columns time=NAME (in Python: "
                "columns={'time': NAME}), or give --rate (rate=) in Hz if sampling is regular. It "
                f"has: {', '.join(map(str, table.columns))}.{_by_position(table)}"
            )
        if not (np.isfinite(rate) and rate > 0):
            raise LogError(f"rate is {rate}; expected a rate in Hz above zero.")
        return np.arange(len(table)) / rate, None
    column = table["time"]
    if column.dtype.kind in "iu" and len(column) and abs(int(column.iloc[0])) > 2**53:
        # nanoseconds since 1970 do not fit a float64 to the nanosecond; differences do
        since: np.ndarray = column.to_numpy() - column.iloc[0]
        return since.astype(np.float64), int(column.iloc[0])
    if column.dtype.kind == "m":
        return _since(column)
    if column.dtype.kind in "fiu":
        return np.asarray(column, dtype=np.float64), None
    if not _is_date(column):  # pandas converts dates to numbers in its own unit
        try:
            return np.asarray(pandas.to_numeric(column), dtype=np.float64), None
        except (TypeError, ValueError):
            pass
        try:  # durations such as 0 days 00:00:01.25
            return _since(pandas.to_timedelta(column))
        except (TypeError, ValueError):
            pass
    try:
        stamps = pandas.to_datetime(
            column, utc=True, format=None if _is_date(column) else "ISO8601"
        )
    except (TypeError, ValueError) as error:
        raise LogError(
            f"{source}: the time column holds neither numbers nor dates: {error}"
        ) from None
    return _since(stamps)


def _since(stamps: Any) -> tuple[np.ndarray, Any]:
    """Seconds since the first of some dates or durations, and this first one."""
    import pandas

    first = stamps.iloc[0] if len(stamps) else None
    since = np.asarray((stamps - first).dt.total_seconds(), dtype=np.float64)
    return since, None if pandas.isna(first) else first


def _is_date(column: pd.Series) -> bool:
    return column.dtype.kind == "M"


def align_channels(
    tables: Sequence[pd.DataFrame],
    names: Sequence[str],
    rate: float | None,
    notes: list[str],
) -> pd.DataFrame:
    """Bring channels with separate clocks, ``time`` in s, to one clock, on the rows that all cover.

    The clock is that of the channel with the positions, or regular at ``rate`` in Hz; other signals
    are interpolated linearly, never beyond their first and last sample and never across a gap.
    Notes are appended to ``notes``. A LogError is raised if the rate is invalid, a signal occurs in
    two channels, the clock of one of several channels restarts, or channels do not overlap in time.
    """
    import pandas

    if rate is not None and not (np.isfinite(rate) and rate > 0):
        raise LogError(f"resample_rate is {rate}; expected a rate in Hz above zero.")
    if len(tables) == 1 and rate is None:
        return tables[0]
    for table, name in zip(tables, names, strict=True):
        unread = np.flatnonzero(~np.isfinite(table["time"].to_numpy()))
        if len(unread):
            raise LogError(
                f"the clock of {name} is not a number in row {unread[0]} ({len(unread)} such rows)"
                "; remove these rows before signals are interpolated."
            )
    if len(tables) == 1:
        assert rate is not None
        return _resampled(tables[0], rate, notes)
    _refuse_ambiguous(tables, names)
    begin, end = _common_time(tables, names)
    if rate is not None:
        _refuse_too_fast(np.array([begin, end]), rate, sum(len(t.columns) for t in tables))
    base = next((k for k, table in enumerate(tables) if "q1" in table.columns), 0)
    clock = tables[base]["time"].to_numpy() if rate is None else np.arange(begin, end, 1 / rate)
    common = (clock >= begin) & (clock <= end)
    covered = common.copy()
    for table in tables:
        covered &= ~_in_gap(table["time"].to_numpy(), clock)
    rows = clock[covered]
    parts = [pandas.DataFrame({"time": rows})]
    for k, table in enumerate(tables):
        if k == base and rate is None:
            parts.append(table.loc[covered].drop(columns="time").reset_index(drop=True))
        else:
            parts.append(_interpolate(table, rows))
    grid = f"{rate:g} Hz" if rate is not None else names[base]
    step = float(np.median(np.diff(rows))) if len(rows) > 1 else 0.0
    faster = [n for t, n in zip(tables, names, strict=True) if _slower(step, t["time"].to_numpy())]
    if faster:
        grid += f" ({', '.join(faster)} averaged over its steps)"
    notes.append(
        f"channels {', '.join(names)} interpolated to the clock of {grid}; {int((~common).sum())} "
        f"row(s) outside their common time and {int((common & ~covered).sum())} in gaps left out"
    )
    joined: pd.DataFrame = pandas.concat(parts, axis=1)
    return joined


def _refuse_ambiguous(tables: Sequence[pd.DataFrame], names: Sequence[str]) -> None:
    """Refuse a signal that two channels have, and a clock that goes back."""
    owner: dict[str, str] = {}
    for table, name in zip(tables, names, strict=True):
        for column in table.columns:
            if column != "time" and owner.setdefault(column, name) != name:
                raise LogError(
                    f"{column} is in {owner[column]} and in {name}; choose one with "
                    "topics=[...] (--topics on the command line)."
                )
        restarts = np.flatnonzero(np.diff(table["time"].to_numpy()) < 0)
        if len(restarts):
            raise LogError(
                f"the clock of {name} goes back in row {restarts[0] + 1}: the corresponding rows "
                "of the other channels cannot be determined. Store every run in a separate file."
            )


def _common_time(tables: Sequence[pd.DataFrame], names: Sequence[str]) -> tuple[Any, Any]:
    """Begin and end of the time that all channels cover, s."""
    begin = max(table["time"].min() for table in tables)
    end = min(table["time"].max() for table in tables)
    if not end > begin:
        spans = ", ".join(
            f"{name}: {t['time'].min():.3f}..{t['time'].max():.3f} s"
            for t, name in zip(tables, names, strict=True)
        )
        raise LogError(f"the channels do not overlap in time ({spans}).")
    return begin, end


def _resampled(table: pd.DataFrame, rate: float, notes: list[str]) -> pd.DataFrame:
    """One table on a regular clock within each of its runs."""
    import pandas

    time = table["time"].to_numpy()
    _refuse_too_fast(time, rate, len(table.columns))
    run = np.zeros(len(time), dtype=np.int64)
    run[1:] = np.cumsum(np.diff(time) < 0)
    if "trajectory" in table.columns:
        number = table["trajectory"].to_numpy()
        run[1:] += np.cumsum(number[1:] != number[:-1])
    parts, lonely = [], 0
    gaps: list[tuple[float, float]] = []  # length and beginning, s
    for rows in find_segments(run, time):
        part = table.iloc[rows]
        if rows.start and run[rows.start] == run[rows.start - 1]:
            before = time[rows.start - 1]
            gaps.append((float(time[rows.start] - before), float(before)))
        first, last = time[rows][0], time[rows][-1]
        if not last > first:
            lonely += len(part)
            continue
        # a last sample that is a rounding error short of the grid is on the grid
        clock = first + np.arange(int((last - first) * rate + 1e-6) + 1) / rate
        parts.append(_interpolate(part, np.minimum(clock, last)).assign(time=clock))
    if not parts:
        raise LogError("the log has no two consecutive samples, so it cannot be resampled.")
    alone = f"; {lonely} isolated row(s) left out" if lonely else ""
    if gaps:
        longest, begin = max(gaps)
        alone += (
            f"; {len(gaps)} gap(s) in time, the longest of {longest:.3g} s from {begin:.6g} s on, "
            "cannot be resampled and remain"
        )
    how = "averaged" if _slower(1 / rate, time) else "interpolated"
    regular: pd.DataFrame = pandas.concat(parts, ignore_index=True)
    notes.append(
        f"resample: {how} to {rate:g} Hz within {len(parts)} run(s) without a gap, {len(regular)} "
        f"rows in place of {len(time)}{alone}"
    )
    return regular


def _refuse_too_fast(time: np.ndarray, rate: float, n_columns: int) -> None:
    """Refuse a rate at which the log would not fit the bound of a file in memory."""
    last, first = float(np.max(time, initial=-np.inf)), float(np.min(time, initial=np.inf))
    rows = max(0.0, last - first) * rate
    if 8 * rows * n_columns > MAX_BYTES:
        raise LogError(
            f"resample_rate is {rate:g} Hz, at which the log would have {rows:.3g} rows; give a "
            "rate in Hz near the recorded one."
        )


def _in_gap(time: np.ndarray, clock: np.ndarray) -> np.ndarray:
    """Mask of times of a clock in a gap of a channel."""
    steps = np.diff(time)
    moving = steps[steps > 0]
    if not len(moving):
        return np.zeros(len(clock), dtype=bool)
    longest = GAP_STEPS * float(np.median(moving))
    right = np.clip(np.searchsorted(time, clock), 1, len(time) - 1)
    near = np.minimum(np.abs(clock - time[right]), np.abs(clock - time[right - 1]))
    return np.asarray((steps[right - 1] > longest) & (near > 1e-6 * longest))


def _interpolate(table: pd.DataFrame, clock: np.ndarray) -> pd.DataFrame:
    """Columns of a channel at other times; numbers of trajectories are not mixed.

    On a slower clock a value is the mean over one of its steps: in single samples, noise and
    vibration faster than the clock would appear as slow motion.
    """
    import pandas

    time = table["time"].to_numpy()
    before = np.clip(np.searchsorted(time, clock, side="right") - 1, 0, len(time) - 1)
    half = _half_step(time, clock)
    columns = {}
    for name in table.columns:
        if name == "trajectory":
            columns[name] = table[name].to_numpy()[before]
        elif name != "time":
            values = table[name].to_numpy(dtype=float)
            columns[name] = np.interp(clock, time, values)
            if half is not None:
                wide = half > 0
                columns[name][wide] = _mean_around(time, values, clock[wide], half[wide])
    then: pd.DataFrame = pandas.DataFrame(columns)
    return then


def _slower(step: float, time: np.ndarray) -> bool:
    """Whether a clock of such steps is slower than that of a channel."""
    return len(time) > 1 and step > SLOWER * float(np.median(np.diff(time)))


def _half_step(time: np.ndarray, clock: np.ndarray) -> np.ndarray | None:
    """Half the averaging span, limited by ends and gaps; None unless the clock is slower."""
    step = float(np.median(np.diff(clock))) if len(clock) > 1 else 0.0
    if not _slower(step, time):
        return None
    parts = find_segments(np.zeros(len(time)), time)
    begins = np.array([time[part.start] for part in parts])
    ends = np.array([time[part.stop - 1] for part in parts])
    own = np.clip(np.searchsorted(begins, clock, side="right") - 1, 0, None)
    room = np.minimum(clock - begins[own], ends[own] - clock)
    half: np.ndarray = np.clip(room, 0.0, 0.5 * step)
    return half


def _mean_around(
    time: np.ndarray, values: np.ndarray, clock: np.ndarray, half: np.ndarray
) -> np.ndarray:
    """Mean of the line through the samples over ``clock - half`` to ``clock + half``."""
    missing = ~np.isfinite(values)
    line = np.where(missing, 0.0, values)
    steps = np.diff(time)
    area = np.r_[0.0, np.cumsum(steps * (line[1:] + line[:-1]) / 2)]
    slope = np.divide(np.diff(line), steps, out=np.zeros(len(steps)), where=steps > 0)

    def until(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        k = np.clip(np.searchsorted(time, t, side="right") - 1, 0, len(steps) - 1)
        on = t - time[k]
        return k, area[k] + on * (line[k] + on * slope[k] / 2)

    (first, low), (last, high) = until(clock - half), until(clock + half)
    mean = (high - low) / (2 * half)
    count = np.r_[0, np.cumsum(missing)]
    touched = count[np.minimum(last + 2, len(values))] > count[first]
    return np.where(touched, np.nan, mean)


def order_stamps(time: np.ndarray, trajectory: np.ndarray) -> tuple[np.ndarray, int]:
    """Stamps in ascending order for rows that stay as recorded, and how many went back.

    Only stamps that jitter by a few steps are ordered; those of other logs are returned as they
    are.
    """
    if not stamps_jitter(time, trajectory):
        return time, 0
    back = int(np.sum((np.diff(time) < 0) & (trajectory[1:] == trajectory[:-1])))
    ordered = np.array(time, dtype=float)
    for rows in find_segments(trajectory):
        ordered[rows] = np.sort(ordered[rows])
    return ordered, back


def put_together(trajectory: np.ndarray) -> np.ndarray | None:
    """Order of rows in which those of each trajectory follow each other; None if they do.

    Only trajectories that alternate in nearly every row are put together: a number that occurs
    again later is another part of it.
    """
    blocks = 1 + int(np.sum(trajectory[1:] != trajectory[:-1]))
    if blocks <= max(len(trajectory) / ALTERNATE, 2 * len(np.unique(trajectory))):
        return None
    return np.argsort(trajectory, kind="stable")


def split_at_restarts(time: np.ndarray) -> tuple[np.ndarray, int]:
    """Trajectory numbers for a log whose clock restarts with every run, and the number of restarts.

    A step back to the beginning (within 5 % of what has passed) is a new run; a smaller step back
    is left for :func:`skidyn._checks.check_time_order` to refuse.
    """
    number = np.zeros(len(time), dtype=np.int64)
    begin = 0
    if stamps_jitter(time, number):
        return number, 0  # also in the first rows of a log
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
    """Cut trajectories at gaps in time and in the middle of long rests; new numbers from 0.

    Time in s increases strictly within each trajectory. ``gap`` is the longest step within one, s;
    ``"auto"`` means 20 median steps, at least 0.2 s. ``dwell`` is the shortest rest that is cut, s.
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


#: A rest: all positions stay within this share of their range for as long as a rest is long.
STILL = 2e-3


def _rest_middles(
    time: np.ndarray, trajectory: np.ndarray, position: np.ndarray, dwell: float
) -> list[int]:
    """Rows in the middle of rests: for at least ``dwell`` s no joint leaves its band of noise.

    The band, and not the step from row to row, distinguishes a rest with a noisy encoder from slow
    motion.
    """
    if len(time) < 3:
        return []
    # second differences are nearly all noise: their median size is 1.65 of its deviation
    noise = np.median(np.abs(np.diff(position, n=2, axis=0)), axis=0) / 1.65
    band = STILL * np.ptp(position, axis=0) + 8 * noise + 1e-12
    middles = []
    borders = np.flatnonzero(np.diff(trajectory)) + 1
    for first, last in zip(np.r_[0, borders], np.r_[borders, len(time)], strict=True):
        t, q = time[first:last], position[first:last]
        ends = np.searchsorted(t, t + dwell - 1e-9)  # first row that is a rest away from each
        still = np.zeros(len(t) + 1, dtype=np.int64)
        for begin in np.flatnonzero(_stays(q, ends, band)):
            still[begin] += 1
            still[ends[begin] + 1] -= 1
        resting = np.cumsum(still)[:-1] > 0
        middles += [
            int(first + (begin + end) // 2)
            for begin, end in zip(*runs_of(resting), strict=True)
            if begin > 0 and end < len(t)  # a rest at the border cuts nothing
        ]
    return middles


def _stays(q: np.ndarray, ends: np.ndarray, band: np.ndarray) -> np.ndarray:
    """Whether all joints stay in their bands from each row to the row where its rest would end."""
    from scipy.ndimage import maximum_filter1d, minimum_filter1d  # only a log in one piece needs it

    stays = ends < len(q)
    length = np.minimum(ends, len(q) - 1) - np.arange(len(q)) + 1
    size = int(np.median(length)) if len(length) else 1
    for j in range(q.shape[1]):
        # windows of the usual length; uneven clocks make a rest a little shorter or longer
        high = maximum_filter1d(q[:, j], size, origin=-((size - 1) // 2))
        low = minimum_filter1d(q[:, j], size, origin=-((size - 1) // 2))
        stays &= high - low <= band[j]
    return stays


def derive_velocity(position: np.ndarray, time: np.ndarray, trajectory: np.ndarray) -> np.ndarray:
    """Central differences of the positions within each segment, which needs more than one row."""
    segments = find_segments(trajectory, time)
    alone = next((rows.start for rows in segments if rows.stop - rows.start < 2), None)
    if alone is not None:
        raise LogError(
            f"row {alone} is isolated between gaps, so no velocity can be derived for it; remove "
            "it or supply dq."
        )
    return rates_of(position, time, segments)
