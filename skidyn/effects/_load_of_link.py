# SPDX-License-Identifier: BSD-3-Clause
"""Load of a link behind a gap with soft flanks or a gear that stiffens, from its motor's motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from skidyn._signals import Array, Signals

#: Time, s, within which a load does not turn; faster changes are due to the crossing of a gap.
TURN = 0.02
#: Most steps of the solution, relative change of its error at which it ends, and least share of a
#: step.
STEPS, SETTLED, SHORTEST = 10, 1e-3, 0.05
#: Ridge of the equations of a step, relative to their largest diagonal element: a link that gravity
#: holds at the top of a soft gap makes them singular to rounding errors.
ROUNDING = 1e-12


class Yielding(Protocol):
    """How far a motor turns ahead of its link under a load."""

    def position(self, load: Array) -> Array:
        """Position of the motor minus that of the link, rad or m, for a load in N m or N."""
        raise NotImplementedError

    def slope(self, load: Array) -> Array:
        """Change of this position per change of the load, rad/(N m) or m/N."""
        raise NotImplementedError


@dataclass(frozen=True)
class SoftGap:
    """A gap whose flanks give way: half of it times tanh(load / torque).

    Parameters
    ----------
    gap : float, rad or m
        Whole gap.
    torque : float, N m or N
        Load that presses the link 76 % of the way to a flank.
    """

    gap: float
    torque: float

    def position(self, load: Array) -> Array:
        """Position of the motor minus that of the link."""
        return np.asarray(self.gap / 2 * np.tanh(load / self.torque))

    def slope(self, load: Array) -> Array:
        """Its change per change of the load."""
        ratio = np.clip(load / self.torque, -300, 300)
        return np.asarray(self.gap / (2 * self.torque) / np.cosh(ratio) ** 2)


@dataclass(frozen=True)
class Stiffening:
    """A gear that becomes stiffer under load: compliance times torque times asinh(load / torque).

    Parameters
    ----------
    compliance : float, rad/(N m) or m/N
        Without load.
    torque : float, N m or N
        Load at which the compliance is 71 % of this.
    """

    compliance: float
    torque: float

    def position(self, load: Array) -> Array:
        """Position of the motor minus that of the link."""
        return np.asarray(self.compliance * self.torque * np.arcsinh(load / self.torque))

    def slope(self, load: Array) -> Array:
        """Its change per change of the load."""
        return np.asarray(self.compliance / np.hypot(1.0, load / self.torque))


class LoadOfLink:
    r"""The load that a link has while the encoder shows the motion of its motor.

    The motor is :math:`x(\ell)` ahead of the link. It follows the motion of the link and in
    addition winds up the gear or crosses the gap, so that the load computed from its motion,
    :math:`\ell_m`, contains accelerations that the link does not have. The load of the link is the
    smoothest one that explains it, the minimum over :math:`\ell` of

    .. math::

        \sum |\ell + S_q x + S_{\dot q} \dot x + S_{\ddot q} \ddot x - \ell_m|^2
        + \sum |T^3 \dddot\ell|^2

    with the slopes :math:`S` of inverse dynamics and a time :math:`T`. It is found by the
    Gauss-Newton method; all matrices have few diagonals.

    Parameters
    ----------
    signals : Signals
        Motion of the motor and its load.
    joint : int
        Joint, from 0.
    slopes : sequence of 3 ndarray of shape (n_samples,)
        Change of the joint's torque per change of its position, velocity and acceleration.
    """

    def __init__(self, signals: Signals, joint: int, slopes: Sequence[Array]) -> None:
        assert signals.load is not None
        self.logged = signals.load[:, joint]
        stiff, damp, inert = slopes
        # Factors of the positions before, at and after each sample; 0 at the ends of recordings.
        self.before, self.at, self.after = (np.zeros(signals.n_samples) for _ in range(3))
        self.stretch = np.zeros(signals.n_samples)
        for rows, step in zip(signals.segments, signals.steps, strict=True):
            own = slice(rows.start + 1, rows.stop - 1)
            self.before[own] = inert[own] / step**2 - damp[own] / (2 * step)
            self.after[own] = inert[own] / step**2 + damp[own] / (2 * step)
            self.at[own] = stiff[own] - 2 * inert[own] / step**2
            self.stretch[rows.start : max(rows.start, rows.stop - 3)] = (TURN / step) ** 3
        self.stretch = self.stretch[:-3]
        self.smooth = _squared_third_differences(self.stretch)
        start = 64 * self.smooth  # twice the time
        start[0] += 1.0
        self.start = _solution(start, self.logged) if len(self.logged) > 3 else self.logged

    def behind(self, gear: Yielding) -> Array:
        """Load of a link behind a gear, N m or N, of shape (n_samples,)."""
        if len(self.logged) < 4:
            return self.logged
        load = self.start
        left, size = self._left(gear, load)
        for _ in range(STEPS):
            move, share, last = _solution(*self._equations(gear, load, left)), 1.0, size
            while True:
                tried = load - share * move
                left_then, size_then = self._left(gear, tried)
                if size_then < size or share < SHORTEST:
                    break
                share /= 2
            if size_then < size:
                load, left, size = tried, left_then, size_then
            if last - size < SETTLED * last:
                break
        return load

    def _left(self, gear: Yielding, load: Array) -> tuple[Array, float]:
        """What a load leaves of the logged one, and the sum that is minimized."""
        x = gear.position(load)
        left = load + self.at * x - self.logged
        left[1:] += self.before[1:] * x[:-1]
        left[:-1] += self.after[:-1] * x[1:]
        rough = self.stretch * np.diff(load, 3)
        return left, float(left @ left + rough @ rough)

    def _equations(self, gear: Yielding, load: Array, left: Array) -> tuple[Array, Array]:
        """Lower diagonals and right side of the equations of one step."""
        slope = gear.slope(load)
        down, own, up = self.before.copy(), 1 + self.at * slope, self.after.copy()
        down[1:] *= slope[:-1]
        up[:-1] *= slope[1:]
        bands = self.smooth.copy()
        bands[0] += own**2
        bands[0, :-1] += down[1:] ** 2
        bands[0, 1:] += up[:-1] ** 2
        bands[1, :-1] += own[:-1] * up[:-1] + down[1:] * own[1:]
        bands[2, :-2] += down[1:-1] * up[1:-1]
        bands[0] += ROUNDING * bands[0].max()
        right = own * left + _product(self.smooth, load)
        right[:-1] += down[1:] * left[1:]
        right[1:] += up[:-1] * left[:-1]
        return bands, right


def _solution(bands: Array, right: Array) -> Array:
    """Solution of symmetric equations, given by their lower diagonals."""
    from scipy.linalg import solveh_banded

    # upper diagonals take twice as long
    return np.asarray(solveh_banded(bands, right, lower=True))


def _squared_third_differences(weight: Array) -> Array:
    """Lower diagonals of the sum of squared third differences, each times a weight, (4, n)."""
    n, parts = len(weight) + 3, (-1.0, 3.0, -3.0, 1.0)
    bands = np.zeros((4, n))
    for i in range(4):
        for k in range(i, 4):
            bands[k - i, i : n - 3 + i] += parts[i] * parts[k] * weight**2
    return bands


def _product(bands: Array, vector: Array) -> Array:
    """Product of a symmetric matrix, given by its lower diagonals, with a vector."""
    product = bands[0] * vector
    for k in (1, 2, 3):
        product[:-k] += bands[k, :-k] * vector[k:]
        product[k:] += bands[k, :-k] * vector[:-k]
    return np.asarray(product)
