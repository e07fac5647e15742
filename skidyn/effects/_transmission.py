# SPDX-License-Identifier: BSD-3-Clause
"""Effects between motor and link; the logged position is the motor's."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, TypeVar

import numpy as np

from skidyn._sensor_steps import position_step
from skidyn._signals import Array, Signals
from skidyn.effects._base import Effect
from skidyn.effects._derivatives import smooth_derivatives
from skidyn.effects._load_of_link import LoadOfLink, SoftGap, Stiffening, Yielding
from skidyn.effects._nameless import NamelessEffect
from skidyn.effects._parameters import Coefficient, Shape

Shared = TypeVar("Shared")


def _swing(
    load: Array, inertia: Array, signals: Signals, resonance: float, damping: float
) -> tuple[Array, Array, Array]:
    """Wind-up of a spring-mass under a load, times the stiffness, and its time derivatives.

    The link oscillates on its spring: far below the resonance the wind-up is proportional to the
    load, near it the wind-up is larger and delayed, and above it the link does not follow. The
    inertia of the link, and with it the resonance, changes with the pose. The derivatives come from
    the same equation, because a later differentiation would need smoothing, which removes most of
    an oscillation at 10 Hz.

    Parameters
    ----------
    load : ndarray of shape (n_samples,), N m or N
        Torque of the rigid body without compliance.
    inertia : ndarray of shape (n_samples,), kg m^2 or kg
        Inertia of the free link at the joint.
    signals : Signals
        For its segments and clock.
    resonance : float, Hz
        Resonance with a fixed motor and the median inertia.
    damping : float
        Damping ratio there.

    Returns
    -------
    tuple of 3 ndarray of shape (n_samples,), N m or N
        The wind-up, and its derivatives per s and per s^2.
    """
    omega = 2 * np.pi * resonance
    mobility = np.median(inertia) / inertia
    moves = tuple(np.zeros_like(load) for _ in range(3))
    for rows, step in zip(signals.segments, signals.steps, strict=True):
        if rows.stop - rows.start < 7:
            continue
        # An oscillation faster than the sampling cannot be seen; the link follows at once.
        fastest = min(omega, 1.0 / step)
        spring = fastest**2 * mobility[rows]
        damper = 2 * damping * fastest * mobility[rows]
        found = _oscillation(load[rows], spring, damper, step)
        for move, values in zip(moves, found, strict=True):
            move[rows] = values
    return moves  # type: ignore[return-value]


def _oscillation(
    load: Array, spring: Array, damper: Array, step: float
) -> tuple[Array, Array, Array]:
    r"""Solution of :math:`\ddot x = k(t) (f(t) - x) - d(t) \dot x` from rest, and its derivatives.

    By the trapezoidal rule, as one triangular system of equations for all samples: for constant
    ``k`` and ``d`` it is the filter of :func:`second_order_filter`.

    Parameters
    ----------
    load : ndarray of shape (n_samples,)
        ``f``.
    spring : ndarray of shape (n_samples,), 1/s^2
        ``k``.
    damper : ndarray of shape (n_samples,), 1/s
        ``d``.
    step : float, s
        Time step.

    Returns
    -------
    tuple of 3 ndarray of shape (n_samples,)
        ``x`` and its derivatives per s and per s^2.
    """
    from scipy.linalg.blas import dtbsv

    half = step / 2
    # The unknowns are the speed and the position of every sample in turn; row i holds the i-th
    # diagonal of the matrix from the main one downwards.
    bands = np.zeros((4, 2 * len(load)), order="F")
    right = np.zeros(2 * len(load))
    bands[0] = 1.0
    bands[0, 2::2] += half * (damper[1:] + half * spring[1:])
    bands[2, 0:-2:2] = half * (damper[:-1] + half * spring[1:]) - 1.0
    bands[1, 1:-1:2] = half * (spring[:-1] + spring[1:])
    right[1] = load[0]
    right[2::2] = half * (spring[:-1] * load[:-1] + spring[1:] * load[1:])
    bands[1, 2::2] = -half
    bands[2, 1:-2:2] = -1.0
    bands[3, 0:-3:2] = -half
    moved = dtbsv(3, bands, right, lower=1)
    speed, position = moved[0::2], moved[1::2]
    return position, speed, spring * (load - position) - damper * speed


#: Frequency, Hz, above which accelerations are taken as noise, and fewest samples of a recording
#: that can be split there.
_FAST, _FEWEST = 4.0, 20
#: Step of the difference quotients; about their relative error, with a thousandth due to rounding.
_STEP = 1e-6
#: What the torque of a joint depends on.
MOTION = ("position", "velocity", "acceleration")


def _shared(signals: Signals, joint: int, name: str, make: Callable[[], Shared]) -> Shared:
    """A quantity of a joint that does not depend on the shape.

    Shapes only change the motion of the link. Quantities are cached for the last joint: shapes of
    one joint are evaluated in succession, and all joints together would take many times the memory
    of the log.
    """
    kept: dict[tuple[int, str], Any] = signals.once("shared by shapes", dict, of_fit=True)
    if (joint, name) not in kept:
        for other in [key for key in kept if key[0] != joint]:
            del kept[other]
        kept[joint, name] = make()
    found: Shared = kept[joint, name]
    return found


def _slope(signals: Signals, joint: int, by: str) -> Array:
    """Change of all torques per change of a joint's position, velocity or acceleration.

    Parameters
    ----------
    signals : Signals
        Motion.
    joint : int
        Joint, from 0.
    by : {"position", "velocity", "acceleration"}
        Quantity that is changed.

    Returns
    -------
    ndarray of shape (n_joints, n_samples)
        N m/rad, N m s/rad or kg m^2, or the corresponding units for sliders.
    """

    def make() -> Array:
        return np.ascontiguousarray(_differentiate_torque(signals, joint, by).T)

    return _shared(signals, joint, by, make)


def _differentiate_torque(signals: Signals, joint: int, by: str) -> Array:
    robot = signals.robot
    assert robot is not None
    own, q, dq, ddq = signals.inertial_parameters, signals.q, signals.dq, signals.ddq
    direction = np.zeros(signals.n_joints)
    direction[joint] = 1.0
    if by == "acceleration":
        return robot.inertial_torque(q, np.broadcast_to(direction, q.shape), parameters=own)
    inverse_dynamics = partial(robot.inverse_dynamics, parameters=own)
    here: Array = signals.once("torque", lambda: inverse_dynamics(q, dq, ddq), of_fit=True)
    step = _STEP * signals.unit[joint]
    moved = inverse_dynamics(
        q + step * direction if by == "position" else q,
        dq + step * direction if by == "velocity" else dq,
        ddq,
    )
    return np.asarray((moved - here) / step)


def _link_inertia(signals: Signals, joint: int) -> Array:
    """Inertia of the free link at its own joint, kg m^2 or kg."""

    def make() -> Array:
        inertia = _slope(signals, joint, "acceleration")[joint]
        # Identified parameters need not be consistent; a link without inertia would move away at
        # once.
        inertia = np.maximum(inertia, 0.05 * np.abs(np.median(inertia)))
        return np.asarray(np.maximum(inertia, np.finfo(float).tiny))

    return _shared(signals, joint, "inertia", make)


class _LinkSideEffect(Effect):
    """The link is displaced from the logged position by ``-c s(load)``.

    To first order the torque of all joints changes by the directional derivative of inverse
    dynamics along that displacement, which is the column.
    """

    needs = ("robot", "load", "time")
    moves_link = True

    def moves(self, signals: Signals, joint: int, **shape: Any) -> tuple[Array, Array, Array]:
        """Displacement of the link for a unit coefficient and its time derivatives.

        Each of shape (n_samples,): in rad, rad/s and rad/s^2, or m, m/s and m/s^2.
        """
        raise NotImplementedError

    def torque_columns(
        self, signals: Signals, joints: Sequence[int], **shape: Any
    ) -> dict[int, Array]:
        (joint,) = joints
        moves = self.moves(signals, joint, **shape)
        slopes = [_slope(signals, joint, by) for by in MOTION]
        change = np.zeros((signals.n_joints, signals.n_samples))
        product = np.empty_like(change)
        for slope, move in zip(slopes, moves, strict=True):
            change -= np.multiply(slope, move, out=product)
        return {j: own[:, None] for j, own in enumerate(change)}


def _yields(signals: Signals, joint: int, gear: Yielding) -> tuple[Array, Array, Array]:
    """Displacement of a link whose motor is ahead of it by what a load does, and derivatives."""

    def make() -> LoadOfLink:
        return LoadOfLink(signals, joint, [_slope(signals, joint, by)[joint] for by in MOTION])

    load = _shared(signals, joint, "load of link", make).behind(gear)
    return smooth_derivatives(gear.position(load), signals)


class AccelerationNoise(NamelessEffect):
    """Torques due to the noise of a position in its second derivative.

    It is not an effect of the robot. It is fitted together with effects that move a link if
    averages are so short that they contain this noise: far above its resonance a link does not
    follow the acceleration, which has the same form as noise of the acceleration.
    """

    kind = "acceleration_noise"
    title = "Noise of the acceleration"
    formula = r"M_{\cdot j}(q)\,\varepsilon(\ddot q_j)"
    coefficients = (Coefficient("share", "1"),)
    needs = ("robot", "load", "time")
    search = "given"
    depends_on = ("ddq_own",)

    def torque_columns(
        self, signals: Signals, joints: Sequence[int], **shape: Any
    ) -> dict[int, Array]:
        (joint,) = joints
        fast: Array = signals.once("fast accelerations", lambda: _fast_part(signals.ddq, signals))
        by_acceleration = _slope(signals, joint, "acceleration")
        return {j: own[:, None] for j, own in enumerate(by_acceleration * fast[:, joint])}


def _fast_part(values: Array, signals: Signals) -> Array:
    """Part of signals faster than any commanded motion, without a phase shift."""
    from scipy.signal import butter, sosfiltfilt

    fast = np.zeros_like(values)
    for rows, step in zip(signals.segments, signals.steps, strict=True):
        part = values[rows]
        if len(part) > _FEWEST and 2 * _FAST * step < 1:
            fast[rows] = sosfiltfilt(
                butter(2, 2 * _FAST * step, "high", output="sos"), part, axis=0
            )
    return fast


class JointElasticity(_LinkSideEffect):
    """A gear that winds up under load, with the encoder on the motor side.

    With ``stiffening`` in its shape, in N m, the gear becomes stiffer under load, as a harmonic
    drive does, and the link does not oscillate: it winds up by the compliance times ``stiffening``
    times ``asinh(load / stiffening)``. The resonance is then that without load.
    """

    kind = "joint_elasticity"
    drawn_against = "load"
    title = "Joint elasticity"
    formula = r"\tau(q - \tau_\mathrm{load}/K) - \tau(q)"
    coefficients = (Coefficient("compliance", "rad/(N m)", sign=1),)
    shapes = (
        Shape(
            "resonance",
            "Hz",
            (100.0, 50.0, 25.0, 18.0, 13.0, 9.5, 7.0, 5.0, 3.5, 2.5, 1.8),
            1.0,
            100.0,
            scales=False,
        ),
        # An oscillation of low inertia follows the noise of the accelerations at its resonance.
        Shape("damping", "1", (0.2,), 0.005, 0.5, scales=False),
        Shape("stiffening", "N m", (), 1e-12, np.inf, scales=False),
    )
    #: As a share of the root mean square of the load.
    forms = ({"stiffening": 0.5},)
    without_swing = frozenset({"stiffening"})
    follows_acceleration = True
    simplicity = 19
    rivals = ("time_delay", "rotor_inertia", "backlash", "base_tilt")
    separating_motion = "fast reversals with a heavy load, near the first resonance"
    reference = "Spong (1987), ASME JDSMC 109(4), 310-319."

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        assert signals.load is not None
        usual, (form,) = _usual(signals.load[:, joints[0]]), self.forms
        swinging, damping = self.shapes[:2]
        shapes = [{"resonance": f, "damping": d} for d in damping.grid for f in swinging.grid]
        stiffening = form["stiffening"] * usual
        soft = [{"resonance": f, "stiffening": stiffening} for f in SOFT_RESONANCES]
        return shapes + [s for s in soft if self.admissible(signals, joints, s)]

    def admissible(self, signals: Signals, joints: Sequence[int], shape: Mapping[str, Any]) -> bool:
        if "stiffening" not in shape:
            return True
        # At larger loads than there are it is a linear spring, and at tiny ones a gap.
        assert signals.load is not None
        load = np.abs(signals.load[:, joints[0]])
        return bool(LEAST_STIFFENING * load.max() < shape["stiffening"] < load.max())

    def moves(self, signals: Signals, joint: int, **shape: Any) -> tuple[Array, Array, Array]:
        assert signals.load is not None
        load, inertia = signals.load[:, joint], _link_inertia(signals, joint)
        if "stiffening" in shape:
            compliance = _compliance(shape["resonance"], float(np.median(inertia)))
            moved = _yields(signals, joint, Stiffening(compliance, shape["stiffening"]))
            return tuple(own / compliance for own in moved)  # type: ignore[return-value]
        return _swing(load, inertia, signals, shape["resonance"], shape["damping"])

    def bounded(
        self, signals: Signals, joints: Sequence[int], shape: Mapping[str, Any], share: float
    ) -> dict[str, Any]:
        inertia = float(np.median(_link_inertia(signals, joints[0])))
        return {**shape, "inertia": inertia, "share": share}

    def least(self, shape: Mapping[str, Any]) -> float:
        # Resonance and inertia determine the compliance of a joint that oscillates freely.
        if "inertia" not in shape:
            return 0.0
        return float(shape["share"] * _compliance(shape["resonance"], shape["inertia"]))

    def fastest(self, shape: Mapping[str, Any]) -> float:
        return float(shape["resonance"])

    def parameters(
        self, coefficients: Array, shape: Mapping[str, Any], signals: Signals | None = None
    ) -> dict[str, Any]:
        compliance = float(coefficients[0])
        stiffness = 1.0 / compliance if compliance else np.inf
        further = {name: shape[name] for name in ("damping", "stiffening") if name in shape}
        return {"K": stiffness, "resonance": shape["resonance"], **further}

    def units(self, prismatic: bool = False) -> dict[str, str]:
        stiffness, torque = ("N/m", "N") if prismatic else ("N m/rad", "N m")
        return {"K": stiffness, "resonance": "Hz", "damping": "1", "stiffening": torque}


#: Resonances, Hz, without load with which the search for a gear that becomes stiffer starts.
SOFT_RESONANCES = (30.0, 10.0, 4.0)
#: Least load from which a gear becomes stiffer, as a share of the largest load.
LEAST_STIFFENING = 0.02


def _usual(load: Array) -> float:
    """Root mean square of a load."""
    return float(np.sqrt(np.mean(load**2)))


def _compliance(resonance: float, inertia: float) -> float:
    """Compliance, rad/(N m), of a spring on which an inertia, kg m^2, has a resonance in Hz."""
    return 1 / (inertia * (2 * np.pi * resonance) ** 2)


class Backlash(_LinkSideEffect):
    """Play between motor and link: the link crosses the gap when its load changes sign.

    In the plain form the link flies from one hard flank to the other. With a ``torque`` in its
    shape the flanks give way, and the link is where the load presses it,
    ``x = tanh(load / torque) / 2`` of the gap.
    """

    kind = "backlash"
    title = "Backlash"
    drawn_against = "load"
    formula = r"\tau(q - g\,x) - \tau(q),\quad m\,\ddot x = \tau_\mathrm{load}/g,\ |x| \le 1/2"
    coefficients = (Coefficient("share", "1", sign=1, is_share=True),)
    # The time of a crossing, and with it the whole column, changes with the root of the gap.
    shapes = (
        Shape("gap", "rad", (0.002, 0.003, 0.0045, 0.006, 0.009, 0.013, 0.02), 2e-4, 0.2),
        Shape("torque", "N m", (), 1e-12, np.inf, scales=False),
    )
    #: As a share of the root mean square of the load.
    forms = ({"torque": 0.2},)
    simplicity = 18
    rivals = ("joint_elasticity", "dahl")
    separating_motion = "slow motion through poses in which the load changes sign"
    reference = "Nordin, Gutman (2002), Automatica 38(10), 1633-1649."

    def too_small(
        self, intervals: Mapping[str, tuple[float, float, float]], signals: Signals
    ) -> str | None:
        gap, low, _ = intervals["gap"]
        if low <= 0:
            return "the interval of the play contains zero"
        steps = [step for step in map(position_step, signals.q.T) if step > gap]
        if len(steps) < signals.n_joints:  # a finer sensor, or one without visible steps
            return None
        return (
            f"the play is less than a step of the position sensors ({gap / min(steps):.2g} of the "
            "smallest), whose rounding looks like it"
        )

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        assert signals.load is not None
        load, unit = signals.load[:, joints[0]], float(signals.unit[joints[0]])
        usual = _usual(load)
        (form,) = self.forms
        shapes: list[dict[str, Any]] = [{"gap": gap * unit} for gap in self.shapes[0].grid]
        soft = [{"gap": gap * unit, "torque": form["torque"] * usual} for gap in SOFT_GAPS]
        return shapes + [s for s in soft if self.admissible(signals, joints, s)]

    def admissible(self, signals: Signals, joints: Sequence[int], shape: Mapping[str, Any]) -> bool:
        if "torque" not in shape:
            return True
        # A gap that the load does not close on both sides is an elastic gear.
        assert signals.load is not None
        low, high = np.quantile(signals.load[:, joints[0]], (CLOSED, 1 - CLOSED)).tolist()
        return bool(0 < shape["torque"] < min(-low, high))

    def moves(self, signals: Signals, joint: int, **shape: Any) -> tuple[Array, Array, Array]:
        assert signals.load is not None
        if "torque" in shape:
            return _yields(signals, joint, SoftGap(shape["gap"], shape["torque"]))
        free = signals.load[:, joint] / _link_inertia(signals, joint)
        position: Array = np.zeros_like(free)
        for rows, step in zip(signals.segments, signals.steps, strict=True):
            position[rows] = _flight(free[rows], step, shape["gap"] / 2)
        return smooth_derivatives(position, signals)

    def bounded(
        self, signals: Signals, joints: Sequence[int], shape: Mapping[str, Any], share: float
    ) -> dict[str, Any]:
        return {**shape, "share": share}

    def least(self, shape: Mapping[str, Any]) -> float:
        # The times of the crossings determine the gap: rounded positions resemble a play of another
        # size.
        return float(shape.get("share", 0.0))

    def parameters(
        self, coefficients: Array, shape: Mapping[str, Any], signals: Signals | None = None
    ) -> dict[str, Any]:
        torque = {"torque": shape["torque"]} if "torque" in shape else {}
        return {"gap": float(coefficients[0]) * shape["gap"], **torque}


#: Gaps with soft flanks with which the search starts, rad: the column of another gap has nearly the
#: same form.
SOFT_GAPS = (0.0015, 0.008, 0.04)
#: Share of the samples in which the load closes a gap on each side, at least.
CLOSED = 0.02


def _flight(acceleration: Array, step: float, half: float, chunk: int = 64) -> Array:
    """Position of a link in a gap of two inelastic flanks, pushed by a given acceleration.

    Parameters
    ----------
    acceleration : ndarray of shape (n_samples,), rad/s^2 or m/s^2
        Acceleration of the link without contact.
    step : float, s
        Time step.
    half : float, rad or m
        Half the gap.
    chunk : int, default=64
        Samples integrated at a time while the link crosses the gap.

    Returns
    -------
    ndarray of shape (n_samples,), rad or m
    """
    n = len(acceleration)
    position = np.empty(n)
    side = 1.0 if acceleration[0] >= 0 else -1.0
    changes = np.flatnonzero(np.diff(np.sign(acceleration))) + 1
    away = {s: np.append(changes[acceleration[changes] * s < 0], n) for s in (1.0, -1.0)}
    k = 0
    while k < n:
        # On a flank until the acceleration points away from it.
        leaving = away[side]
        start = k if acceleration[k] * side < 0 else int(leaving[np.searchsorted(leaving, k)])
        position[k:start] = side * half
        k, x, v = start, side * half, 0.0
        while k < n:
            a = acceleration[k : k + chunk]
            speeds = v + step * np.cumsum(a)
            path = x + step * np.cumsum(speeds)
            hits = np.flatnonzero(np.abs(path) >= half)
            end = int(hits[0]) if len(hits) else len(a)
            position[k : k + end] = path[:end]
            if len(hits):
                k, side = k + end, float(np.sign(path[end]))
                # At least one sample on the flank, or the crossing would never end.
                position[k] = side * half
                k += 1
                break
            k, x, v = k + len(a), float(path[-1]), float(speeds[-1])
    return position
