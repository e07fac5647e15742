# SPDX-License-Identifier: BSD-3-Clause
"""Pre-sliding friction: bristles that bend before they slip.

Every state depends on the path and not on time, so between two reversals it has a closed form;
only the reversals are visited one by one.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from skidyn._signals import Signals
from skidyn.effects._base import Array, Coefficient, Effect, Shape

#: State after a monotone stroke: (state at its start, direction, way gone) -> state.
Law = Callable[[Array, Array, Array], Array]


def _run(position: Array, segments: list[slice], law: Law) -> Array:
    """State of a rate-independent hysteresis along a path, zero at the start of each segment."""
    state = np.zeros(len(position))
    for rows in segments:
        x = position[rows]
        if len(x) < 2:
            continue
        direction = np.sign(np.diff(x))
        moving = np.flatnonzero(direction)
        if len(moving) == 0:
            continue
        # At rest a stroke goes on: fill zeros with the direction before them (at the start, after).
        last = np.searchsorted(moving, np.arange(len(direction)), side="right") - 1
        direction = direction[moving[np.maximum(last, 0)]]
        first = np.r_[0, np.flatnonzero(np.diff(direction)) + 1]
        length = np.diff(np.r_[first, len(direction)])
        ends = np.abs(x[first + length] - x[first])
        start = np.zeros(len(first))
        for k in range(len(first) - 1):
            start[k + 1] = law(start[k], direction[first[k]], ends[k])
        way = np.abs(x[1:] - np.repeat(x[first], length))
        state[rows.start + 1 : rows.stop] = law(np.repeat(start, length), direction, way)
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
        Way over which friction builds up, Fc / sigma0.

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

    def law(start: Array, direction: Array, way: Array) -> Array:
        return direction - (direction - start) * np.exp(-way / presliding)

    return _run(position, segments, law)


def stop_state(position: Array, segments: list[slice], presliding: float) -> Array:
    """Normalised force of one Maxwell-slip element (the stop operator) along a path.

    Parameters
    ----------
    position : ndarray of shape (n_samples,), rad or m
        Joint position.
    segments : list of slice
        Rows within which the path is continuous.
    presliding : float, rad or m
        Way from rest to slip.

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

    def law(start: Array, direction: Array, way: Array) -> Array:
        return np.clip(start + direction * way / presliding, -1.0, 1.0)

    return _run(position, segments, law)


class Dahl(Effect):
    """Friction that builds up over a short way after each reversal."""

    kind = "dahl"
    drawn_against = "dq"
    title = "Dahl friction (pre-sliding)"
    formula = r"F\,h,\quad \tfrac{dh}{dq} = \tfrac{1}{\delta}\,(1 - h\,\mathrm{sign}\,\dot q)"
    coefficients = (Coefficient("F", "N m", sign=1),)
    shapes = (
        Shape("presliding", "rad", (0.003, 0.008, 0.014, 0.022, 0.035, 0.055, 0.09), 0.0005, 0.5),
    )
    family = "hysteresis"
    simplicity = 21
    rivals = ("lugre", "maxwell_slip", "coulomb", "stribeck", "backlash", "joint_elasticity")
    separating_motion = "small reversals inside the pre-sliding range, of several amplitudes"
    reference = "Dahl (1968), A solid friction model, Aerospace Corporation TOR-0158."

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        return dahl_state(signals.q[:, joint], signals.segments, shape["presliding"])[:, None]


class LuGre(Effect):
    """Bristles whose strength follows a Stribeck curve."""

    kind = "lugre"
    drawn_against = "dq"
    title = "LuGre friction"
    formula = r"\left(F_c + \Delta F\,e^{-(\dot q/v_s)^2}\right) h,\quad h\ \text{as in Dahl}"
    coefficients = (Coefficient("F", "N m", sign=1), Coefficient("dF", "N m"))
    shapes = (
        Shape("presliding", "rad", (0.003, 0.008, 0.014, 0.022), 0.0005, 0.5),
        Shape("vs", "rad/s", (0.05, 0.1, 0.16), 0.01, 1.0),
    )
    family = "hysteresis"
    simplicity = 25
    rivals = ("dahl", "maxwell_slip", "stribeck")
    separating_motion = "small reversals and slow constant-speed sweeps in one recording"
    reference = "Canudas de Wit, Olsson, Astrom, Lischinsky (1995), IEEE TAC 40(3), 419-425."

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        state = dahl_state(signals.q[:, joint], signals.segments, shape["presliding"])
        stribeck = np.exp(-((signals.dq[:, joint] / shape["vs"]) ** 2))
        return np.column_stack([state, stribeck * state])


class MaxwellSlip(Effect):
    """Several spring-slider elements in parallel."""

    kind = "maxwell_slip"
    drawn_against = "dq"
    title = "Maxwell-slip friction"
    formula = r"\sum_i F_i\,h_i,\quad \dot h_i = \dot q/\delta_i\ \text{while}\ |h_i| < 1"
    coefficients = (
        Coefficient("F1", "N m"),
        Coefficient("F2", "N m"),
        Coefficient("F3", "N m"),
    )
    shapes = (Shape("presliding", "rad", (0.005, 0.016, 0.025, 0.04, 0.06, 0.1), 0.001, 0.5),)
    family = "hysteresis"
    simplicity = 24
    rivals = ("dahl", "lugre", "coulomb")
    separating_motion = "small reversals inside the pre-sliding range, of several amplitudes"
    reference = "Al-Bender, Lampaert, Swevers (2005), IEEE TAC 50(11), 1883-1887."

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        q, way = signals.q[:, joint], shape["presliding"]
        return np.column_stack(
            [stop_state(q, signals.segments, way * share) for share in (1.0, 0.5, 2.0)]
        )
