# SPDX-License-Identifier: BSD-3-Clause
"""A reading of the columns of a log: signs, order, zeros, scales and gravity."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from skidyn._signals import Signals


@dataclass(frozen=True)
class Reading:
    """A reading of the columns of a log; the default leaves them unchanged.

    Attributes
    ----------
    flip_motion, flip_torque : frozenset of int
        Joints, from 0, whose positions and velocities, or torques, have the opposite sign.
    order, torque_order : tuple of int or None
        Column of each joint: for all signals, and for the torque in addition.
    summed : tuple of (int, int)
        Joints whose position includes that of the previous joint, and its sign: angles relative to
        the base, as for arms whose links are driven by parallelograms.
    zero : tuple of (int, float)
        Joints and their recorded positions at the robot's zero.
    gravity : tuple of float or None
        Gravity in the base frame, m/s^2; the robot's own if None.
    size, stretch : float
        Factors of positions, and of time, to be divided out.
    sized : frozenset of int or None
        Joints, from 0, whose positions have that factor; all if None.
    """

    flip_motion: frozenset[int] = frozenset()
    flip_torque: frozenset[int] = frozenset()
    order: tuple[int, ...] | None = None
    torque_order: tuple[int, ...] | None = None
    summed: tuple[tuple[int, int], ...] = ()
    zero: tuple[tuple[int, float], ...] = ()
    gravity: tuple[float, float, float] | None = None
    size: float = 1.0
    stretch: float = 1.0
    sized: frozenset[int] | None = None

    @property
    def of_motion(self) -> Reading:
        """The same without what concerns the torque alone."""
        return replace(self, flip_torque=frozenset(), torque_order=None)

    def motion(self, signals: Signals) -> Signals:
        """Motion of recorded signals in this reading."""
        n = signals.n_joints
        order = slice(None) if self.order is None else list(self.order)
        sign, zero, size = np.ones(n), np.zeros(n), np.full(n, self.size)
        sign[list(self.flip_motion)] = -1
        for joint, value in self.zero:
            zero[joint] = value
        if self.sized is not None:
            size[[j for j in range(n) if j not in self.sized]] = 1.0
        q, dq, ddq = (
            values[:, order] * (sign * self.stretch**k / size)
            for k, values in enumerate((signals.q, signals.dq, signals.ddq))
        )
        if self.summed:
            apart = np.eye(n)
            for joint, before in self.summed:
                apart[joint - 1, joint] = -before
            q, dq, ddq = q @ apart, dq @ apart, ddq @ apart
        return signals.with_(q=q - zero, dq=dq, ddq=ddq)

    def torque_column(self, joint: int) -> tuple[int, float]:
        """Column of the torque of a joint, and its sign."""
        column = joint if self.torque_order is None else self.torque_order[joint]
        column = column if self.order is None else self.order[column]
        return column, -1.0 if joint in self.flip_torque else 1.0
