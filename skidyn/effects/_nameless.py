# SPDX-License-Identifier: BSD-3-Clause
"""Unknown functions of one or two signals, used by the diagnosis if no known effect fits.

They are ordinary terms, so a model with one is fitted, used for prediction and stored as usual.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
from numpy.polynomial.legendre import legvander
from numpy.typing import NDArray

from skidyn._signals import Array, Signals
from skidyn.effects._base import Coefficient, Effect, Shape

#: Share of the samples of a trajectory left out at either end of its range.
_OUTSIDE = 0.002

#: Number of trajectories that must reach a value for a function to be fitted there.
_REACHING = 3

#: Share of the range over which the secant is computed that continues a function beyond it.
_SECANT = 0.15

#: Difference between the ratios of torque and of distance above which a coupling is not elastic.
_UNEQUAL = 0.2

#: Highest order of a function of one signal.
_ORDER = 12

#: Number of pairs of joints, nearest first, between which a torque is tried.
_PAIRS = 28


def unnamed_coefficients(count: int) -> tuple[Coefficient, ...]:
    return tuple(Coefficient(f"c{i + 1}", "N m") for i in range(count))


class NamelessEffect(Effect):
    """A smooth function of the signals in :attr:`depends_on`."""

    nameless = True
    softness = 1e-5
    #: Whether its signals are combined to one number, such as a sum or the distance since a
    #: reversal, so that none of them can be tested alone.
    is_of_one_number: ClassVar[bool] = False
    #: Signals it depends on: ``own`` joint, the ``other`` joint or time.
    depends_on: ClassVar[tuple[str, ...]] = ()

    def words(self, shape: Mapping[str, Any]) -> str:
        """Title for some shape, if the names of the signals are not sufficient.

        Parameters
        ----------
        shape : mapping
            Shape parameters.
        """
        return ""

    def variables(self, joint: int, shape: dict[str, Any]) -> tuple[str, ...]:
        """Names of the signals, joints counted from 1.

        Parameters
        ----------
        joint : int
            Joint on which it acts, from 0.
        shape : dict
            Shape parameters of the term.
        """
        other = int(shape.get("other", joint))
        names = []
        for name in self.depends_on:
            signal, _, of = name.partition("_")
            names.append(signal if not of else f"{signal}{(joint if of == 'own' else other) + 1}")
        return tuple(dict.fromkeys(names))

    def denies(self, effect: Effect, shape: Mapping[str, Any]) -> bool:
        """Whether a finding with some shape cannot be a known effect.

        Parameters
        ----------
        effect : Effect
            Known effect on the same joints.
        shape : mapping
            Shape parameters of the finding.

        Returns
        -------
        bool
            False by default.
        """
        return False

    def others(self, signals: Signals, joint: int) -> list[dict[str, Any]]:
        """Grid over the other joints."""
        return [{"other": k} for k in range(signals.n_joints) if k != joint]


class _Spline(NamelessEffect):
    softness = 2e-3
    signal: ClassVar[str] = "q"
    n_splines: ClassVar[int] = 10

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        x = getattr(signals, self.signal)[:, joints[0]]
        low, high = supported_range(signals, x)
        return [{"low": low, "high": high}] if high > low else []

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        x = getattr(signals, self.signal)[:, joint]
        return splines(x, shape["low"], shape["high"], self.n_splines)


class FunctionOfPosition(_Spline):
    """A smooth function of the joint's own position."""

    kind = "function_of_position"
    title = "Function of position"
    formula = r"f(q_j)"
    coefficients = unnamed_coefficients(30)
    depends_on = ("q_own",)
    signal, n_splines = "q", 30


class FunctionOfVelocity(_Spline):
    """A smooth function of the joint's own velocity."""

    kind = "function_of_velocity"
    drawn_against = "dq"
    title = "Function of velocity"
    formula = r"f(\dot q_j)"
    coefficients = unnamed_coefficients(24)
    depends_on = ("dq_own",)
    signal, n_splines = "dq", 24


class FrictionOverPosition(NamelessEffect):
    """Friction that varies with the joint's own position."""

    kind = "friction_over_position"
    drawn_against = "q"
    title = "Friction that varies with position"
    formula = r"f(q_j)\,\dot q_j + g(q_j)\,\mathrm{sign}\,\dot q_j"
    coefficients = unnamed_coefficients(6)
    depends_on = ("q_own", "dq_own")

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        x = signals.q[:, joint] / signals.unit[joint]
        dq, sign = signals.dq[:, joint], signals.sign[:, joint]
        waves = [np.cos(x), np.sin(x), np.cos(2 * x), np.sin(2 * x)]
        return np.column_stack([*(w * dq for w in waves), *(w * sign for w in waves[:2])])


class FunctionOfPositionAndVelocity(_Spline):
    """A torque that depends on the joint's own position and velocity, in low orders.

    Unlike friction, it may act in one direction, as a push that occurs only during motion.
    """

    kind = "function_of_position_and_velocity"
    drawn_against = "dq"
    title = "Function of position and velocity"
    formula = r"f(q_j, \dot q_j)"
    coefficients = unnamed_coefficients(9)
    depends_on = ("q_own", "dq_own")
    softness = 1e-5

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        low, high = shape["low"], shape["high"]
        orders = _ordered_functions(signals.q[:, joint], None, low, high)[:, :3]
        dq = signals.dq[:, joint]
        motion = (dq, signals.sign[:, joint], np.abs(dq))
        return np.hstack([orders * m[:, None] for m in motion])


class _WithOther(NamelessEffect):
    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        return self.others(signals, joints[0])


class FunctionOfTwoPositions(_WithOther):
    """A smooth torque that depends on two positions: a cable, a hose, a closed chain."""

    kind = "function_of_two_positions"
    title = "Function of two positions"
    formula = r"f(q_j, q_k)"
    coefficients = unnamed_coefficients(7)
    depends_on = ("q_own", "q_other")

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        k = int(shape["other"])
        x, y = (signals.q[:, i] / signals.unit[i] for i in (joint, k))
        return np.column_stack(
            [
                np.cos(x - y),
                np.sin(x - y),
                np.cos(x + y),
                np.sin(x + y),
                np.sin(y),
                np.cos(y),
                np.ones_like(x),
            ]
        )


class FrictionOverOtherPosition(_WithOther):
    """Friction of one joint that varies with the position of another."""

    kind = "friction_over_other_position"
    drawn_against = "dq"
    title = "Friction that varies with another joint's position"
    formula = r"f(q_k)\,\mathrm{sign}\,\dot q_j + g(q_k)\,\dot q_j"
    coefficients = unnamed_coefficients(4)
    depends_on = ("dq_own", "q_other")

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        k = int(shape["other"])
        y = signals.q[:, k] / signals.unit[k]
        motion = (signals.sign[:, joint], signals.dq[:, joint])
        return np.column_stack([wave * m for m in motion for wave in (np.cos(y), np.sin(y))])


class FunctionOfTwoVelocities(_WithOther):
    """Drag of one joint that depends on the velocity of another."""

    kind = "function_of_two_velocities"
    drawn_against = "dq"
    title = "Function of two velocities"
    formula = r"f(\dot q_j, \dot q_k)"
    coefficients = unnamed_coefficients(6)
    depends_on = ("dq_own", "dq_other")

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        k = int(shape["other"])
        dq, sign = signals.dq[:, joint], signals.sign[:, joint]
        other, other_sign = signals.dq[:, k], signals.sign[:, k]
        return np.column_stack(
            [
                dq * np.abs(other),
                np.abs(dq) * other,
                sign * np.abs(other),
                np.abs(dq) * other_sign,
                other,
                other_sign,
            ]
        )


class FunctionOfSignals(NamelessEffect):
    """A smooth function of the few signals on which the residual was found to depend.

    Products of Legendre polynomials of positions and accelerations, and of powers of velocities
    with their direction, the lowest orders first.
    """

    n_signals: ClassVar[int] = 1
    search = "screened"
    drawn = 1e-2

    def variables(self, joint: int, shape: dict[str, Any]) -> tuple[str, ...]:
        return tuple(shape["of"])

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        return []

    def shape_of(self, signals: Signals, names: Sequence[str]) -> dict[str, Any]:
        """Shape of a function of some signals, over the range that they cover.

        Parameters
        ----------
        signals : Signals
        names : sequence of str
            Signals, joints counted from 1, such as ``"q2"``.
        """
        low, high = zip(
            *(supported_range(signals, signals.named(name)) for name in names), strict=True
        )
        return {"of": tuple(names), "low": low, "high": high}

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        n = len(self.coefficients)
        parts = []
        for name, low, high in zip(shape["of"], shape["low"], shape["high"], strict=True):
            sign = signals.sign[:, int(name[2:]) - 1] if name.startswith("dq") else None
            parts.append(_ordered_functions(signals.named(name), sign, low, high))
        orders = [range(p.shape[1]) for p in parts]
        chosen = sorted(itertools.product(*orders), key=lambda powers: (sum(powers), powers))
        return np.column_stack(
            [
                np.prod([p[:, k] for p, k in zip(parts, powers, strict=True)], axis=0)
                for powers in chosen[:n]
            ]
        )


#: Range of a signal that is more than rounding, as a share of its values.
LEAST_RANGE = 1e-9


def splines(x: Array, low: float, high: float, count: int) -> Array:
    """Cubic B-splines on a range, continued beyond it, shape (n_samples, count).

    Their sum is a constant, which the model may lack. The recursion is that of Cox and de Boor
    [1]_, for the four splines that are not zero at a sample.

    References
    ----------
    .. [1] L. Piegl, W. Tiller (1997), The NURBS book, 2nd ed., Springer, algorithm A2.2.
    """
    if not high - low > LEAST_RANGE * max(abs(low), abs(high)):
        return np.zeros((len(x), count))  # a joint at one place, but for rounding
    degree = 3
    n_pieces = count - degree
    knots = np.r_[[low] * degree, np.linspace(low, high, n_pieces + 1), [high] * degree]

    def functions(inside: Array) -> Array:
        inside = np.clip(inside, low, high - 1e-9 * (high - low))
        piece = ((inside - low) * (n_pieces / (high - low))).astype(np.int64)
        piece = np.minimum(piece, n_pieces - 1)
        before = [inside - knots[piece + degree - k] for k in range(degree)]
        after = [knots[piece + degree + 1 + k] - inside for k in range(degree)]
        values: list[Any] = [1.0]
        for order in range(1, degree + 1):
            carried, raised = 0.0, []
            for r, value in enumerate(values):
                part = value / (after[r] + before[order - 1 - r])
                raised.append(carried + after[r] * part)
                carried = before[order - 1 - r] * part
            values = [*raised, carried]
        columns = np.zeros((len(inside), count))
        place = np.arange(0, columns.size, count) + piece
        for r, value in enumerate(values):
            columns.ravel()[place + r] = value
        return columns

    return continued(functions, x, low, high)


def supported_range(signals: Signals, x: Array) -> tuple[float, float]:
    """Range of a signal that several trajectories cover, so that no single one decides."""
    (found,) = supported_ranges(signals, x[:, None])
    return found


def supported_ranges(signals: Signals, x: Array) -> list[tuple[float, float]]:
    """:func:`supported_range` of several signals, shape (n_samples, n_signals)."""
    rows = signals.once("rows of trajectories", lambda: _rows_of_trajectories(signals))
    ends = np.array([np.quantile(x[own], [_OUTSIDE, 1 - _OUTSIDE], axis=0) for own in rows])
    ends.sort(axis=0)
    at = min(_REACHING, (len(ends) + 1) // 2) - 1
    return [
        (float(low[at]), float(high[-1 - at]))
        if high[-1 - at] > low[at]
        else (float(low[0]), float(high[-1]))
        for low, high in np.moveaxis(ends, 2, 0).transpose(0, 2, 1)
    ]


def _rows_of_trajectories(signals: Signals) -> list[NDArray[np.int64]]:
    return [np.flatnonzero(signals.trajectory == k) for k in np.unique(signals.trajectory)]


def continued(functions: Callable[[Array], Array], x: Array, low: float, high: float) -> Array:
    """Functions on a range, continued beyond it along their secants over its outer parts."""
    values = functions(np.clip(x, low, high))
    reach = _SECANT * (high - low)
    for beyond, edge, inner in (
        (np.minimum(x - low, 0.0), low, low + reach),
        (np.maximum(x - high, 0.0), high, high - reach),
    ):
        rows = np.flatnonzero(beyond)
        if len(rows):
            at_edge, inside = functions(np.array([edge, inner]))
            values[rows] += np.outer(beyond[rows] / (edge - inner), at_edge - inside)
    return values


def _ordered_functions(x: Array, sign: Array | None, low: float, high: float) -> Array:
    """Functions of one signal by rising order, the constant first."""
    if sign is None:
        inside = (2 * x - low - high) / max(high - low, 1e-300)
        return continued(lambda t: np.asarray(legvander(t, _ORDER)), inside, -1.0, 1.0)
    v = np.clip(x / max(-low, high, 1e-300), -1.0, 1.0)
    size = np.abs(v)
    powers = [np.ones_like(v), v, sign, size, v * v, v * size, v**3, size**3]
    powers += [sign * size ** (0.5 * k) for k in range(1, _ORDER - len(powers) + 2)]
    return np.column_stack(powers)


class FunctionOfSignal(FunctionOfSignals):
    """A function of one signal of any joint."""

    kind = "function_of_signal"
    title = "Function of one signal"
    formula = r"f(s)"
    coefficients = unnamed_coefficients(_ORDER + 1)
    n_signals = 1


class FunctionOfTwoSignals(FunctionOfSignals):
    """A function of two signals of any joints."""

    kind = "function_of_two_signals"
    title = "Function of two signals"
    formula = r"f(s_1, s_2)"
    coefficients = unnamed_coefficients(28)
    n_signals = 2


class LowOrderOfTwoSignals(FunctionOfTwoSignals):
    """A function of two signals of any joints in low orders, which a short log determines."""

    kind = "low_order_of_two_signals"
    title = "Function of two signals in low orders"
    coefficients = unnamed_coefficients(10)


class FunctionOfThreeSignals(FunctionOfSignals):
    """A function of three signals of any joints."""

    kind = "function_of_three_signals"
    title = "Function of three signals"
    formula = r"f(s_1, s_2, s_3)"
    coefficients = unnamed_coefficients(35)
    n_signals = 3


class FunctionOfSum(NamelessEffect):
    """A function of a sum of positions, such as the angle of a link about parallel axes."""

    kind = "function_of_sum"
    title = "Function of a sum of positions"
    formula = r"f(\pm q_i \pm q_k \pm \ldots)"
    coefficients = unnamed_coefficients(16)
    search = "screened"
    softness = 2e-3
    is_of_one_number = True

    def variables(self, joint: int, shape: dict[str, Any]) -> tuple[str, ...]:
        return tuple(sorted(shape["of"]))

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        return []

    def shape_of(
        self, signals: Signals, joints: Sequence[int], weights: Sequence[float]
    ) -> dict[str, Any]:
        """Shape of a function of a weighted sum of positions, over the range that it covers.

        Parameters
        ----------
        signals : Signals
        joints : sequence of int
            Joints, from 0.
        weights : sequence of float
            Factor of the position of each.

        Returns
        -------
        dict
        """
        names = tuple(f"q{k + 1}" for k in joints)
        low, high = supported_range(signals, _weighted_sum(signals, names, weights))
        return {"of": names, "weights": tuple(weights), "low": low, "high": high}

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        total = _weighted_sum(signals, shape["of"], shape["weights"])
        return splines(total, shape["low"], shape["high"], len(self.coefficients))


def _weighted_sum(signals: Signals, names: Sequence[str], weights: Sequence[float]) -> Array:
    return np.asarray(sum(w * signals.named(n) for n, w in zip(names, weights, strict=True)))


class TorqueBetweenTwoJoints(NamelessEffect):
    """A torque between two joints that depends on a sum of their positions.

    The torque on the second joint is that on the first one times ``passed``. If the connection
    stores energy, as a cable that tightens or links that touch each other, this is the ratio, which
    is also used if the shape has none; if the connection loses energy, or is driven, it may differ.
    """

    is_of_one_number = True
    kind = "torque_between_two_joints"
    title = "Torque between two joints"
    formula = r"f(x),\quad x = q_i + r\,q_j"
    coefficients = unnamed_coefficients(10)
    shapes = (
        Shape(
            "ratio",
            "1",
            (-2.0, -1.0, -0.5, 0.5, 1.0, 2.0),
            -np.inf,
            np.inf,
            spacing="linear",
            scales=False,
            has_interval=False,
        ),
        Shape("passed", "1", (), -np.inf, np.inf, spacing="linear", scales=False),
    )
    scope = "pair"
    softness = 2e-3

    def variables(self, joint: int, shape: dict[str, Any]) -> tuple[str, ...]:
        return (f"q{joint + 1}", f"q{int(shape['other']) + 1}")

    def sites(self, signals: Signals) -> list[tuple[int, ...]]:
        near = sorted(super().sites(signals), key=lambda pair: pair[1] - pair[0])
        return sorted(near[:_PAIRS])

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        unit = self.travel(signals, joints, {})
        every = signals.once("ranges of q", lambda: supported_ranges(signals, signals.q))
        ranges = [every[j] for j in joints]
        middle = tuple((low + high) / 2 for low, high in ranges)
        half = tuple((high - low) / 2 for low, high in ranges)
        found = []
        ratios = unit * np.array(self.shapes[0].grid)
        sums = signals.q[:, [joints[0]]] + ratios * signals.q[:, [joints[1]]]
        for ratio, (low, high) in zip(
            ratios.tolist(), supported_ranges(signals, sums), strict=True
        ):
            # The range of the sum, in terms that do not change when the ratio is refined.
            share = (high - low) / 2 / max(half[0] + abs(ratio) * half[1], 1e-300)
            shift = (low + high) / 2 - (middle[0] + ratio * middle[1])
            shape = {"middle": middle, "half": half, "share": share, "shift": shift}
            found.append({"ratio": ratio, "passed": ratio, "other": joints[1]} | shape)
        return found

    def travel(self, signals: Signals, joints: Sequence[int], shape: Mapping[str, Any]) -> float:
        i, j = joints
        return float(signals.unit[i] / signals.unit[j])

    def denies(self, effect: Effect, shape: Mapping[str, Any]) -> bool:
        """A coupling of two joints transmits torque with the same ratio as distance."""
        ratio = shape["ratio"]
        passed = shape.get("passed", ratio)
        return effect.scope == "pair" and abs(passed - ratio) > _UNEQUAL * abs(ratio)

    def torque_columns(
        self, signals: Signals, joints: Sequence[int], **shape: Any
    ) -> dict[int, Array]:
        (i, j), ratio = joints, shape["ratio"]
        middle = shape["middle"][0] + ratio * shape["middle"][1] + shape["shift"]
        half = shape["share"] * (shape["half"][0] + abs(ratio) * shape["half"][1])
        total = signals.q[:, i] + ratio * signals.q[:, j]
        block = splines(total, middle - half, middle + half, len(self.coefficients))
        return {i: block, j: shape.get("passed", ratio) * block}


class ClockPeriodic(NamelessEffect):
    """A torque periodic in time, of any wave form: a pump, a cam, a cyclic controller."""

    kind = "clock_periodic"
    drawn_against = "time"
    title = "Periodic in time"
    formula = r"\sum_h a_h\sin(2\pi h f t) + b_h\cos(2\pi h f t)"
    coefficients = unnamed_coefficients(8)
    depends_on: ClassVar[tuple[str, ...]] = ("time",)
    needs = ("time",)
    search = "clock"
    #: Waves per period: a square wave has the odd ones.
    harmonics: ClassVar[tuple[int, ...]] = (1, 2, 3, 5)
    #: Highest frequency in Hz that averaged rows contain; higher waves are left out.
    highest: ClassVar[float] = 8.0

    def carriers(self, signals: Signals, joint: int) -> list[Array]:
        """What the waves are multiplied by, each of shape (n_samples,).

        The line is searched in the residual times the last one.
        """
        return [np.ones(signals.n_samples)]

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        phase = 2 * np.pi * shape["frequency"] * signals.clock
        shown = [float(h * shape["frequency"] <= self.highest) for h in self.harmonics]
        waves = [
            s * wave(h * phase)
            for h, s in zip(self.harmonics, shown, strict=True)
            for wave in (np.sin, np.cos)
        ]
        carriers = self.carriers(signals, joint)
        return np.column_stack([carrier * wave for carrier in carriers for wave in waves])


class PulsatingFriction(ClockPeriodic):
    """Friction periodic in time: a brake that drags at times, a pulsing pressure on a seal."""

    kind = "pulsating_friction"
    drawn_against = "dq"
    title = "Friction periodic in time"
    formula = r"\mathrm{sign}\,\dot q_j\sum_h a_h\sin(2\pi h f t) + b_h\cos(2\pi h f t)"
    depends_on = ("dq_own", "time")
    is_of_one_number = True

    def carriers(self, signals: Signals, joint: int) -> list[Array]:
        return [signals.sign[:, joint]]


class PulsatingSpring(ClockPeriodic):
    """A torque over the position that is periodic in time: an air spring that breathes."""

    kind = "pulsating_spring"
    drawn_against = "q"
    title = "Spring periodic in time"
    formula = r"(q_j - q_0)\sum_h a_h\sin(2\pi h f t) + b_h\cos(2\pi h f t)"
    depends_on = ("q_own", "time")
    is_of_one_number = True
    harmonics = (1, 2)

    def carriers(self, signals: Signals, joint: int) -> list[Array]:
        x = signals.q[:, joint] / signals.unit[joint]
        return [np.ones(signals.n_samples), x]


class Vibration(NamelessEffect):
    """A wave in time that is faster than the motion: a fan, mains hum, a loose part."""

    kind = "vibration"
    drawn_against = "time"
    title = "Vibration"
    formula = r"a\sin(2\pi f t) + b\cos(2\pi f t)"
    coefficients = unnamed_coefficients(2)
    depends_on = ("time",)
    needs = ("time",)
    # As with torque ripple: averaging over windows of time would remove it.
    search = "spectrum"

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        phase = 2 * np.pi * shape["frequency"] * signals.clock
        return np.column_stack([np.sin(phase), np.cos(phase)])


NAMELESS: tuple[type[NamelessEffect], ...] = (
    FunctionOfPosition,
    FunctionOfVelocity,
    FrictionOverPosition,
    FunctionOfPositionAndVelocity,
    FunctionOfTwoPositions,
    FrictionOverOtherPosition,
    FunctionOfTwoVelocities,
    FunctionOfSignal,
    FunctionOfTwoSignals,
    LowOrderOfTwoSignals,
    FunctionOfThreeSignals,
    FunctionOfSum,
    TorqueBetweenTwoJoints,
    ClockPeriodic,
    PulsatingFriction,
    PulsatingSpring,
    Vibration,
)
