# SPDX-License-Identifier: BSD-3-Clause
"""Checks that a table is a log; errors that would make all later results wrong are refused."""

from __future__ import annotations

import inspect
import re
import warnings
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Literal

import numpy as np

from skidyn._exceptions import LogError, LogWarning
from skidyn._text import counted

if TYPE_CHECKING:
    import pandas as pd

#: Columns of a log that hold numbers of one signal.
SIGNAL_COLUMN = re.compile(r"(q|dq|ddq|tau|temp|cmd)(\d+)")


def warn_about_log(message: str) -> None:
    """Issue a LogWarning that refers to the line outside skidyn that caused it."""
    level, frame = 1, inspect.currentframe()
    while frame is not None and frame.f_globals.get("__name__", "").startswith("skidyn."):
        level, frame = level + 1, frame.f_back
    warnings.warn(message, LogWarning, stacklevel=level)


def count_joints(frame: pd.DataFrame, source: str = "the log") -> int:
    """Number of joints of a log from its columns ``q1 .. qn``.

    A LogError, with the name ``source``, is raised if there are no positions, a joint has none, or
    a column occurs twice.
    """
    refuse_duplicates([str(name) for name in frame.columns], source)
    numbers = sorted(
        int(hit[1]) for name in frame.columns if (hit := re.fullmatch(r"q(\d+)", str(name)))
    )
    if not numbers:
        raise LogError(
            f"{source} has no joint positions. Recognised names are q1, q_<joint>, position_1 "
            "and similar ones; it has:"
            f" {', '.join(map(str, frame.columns))}. Name them with {_example(frame.columns)}."
        )
    if numbers != list(range(1, len(numbers) + 1)):
        absent = sorted(set(range(1, numbers[-1] + 1)) - set(numbers))
        raise LogError(
            f"{source} has q{numbers[-1]} but lacks {', '.join(f'q{k}' for k in absent)}."
        )
    return len(numbers)


#: Words in names of columns that hold no positions.
_OTHERS = re.compile(
    r"vel|speed|spd|dq|acc|tau|torque|eff|curr|force|temp|volt|cmd|des|target", re.I
)


def _example(columns: Iterable[object]) -> str:
    """The option that names positions, with numbered columns of the log if it has some.

    >>> _example(["time", "turn_A1", "turn_A2", "torque_A1", "torque_A2"])
    "--columns 'q=turn_A{i}' (in Python: columns={'q': 'turn_A{i}'})"
    """
    numbers: dict[str, set[int]] = {}
    for name in map(str, columns):
        if (hit := re.fullmatch(r"(.*?)(\d+)(\D*)", name)) and not _OTHERS.search(name):
            numbers.setdefault(f"{hit[1]}{{i}}{hit[3]}", set()).add(int(hit[2]))
    for name, own in numbers.items():
        first = min(own)
        if name != "{i}" and first < 2 <= len(own) and own == {first + k for k in range(len(own))}:
            return f"--columns 'q={name}' (in Python: columns={{'q': '{name}'}})"
    return "--columns 'q=first{i}' (in Python: columns={'q': ['first', 'second', ...]})"


def require_columns(
    frame: pd.DataFrame,
    n_joints: int,
    quantities: Sequence[str] = ("q", "tau"),
    source: str = "the log",
) -> None:
    """Raise a LogError unless the quantities are present for every joint and for no others."""
    names = [str(name) for name in frame.columns]
    present = {hit[1] for name in names if (hit := SIGNAL_COLUMN.fullmatch(name))}
    for quantity in dict.fromkeys([*quantities, *sorted(present)]):
        found = {
            int(hit[2]) for n in names if (hit := SIGNAL_COLUMN.fullmatch(n)) and hit[1] == quantity
        }
        missing = sorted(set(range(1, n_joints + 1)) - found)
        surplus = sorted(found - set(range(1, n_joints + 1)))
        if missing:
            needed = (
                f"needs {quantity}1" if n_joints == 1 else f"need {quantity}1..{quantity}{n_joints}"
            )
            servos = (
                " For position servos, their commands (cmd1..) can take the place of torque: "
                "skidyn diagnose --controller fit; in Python needs_torque=False and servo_torque."
            )
            raise LogError(
                f"{source} lacks {', '.join(f'{quantity}{k}' for k in missing)}: "
                f"{counted(n_joints, 'joint')} {needed}. It has: {', '.join(names)}."
                f"{servos if quantity == 'tau' and not found else ''}"
            )
        if surplus:
            raise LogError(
                f"{source} has {', '.join(f'{quantity}{k}' for k in surplus)}, but positions of "
                f"{n_joints} joint(s) only. Name the missing positions, or select the columns to "
                "use with columns={...}."
            )


def refuse_duplicates(names: Sequence[str], source: str) -> None:
    """Raise if a column name occurs twice."""
    twice = sorted(name for name, count in Counter(names).items() if count > 1 and name)
    if twice:
        raise LogError(
            f"{source}: the column(s) {', '.join(twice)} occur more than once. Rename or remove "
            "the surplus ones; the intended column cannot be determined."
        )


def as_numbers(frame: pd.DataFrame, names: Sequence[str], source: str = "the log") -> pd.DataFrame:
    """Copy with the named columns as float64; a LogError states a cell that is not a number."""
    import pandas as pd

    # All at once: the time for one column after another grows as the square of their number.
    columns = dict(frame.items())
    for name in names:
        column = frame[name]
        if column.dtype.kind in "fiub":
            columns[name] = column.astype(np.float64)
            continue
        if column.dtype.kind == "M":
            raise LogError(
                f"{source}: column {name!r} holds dates. Only the time column may hold dates; it "
                "is then converted to seconds since its first row."
            )
        cells = column.to_numpy(dtype=object)
        for row, cell in enumerate(cells):
            try:
                cells[row] = np.nan if cell is None else float(cell)
            except (TypeError, ValueError):
                raise LogError(
                    f"{source}: column {name!r} holds {cell!r} in row {row} where a number is "
                    "expected. Fix or remove that row, or leave the column out."
                ) from None
        columns[name] = pd.Series(cells.astype(np.float64), index=frame.index)
    return pd.DataFrame(columns)


def handle_missing(
    frame: pd.DataFrame,
    names: Sequence[str],
    missing: Literal["error", "drop"],
    notes: list[str],
    source: str = "the log",
) -> pd.DataFrame:
    """Refuse rows with NaN or infinite values, or drop them and append their number to ``notes``.

    A LogError is raised if such rows are not to be dropped, or no row is left.
    """
    finite = np.isfinite(frame[list(names)].to_numpy())
    bad = ~finite.all(axis=1)
    if not bad.any():
        return frame
    counts = {name: int(n) for name, n in zip(names, (~finite).sum(axis=0), strict=True) if n}
    told = ", ".join(f"{name}: {n}" for name, n in list(counts.items())[:8])
    told += ", ..." if len(counts) > 8 else ""
    message = (
        f"{source}: {int(bad.sum())} of {len(frame)} rows hold NaN or infinite values ({told}; "
        f"first in row {int(np.argmax(bad))})."
    )
    if "time" in names and not finite[:, list(names).index("time")].any():
        raise LogError(
            f"{message} No row has a time: state the sampling rate with --rate (in Python: "
            "rate=...), or name another column with --columns time=NAME (in Python: "
            "columns={'time': NAME})."
        )
    if missing == "error" and not bad.all():
        raise LogError(
            f"{message} Fix them, or leave these rows out with --missing drop (in Python: "
            "missing='drop'); derivatives and filters then do not cross the gaps."
        )
    if bad.all():
        raise LogError(
            f"{message} No row is left; fix them, or leave out the columns without values with "
            "--columns (in Python: columns=...)."
        )
    notes.append(
        f"missing: {int(bad.sum())} of {len(frame)} rows with NaN or infinite values were left out"
    )
    kept: pd.DataFrame = frame[~bad].reset_index(drop=True)
    return kept


#: Most steps of a clock by which jittering stamps go back: more is another recording.
FEW_STEPS = 5.0


def stamps_jitter(time: np.ndarray, trajectory: np.ndarray) -> bool:
    """Whether time goes backwards within trajectories, and only by a few steps.

    >>> stamps_jitter(np.array([0.0, 0.1, 0.22, 0.21, 0.4]), np.zeros(5, int))
    True
    >>> stamps_jitter(np.array([0.0, 0.1, 0.2, 0.3, 0.0, 0.1]), np.zeros(6, int))
    False
    """
    same = trajectory[1:] == trajectory[:-1]
    steps = np.diff(time)[same]
    forward = steps[steps > 0]
    if not len(forward) or len(forward) < len(steps) / 2 or not np.any(steps < 0):
        return False
    # a restart after a few rows is a new recording, unless there are many steps forward
    least = min(FEW_STEPS, len(forward) / 2)
    order = np.lexsort((time, trajectory))
    sorted_steps = np.diff(time[order])[np.diff(trajectory[order]) == 0]
    usual = np.median(sorted_steps[sorted_steps > 0])  # steps between shuffled rows are long
    return bool(steps.min() > -least * usual)


def _refuse_trajectories_that_come_again(
    time: np.ndarray, trajectory: np.ndarray, source: str
) -> None:
    """Refuse a trajectory whose rows begin anew elsewhere, as of a log appended to itself."""
    order = np.argsort(trajectory, kind="stable")
    steps = np.diff(time[order])
    again = (np.diff(trajectory[order]) == 0) & (np.diff(order) > 1) & (steps < 0)
    if again.any():
        before, row = order[int(np.argmax(again)) : int(np.argmax(again)) + 2]
        raise LogError(
            f"{source}: trajectory {trajectory[row]} comes again in row {row}, at "
            f"{time[row]:.6g} s, after {time[before]:.6g} s in row {before}. Give every recording "
            "a number of its own, and remove those that are there twice"
        )


def check_time_order(
    time: np.ndarray, trajectory: np.ndarray, source: str = "the log"
) -> np.ndarray:
    """Rows to keep so that time increases strictly within each trajectory.

    A row with the time of the previous row is left out; a LogError is raised if time goes
    backwards, which offers even steps if it does so by the jitter of stamps only.
    """
    same = trajectory[1:] == trajectory[:-1]
    steps = np.diff(time)
    back = np.flatnonzero(same & (steps < 0))
    if len(back):
        row = int(back[0]) + 1
        places = (
            f"{source}: time goes backwards in {len(back)} place(s), first in row {row} "
            f"({time[row]:.6g} s after {time[row - 1]:.6g} s, trajectory {trajectory[row]})"
        )
        if stamps_jitter(time, trajectory):
            raise LogError(
                f"{places}, by no more than a few steps: the stamps jitter, or rows are out of "
                "order. If the rows are in the order of the samples, which were taken at even "
                "steps: --clock regular (in Python: clock='regular'); otherwise sort them by time."
            )
        raise LogError(
            f"{places}. If a new recording begins there, give the rows a trajectory column; if the "
            "rows are out of order, sort them by time."
        )
    _refuse_trajectories_that_come_again(time, trajectory, source)
    advances: np.ndarray = np.r_[True, ~(same & (steps == 0))]
    return advances
