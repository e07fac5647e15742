# SPDX-License-Identifier: BSD-3-Clause
"""The signals of a log for regressor columns and effects."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from skidyn._columns import Columns, ColumnSpec, column_names, resolve_columns, trajectory_numbers
from skidyn._exceptions import ColumnError, LogError

if TYPE_CHECKING:
    from skidyn.robots import Robot

Array = NDArray[np.float64]

#: Velocity below which the direction of dry friction is smooth, as a share of ``unit_velocity``.
SIGN_BLUR = 0.003
#: A time step longer than this many median steps is a gap.
GAP_STEPS = 5.0
#: Whole trajectories are held out if there are more than this many, else blocks of them: at least
#: two of each, and this many together.
FEW_TRAJECTORIES, FEWEST_BLOCKS = 6, 8
#: Standard deviation of a normal distribution over the median of its absolute values.
MAD = 1.4826


def find_segments(trajectory: NDArray[Any], time: Array | None = None) -> list[slice]:
    """Contiguous runs of rows of the same trajectory without a gap in time, in row order.

    A step of time (s) that is negative or longer than 5 median steps of its trajectory starts a new
    segment.
    """
    n = len(trajectory)
    if n == 0:
        return []
    starts = np.flatnonzero(trajectory[1:] != trajectory[:-1]) + 1
    edges = [0, *starts.tolist(), n]
    if time is not None and n > 1:
        gaps = [
            a + 1 + _gaps(np.diff(time[a:b])) for a, b in zip(edges[:-1], edges[1:], strict=True)
        ]
        edges = np.unique(np.concatenate([edges, *gaps])).tolist()
    return [slice(int(a), int(b)) for a, b in zip(edges[:-1], edges[1:], strict=True)]


def blocks_held_out(n_trajectories: int) -> int:
    """Number of blocks of every trajectory that are held out one at a time.

    >>> blocks_held_out(12), blocks_held_out(5), blocks_held_out(1)
    (1, 2, 8)
    """
    if n_trajectories > FEW_TRAJECTORIES:
        return 1
    return max(2, -(-FEWEST_BLOCKS // max(1, n_trajectories)))


def scatter(values: Array, axis: int | None = None) -> Any:
    """Standard deviation around zero of normal values among which there are outliers.

    >>> round(float(scatter(np.array([-1.0, 0.5, 1.0, 90.0]))), 4)
    1.4826
    """
    return MAD * np.median(np.abs(values), axis=axis)


def runs_of(mask: NDArray[np.bool_]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """First rows of the runs of true rows in a mask, and the rows after their last ones.

    >>> runs_of(np.array([True, False, True, True]))
    (array([0, 2]), array([1, 4]))
    """
    edges = np.flatnonzero(np.diff(np.r_[0, mask.astype(int), 0]))
    return edges[::2], edges[1::2]


def rates_of(values: Array, time: Array, segments: Iterable[slice]) -> Array:
    """Rates per s of channels (n_samples, n_channels) by central differences, segment by segment.

    Time, in s, increases in every segment; the rate is zero in segments of a single row.
    """
    rates = np.zeros(values.shape)
    for rows in segments:
        if rows.stop - rows.start > 1:
            rates[rows] = np.gradient(values[rows], time[rows], axis=0)
    return rates


def joined(parts: Sequence[Array]) -> Array:
    """Arrays one after another; the same one if it is alone."""
    return parts[0] if len(parts) == 1 else np.concatenate(parts)


def _gaps(steps: Array) -> NDArray[np.intp]:
    """Steps back, and steps much longer than most of the same trajectory."""
    if not len(steps) or 0 < steps.max() <= GAP_STEPS * steps.min():
        return np.zeros(0, dtype=np.intp)  # their median is no less than the shortest one
    forward = steps[steps > 0]
    longest = GAP_STEPS * np.median(forward) if len(forward) else np.inf
    return np.flatnonzero((steps < 0) | (steps > longest))


class _Later:
    """Field whose value may be given as a function, which is called when it is first read."""

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = f"_{name}"

    def __get__(self, signals: Signals | None, owner: type) -> Array | None:
        if signals is None:
            return None  # default of the field
        value = self.stored(signals)
        if callable(value):
            value = signals.__dict__[self._name] = value()
        found: Array | None = value
        return found

    def __set__(self, signals: Signals, value: Any) -> None:
        signals.__dict__[self._name] = value

    def stored(self, signals: Signals) -> Any:
        """The value, or the function if it was not read yet."""
        return signals.__dict__[self._name]


@dataclass(frozen=True)
class Signals:
    """Motion of a robot and accompanying signals, one row per sample.

    Attributes
    ----------
    q, dq, ddq : ndarray of shape (n_samples, n_joints)
        Position (rad or m), velocity (rad/s or m/s), acceleration (rad/s^2 or m/s^2).
    trajectory : ndarray of shape (n_samples,)
        Trajectory number.
    time : ndarray of shape (n_samples,) or None
        Time in s.
    temperature : ndarray of shape (n_samples, n_joints) or None
        Joint temperatures in degrees Celsius.
    prismatic : ndarray of shape (n_joints,) of bool
        Whether a joint is prismatic.
    robot : Robot or None
        The robot, for effects that act through its kinematics or dynamics.
    load : ndarray of shape (n_samples, n_joints) or None
        Torque that the transmission carries: the rigid-body part of the model (N m or N).
    model_torque : ndarray of shape (n_samples, n_joints) or None
        Torque of the whole model so far (N m or N).
    smooth_torque : ndarray of shape (n_samples, n_joints) or None
        The model's torque without dry friction, which jumps at reversals (N m or N).
    inertial_parameters : ndarray of shape (n_bodies, 10) or None
        Parameters of the rigid body where effects need them; the robot's own if None.
    valid : ndarray of shape (n_samples, n_joints) of bool or None
        False for a sample of a joint that is not to be used: broken, or near the end of a segment,
        where the smoother is one-sided. None if all samples are good.
    half_width : int
        Half the width of the windows in which the motion was smoothed, in samples, at most; 0 as
        logged.
    cutoff : ndarray of shape (n_samples,) or None
        Cut-off of that smoother, Hz, equal for all samples of a trajectory; None if none has been
        chosen.
    """

    q: Array
    dq: Array
    ddq: Array
    trajectory: NDArray[Any]
    time: Array | None = None
    temperature: Array | None = None
    prismatic: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, dtype=bool))
    robot: Robot | None = None
    load: Array | None = None
    model_torque: Array | None = _Later()  # type: ignore[assignment]
    smooth_torque: Array | None = _Later()  # type: ignore[assignment]
    inertial_parameters: Array | None = None
    valid: NDArray[np.bool_] | None = None
    half_width: int = 0
    cutoff: Array | None = None

    def __post_init__(self) -> None:
        if len(self.prismatic) == 0:
            object.__setattr__(self, "prismatic", np.zeros(self.n_joints, dtype=bool))

    @property
    def n_samples(self) -> int:
        """Number of rows."""
        return len(self.q)

    @property
    def n_joints(self) -> int:
        """Number of joints."""
        return int(self.q.shape[1])

    @cached_property
    def unit(self) -> Array:
        """A length of motion that is moderate for each joint: 1 rad, or 0.1 m for sliders."""
        return np.where(self.prismatic, 0.1, 1.0)

    @cached_property
    def sign(self) -> Array:
        """Direction of motion in [-1, 1], smooth where a joint hardly moves."""
        return np.tanh(self.dq / (SIGN_BLUR * self.unit))

    @cached_property
    def segments(self) -> list[slice]:
        """Contiguous runs of rows; states of hysteresis, filters and windows never cross them."""
        return find_segments(self.trajectory, self.time)

    @property
    def within(self) -> NDArray[np.bool_]:
        """Steps from row to row that stay within a trajectory, (n_samples - 1,)."""
        return np.asarray(self.trajectory[1:] == self.trajectory[:-1])

    @cached_property
    def clock(self) -> Array:
        """Time in s; the sample number if no time is logged."""
        return np.arange(self.n_samples, dtype=float) if self.time is None else self.time

    @cached_property
    def since_start(self) -> Array:
        """Time since the first sample of the trajectory, s."""
        since = np.zeros(self.n_samples)
        for name in np.unique(self.trajectory):
            here = self.trajectory == name
            since[here] = self.clock[here] - self.clock[here].min()
        return since

    @cached_property
    def rate(self) -> float:
        """Median sampling rate, Hz; 1 if no time is logged."""
        steps = np.diff(self.clock)[self.within]
        steps = steps[steps > 0]
        return 1.0 / float(np.median(steps)) if len(steps) else 1.0

    @property
    def usable(self) -> NDArray[np.bool_]:
        """Samples of every joint that may be used, (n_samples, n_joints)."""
        return np.ones(self.q.shape, dtype=bool) if self.valid is None else self.valid

    @cached_property
    def steps(self) -> list[float]:
        """Usual time from one sample to the next in every segment, s; 1 where there is one only."""
        return [
            float(np.median(np.diff(self.clock[rows]))) if rows.stop - rows.start > 1 else 1.0
            for rows in self.segments
        ]

    def once(self, name: Hashable, make: Callable[[], Any], *, of_fit: bool = False) -> Any:
        """Result of ``make`` for these signals, computed at the first call; it must not be changed.

        Effects are tried at many shapes; quantities independent of the shape are computed once. The
        name must contain everything on which ``make`` depends other than the signals. Results are
        kept when the model is fitted again, unless they are ``of_fit``: dependent on its load,
        torque or inertial parameters.
        """
        kept = self.__dict__.setdefault("_kept_of_fit" if of_fit else "_kept", {})
        if name not in kept:
            kept[name] = make()
        return kept[name]

    def __getstate__(self) -> dict[str, Any]:
        for name in _LATER:
            getattr(self, name)
        return {k: value for k, value in self.__dict__.items() if not k.startswith("_kept")}

    def named(self, name: str) -> Array:
        """A signal by its name, joints counted from 1: ``"dq3"``, ``"temp2"``, ``"time"``, ...

        ``"tau3"`` is the torque of the model, ``"trajectory"`` the number of the recording,
        ``"since_start"`` the time since the first sample of the recording.
        """
        if name == "time":
            return self.clock
        if name == "since_start":
            return self.since_start
        if name == "trajectory":
            return self.trajectory.astype(float)
        kind = name.rstrip("0123456789")
        table = getattr(self, {"temp": "temperature", "tau": "model_torque"}.get(kind, kind))
        assert table is not None
        return np.asarray(table[:, int(name[len(kind) :]) - 1])

    def with_(self, **changes: Any) -> Signals:
        """Copy with some fields replaced; a torque of the model may be a function returning it."""
        new = replace(self, **{k: f.stored(self) for k, f in _LATER.items()} | changes)
        if not {"dq", "prismatic"} & set(changes) and "sign" in self.__dict__:
            new.__dict__["sign"] = self.sign
        if _OF_FIT >= set(changes):
            new.__dict__["_kept"] = self.__dict__.setdefault("_kept", {})
        if not {"time", "trajectory"} & set(changes):
            for name in _OF_CLOCK & set(self.__dict__):
                new.__dict__[name] = self.__dict__[name]
        return new

    def take(self, rows: slice | NDArray[Any]) -> Signals:
        """The same signals on some rows."""
        per_sample = ("q", "dq", "ddq", "trajectory", "time", "temperature", "load", "valid")
        values = {name: getattr(self, name) for name in (*per_sample, "cutoff")}
        values |= {name: field.stored(self) for name, field in _LATER.items()}
        return replace(self, **{name: _rows(value, rows) for name, value in values.items()})

    def thinned(self, step: int) -> tuple[NDArray[np.int64], Signals]:
        """The middle one of every few (an odd number) successive samples, segment by segment.

        Their rows, and signals that keep the segments of these, so that no gap is closed.
        """
        index, few = self.once(("thinned", step), lambda: self._thinned(step))
        of_fit = {name: _rows(field.stored(self), index) for name, field in _LATER.items()}
        of_fit["load"] = _rows(self.load, index)
        return index, few.with_(**of_fit, inertial_parameters=self.inertial_parameters)

    def _thinned(self, step: int) -> tuple[NDArray[np.int64], Signals]:
        """As :meth:`thinned`, without what belongs to a fit."""
        parts = [np.arange(rows.start + step // 2, rows.stop, step) for rows in self.segments]
        parts = [part for part in parts if len(part)]
        index = np.concatenate(parts) if parts else np.zeros(0, dtype=np.int64)
        few = self.with_(**dict.fromkeys(_OF_FIT)).take(index)
        ends = np.cumsum([0, *map(len, parts)]).tolist()
        few.__dict__["segments"] = [slice(a, b) for a, b in zip(ends[:-1], ends[1:], strict=True)]
        return index, few


#: Fields that a fit of the model sets, and what is computed once from the clock.
_OF_FIT = {"load", "model_torque", "smooth_torque", "inertial_parameters"}
_OF_CLOCK = {"segments", "clock", "rate", "steps"}
#: Fields that are computed when they are first read.
_LATER: dict[str, _Later] = {k: v for k, v in vars(Signals).items() if isinstance(v, _Later)}


def _rows(value: Any, rows: slice | NDArray[Any]) -> Any:
    """Some rows of a field, or a function that returns them."""
    if callable(value):
        return lambda: value()[rows]
    return None if value is None else value[rows]


def signals_from(
    X: Array, columns: Columns, robot: Robot | None = None, *, to_derive: bool = False
) -> Signals:
    """Read the signals from the columns of X.

    The robot gives the joint types. With ``to_derive`` accelerations may be missing, to be derived
    from the positions; they are zero until then.
    """
    if columns.ddq is None and not to_derive:
        raise ValueError("the columns hold no accelerations; derive them first")
    q, dq = X[:, list(columns.q)], X[:, list(columns.dq)]
    prismatic = np.zeros(columns.n_joints, dtype=bool)
    if robot is not None:
        prismatic = np.array([kind == "prismatic" for kind in robot.joint_types])
    return Signals(
        q,
        dq,
        np.zeros_like(q) if columns.ddq is None else X[:, list(columns.ddq)],
        trajectory=trajectory_numbers(X, columns),
        time=None if columns.time is None else X[:, columns.time],
        temperature=None if columns.temperature is None else X[:, list(columns.temperature)],
        prismatic=prismatic,
        robot=robot,
    )


def read_signals(
    X: Any,
    tau: Any,
    robot: Robot,
    *,
    trajectory: ColumnSpec = "auto",
    time: ColumnSpec = "auto",
    rate: float | None = None,
    to_derive: bool = True,
) -> tuple[Signals, Array]:
    """Signals and torque (N m or N) of a table that follows the X contract, checked.

    If the columns have names, accelerations may be missing and are derived. ``rate``, in Hz, is
    that of an X without time. A ColumnError is raised if a column or the time is missing, a
    LogError if the torque has another shape or a value is not finite.
    """
    refuse_other_gravity(X, robot)
    refuse_other_order(tau, robot)
    names = column_names(X)
    values = np.asarray(X.to_numpy() if hasattr(X, "to_numpy") else X)
    if values.ndim != 2:
        raise LogError(
            f"X has {values.ndim} dimensions; a table or an array of shape (n_samples, n_columns) "
            "is expected"
        )
    torque = np.asarray(tau.to_numpy() if hasattr(tau, "to_numpy") else tau, dtype=float)
    torque = torque.reshape(len(torque), -1)
    columns = resolve_columns(
        names,
        values.shape[1],
        robot.joint_names,
        trajectory=trajectory,
        time=time,
        require_acceleration=names is None or not to_derive,
    )
    if torque.shape != (len(values), columns.n_joints):
        raise LogError(
            f"the torque has shape {torque.shape}; {len(values)} samples of {columns.n_joints} "
            f"joints ({', '.join(robot.joint_names)}) are expected"
        )
    table = np.zeros(values.shape)
    table[:, columns.used()] = values[:, columns.used()]  # other columns may not contain numbers
    signals = signals_from(table, columns, robot, to_derive=True)
    signals = signals.with_(trajectory=signals.trajectory.astype(np.int64))
    if signals.time is None:
        if rate is None:
            raise ColumnError(
                "X has no time column; name it by time=..., or give the sampling rate by rate=..."
            )
        signals = signals.with_(time=np.arange(len(values)) / rate)
    elif columns.time is not None:
        refuse_equal_times(signals, named(columns.time, names))
    for name, block in (("q", signals.q), ("dq", signals.dq), ("tau", torque)):
        bad = ~np.isfinite(block)
        if bad.any():
            row, joint = map(int, np.argwhere(bad)[0])
            raise LogError(
                f"{name} of joint {joint + 1} ({robot.joint_names[joint]}) is not finite in row "
                f"{row} ({int(bad.any(1).sum())} such rows); drop or repair them first"
            )
    return signals, torque


def named(column: int, names: Sequence[str] | None) -> str:
    """A column of X in a message, by its name or its number.

    >>> named(1, ["trajectory", "time"]), named(1, None)
    ("'time'", '1')
    """
    return str(column) if names is None else repr(str(names[column]))


def refuse_equal_times(signals: Signals, column: str) -> None:
    """Refuse a clock that stands still in a trajectory, or in most steps of all trajectories."""
    if signals.time is None or signals.n_samples == 0:
        return
    ends = np.flatnonzero(~signals.within) + 1
    names, still = signals.trajectory[np.r_[0, ends]], []
    told = ""
    for name, times in zip(names, np.split(signals.time, ends), strict=True):
        if len(times) > 2:
            still.append(float(np.mean(np.diff(times) == 0)))
            if still[-1] == 1 and not told:
                told = f"all {len(times)} rows of trajectory {name:g}, {times[0]:.9g} s"
    if still and not told and min(still) > 0.5:
        told = f"at least {min(still):.0%} of the rows"
    if told:
        raise ColumnError(
            f"the times in column {column} of X are equal to those of the row before in {told}; "
            "leave out repeated rows and give times in s that advance, in float64, since float32 "
            "cannot hold seconds since 1970 unless the start is subtracted, or give time=None"
        )


def refuse_other_order(torque: Any, robot: Robot) -> None:
    """Refuse a table of torque whose names are in another order than the joints of the robot.

    >>> import pandas as pd
    >>> from skidyn.datasets import load_planar_arm
    >>> refuse_other_order(pd.DataFrame([[0.0, 0.0]], columns=["tau1", "tau2"]), load_planar_arm())
    """
    names = column_names(torque)
    if names is None or len(names) != robot.n_joints:
        return
    for symbol in ([str(k + 1) for k in range(robot.n_joints)], robot.joint_names):
        expected = ["tau" + name if name.isdigit() else "tau_" + name for name in symbol]
        if names != expected and sorted(names) == sorted(expected):
            raise ColumnError(
                f"the columns of the torque are {', '.join(names)}, in another order than the "
                f"joints of the robot ({', '.join(robot.joint_names)}); give "
                f"table[[{', '.join(map(repr, expected))}]]"
            )


def refuse_other_gravity(X: Any, robot: Robot) -> None:
    """Refuse a log that was read with another gravity than that of the robot."""
    stated = getattr(X, "attrs", {}).get("gravity")
    if stated is not None and not np.allclose(stated, robot.gravity):
        own = ", ".join(f"{g:g}" for g in robot.gravity)
        raise LogError(
            f"the log was read with gravity {list(stated)} m/s^2, and the robot has [{own}]; give "
            f"the model robot.with_gravity({list(stated)})"
        )
