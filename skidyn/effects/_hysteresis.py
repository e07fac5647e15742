# SPDX-License-Identifier: BSD-3-Clause
"""Pre-sliding friction: bristles that bend before they slip.

Every state depends on the path and not on time, so between two reversals it has a closed form; only
the reversals are processed one by one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array, Signals
from skidyn.effects._base import Effect
from skidyn.effects._friction import is_of_low_speed, of_low_speed
from skidyn.effects._parameters import Coefficient, Shape


@dataclass(frozen=True)
class Law:
    """Change of a state along a monotone stroke, for numbers and arrays.

    Attributes
    ----------
    measure : callable
        Function of the distance in rad or m, on which the change depends.
    change : callable
        ``change(start, direction, measure) -> state``.
    """

    measure: Callable[[Any], Any]
    change: Callable[[Any, Any, Any], Any]

    def __call__(self, start: Any, direction: Any, way: Any) -> Any:
        return self.change(start, direction, self.measure(way))


@dataclass(frozen=True)
class Strokes:
    """A path cut at its reversals, for all laws of hysteresis.

    Attributes
    ----------
    rows : ndarray of shape (n_moving,)
        Samples with a state; first samples and constant paths have none.
    stroke : ndarray of shape (n_moving,)
        Stroke of each sample.
    way : ndarray of shape (n_moving,), rad or m
        Distance travelled since the stroke began.
    direction : ndarray of shape (n_strokes,)
        1 or -1.
    length : ndarray of shape (n_strokes,), rad or m
        Distance of the whole stroke.
    opens : ndarray of shape (n_strokes,) of bool
        Whether a stroke is the first of its segment, which starts without a state.
    """

    rows: NDArray[np.int64]
    stroke: NDArray[np.int64]
    way: Array
    direction: Array
    length: Array
    opens: NDArray[np.bool_]


def cut_strokes(position: Array, segments: list[slice]) -> Strokes:
    """Strokes of a path within each segment."""
    parts: list[tuple[Any, ...]] = []
    count = 0
    for rows in segments:
        x = position[rows]
        if len(x) < 2:
            continue
        direction = np.sign(np.diff(x))
        moving = np.flatnonzero(direction)
        if len(moving) == 0:
            continue
        # At rest a stroke continues: fill zeros with the direction before them (at the start,
        # after).
        last = np.cumsum(direction != 0) - 1
        direction = direction[moving[np.maximum(last, 0)]]
        first = np.r_[0, np.flatnonzero(np.diff(direction)) + 1]
        steps = np.diff(np.r_[first, len(direction)])
        parts.append(
            (
                np.arange(rows.start + 1, rows.stop),
                np.repeat(np.arange(count, count + len(first)), steps),
                np.abs(x[1:] - np.repeat(x[first], steps)),
                direction[first],
                np.abs(x[first + steps] - x[first]),
                np.arange(len(first)) == 0,
            )
        )
        count += len(first)
    if not parts:
        none = np.zeros(0)
        whole = none.astype(np.int64)
        return Strokes(whole, whole, none, none, none, none.astype(bool))
    return Strokes(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def strokes_of(signals: Signals, joint: int, name: str = "q") -> Strokes:
    """Strokes of a joint, from 0, cut once for all states that depend on its path.

    Those of its velocity if ``name`` is ``"dq"``.
    """
    strokes: Strokes = signals.once(
        ("strokes", joint, name),
        lambda: cut_strokes(getattr(signals, name)[:, joint], signals.segments),
    )
    return strokes


def _run(strokes: Strokes, n_samples: int, law: Law) -> Array:
    """State of a rate-independent hysteresis along a path, zero at the start of each segment."""
    state = np.zeros(n_samples)
    start, value = [], 0.0
    # Plain numbers: single operations on NumPy's take fifty times as long.
    for opens, direction, gone in zip(
        strokes.opens.tolist(),
        strokes.direction.tolist(),
        law.measure(strokes.length).tolist(),
        strict=True,
    ):
        value = 0.0 if opens else value
        start.append(value)
        value = law.change(value, direction, gone)
    if start:
        own = strokes.stroke
        state[strokes.rows] = law(np.array(start)[own], strokes.direction[own], strokes.way)
    return state


def dahl_state(position: Array, segments: list[slice], presliding: float) -> Array:
    """Normalised Dahl friction along a path.

    Parameters
    ----------
    position : ndarray of shape (n_samples,), rad or m
        Joint position.
    segments : list of slice
        Rows within which the path is continuous.
    presliding : float, rad or m
        Distance over which friction builds up, Fc / sigma0.

    Returns
    -------
    ndarray of shape (n_samples,)
        Friction over Coulomb friction, in [-1, 1].

    References
    ----------
    P. R. Dahl (1968), A solid friction model, Aerospace Corporation TOR-0158.

    Examples
    --------
    >>> import numpy as np
    >>> dahl_state(np.linspace(0, 1, 11), [slice(0, 11)], 0.05)[-1].round(3)
    np.float64(1.0)
    """
    return _run(cut_strokes(position, segments), len(position), _dahl_law(presliding))


def _dahl_law(presliding: float, exponent: float = 1.0) -> Law:
    if exponent != 1.0:
        # With u = 1 - h in the direction of the stroke: du/dx = -u^i.
        less = exponent - 1.0

        def slower(start: Any, direction: Any, way: Any) -> Any:
            short = np.maximum(1.0 - direction * start, 1e-300)
            return direction * (1.0 - np.maximum(short**-less + less * way, 0.0) ** (-1.0 / less))

        return Law(lambda way: way / presliding, slower)

    def change(start: Any, direction: Any, fading: Any) -> Any:
        return direction - (direction - start) * fading

    return Law(lambda way: np.exp(-way / presliding), change)


def stop_state(position: Array, segments: list[slice], presliding: float) -> Array:
    """Normalised force of one Maxwell-slip element (the stop operator) along a path.

    Parameters
    ----------
    position : ndarray of shape (n_samples,), rad or m
        Joint position.
    segments : list of slice
        Rows within which the path is continuous.
    presliding : float, rad or m
        Distance from rest to slip.

    Returns
    -------
    ndarray of shape (n_samples,)
        Force over the slip force, in [-1, 1].

    Examples
    --------
    >>> import numpy as np
    >>> stop_state(np.array([0.0, 0.1, 0.3]), [slice(0, 3)], 0.2).tolist()
    [0.0, 0.5, 1.0]
    """
    return stop_along(cut_strokes(position, segments), len(position), presliding)


def stop_along(strokes: Strokes, n_samples: int, presliding: float) -> Array:
    """As :func:`stop_state`, along a path that was cut into strokes."""
    return _run(strokes, n_samples, _stop_law(presliding))


def _stop_law(presliding: float) -> Law:
    def change(start: Any, direction: Any, bend: Any) -> Any:
        force = start + direction * bend
        if isinstance(force, float):
            return min(max(force, -1.0), 1.0)
        return np.clip(force, -1.0, 1.0)

    return Law(lambda way: way / presliding, change)


class PathMemory(Effect):
    """Base of effects whose state depends on the path of their own joint alone.

    A subclass defines the change of each state along a stroke in one direction, and the columns for
    given states. Logs are processed from reversal to reversal; a simulation advances the same laws
    step by step.
    """

    def laws(self, **shape: Any) -> tuple[Law, ...]:
        """Change of every state along a stroke: ``law(start, direction, way) -> state``."""
        raise NotImplementedError

    def columns_at(
        self, signals: Signals, joint: int, states: Sequence[Array], **shape: Any
    ) -> Array:
        """Columns for given states, each of shape (n_samples,)."""
        return np.column_stack(states)

    def path_states(self, signals: Signals, joint: int, **shape: Any) -> list[Array]:
        """States along the logged path, zero at the start of every segment."""
        strokes = strokes_of(signals, joint)
        return [_run(strokes, signals.n_samples, law) for law in self.laws(**shape)]

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        states = self.path_states(signals, joint, **shape)
        return self.columns_at(signals, joint, states, **shape)


class Dahl(PathMemory):
    """Friction that builds up over a short distance after each reversal.

    Dahl's exponent i is 1 (ductile materials) in the plain form, or the ``exponent`` of the shape.
    """

    kind = "dahl"
    drawn_against = "dq"
    title = "Dahl friction (pre-sliding)"
    formula = r"F\,h,\quad \tfrac{dh}{dq} = \tfrac{1}{\delta}\,(1 - h\,\mathrm{sign}\,\dot q)^i"
    coefficients = (Coefficient("F", "N m", sign=1),)
    forms = ({"exponent": 2.0},)
    shapes = (
        Shape(
            "presliding",
            "rad",
            (0.003, 0.008, 0.014, 0.022, 0.035, 0.055, 0.09),
            0.0005,
            0.5,
            limit_kind="coulomb",
        ),
        Shape("exponent", "1", (), 0.4, 3.0, scales=False, has_interval=False),
    )
    family = "hysteresis"
    simplicity = 21
    rivals = ("lugre", "maxwell_slip", "coulomb", "stribeck", "backlash", "joint_elasticity")
    separating_motion = "small reversals inside the pre-sliding range, of several amplitudes"
    reference = "Dahl (1968), A solid friction model, Aerospace Corporation TOR-0158."

    def laws(self, **shape: Any) -> tuple[Law, ...]:
        return (_dahl_law(shape["presliding"], shape.get("exponent", 1.0)),)


class LuGre(PathMemory):
    """Bristles whose strength follows a Stribeck curve."""

    kind = "lugre"
    drawn_against = "dq"
    title = "LuGre friction"
    formula = r"\left(F_c + \Delta F\,e^{-(\dot q/v_s)^2}\right) h,\quad h\ \text{as in Dahl}"
    coefficients = (Coefficient("F", "N m", sign=1), Coefficient("dF", "N m", sign=1))
    shapes = (
        Shape(
            "presliding",
            "rad",
            (0.003, 0.008, 0.014, 0.022),
            0.0005,
            0.5,
            limit_kind="coulomb",
        ),
        Shape("vs", "rad/s", (0.05, 0.1, 0.16, 0.25), 0.01, 1.0),
    )
    family = "hysteresis"
    simplicity = 25
    rivals = ("dahl", "maxwell_slip", "stribeck")
    separating_motion = "small reversals and slow constant-speed sweeps in one recording"
    reference = "Canudas de Wit, Olsson, Astrom, Lischinsky (1995), IEEE TAC 40(3), 419-425."

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        return of_low_speed(super().grid(signals, joints), signals, joints[0])

    def admissible(self, signals: Signals, joints: Sequence[int], shape: Mapping[str, Any]) -> bool:
        slow = is_of_low_speed(shape["vs"], signals, joints[0])
        return slow and super().admissible(signals, joints, shape)

    def laws(self, **shape: Any) -> tuple[Law, ...]:
        return (_dahl_law(shape["presliding"]),)

    def columns_at(
        self, signals: Signals, joint: int, states: Sequence[Array], **shape: Any
    ) -> Array:
        stribeck = np.exp(-((signals.dq[:, joint] / shape["vs"]) ** 2))
        return np.column_stack([states[0], stribeck * states[0]])


class MaxwellSlip(PathMemory):
    """Several spring-slider elements in parallel.

    Their distances from rest to slip differ by a factor, 2 or the ``spread`` of the shape.
    """

    kind = "maxwell_slip"
    drawn_against = "dq"
    title = "Maxwell-slip friction"
    formula = r"\sum_i F_i\,h_i,\quad \dot h_i = \dot q/\delta_i\ \text{while}\ |h_i| < 1"
    coefficients = (
        Coefficient("F1", "N m"),
        Coefficient("F2", "N m"),
        Coefficient("F3", "N m"),
    )
    forms = ({"spread": 5.0},)
    shapes = (
        Shape(
            "presliding",
            "rad",
            (0.005, 0.016, 0.025, 0.04, 0.06, 0.1),
            0.001,
            0.5,
            limit_kind="coulomb",
        ),
    )
    family = "hysteresis"
    simplicity = 24
    rivals = ("dahl", "lugre", "coulomb")
    separating_motion = "small reversals inside the pre-sliding range, of several amplitudes"
    reference = "Al-Bender, Lampaert, Swevers (2005), IEEE TAC 50(11), 1883-1887."

    def can_have(self, coefficients: Array, shape: Mapping[str, Any], signals: Signals) -> bool:
        # Once all elements slip, they resist the motion.
        return bool(np.sum(coefficients) > 0)

    def laws(self, **shape: Any) -> tuple[Law, ...]:
        spread = shape.get("spread", 2.0)
        ways = (shape["presliding"] * share for share in (1.0, 1 / spread, spread))
        return tuple(map(_stop_law, ways))
