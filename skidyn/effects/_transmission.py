# SPDX-License-Identifier: BSD-3-Clause
"""What lies between motor and link: the logged position is the motor's."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache, partial
from typing import Any

import numpy as np

from skidyn._signals import Signals
from skidyn.effects._base import Array, Coefficient, Effect, Shape
from skidyn.effects._derivatives import smooth_derivatives
from skidyn.effects._second_order import second_order_filter


def _oscillator(load: Array, signals: Signals, resonance: float, damping: float) -> Array:
    """Wind-up of a spring-mass under a load, times the stiffness.

    The link swings on its spring: far below the resonance the wind-up follows the load, near it the
    wind-up is larger and late.

    Parameters
    ----------
    load : ndarray of shape (n_samples,), N m or N
        Torque of the rigid body if nothing gave way.
    signals : Signals
        For its segments and clock.
    resonance : float, Hz
        With the motor held.
    damping : float
        Damping ratio.

    Returns
    -------
    ndarray of shape (n_samples,), N m or N
    """
    from scipy.signal import lfilter

    omega = 2 * np.pi * resonance
    wind_up = np.zeros_like(load)
    for rows, step in zip(signals.segments, signals.steps, strict=True):
        if rows.stop - rows.start < 7:
            continue
        rate = 1.0 / step
        # The swing of a link faster than the sampling cannot be seen; it follows at once.
        w = min(omega, rate)
        b, a, settled = _swing(w, damping, rate)
        wind_up[rows] = lfilter(b, a, load[rows], zi=settled * load[rows.start])[0]
    return wind_up


@lru_cache(maxsize=256)
def _swing(omega: float, damping: float, rate: float) -> tuple[Array, Array, Array]:
    """Digital filter of a spring-mass at a sampling rate, and its state under a unit load."""
    from scipy.signal import lfilter_zi

    b, a = second_order_filter((0.0, 0.0, omega**2), omega, damping, rate)
    return b, a, lfilter_zi(b, a)


#: Step of the difference quotients: they err by about this share, and round by a thousandth of it.
_STEP = 1e-6


def _torque_slopes(signals: Signals, joint: int) -> tuple[Array, Array, Array]:
    """Change of all torques per change of a joint's position, velocity and acceleration.

    Shapes only change how the link moves, so that they share these slopes. They are kept for the
    joint that was asked for last: shapes of one joint follow each other, and all joints together
    would take many times the memory of the log.

    Returns
    -------
    by_position, by_velocity, by_acceleration : ndarray of shape (n_samples, n_joints)
        N m/rad, N m s/rad, kg m^2, or what takes their place where joints slide.
    """
    kept: dict[int, tuple[Array, Array, Array]] = signals.once("torque slopes", dict)
    if joint not in kept:
        kept.clear()
        kept[joint] = _differentiate_torque(signals, joint)
    return kept[joint]


def _differentiate_torque(signals: Signals, joint: int) -> tuple[Array, Array, Array]:
    robot = signals.robot
    assert robot is not None
    inverse_dynamics = partial(robot.inverse_dynamics, parameters=signals.inertial_parameters)
    q, dq, ddq = signals.q, signals.dq, signals.ddq
    here: Array = signals.once("torque", lambda: inverse_dynamics(q, dq, ddq))
    direction = np.zeros(signals.n_joints)
    direction[joint] = 1.0
    step = _STEP * signals.unit[joint]
    by_position = (inverse_dynamics(q + step * direction, dq, ddq) - here) / step
    by_velocity = (inverse_dynamics(q, dq + step * direction, ddq) - here) / step
    by_acceleration = inverse_dynamics(
        q, np.zeros_like(dq), np.broadcast_to(direction, q.shape), gravity=(0.0, 0.0, 0.0)
    )
    return by_position, by_velocity, by_acceleration


def _link_inertia(signals: Signals, joint: int) -> Array:
    """Inertia that the free link presents to its own joint, kg m^2 or kg."""
    inertia = _torque_slopes(signals, joint)[2][:, joint]
    # Identified parameters need not be consistent; an inertia that vanishes would fly at once.
    inertia = np.maximum(inertia, 0.05 * np.abs(np.median(inertia)))
    return np.asarray(np.maximum(inertia, np.finfo(float).tiny))


class _LinkSideEffect(Effect):
    """The link is displaced from the logged position by ``-c s(load)``.

    To first order the torque of all joints changes by the directional derivative of inverse
    dynamics along that displacement, which is what the columns hold.
    """

    needs = ("robot", "load", "time")
    moves_link = True

    def displacement(self, signals: Signals, joint: int, **shape: Any) -> Array:
        """Displacement of the link for a unit coefficient, shape (n_samples,)."""
        raise NotImplementedError

    def torque_columns(
        self, signals: Signals, joints: Sequence[int], **shape: Any
    ) -> dict[int, Array]:
        (joint,) = joints
        moves = smooth_derivatives(self.displacement(signals, joint, **shape), signals)
        slopes = _torque_slopes(signals, joint)
        columns = {}
        for j in range(signals.n_joints):
            change = np.zeros(signals.n_samples)
            for slope, move in zip(slopes, moves, strict=True):
                change -= slope[:, j] * move
            columns[j] = change[:, None]
        return columns


class JointElasticity(_LinkSideEffect):
    """A gear that winds up under load, with the encoder on the motor side."""

    kind = "joint_elasticity"
    drawn_against = "load"
    title = "Joint elasticity"
    formula = r"\tau(q - \tau_\mathrm{load}/K) - \tau(q)"
    coefficients = (Coefficient("compliance", "rad/(N m)", sign=1),)
    shapes = (
        Shape("resonance", "Hz", (25.0, 10.0, 6.5, 4.5, 3.2), 1.0, 100.0, scales=False),
        Shape("damping", "1", (0.05,), 0.005, 1.0, scales=False),
    )
    simplicity = 19
    rivals = ("time_delay", "rotor_inertia", "backlash", "base_tilt")
    separating_motion = "fast reversals with a heavy load, near the first resonance"
    reference = "Spong (1987), ASME JDSMC 109(4), 310-319."

    def displacement(self, signals: Signals, joint: int, **shape: Any) -> Array:
        assert signals.load is not None
        return _oscillator(signals.load[:, joint], signals, **shape)

    def parameters(
        self, coefficients: Array, shape: Mapping[str, Any], signals: Signals | None = None
    ) -> dict[str, Any]:
        compliance = float(coefficients[0])
        return {"K": 1.0 / compliance if compliance else np.inf, **shape}

    def units(self, prismatic: bool = False) -> dict[str, str]:
        return {"K": "N/m" if prismatic else "N m/rad", "resonance": "Hz", "damping": "1"}


class Backlash(_LinkSideEffect):
    """Play between motor and link: the link flies across when its load changes sign."""

    kind = "backlash"
    title = "Backlash"
    is_swift = True
    drawn_against = "load"
    formula = r"\tau(q - g\,x) - \tau(q),\quad m\,\ddot x = \tau_\mathrm{load}/g,\ |x| \le 1/2"
    coefficients = (Coefficient("share", "1", sign=1, is_share=True),)
    # The time of a flight, and with it everything, changes with the root of the gap.
    shapes = (Shape("gap", "rad", (0.002, 0.003, 0.0045, 0.006, 0.009, 0.013, 0.02), 2e-4, 0.2),)
    simplicity = 18
    rivals = ("joint_elasticity", "dahl")
    separating_motion = "slow motion through poses in which the load changes sign"
    reference = "Nordin, Gutman (2002), Automatica 38(10), 1633-1649."

    def displacement(self, signals: Signals, joint: int, **shape: Any) -> Array:
        assert signals.load is not None
        free = signals.load[:, joint] / _link_inertia(signals, joint)
        position: Array = np.zeros_like(free)
        for rows, step in zip(signals.segments, signals.steps, strict=True):
            position[rows] = _flight(free[rows], step, shape["gap"] / 2)
        return position

    def parameters(
        self, coefficients: Array, shape: Mapping[str, Any], signals: Signals | None = None
    ) -> dict[str, Any]:
        return {"gap": float(coefficients[0]) * shape["gap"]}


def _flight(acceleration: Array, step: float, half: float, chunk: int = 64) -> Array:
    """Position of a link in a gap of two inelastic flanks, pushed by a given acceleration.

    Parameters
    ----------
    acceleration : ndarray of shape (n_samples,), rad/s^2 or m/s^2
        Of the link if nothing held it.
    step : float, s
        Time step.
    half : float, rad or m
        Half the gap.
    chunk : int, default=64
        Samples integrated at a time while the link flies.

    Returns
    -------
    ndarray of shape (n_samples,), rad or m
    """
    n = len(acceleration)
    position = np.empty(n)
    side = 1.0 if acceleration[0] >= 0 else -1.0
    changes = np.flatnonzero(np.diff(np.sign(acceleration))) + 1
    k = 0
    while k < n:
        # On a flank until the push turns away from it.
        later = changes[np.searchsorted(changes, k) :]
        leaving = later[acceleration[later] * side < 0]
        start = k if acceleration[k] * side < 0 else (int(leaving[0]) if len(leaving) else n)
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
                # At least one sample on the flank, or the flight would never end.
                position[k] = side * half
                k += 1
                break
            k, x, v = k + len(a), float(path[-1]), float(speeds[-1])
    return position
