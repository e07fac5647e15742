# SPDX-License-Identifier: BSD-3-Clause
"""Torque that depends on the joint's own position, or is constant."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from skidyn._signals import Array, Signals
from skidyn.effects._base import Effect
from skidyn.effects._parameters import Coefficient, Shape

#: Smallest and largest share of samples in contact; with more samples it is a spring.
FEWEST_TOUCHING, MOST_TOUCHING = 0.001, 0.6
#: A piece over a smaller share of the travel is a step of the torque and not a spring; a spring
#: whose rest position is closer to an end of the travel than this share is a stop.
NARROW, ONE_SIDED = 0.1, 0.15
#: Least share of the motion of a vertical slide that is vertical.
_VERTICAL = 0.99


def stiffens(distance: Array, scale: float) -> bool:
    """Whether a hyperbolic sine with this scale is a spring over these distances.

    Distances, shape (n_samples,), and scale are in rad or m. Beyond the logarithm of the precision
    of a number, the largest force exceeds that of most rows so far that they no longer count, and
    the force soon overflows.
    """
    return bool(np.abs(distance).max(initial=0.0) < -np.log(np.finfo(float).eps) * scale)


class Offset(Effect):
    """Constant torque: a sensor or current zero, an unbalanced drive."""

    kind = "offset"
    by_recording = True
    drifts = True
    title = "Torque offset"
    formula = r"\tau_0"
    coefficients = (Coefficient("tau0", "N m"),)
    is_exact = True
    simplicity = 0
    rivals = ("asymmetric_friction", "spring", "temperature_offset")
    separating_motion = "poses in which gravity acts with both signs; zeroing the sensor again"
    reference = "Gautier, Khalil (1988), ICRA."

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        return np.ones((signals.n_samples, 1))


class Spring(Effect):
    """Linear spring between the joint's two links."""

    kind = "spring"
    by_recording = True
    title = "Spring"
    formula = r"k\,(q - q_0)"
    coefficients = (Coefficient("k", "N m/rad", sign=1), Coefficient("tau0", "N m", is_zero=True))
    is_exact = True
    simplicity = 4
    rivals = ("nonlinear_spring", "gravity_compensator", "offset", "end_stop")
    separating_motion = "slow motion over the whole travel"
    reference = "Siciliano, Sciavicco, Villani, Oriolo (2009), Robotics, Springer."

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        return np.column_stack([signals.q[:, joint], np.ones(signals.n_samples)])

    def parameters(
        self, coefficients: Array, shape: Mapping[str, Any], signals: Signals | None = None
    ) -> dict[str, Any]:
        k, tau0 = map(float, coefficients)
        return {"k": k, "q0": -tau0 / k if k else 0.0}

    def units(self, prismatic: bool = False) -> dict[str, str]:
        return {"k": "N/m", "q0": "m"} if prismatic else {"k": "N m/rad", "q0": "rad"}


class NonlinearSpring(Effect):
    """Spring that stiffens or softens: a power of position, or pieces of different stiffness.

    The plain form is a cubic about the middle of the travel. With a ``power`` in its shape it is
    this power, instead of the third, of the distance from ``rest``, in units of 1 rad or 1 m, so
    that units are the same; with a ``scale``, in rad or m, it is the third power times the
    hyperbolic sine of the distance divided by ``scale``, as rubber stiffens. A piecewise linear
    spring has ``low`` and ``high`` in its shape, the positions between which its stiffness is
    ``k_between``; below, it is ``k_below``, and above, ``k_above``. Springs with two rates, with
    slack, or that yield beyond some torque have this form.
    """

    kind = "nonlinear_spring"
    title = "Nonlinear spring"
    formula = r"k_1 x + k_2 x^2 + k_3 x^3 + \tau_0,\quad x = q - q_m"
    coefficients = (
        Coefficient("k1", "N m/rad"),
        Coefficient("k2", "N m/rad^2"),
        Coefficient("k3", "N m/rad^3"),
        Coefficient("tau0", "N m", is_zero=True),
    )
    #: Stiffness of the pieces.
    pieces = (
        Coefficient("k_between", "N m/rad"),
        Coefficient("k_below", "N m/rad"),
        Coefficient("k_above", "N m/rad"),
    )
    shapes = (
        Shape("low", "rad", (), -np.inf, np.inf, spacing="linear", scales=False),
        Shape("high", "rad", (), -np.inf, np.inf, spacing="linear", scales=False),
        Shape("rest", "rad", (), -np.inf, np.inf, spacing="linear", scales=False),
        Shape("power", "", (), 2.0, 6.0, scales=False),
        Shape("scale", "rad", (), 0.05, 2.0),
    )
    #: Initial values of the search: positions as quantiles, powers, scales in units of the joint.
    forms = (
        {"low": 0.2, "high": 0.8},
        {"low": 0.4, "high": 0.6},
        {"low": 0.1, "high": 0.5},
        {"low": 0.5, "high": 0.9},
        {"rest": 0.3, "power": 5.0},
        {"rest": 0.5, "power": 5.0},
        {"rest": 0.5, "power": 2.0},
        {"rest": 0.7, "power": 5.0},
        {"rest": 0.5, "scale": 0.3},
    )
    simplicity = 29
    rivals = ("spring", "gravity_compensator", "end_stop")
    separating_motion = "slow motion over the whole travel"
    reference = "Madsen, Bargsten, Brixius (2020), Nonlinear joint stiffness identification."

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        # Powers of the distance from the middle of the travel keep the columns well conditioned.
        q = signals.q[:, joints[0]]
        forms = [
            {name: self._start(name, x, signals, joints[0]) for name, x in form.items()}
            for form in self.forms
        ]
        finite = [form for form in forms if self._finite(signals, joints, form)]
        return [{"q_middle": float((q.min() + q.max()) / 2)}, *finite]

    @staticmethod
    def _finite(signals: Signals, joints: Sequence[int], shape: Mapping[str, Any]) -> bool:
        rest, scale = shape.get("rest", 0.0), shape.get("scale", np.inf)
        return stiffens(signals.q[:, joints[0]] - rest, scale)

    @staticmethod
    def _start(name: str, value: float, signals: Signals, joint: int) -> float:
        if name == "power":
            return value
        if name == "scale":
            return float(value * signals.unit[joint])
        return float(np.quantile(signals.q[:, joint], value))

    def admissible(self, signals: Signals, joints: Sequence[int], shape: Mapping[str, Any]) -> bool:
        q = signals.q[:, joints[0]]
        if "rest" in shape:
            share = (shape["rest"] - q.min()) / (q.max() - q.min())
            inside = bool(ONE_SIDED < share < 1 - ONE_SIDED)
            return inside and self._finite(signals, joints, shape)
        if "low" not in shape:
            return True
        least = float(np.mean(q < shape["low"])), float(np.mean(q > shape["high"]))
        wide = shape["high"] - shape["low"] > NARROW * (q.max() - q.min())
        return bool(wide) and min(least) > FEWEST_TOUCHING

    def positive(
        self, signals: Signals, joints: Sequence[int], shape: Mapping[str, Any]
    ) -> Array | None:
        # A spring pushes back over its travel as a whole; one that does not is a counterweight.
        q = signals.q[:, joints[0]]
        return np.asarray((q - q.mean()) @ self.columns(signals, joints[0], **shape))

    def coefficients_of(self, shape: Mapping[str, Any]) -> tuple[Coefficient, ...]:
        return (*self.pieces, self.coefficients[-1]) if "low" in shape else self.coefficients

    def formula_of(self, shape: Mapping[str, Any]) -> str:
        if "low" in shape:
            return (
                r"k_\mathrm{between}\,\min(\max(q, q_l), q_h) + k_\mathrm{below}\min(0, q - q_l) "
                r"+ k_\mathrm{above}\max(0, q - q_h) + \tau_0"
            )
        if "scale" in shape:
            return r"k_1 x + k_2 x^2 + k_3\,l^3\sinh(x/l) + \tau_0,\quad x = q - q_r"
        if "power" in shape:
            return r"k_1 x + k_2 x^2 + k_3\,\mathrm{sign}(x)|x|^p + \tau_0,\quad x = q - q_r"
        return self.formula

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        q = signals.q[:, joint]
        if "low" in shape:
            low, high = shape["low"], shape["high"]
            pieces = [np.clip(q, low, high), np.minimum(q - low, 0.0), np.maximum(q - high, 0.0)]
            return np.column_stack([*pieces, np.ones_like(q)])
        x = q - (shape["rest"] if "rest" in shape else shape["q_middle"])
        if "scale" in shape:
            last = shape["scale"] ** 3 * np.sinh(x / shape["scale"])
            return np.column_stack([x, x**2, last, np.ones_like(x)])
        power = np.sign(x) * np.abs(x) ** shape.get("power", 3.0)
        return np.column_stack([x, x**2, power, np.ones_like(x)])

    def units(self, prismatic: bool = False) -> dict[str, str]:
        length, stiffness = ("m", "N/m") if prismatic else ("rad", "N m/rad")
        pieces = {c.name: stiffness for c in self.pieces}
        return super().units(prismatic) | pieces | {"q_middle": length}


class GravityCompensator(Effect):
    """Coil spring with a lever, or a counterweight: trigonometric in the joint's own position.

    A counterweight, and a spring without free length, act as one wave per turn, approximately also
    other springs, with the second harmonic (``overtone``), or with the third (``overtone=3``) where
    the lever changes alike on both sides. A coil spring between a point of either
    link has ``aligned`` in its shape, the position at which both points are on one side of the
    axis, in line with it, and ``lever``, the ratio of their distances to the axis; its force is
    proportional to its length less the free one, so that the torque is ``k`` times the sine of the
    angle from there, less ``kl`` times this sine over the length, in units of the longer distance.
    """

    kind = "gravity_compensator"
    title = "Gravity compensator"
    formula = (
        r"a_1\sin q + b_1\cos q\ (+\ a_2\sin 2q + b_2\cos 2q) + \tau_0\ \text{or}\ "
        r"k\sin x - k_l \sin x / L + \tau_0,\quad "
        r"L^2 = 1 + r^2 - 2 r\cos x,\quad x = q - q_0"
    )
    coefficients = (
        Coefficient("a1", "N m"),
        Coefficient("b1", "N m"),
        Coefficient("tau0", "N m", is_zero=True),
    )
    #: Coefficients of the second or third harmonic, and of a coil spring.
    second = (Coefficient("a2", "N m"), Coefficient("b2", "N m"))
    third = (Coefficient("a3", "N m"), Coefficient("b3", "N m"))
    coil = (Coefficient("k", "N m"), Coefficient("kl", "N m"))
    shapes = (
        Shape("aligned", "rad", (), -np.inf, np.inf, spacing="linear", scales=False),
        Shape("lever", "1", (), 0.05, 0.95, scales=False),
    )
    forms = ({"overtone": 1.0}, {"overtone": 3.0}, {"aligned": 0.0, "lever": 0.5})
    #: Number of positions, evenly spaced over a turn, at which a coil spring may be aligned.
    n_aligned = 6
    simplicity = 29  # as a nonlinear spring: the data decide
    rivals = ("nonlinear_spring", "spring")
    separating_motion = "slow motion over the whole travel"
    reference = "Jubien, Gautier (2013), IFAC; Dietz et al. (2018), coil spring balancers."

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        second, third, coil = map(dict, self.forms)
        q = signals.q[:, joints[0]]
        turn = 2 * np.pi * (np.arange(self.n_aligned) / self.n_aligned - 0.5)
        angles = (q.min() + q.max()) / 2 + turn
        return [{}, second, third, *(coil | {"aligned": float(angle)} for angle in angles)]

    def coefficients_of(self, shape: Mapping[str, Any]) -> tuple[Coefficient, ...]:
        *wave, offset = self.coefficients
        if "lever" in shape:
            return (*self.coil, offset)
        further = {1.0: self.second, 3.0: self.third}.get(shape.get("overtone", 0.0), ())
        return (*wave, *further, offset)

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        q = signals.q[:, joint]
        if "lever" in shape:
            x, lever = q - shape["aligned"], shape["lever"]
            length = np.sqrt(1 + lever**2 - 2 * lever * np.cos(x))
            return np.column_stack([np.sin(x), -np.sin(x) / length, np.ones_like(q)])
        overtone = shape.get("overtone", 0.0)
        orders = [1, *([3] if overtone == 3.0 else [2] if overtone else [])]
        waves = [wave(order * q) for order in orders for wave in (np.sin, np.cos)]
        return np.column_stack([*waves, np.ones_like(q)])

    def units(self, prismatic: bool = False) -> dict[str, str]:
        return super().units(prismatic) | {
            c.name: c.unit for c in (*self.second, *self.third, *self.coil)
        }

    def not_shown(self, signals: Signals, joint: int) -> str | None:
        if signals.prismatic[joint]:
            return f"joint {joint + 1} slides"
        return super().not_shown(signals, joint)


class EndStop(Effect):
    """One-sided elastic contact beyond a position: bumper, hose, cable pulled tight.

    A soft bumper stiffens: then the torque grows with another ``power`` of the deflection (1 if the
    shape has none), in units of 1 rad or 1 m, so that the unit of the stiffness is the same; or,
    with ``stiffening``, in rad or m, with the exponential function of the deflection divided by
    this length, minus 1 and times it, as foam does. A contact that loses energy has a larger torque
    during approach, by the factor ``1 + damping`` times the speed of the approach (Hunt, Crossley
    1975, J. Applied Mechanics 42(2)), and never pulls. With ``q_low`` in the shape there is a
    contact at either end, the second below that position and as stiff as the first. With
    ``q_further``, a second spring sets in at that position, as behind a soft bumper. A damper acts
    ``one_way`` if it resists only the approach, as most shock absorbers do.
    """

    kind = "end_stop"
    title = "End stop"
    formula = (
        r"s\,k\,\max(0,\ s\,(q - q_\mathrm{lim}))^p\,"
        r"\max(0,\ 1 + d\,s\,\dot q),\quad s = \pm 1"
    )
    coefficients = (
        Coefficient("k", "N m/rad", sign=1),
        Coefficient("k_further", "N m/rad", sign=1),
    )
    #: Coefficient of the product of the deflection and the speed of the approach.
    resistance = Coefficient("d", "N m s/rad^2", sign=1)
    shapes = (
        Shape("q_lim", "rad", (), -np.inf, np.inf, spacing="linear", scales=False),
        Shape("q_low", "rad", (), -np.inf, np.inf, spacing="linear", scales=False),
        Shape("q_further", "rad", (), -np.inf, np.inf, spacing="linear", scales=False),
        Shape("damping", "s/rad", (), 1e-3, 1e3, scales=False, has_interval=False),
        Shape("power", "1", (), 0.7, 2.2, scales=False, has_interval=False),
        Shape("stiffening", "rad", (), 0.01, 2.0, has_interval=False),
    )
    forms = (
        {"q_further": 0.4},  # of the deflection
        {"power": 2.0},
        {"stiffening": 0.4},  # of the deflection
        {"power": 1.0, "damping": 0.5},
        {"power": 1.5, "damping": 0.5},
        {"q_low": 0.0},
        {"q_low": 0.0, "damping": 0.5},
        {"one_way": 1.0},
    )
    simplicity = 10
    rivals = ("spring", "nonlinear_spring")
    separating_motion = "slow approach to both ends of the travel"
    reference = "Siciliano, Sciavicco, Villani, Oriolo (2009), Robotics, Springer."

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        q, unit = signals.q[:, joints[0]], signals.unit[joints[0]]
        stops = [
            {"q_lim": float(side * np.quantile(side * q, share)), "side": side}
            for share in (0.80, 0.84, 0.88, 0.92, 0.95, 0.55, 0.65, 0.72)
            for side in (1.0, -1.0)
        ]
        further, stronger, foam, *damped, _, both_damped, one_way = map(dict, self.forms)
        some = [stops[k] for k in (2, 3, 6, 7)]
        softer = [
            stop | form | {"damping": form["damping"] / unit} for form in damped for stop in some
        ]
        both = [
            {"q_lim": float(np.quantile(q, share)), "q_low": float(np.quantile(q, 1 - share))}
            | {"side": 1.0}
            for share in (0.80, 0.88, 0.95)
        ]
        slowing = {"damping": both_damped["damping"] / unit}
        both += [ends | slowing for ends in both]
        stiffer = [stop | stronger for stop in stops] + [stop | one_way for stop in some]
        for stop in some:
            depth = float((stop["side"] * (q - stop["q_lim"])).max())
            stiffer.append(stop | {"stiffening": foam["stiffening"] * depth})
            behind = stop["q_lim"] + stop["side"] * further["q_further"] * depth
            stiffer.append(stop | {"q_further": behind})
        return [*stops, *stiffer, *softer, *both]

    def admissible(self, signals: Signals, joints: Sequence[int], shape: Mapping[str, Any]) -> bool:
        q = signals.q[:, joints[0]]
        depth = shape["side"] * (q - shape["q_lim"])
        beyond = float(np.mean(depth > 0))
        if not stiffens(depth[depth > 0], shape.get("stiffening", np.inf)):
            return False
        if "q_further" in shape:
            behind = shape["side"] * (shape["q_further"] - shape["q_lim"])
            if behind <= 0 or np.mean(depth > behind) < FEWEST_TOUCHING:
                return False
        if "q_low" not in shape:
            return FEWEST_TOUCHING < beyond < MOST_TOUCHING
        below = float(np.mean(q < shape["q_low"]))
        return min(beyond, below) > FEWEST_TOUCHING and beyond + below < MOST_TOUCHING

    def usually(
        self,
        coefficients: Array,
        shape: Mapping[str, Any],
        signals: Signals,
        joints: Sequence[int],
    ) -> str | None:
        # What stops a vertical slide on its way down is more often a table than its lower end.
        robot, (joint,) = signals.robot, joints
        if robot is None or not signals.prismatic[joint] or "q_low" in shape:
            return None
        up = -robot.gravity / max(float(np.linalg.norm(robot.gravity)), np.finfo(float).tiny)
        rise = robot.jacobian(signals.q)[:, :3, joint] @ up
        is_lowered = bool((shape["side"] * rise < -_VERTICAL).all())
        return "environment_contact" if is_lowered else None

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        q, dq = signals.q[:, joint], signals.dq[:, joint]
        power, damping = shape.get("power", 1.0), shape.get("damping", 0.0)
        scale = shape.get("stiffening")
        torque = np.zeros_like(q)
        ends = [(shape["side"], shape["q_lim"])]
        if "q_low" in shape:
            ends.append((-1.0, shape["q_low"]))
        for side, limit in ends:
            push = np.maximum(0.0, side * (q - limit))
            push = side * (push**power if scale is None else scale * (np.exp(push / scale) - 1.0))
            torque += push * np.maximum(0.0, 1.0 + damping * side * dq) if damping else push
        side = shape["side"]
        if "one_way" in shape:
            return np.column_stack([torque, torque * np.maximum(0.0, side * dq)])
        if "q_further" not in shape:
            return torque[:, None]
        second = side * np.maximum(0.0, side * (q - shape["q_further"]))
        return np.column_stack([torque, second])

    def coefficients_of(self, shape: Mapping[str, Any]) -> tuple[Coefficient, ...]:
        stiffness, second = self.coefficients
        if "one_way" in shape:
            return (stiffness, self.resistance)
        return (stiffness, second) if "q_further" in shape else (stiffness,)

    def units(self, prismatic: bool = False) -> dict[str, str]:
        return super().units(prismatic) | {"d": "N s/m^2" if prismatic else self.resistance.unit}
