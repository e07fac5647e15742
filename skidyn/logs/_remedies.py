# SPDX-License-Identifier: BSD-3-Clause
"""Remedies for a log with wrong signals: each is requested, counted and noted."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from skidyn._exceptions import LogError
from skidyn._repeated import is_repeated
from skidyn._signals import find_segments
from skidyn._text import counted
from skidyn.logs._placeholders import Placeholder

if TYPE_CHECKING:
    import pandas as pd

    from skidyn.robots import Robot

#: Quantities whose sign changes with that of the position of a joint.
MOTION = ("q", "dq", "ddq", "cmd")
QUANTITIES = (*MOTION, "tau", "temp")
#: Share of the largest torque below zero that a magnitude may reach.
BELOW = 0.01


@dataclass(frozen=True)
class Remedies:
    """Requested remedies of ``read_log``."""

    order: Sequence[int] | Mapping[str, Sequence[int]] | None = None
    flip: Sequence[str | int] = ()
    combine: Mapping[str, str] | None = None
    gain: Mapping[str, float] | None = None
    summed: Mapping[str, str] | None = None
    zero: Mapping[str, float] | None = None
    unwrap: bool = False
    torque_sign: Literal["recorded", "command"] = "recorded"
    clock: Literal["recorded", "regular"] = "recorded"
    drop_repeated: bool = False
    late: Mapping[str, float | tuple[float, float]] | None = None
    lowpass: Mapping[str, float] | None = None
    split_leaps: bool = False
    restore_gravity: bool = False
    derive: Sequence[str] = ()
    placeholder: Placeholder | None = None


#: Beginnings of the notes of remedies; the last three are options of their own.
REMEDIES = tuple(f"{f.name}:" for f in fields(Remedies)) + ("gravity:", "missing:", "resample:")


def mend_columns(
    table: pd.DataFrame, n: int, joints: Sequence[str], remedies: Remedies, notes: list[str]
) -> pd.DataFrame:
    """Order, sign, scale, sums and zero of columns; what was done is appended to ``notes``.

    A LogError is raised if a joint or column does not exist, an order or a sum is invalid, a gain
    is zero or not finite, a position includes itself, or there are no commanded positions for the
    sign.
    """
    table = table.copy(deep=False)  # whole columns are replaced
    if remedies.order is not None:
        _reorder(table, n, remedies.order, notes)
    if remedies.torque_sign not in ("recorded", "command"):
        raise LogError(
            f"torque_sign is {remedies.torque_sign!r}; expected 'recorded' or 'command'."
        )
    if remedies.torque_sign == "command":
        _sign_from_command(table, n, notes)
    for item in remedies.flip:
        columns = _flipped(item, table, joints)
        for name in columns:
            table[name] = -table[name]
        notes.append(f"flip: the sign of {', '.join(columns)} was changed in {_all(table)} rows")
    if remedies.combine:
        _combine(table, remedies.combine, notes)
    for name, value in _each(remedies.gain, table, "gain"):
        if not np.isfinite(value) or value == 0:
            raise LogError(f"gain: {name} cannot be multiplied by {value}; expected a number.")
        table[name] = value * table[name]
        notes.append(f"gain: {name} was multiplied by {value:g} in {_all(table)} rows")
    if remedies.summed:
        _take_apart(table, n, remedies.summed, notes)
    for name, value in _each(remedies.zero, table, "zero"):
        if not np.isfinite(value):
            raise LogError(f"zero: {name} has the value {value} at zero; expected a number.")
        if not re.fullmatch(r"d?q\d+", name):
            raise LogError(
                f"zero: {name} is neither a position nor a velocity; expected q1 .. q{n} or "
                f"dq1 .. dq{n}."
            )
        for column in {name, re.sub("^q", "cmd", name)}:
            if column in table.columns:
                table[column] = table[column] - value
        notes.append(f"zero: {value:g} was subtracted from {name} in {_all(table)} rows")
    return table


def turn_gravity(
    robot: Robot | None, gravity: Sequence[float] | Literal["none"], notes: list[str]
) -> Robot:
    """The robot with another gravity; what was done is appended to ``notes``.

    A LogError is raised without a robot, a RobotDescriptionError for an invalid gravity.
    """
    if robot is None:
        raise LogError("gravity is that of a robot; give robot=.")
    turned = robot.with_gravity(gravity)
    x, y, z = turned.gravity
    notes.append(f"gravity: ({x:g}, {y:g}, {z:g}) m/s^2 in the base frame in all checks")
    return turned


def restore_gravity(table: pd.DataFrame, robot: Robot | None, notes: list[str]) -> pd.DataFrame:
    """Add the gravity torque of the described bodies, which a driver had subtracted.

    A LogError is raised without a robot or gravity torque; what was done is appended to ``notes``.
    """
    if robot is None:
        raise LogError("restore_gravity adds the gravity torque of a robot; give robot=.")
    n = robot.n_joints
    pull = robot.gravity_torque(table[[f"q{k + 1}" for k in range(n)]].to_numpy(dtype=float))
    if not np.any(pull):
        raise LogError(
            "restore_gravity has no effect: no joint of the robot carries weight, or its gravity "
            "is zero."
        )
    names = [f"tau{k + 1}" for k in range(n)]
    notes.append(f"restore_gravity: the gravity torque was added in {_all(table)} rows")
    restored = table[names].to_numpy() + pull
    return table.assign(**dict(zip(names, restored.T, strict=True)))


def mend_rows(table: pd.DataFrame, n: int, remedies: Remedies, notes: list[str]) -> pd.DataFrame:
    """Clock, repeated rows, delay and wrapped positions of a log in order of time.

    What was done is appended to ``notes``. A LogError is raised if the name of the clock is unknown
    or a channel does not exist.
    """
    names = [f"q{k + 1}" for k in range(n)]
    if remedies.unwrap:
        table = _unwrapped(table, names, notes)
    if remedies.split_leaps:
        table = _split_at_leaps(table, names, notes)
    if remedies.drop_repeated:
        table = _without_repeated(table, n, notes)
    if remedies.clock not in ("recorded", "regular"):
        raise LogError(f"clock is {remedies.clock!r}; expected 'recorded' or 'regular'.")
    if remedies.clock == "regular":
        from skidyn.measurement import regular_clock

        time = table["time"].to_numpy()
        even = regular_clock(time, table["trajectory"].to_numpy(), table[names].to_numpy(float))
        table = table.assign(time=even)
        notes.append(
            f"clock: {int(np.sum(np.abs(even - time) > 1e-9))} of {len(time)} stamps were moved to "
            "even steps"
        )
    if remedies.lowpass:
        table = _without_lowpass(table, remedies.lowpass, notes)
    if remedies.late:
        from skidyn.preprocessing import advance_channels  # needed only here; imports scikit-learn

        before = len(table)
        delays = {name: _delay(name, value) for name, value in remedies.late.items()}
        _each(dict.fromkeys(delays, 0.0), table, "late")  # their columns exist
        try:
            table = advance_channels(table, delays)
        except ValueError as error:
            raise LogError(f"late: {error}") from error
        told = ", ".join(f"{name} by {_in_words(*both)}" for name, both in delays.items())
        notes.append(
            f"late: {told} removed; {before - len(table)} of {before} rows at the ends of "
            "continuous parts left out"
        )
    if remedies.derive:
        table = _with_derived(table, remedies.derive, notes)
    return table


def _all(table: pd.DataFrame) -> str:
    """Text of a count of all rows, in the form of other notes."""
    return f"{len(table)} of {len(table)}"


def _reorder(
    table: pd.DataFrame,
    n: int,
    order: Sequence[int] | Mapping[str, Sequence[int]],
    notes: list[str],
) -> None:
    if isinstance(order, Mapping):
        told = dict(order)
        if (together := told.pop("motion", None)) is not None:
            there = [q for q in MOTION if f"{q}1" in table.columns]
            told = {**dict.fromkeys(there, together), **told}
        orders: Mapping[str, Sequence[int]] = told
    else:
        orders = dict.fromkeys(QUANTITIES, order)
    for quantity, numbers in orders.items():
        if quantity not in QUANTITIES:
            raise LogError(
                f"order: {quantity!r} is none of motion (all of {', '.join(MOTION)}), "
                f"{', '.join(QUANTITIES)}."
            )
        if sorted(numbers) != list(range(1, n + 1)):
            raise LogError(
                f"order: {list(numbers)} is not an order of {counted(n, 'joint')}; expected every "
                f"number from 1 to {n} once: for each joint of the robot the column that holds it."
            )
        columns = [f"{quantity}{k}" for k in numbers]
        if not set(columns) <= set(table.columns):
            if isinstance(order, Mapping):
                raise LogError(f"order: the log has no {quantity}1 .. {quantity}{n}.")
            continue
        table[[f"{quantity}{k + 1}" for k in range(n)]] = table[columns].to_numpy()
    if not isinstance(order, Mapping):
        orders = {"all signals": order}
    said = [
        f"columns of {', '.join(q for q in orders if list(orders[q]) == numbers)} were put in the "
        f"order {numbers}"
        for numbers in map(list, dict.fromkeys(map(tuple, orders.values())))
    ]
    notes.append(f"order: {', '.join(said)} in {_all(table)} rows")


#: One term of a sum of columns.
_TERM = re.compile(r"([+-]?)(?:(\d+\.?\d*(?:e-?\d+)?|\.\d+)\*)?([A-Za-z_]\w*)")


def _combine(table: pd.DataFrame, sums: Mapping[str, str], notes: list[str]) -> None:
    """Sums of recorded columns in the place of columns, such as of the motors of a differential."""
    recorded = table.copy()
    for name, said in sums.items():
        text = str(said).replace(" ", "")
        terms = _TERM.findall(text)
        unsigned = any(not sign for sign, _, _ in terms[1:])
        if not terms or unsigned or "".join(_TERM.sub("", text).split()):
            raise LogError(
                f"combine: {name}={said} is not a sum of columns; expected for example "
                "tau6=tau6+tau7, or tau6=0.5*tau6-0.5*tau7."
            )
        for column in (name, *(column for _, _, column in terms)):
            if column not in recorded.columns or column in ("time", "trajectory"):
                raise LogError(
                    f"combine: {name}={said}: the log has no signal {column}; it has "
                    f"{', '.join(map(str, recorded.columns))}."
                )
        table[name] = sum(
            (-1.0 if sign == "-" else 1.0) * float(factor or 1.0) * recorded[column]
            for sign, factor, column in terms
        )
        notes.append(f"combine: {name} was replaced by {text} in {_all(table)} rows")


def _take_apart(table: pd.DataFrame, n: int, summed: Mapping[str, str], notes: list[str]) -> None:
    """Subtract the recorded position of another joint from positions that include it."""
    recorded = table.copy()
    for name, other in summed.items():
        own, held = re.fullmatch(r"q(\d+)", name), re.fullmatch(r"(-?)q(\d+)", str(other))
        if own is None or held is None or own[1] == held[2]:
            raise LogError(
                f"summed: {name}={other} does not name a position and the position of another "
                "joint that it includes; expected for example q3=q2, or q3=-q2 if the other is "
                "subtracted from it."
            )
        joint, sign, before = own[1], -1.0 if held[1] else 1.0, held[2]
        if max(int(joint), int(before)) > n or min(int(joint), int(before)) < 1:
            raise LogError(f"summed: {name}={other}: the log has q1 .. q{n}.")
        for quantity in MOTION:
            columns = f"{quantity}{joint}", f"{quantity}{before}"
            if set(columns) <= set(table.columns):
                table[columns[0]] = recorded[columns[0]] - sign * recorded[columns[1]]
        notes.append(f"summed: {other} was subtracted from {name} in {_all(table)} rows")


def _flipped(item: str | int, table: pd.DataFrame, joints: Sequence[str]) -> list[str]:
    """Columns whose sign changes: of one column, of the motion of a joint, or its torque."""
    name = str(item)
    if name in joints:
        name = f"tau{list(joints).index(name) + 1}"
    elif name.isdigit():
        name = f"tau{name}"
    hit = re.fullmatch(r"(q|dq|ddq|tau|cmd)(\d+)", name)
    if hit is None or name not in table.columns:
        raise LogError(
            f"flip: {item!r} is neither a joint ({', '.join(joints)}) nor a column such as q1, dq1 "
            "or tau1."
        )
    if hit[1] != "q":
        return [name]
    return [f"{quantity}{hit[2]}" for quantity in MOTION if f"{quantity}{hit[2]}" in table.columns]


def _each(
    values: Mapping[str, float] | None, table: pd.DataFrame, option: str
) -> list[tuple[str, float]]:
    """Columns and values; a quantity means all its joints."""
    told: list[tuple[str, float]] = []
    for name, value in (values or {}).items():
        joints = [c for c in table.columns if re.fullmatch(rf"{re.escape(name)}\d+", str(c))]
        if name not in table.columns and not joints:
            raise LogError(
                f"{option}: the log has no {name}; it has {', '.join(map(str, table.columns))}."
            )
        columns = [name] if name in table.columns else joints
        told += [(column, float(value)) for column in columns]
    return told


def _delay(name: str, value: object) -> tuple[float, float]:
    """Delay at the beginning of recordings, s, and its growth, s/s, of a number or two."""
    parts: list[Any] = list(value) if isinstance(value, (tuple, list)) else [value, 0.0]
    good = len(parts) == 2 and all(
        isinstance(x, (int, float, np.number)) and np.isfinite(x) for x in parts
    )
    if not good or parts[1] <= -1:  # the clock would stand still, or run backwards
        raise LogError(
            f"late: the delay of {name} is {value}; expected seconds, such as 0.008, or seconds at "
            "the beginning of a recording and their growth per second, such as (0.013, 0.0005), "
            "which is 0.013+0.0005*t on the command line."
        )
    return float(parts[0]), float(parts[1])


def _in_words(lag: float, growth: float) -> str:
    """A delay with its growth."""
    return f"{1e3 * lag:g} ms" + (f" and {1e3 * growth:g} ms more per second" if growth else "")


def _with_derived(table: pd.DataFrame, asked: Sequence[str], notes: list[str]) -> pd.DataFrame:
    """Differentiated positions in the place of recorded velocities."""
    from skidyn.logs._clock import derive_velocity

    time, number = table["time"].to_numpy(), table["trajectory"].to_numpy()
    columns = [name for name, _ in _each(dict.fromkeys(asked, 0.0), table, "derive")]
    for name in columns:
        if not re.fullmatch(r"dq\d+", name):
            raise LogError(f"derive: {name} is not a velocity; expected dq, or dq1, dq2, ...")
    q = table[[name[1:] for name in columns]].to_numpy(dtype=float)
    derived = derive_velocity(q, time, number)
    notes.append(
        f"derive: {', '.join(columns)} {'was' if len(columns) == 1 else 'were'} replaced by "
        "differences of the positions in "
        f"{_all(table)} rows"
    )
    return table.assign(**{name: derived[:, k] for k, name in enumerate(columns)})


def _sign_from_command(table: pd.DataFrame, n: int, notes: list[str]) -> None:
    absent = [f"cmd{k + 1}" for k in range(n) if f"cmd{k + 1}" not in table.columns]
    if absent:
        raise LogError(
            f"torque_sign='command' needs the commanded positions; the log has no "
            f"{', '.join(absent)}. Name them with --columns 'cmd=goal_{{i}}' (in Python: "
            "columns={'cmd': [...]})."
        )
    turned, signless = 0, 0
    for k in range(1, n + 1):
        if table[f"tau{k}"].min() < -BELOW * table[f"tau{k}"].max():
            continue  # it has its sign
        sign = np.sign(table[f"cmd{k}"] - table[f"q{k}"])
        torque = np.abs(table[f"tau{k}"]) * sign
        turned += int(np.sum(torque < 0))
        signless += 1
        table[f"tau{k}"] = torque
    notes.append(
        f"torque_sign: torques of {signless} joint(s) that were never negative have the sign of "
        f"commanded minus measured position; {turned} of {signless * len(table)} values became "
        "negative"
    )


def _unwrapped(table: pd.DataFrame, names: Sequence[str], notes: list[str]) -> pd.DataFrame:
    """Positions without jumps by a full turn, or by the range of a counter, in parts and between.

    A wrapped position hides in which turn a part begins. All parts are moved by whole turns to be
    near the one of the largest range, since the range of a joint is limited. The size of equal
    jumps is measured: a counter may overflow at another range than a turn.
    """
    from skidyn.measurement import wrap_period

    time, number = table["time"].to_numpy(), table["trajectory"].to_numpy()
    parts = find_segments(number, time)
    changed: dict[str, np.ndarray] = {}
    moved = 0
    others = np.zeros(len(table), dtype=bool)
    ranges = ""
    for name in names:
        q = table[name].to_numpy(dtype=float).copy()
        turn = wrap_period(q, number) or 2 * np.pi
        for rows in parts:
            q[rows] = np.unwrap(q[rows], period=turn)
        if np.array_equal(q, table[name]):
            continue
        low, high = (np.array([end(q[rows]) for rows in parts]) for end in (np.min, np.max))
        middle, widest = (low + high) / 2, int(np.argmax(high - low))
        turns = np.round((middle - middle[widest]) / turn)
        for rows, whole in zip(parts, turns, strict=True):
            q[rows] -= turn * whole
        if turn != 2 * np.pi:
            ranges += f"; those of {name} are by {turn:.6g}, the range of a counter"
        moved += int(np.count_nonzero(turns))
        others |= q != table[name].to_numpy(dtype=float)
        changed[name] = q
    told = ", ".join(changed) or "no position"
    apart = f"; {moved} of {len(changed) * len(parts)} parts were moved by whole turns" * bool(
        moved
    )
    notes.append(
        f"unwrap: jumps by a full turn were removed from {told} in "
        f"{int(others.sum())} of {len(table)} rows{apart}{ranges}"
    )
    return table.assign(**changed)


def _split_at_leaps(table: pd.DataFrame, names: Sequence[str], notes: list[str]) -> pd.DataFrame:
    from skidyn.measurement import find_leaps

    number = table["trajectory"].to_numpy()
    rows = find_leaps(table[names].to_numpy(dtype=float), table["time"].to_numpy(), number)
    cut = np.zeros(len(table), dtype=np.int64)
    cut[1:] = number[1:] != number[:-1]
    cut[rows] = 1
    notes.append(
        f"split_leaps: {len(rows)} of {len(table)} rows after a jump of positions begin a new "
        "trajectory"
    )
    return table.assign(trajectory=np.cumsum(cut) + 1)


def _without_lowpass(
    table: pd.DataFrame, constants: Mapping[str, float], notes: list[str]
) -> pd.DataFrame:
    """Undo first-order low passes within intervals without gaps."""
    from skidyn.measurement import without_lowpass

    time, number = table["time"].to_numpy(dtype=float), table["trajectory"].to_numpy()
    changed: dict[str, np.ndarray] = {}
    for name, constant in _each(constants, table, "lowpass"):
        if name in ("time", "trajectory") or not np.isfinite(constant) or constant <= 0:
            raise LogError(
                f"lowpass: got {name} and {constant:g} s; expected a signal and the positive time "
                "constant of its low-pass filter, such as tau=0.04."
            )
        values = table[name].to_numpy(dtype=float).copy()
        for rows in find_segments(number, time):
            if np.any(np.diff(time[rows]) <= 0):
                raise LogError(
                    "lowpass: time does not increase; fix the clock first (clock='regular')."
                )
            values[rows] = without_lowpass(time[rows], values[rows], constant)
        changed[name] = values
        notes.append(
            f"lowpass: a filter of {1e3 * constant:g} ms was undone in {_all(table)} of {name}"
        )
    return table.assign(**changed)


def _without_repeated(table: pd.DataFrame, n: int, notes: list[str]) -> pd.DataFrame:
    from skidyn.measurement import idle_rows, is_held, lost_parts

    q = table[[f"q{k + 1}" for k in range(n)]].to_numpy(dtype=float)
    number = table["trajectory"].to_numpy()
    velocities = [f"dq{k + 1}" for k in range(n)]
    if set(velocities) <= set(table.columns):
        dq = table[velocities].to_numpy(dtype=float)
    else:
        dq = np.gradient(q, axis=0)
    again = is_repeated(q, dq, number)
    torques = [f"tau{k + 1}" for k in range(n)]
    if set(torques) <= set(table.columns):
        moved = np.any(q[1:] != q[:-1], axis=1) & (number[1:] == number[:-1])
        torque = table[torques].to_numpy(dtype=float)
        again |= is_held(torque, moved)
        again |= lost_parts(q, torque, number)
        again |= idle_rows(q, dq, torque, table["time"].to_numpy(dtype=float), number)
    notes.append(f"drop_repeated: {int(again.sum())} of {len(q)} rows left out")
    return table[~again].reset_index(drop=True)
