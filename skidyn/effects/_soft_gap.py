# SPDX-License-Identifier: BSD-3-Clause
"""Load of a link behind a gap with soft flanks, from the motion of its motor."""

from __future__ import annotations

from collections.abc import Sequence

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


class LoadOfLink:
    r"""The load that a link behind a gap has while the encoder shows the motion of its motor.

    The link is at :math:`x = -(g/2) \tanh(\ell/\tau_0)` from the position of the motor. The motor
    follows the motion of the link and in addition crosses the gap, so that the load computed from
    its motion, :math:`\ell_m`, contains accelerations that the link does not have. The load of the
    link is the smoothest one that explains it, the minimum over :math:`\ell` of

    .. math::

        \sum |\ell - S_q x - S_{\dot q} \dot x - S_{\ddot q} \ddot x - \ell_m|^2
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
    gap : float, rad or m
        Whole gap.
    torque : float, N m or N
        Load that presses the link 76 % of the way to a flank.
    """

    def __init__(
        self, signals: Signals, joint: int, slopes: Sequence[Array], gap: float, torque: float
    ) -> None:
        assert signals.load is not None
        self.logged = signals.load[:, joint]
        self.gap, self.torque = gap, torque
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

    def position(self, load: Array) -> Array:
        """Position of the motor minus that of the link, rad or m, (n_samples,), for a load."""
        return np.asarray(self.gap / 2 * np.tanh(load / self.torque))

    def found(self) -> Array:
        """Load of the link, N m or N, of shape (n_samples,)."""
        from scipy.linalg import solveh_banded

        if len(self.logged) < 4:
            return self.logged
        start = 64 * self.smooth  # twice the time
        start[-1] += 1.0
        load = np.asarray(solveh_banded(start, self.logged))
        left, size = self._left(load)
        for _ in range(STEPS):
            move, share, last = solveh_banded(*self._equations(load, left)), 1.0, size
            while True:
                tried = load - share * move
                left_then, size_then = self._left(tried)
                if size_then < size or share < SHORTEST:
                    break
                share /= 2
            if size_then < size:
                load, left, size = tried, left_then, size_then
            if last - size < SETTLED * last:
                break
        return load

    def _left(self, load: Array) -> tuple[Array, float]:
        """What a load leaves of the logged one, and the sum that is minimized."""
        x = self.position(load)
        left = load + self.at * x - self.logged
        left[1:] += self.before[1:] * x[:-1]
        left[:-1] += self.after[:-1] * x[1:]
        rough = self.stretch * np.diff(load, 3)
        return left, float(left @ left + rough @ rough)

    def _equations(self, load: Array, left: Array) -> tuple[Array, Array]:
        """Upper diagonals and right side of the equations of one step."""
        ratio = np.clip(load / self.torque, -300, 300)
        slope = self.gap / (2 * self.torque) / np.cosh(ratio) ** 2
        down, own, up = self.before.copy(), 1 + self.at * slope, self.after.copy()
        down[1:] *= slope[:-1]
        up[:-1] *= slope[1:]
        bands = self.smooth.copy()
        bands[3] += own**2
        bands[3, :-1] += down[1:] ** 2
        bands[3, 1:] += up[:-1] ** 2
        bands[2, 1:] += own[:-1] * up[:-1] + down[1:] * own[1:]
        bands[1, 2:] += down[1:-1] * up[1:-1]
        bands[3] += ROUNDING * bands[3].max()
        right = own * left + _product(self.smooth, load)
        right[:-1] += down[1:] * left[1:]
        right[1:] += up[:-1] * left[:-1]
        return bands, right


def _squared_third_differences(weight: Array) -> Array:
    """Upper diagonals of the sum of squared third differences, each times a weight, (4, n)."""
    n, parts = len(weight) + 3, (-1.0, 3.0, -3.0, 1.0)
    bands = np.zeros((4, n))
    for i in range(4):
        for k in range(i, 4):
            bands[3 - (k - i), k : n - 3 + k] += parts[i] * parts[k] * weight**2
    return bands


def _product(bands: Array, vector: Array) -> Array:
    """Product of a symmetric matrix, given by its upper diagonals, with a vector."""
    product = bands[3] * vector
    for k in (1, 2, 3):
        product[:-k] += bands[3 - k, k:] * vector[k:]
        product[k:] += bands[3 - k, k:] * vector[:-k]
    return np.asarray(product)
