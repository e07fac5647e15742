# SPDX-License-Identifier: BSD-3-Clause
"""Unknown torques that depend on history."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
from numpy.polynomial.legendre import legvander

from skidyn._signals import Array, Signals
from skidyn.effects._hysteresis import cut_strokes, dahl_state, stop_along, strokes_of
from skidyn.effects._moments import moments
from skidyn.effects._nameless import NamelessEffect, unnamed_coefficients
from skidyn.effects._parameters import Shape
from skidyn.effects._smooth import range_of, splines

#: Distances since the last reversal, rad or tenths of m, over which a torque may fade.
_WAYS = (0.01, 0.03, 0.1, 0.3)
#: Times since the last reversal, s, over which a torque may fade.
_SINCE = (0.1, 0.4, 1.6)
#: Widths of play, as shares of the range of a position, and number of splines of the function.
_PLAYS, _LAGGING = (0.03, 0.06, 0.1, 0.15, 0.22, 0.33, 0.5), 16
#: Widths of stop operators, as shares of the range of a torque.
_STOPS = (0.05, 0.1, 0.2, 0.4)
#: Times in s over which a torque may relax.
_RELAXATION = (0.1, 0.3, 1.0, 3.0)
#: Least number of recordings for a torque that drifts.
_DRIFTING = 5
#: Number of moments that are tried.
_MOMENTS = 32
#: Times since the start of a recording over which a torque may fade, as shares of its length.
_FADING = (0.05, 0.15, 0.5)
#: Number of splines of a function of the position of the last reversal.
_TURNING = 12
#: Times in s over which what a motion warmed cools again.
_COOLING = (0.5, 2.0, 8.0)


def _fading_and_growing(share: Array) -> Array:
    """Columns of a function of what has passed, as a share of the most that passes."""
    fading = [np.exp(-share / s) for s in _FADING]
    return np.column_stack([*fading, share, np.ones_like(share)])


class FunctionOfTimeSinceStart(NamelessEffect):
    """A torque that fades or grows from the start of every recording."""

    kind = "function_of_time_since_start"
    drawn_against = "time"
    title = "Function of the time since the start of a recording"
    formula = r"f(t - t_\mathrm{start})"
    coefficients = unnamed_coefficients(len(_FADING) + 2)
    depends_on = ("time",)
    needs = ("time",)

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        return [{"length": float(np.max(signals.since_start))}]

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        return _fading_and_growing(signals.since_start / max(shape["length"], 1e-9))


class OscillationSinceStart(NamelessEffect):
    """An oscillation that fades from the start of every recording, as of a hook or a table."""

    kind = "oscillation_since_start"
    drawn_against = "time"
    title = "Oscillation that fades from the start of every recording"
    formula = r"e^{-t/T}\,(c_1\cos 2\pi f t + c_2\sin 2\pi f t)"
    coefficients = unnamed_coefficients(2)
    shapes = (
        Shape("frequency", "Hz", (0.4, 0.6, 0.9, 1.35, 2.0, 3.0), 0.1, 20.0, scales=False),
        Shape("decay", "s", (0.5, 2.0), 0.1, 30.0, scales=False),
    )
    depends_on = ("time",)
    needs = ("time",)

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        since = signals.since_start
        phase = 2 * np.pi * shape["frequency"] * since
        fading = np.exp(-since / shape["decay"])
        return np.column_stack([fading * np.cos(phase), fading * np.sin(phase)])


class FunctionOfTime(NamelessEffect):
    """A torque that drifts slowly over the whole log, as the zero of a sensor does."""

    kind = "function_of_time"
    drawn_against = "time"
    title = "Slow drift over the log"
    formula = r"f(t)"
    coefficients = unnamed_coefficients(4)
    depends_on = ("time",)
    needs = ("time",)

    def not_shown(self, signals: Signals, joint: int) -> str | None:
        if len(signals.segments) < _DRIFTING:
            return "too few recordings to separate a drift from differences between them"
        return super().not_shown(signals, joint)

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        start, end = float(np.min(signals.clock)), float(np.max(signals.clock))
        return [{"low": start, "high": end}] if end > start else []

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        # Beyond the log the drift is unknown: the torque stays constant.
        share = np.clip((signals.clock - shape["low"]) / (shape["high"] - shape["low"]), 0.0, 1.0)
        return legvander(2 * share - 1, len(self.coefficients) - 1)


class SuddenOffset(NamelessEffect):
    """A torque that sets in at some moment and stays, as after a collision or a slip."""

    kind = "sudden_offset"
    drawn_against = "time"
    title = "Torque with an onset in time"
    formula = r"\tau_0\,[t \geq t_0]"
    coefficients = unnamed_coefficients(1)
    shapes = (Shape("moment", "s", (), -np.inf, np.inf, spacing="samples", scales=False),)
    depends_on = ("time",)
    needs = ("time",)

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        return [{"moment": moment} for moment in moments(signals, _MOMENTS)]

    def admissible(self, signals: Signals, joints: Sequence[int], shape: Mapping[str, Any]) -> bool:
        since = float(np.mean(signals.clock >= shape["moment"]))
        least = 1 / (_MOMENTS + 2)
        return least < since < 1 - least

    def words(self, shape: Mapping[str, Any]) -> str:
        return f"Torque with an onset at {shape['moment']:.6g} s"

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        return np.asarray(signals.clock >= shape["moment"], dtype=float)[:, None]


class FrictionSinceReversal(NamelessEffect):
    """Friction that fades or grows with the distance since the last reversal of the joint."""

    is_of_one_number = True
    kind = "friction_since_reversal"
    title = "Friction that depends on the distance since the last reversal"
    formula = r"f(|q - q_\mathrm{turn}|)\,\mathrm{sign}\,\dot q"
    coefficients = unnamed_coefficients(len(_WAYS))
    depends_on = ("q_own", "dq_own")

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        q, unit = signals.q[:, joint], signals.unit[joint]
        # The difference of a Dahl state from its direction is the exponential of that distance.
        return np.column_stack(
            [signals.sign[:, joint] - dahl_state(q, signals.segments, way * unit) for way in _WAYS]
        )


class _OfAnyJoint(NamelessEffect):
    """A torque that depends on the history of any joint, this one included."""

    is_of_one_number = True
    depends_on: ClassVar[tuple[str, ...]] = ("q_other", "dq_other")

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        return [{"other": k} for k in range(signals.n_joints)]

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        k = int(shape.get("other", joint))
        # the same for every joint on which it may act
        columns: Array = signals.once((self.kind, k), lambda: self.of_history(signals, k))
        return columns

    def of_history(self, signals: Signals, joint: int) -> Array:
        """Columns from the history of a joint, from 0, shape (n_samples, n_coefficients)."""
        raise NotImplementedError


def _fading(since: Array, scales: Sequence[float], direction: Array) -> Array:
    """Exponentials of what has passed since a reversal, in either direction and by direction."""
    columns = np.column_stack([np.exp(-since / scale) for scale in scales])
    return np.hstack([columns, columns * direction[:, None]])


class FunctionOfWaySinceReversal(_OfAnyJoint):
    """A torque that fades or grows with the distance since the last reversal of a joint."""

    kind = "function_of_way_since_reversal"
    title = "Function of the distance since the last reversal"
    formula = r"f(|q_k - q_{k,\mathrm{turn}}|)"
    coefficients = unnamed_coefficients(2 * len(_WAYS))

    def of_history(self, signals: Signals, joint: int) -> Array:
        strokes = strokes_of(signals, joint)
        way = np.zeros(signals.n_samples)
        way[strokes.rows] = strokes.way / signals.unit[joint]
        return _fading(way, _WAYS, signals.sign[:, joint])


class FunctionOfWaySinceStart(_OfAnyJoint):
    """A torque that fades or grows with the way that a joint covers in a recording.

    A fresh film of grease, a rope that settles on its drum.
    """

    kind = "function_of_way_since_start"
    title = "Function of the way since the start of a recording"
    formula = r"f(\textstyle\int|\dot q_k|\,dt)"
    coefficients = unnamed_coefficients(len(_FADING) + 2)
    depends_on = ("dq_other", "time")

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        found = []
        for shape in super().grid(signals, joints):
            length = float(_way_since_start(signals, shape["other"]).max())
            if length > 0:
                found.append({**shape, "length": length})
        return found

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        k, length = int(shape["other"]), shape["length"]
        columns: Array = signals.once(
            (self.kind, k, length),
            lambda: _fading_and_growing(_way_since_start(signals, k) / length),
        )
        return columns


class FunctionOfTimeSinceReversal(_OfAnyJoint):
    """A torque that fades or grows with the time since the last reversal of a joint."""

    kind = "function_of_time_since_reversal"
    title = "Function of the time since the last reversal"
    formula = r"f(t - t_{k,\mathrm{turn}})"
    coefficients = unnamed_coefficients(2 * len(_SINCE))
    depends_on = ("dq_other", "time")
    needs = ("time",)

    def of_history(self, signals: Signals, joint: int) -> Array:
        return _fading(_time_since_reversal(signals, joint), _SINCE, signals.sign[:, joint])


class FunctionOfLastReversal(_OfAnyJoint):
    """A torque that remembers where a joint turned round last: a dragged cable, a slack chain."""

    kind = "function_of_last_reversal"
    title = "Function of the position of the last reversal"
    formula = r"f(q_{k,\mathrm{turn}})"
    coefficients = unnamed_coefficients(_TURNING)
    softness = 2e-3

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        found = []
        for shape in super().grid(signals, joints):
            low, high = range_of(signals, f"q{shape['other'] + 1}")
            if high > low:
                found.append({**shape, "low": low, "high": high})
        return found

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        k = int(shape["other"])
        turned = signals.once(("last reversal", k), lambda: _last_reversal(signals, k))
        return splines(turned, shape["low"], shape["high"], _TURNING)


class FrictionAfterMotion(_OfAnyJoint):
    """Friction that depends on how much a joint has moved recently: a brake, grease, a damper.

    It is proportional to the square of a velocity, averaged over the recent past, as a temperature
    is.
    """

    kind = "friction_after_motion"
    drawn_against = "dq"
    title = "Friction that depends on recent motion"
    formula = r"(a\,\dot q_j + b\,\mathrm{sign}\,\dot q_j)\,h,\quad T\,\dot h = \dot q_k^2 - h"
    coefficients = unnamed_coefficients(2 * len(_COOLING))
    depends_on = ("dq_own", "dq_other")
    needs = ("time",)

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        k = int(shape["other"])
        heat = signals.once(
            ("recent motion", k),
            lambda: [_followed(signals.dq[:, k] ** 2, signals, time) for time in _COOLING],
        )
        motion = signals.dq[:, joint], signals.sign[:, joint]
        return np.column_stack([h * m for m in motion for h in heat])


class TorqueOfRecentMotion(_OfAnyJoint):
    """A torque that depends on how much a joint has moved recently: a warm sensor, a hose.

    It is a sum of the speed and of its square, averaged over the recent past.
    """

    kind = "torque_of_recent_motion"
    drawn_against = "time"
    title = "Torque that depends on recent motion"
    formula = r"a\,h,\quad T\,\dot h = |\dot q_k|^p - h,\ p = 1, 2"
    coefficients = unnamed_coefficients(2 * len(_COOLING))
    depends_on = ("dq_other",)
    needs = ("time",)
    softness = 2e-3

    def of_history(self, signals: Signals, joint: int) -> Array:
        speed = np.abs(signals.dq[:, joint])
        powers = speed, speed**2
        return np.column_stack([_followed(x, signals, t) for x in powers for t in _COOLING])


class TorqueOfLargestPosition(_OfAnyJoint):
    """A torque that remembers how far a joint has been: a stretched cover, a hose that was pushed.

    Linear in the distance from the largest and from the smallest position in the recording so far.
    """

    kind = "torque_of_largest_position"
    title = "Torque that depends on the largest position so far"
    formula = r"a\,(\max_{s \leq t} q_k(s) - q_k) + b\,(q_k - \min_{s \leq t} q_k(s))"
    coefficients = unnamed_coefficients(2)
    depends_on = ("q_other",)

    def of_history(self, signals: Signals, joint: int) -> Array:
        q = signals.q[:, joint]
        columns = np.zeros((signals.n_samples, 2))
        for rows in signals.segments:
            own = q[rows]
            columns[rows, 0] = np.maximum.accumulate(own) - own
            columns[rows, 1] = own - np.minimum.accumulate(own)
        return columns


class HysteresisOverLoad(NamelessEffect):
    """A hysteresis of the joint's own torque: a flexspline, a sensor that lags its load.

    A sum of stop operators [1]_.

    References
    ----------
    .. [1] A. Visintin (1994), Differential models of hysteresis, Springer, chapter III.
    """

    is_of_one_number = True
    kind = "hysteresis_over_load"
    drawn_against = "load"
    title = "Hysteresis over the load"
    formula = r"\sum_i c_i\,\mathcal{S}_{r_i}[\tau]"
    coefficients = unnamed_coefficients(len(_STOPS))
    needs = ("model_torque",)

    def variables(self, joint: int, shape: dict[str, Any]) -> tuple[str, ...]:
        return (f"tau{joint + 1}",)

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        if signals.model_torque is None:
            return []
        low, high = range_of(signals, f"tau{joints[0] + 1}")
        return [{"range": high - low}] if high > low else []

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        assert signals.model_torque is not None
        strokes = cut_strokes(signals.model_torque[:, joint], signals.segments)
        return np.column_stack(
            [stop_along(strokes, signals.n_samples, share * shape["range"]) for share in _STOPS]
        )


class FunctionOfLaggingPosition(NamelessEffect):
    """A torque with play: a function of a position that lags behind by some play.

    A torque that switches at different angles in the two directions, as by a latch, a magnet or a
    hose that flips over, is a function of the output of a play operator [1]_.

    References
    ----------
    .. [1] A. Visintin (1994), Differential models of hysteresis, Springer, chapter III.
    """

    is_of_one_number = True
    kind = "function_of_lagging_position"
    title = "Function of the position with play"
    formula = r"f(\mathcal{P}_r[q])"
    coefficients = unnamed_coefficients(_LAGGING)
    depends_on = ("q_own",)
    softness = 2e-3
    #: The signal that lags, and the widths of play as shares of its range.
    signal: ClassVar[str] = "q"
    plays: ClassVar[tuple[float, ...]] = _PLAYS

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        low, high = range_of(signals, f"{self.signal}{joints[0] + 1}")
        return [{"play": share * (high - low), "low": low, "high": high} for share in self.plays]

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        x, play = getattr(signals, self.signal)[:, joint], shape["play"]
        strokes = strokes_of(signals, joint, self.signal)
        lagging = x - play * stop_along(strokes, len(x), play)
        return splines(lagging, shape["low"], shape["high"], _LAGGING)


class FunctionOfLaggingVelocity(FunctionOfLaggingPosition):
    """A torque that switches at one speed while it increases and at another while it decreases."""

    kind = "function_of_lagging_velocity"
    drawn_against = "dq"
    title = "Function of the velocity with play"
    formula = r"f(\mathcal{P}_r[\dot q])"
    depends_on = ("dq_own",)
    signal, plays = "dq", _PLAYS[2:5]


class RelaxingSpring(_OfAnyJoint):
    """A torque that depends on a position and relaxes at rest: rubber, hoses, grease [1]_.

    References
    ----------
    .. [1] J. D. Ferry (1980), Viscoelastic properties of polymers, 3rd ed., Wiley, chapter 1
       (Maxwell elements).
    """

    kind = "relaxing_spring"
    title = "Torque that relaxes"
    formula = r"\sum_i k_i\,(q_k - q_i),\quad T_i\,\dot q_i = q_k - q_i"
    coefficients = unnamed_coefficients(len(_RELAXATION))
    needs = ("time",)

    def of_history(self, signals: Signals, joint: int) -> Array:
        q = signals.q[:, joint]
        return np.column_stack([q - _followed(q, signals, time) for time in _RELAXATION])


def _followed(x: Array, signals: Signals, time_constant: float) -> Array:
    """First-order lag of a signal, from its value at the start of each segment."""
    from scipy.signal import lfilter  # not needed to check a log

    y = np.array(x)
    for rows, step in zip(signals.segments, signals.steps, strict=True):
        if rows.stop - rows.start < 2:
            continue
        fade = np.exp(-step / time_constant)
        # y[i] = fade y[i-1] + (1 - fade) (x[i] + x[i-1]) / 2
        own = x[rows]
        weights = [(1 - fade) / 2, (1 - fade) / 2]
        y[rows.start + 1 : rows.stop] = lfilter(
            weights, [1.0, -fade], own[1:], zi=[fade * own[0] + weights[1] * own[0]]
        )[0]
    return y


def _time_since_reversal(signals: Signals, joint: int) -> Array:
    """Time in s since a joint turned round last; since the start before it has turned."""
    since = np.array(signals.since_start)
    strokes = strokes_of(signals, joint)
    if len(strokes.rows):
        first = np.flatnonzero(np.diff(strokes.stroke, prepend=-1))
        moved, counts = signals.clock[strokes.rows], np.diff([*first, len(strokes.rows)])
        since[strokes.rows] = moved - np.repeat(moved[first], counts)
    return since


def _way_since_start(signals: Signals, joint: int) -> Array:
    """Distance that a joint has covered since the start of the recording, rad or m."""

    def covered() -> Array:
        q = signals.q[:, joint]
        way = np.cumsum(np.r_[0.0, np.where(signals.within, np.abs(np.diff(q)), 0.0)])
        first = np.flatnonzero(np.r_[True, ~signals.within])
        return np.asarray(way - np.repeat(way[first], np.diff(np.r_[first, len(q)])))

    return signals.once(("way since start", joint), covered)  # type: ignore[no-any-return]


def _last_reversal(signals: Signals, joint: int) -> Array:
    """Position at which a joint turned round last; that of the start before it has turned."""
    turned = np.array(signals.q[:, joint])
    for rows in signals.segments:
        turned[rows] = turned[rows.start]
    strokes = strokes_of(signals, joint)
    way = strokes.direction[strokes.stroke] * strokes.way
    turned[strokes.rows] = signals.q[strokes.rows, joint] - way
    return turned


HISTORY: tuple[type[NamelessEffect], ...] = (
    FunctionOfTime,
    SuddenOffset,
    FunctionOfTimeSinceStart,
    OscillationSinceStart,
    FrictionSinceReversal,
    FunctionOfWaySinceReversal,
    FunctionOfWaySinceStart,
    FunctionOfTimeSinceReversal,
    FunctionOfLastReversal,
    FrictionAfterMotion,
    TorqueOfRecentMotion,
    TorqueOfLargestPosition,
    HysteresisOverLoad,
    FunctionOfLaggingPosition,
    FunctionOfLaggingVelocity,
    RelaxingSpring,
)
