# SPDX-License-Identifier: BSD-3-Clause
"""Fits of all joints together to torques at other times, with identified bodies common to them."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array, Signals
from skidyn.measurement._fits import SAMPLES, Fits, friction
from skidyn.measurement._loads import LOAD, n_loads
from skidyn.measurement._peak import peak
from skidyn.measurement._reading import Reading
from skidyn.measurement._robust import FEWEST, RobustFit, fit_together, gains_of
from skidyn.robots import base_parameter_index

#: Distance of the lags of a parabola, s.
NEAR = 2e-3
#: Largest change of a lag, s, or twice its standard error.
FAR = 1e-3
#: Least velocity of rows that count, in rad/s (a tenth of it in m/s).
SLIDING = 0.05


class JointFit:
    """Fits of all joints together to changed torques, with common bodies.

    Parameters
    ----------
    fits : Fits
        Rows.
    changed : sequence of int
        Joints, from 0, whose torque is changed.
    """

    def __init__(self, fits: Fits, changed: Sequence[int]) -> None:
        self.fits, self.changed = fits, list(changed)
        self.signals = s = Reading().motion(fits.signals)
        self.base = base_parameter_index(fits.robot)
        self.joints: list[int] = []
        self.designs: list[Array] = []
        self.places: list[NDArray[np.int64]] = []
        self.rows: list[NDArray[np.bool_]] = []
        self.own: list[Array] = []
        first = len(self.base) + n_loads(fits.carrying)
        for j, (bodies, felt, carried) in enumerate(fits.felt_bodies(fits.robot, s)):
            use = sliding(fits, s, j)
            if not fits.usable(j) or use.sum() < FEWEST:
                continue
            own = own_columns(s, j)
            self.joints.append(j)
            self.rows.append(use)
            self.own.append(own)
            self.designs.append(np.hstack([bodies, carried, fits.average(own)])[use])
            loads = len(self.base) + np.arange(carried.shape[1])
            self.places.append(np.concatenate([felt, loads, first + np.arange(own.shape[1])]))
            first += own.shape[1]
        self.torque = fits.average(fits.torque)

    def changing(self, changed: Sequence[int]) -> JointFit:
        """The same fit, in which the torque of other joints is changed."""
        other = copy(self)
        other.changed = list(changed)
        return other

    def with_columns(self, columns: Array) -> JointFit:
        """The same fit with further columns of each joint, shape (n_rows, n_fitted_joints, n)."""
        other, n = copy(self), columns.shape[2]
        first = 1 + max((int(place.max()) for place in self.places), default=-1)
        other.designs, other.places = [], []
        for j, (design, place, use) in enumerate(
            zip(self.designs, self.places, self.rows, strict=True)
        ):
            other.designs.append(np.hstack([design, columns[use, j]]))
            other.places.append(np.concatenate([place, first + n * j + np.arange(n)]))
        return other

    def moved(self, signals: Signals) -> JointFit:
        """The same coefficients for another motion, whose residual :meth:`left` gives."""
        other = copy(self)
        other.signals = signals
        other.own = [own_columns(signals, j) for j in self.joints]
        return other

    def fit(self, samples: Array) -> list[RobustFit]:
        """Fits to the torque of all samples of the rows, shape (n_samples, n_joints)."""
        torque = self.torque.copy()
        torque[:, self.changed] = self.fits.average(samples)[:, self.changed]
        targets = [torque[use, j] for j, use in zip(self.joints, self.rows, strict=True)]
        return fit_together(self.designs, self.places, targets)

    def fit_at(self, lag: float | Array) -> list[RobustFit]:
        """Fits to the torque that was recorded a lag (s) after the motion, or lags of samples."""
        return self.fit(self.fits.torque_at(lag))

    def likelihood(self, samples: Array) -> float:
        """Log-likelihood of these fits."""
        return sum(fit.likelihood for fit in self.fit(samples))

    def likelihood_at(self, lag: float | Array) -> float:
        """Log-likelihood of these fits."""
        return sum(fit.likelihood for fit in self.fit_at(lag))

    def left(self, samples: Array, fitted: Sequence[RobustFit]) -> Array:
        """Residual torque of every sample, for the fitted joints."""
        robot, s = self.fits.robot, self.signals
        parameters = np.zeros((robot.n_bodies, 10))
        number = self.fits.carrying
        loads = np.zeros(n_loads(number))
        for place, fit in zip(self.places, fitted, strict=True):
            bodies = place < len(self.base)
            parameters.flat[self.base[place[bodies]]] = fit.coefficients[bodies]
            carried = (place >= len(self.base)) & (place < len(self.base) + len(loads))
            loads[place[carried] - len(self.base)] = fit.coefficients[carried]
        rigid = robot.inverse_dynamics(s.q, s.dq, s.ddq, parameters=parameters)
        for run, load in zip(np.unique(number)[1:], loads.reshape(-1, len(LOAD)), strict=False):
            rows = np.repeat(number == run, SAMPLES)
            carried_only = np.zeros((robot.n_bodies, 10))
            carried_only.flat[10 * robot.n_bodies + LOAD] = load
            rigid[rows] += robot.inverse_dynamics(
                s.q[rows], s.dq[rows], s.ddq[rows], parameters=carried_only
            )
        own = [
            columns @ fit.coefficients[-columns.shape[1] :]
            for columns, fit in zip(self.own, fitted, strict=True)
        ]
        return np.asarray((samples - rigid)[:, self.joints] - np.column_stack(own))


def refined_lag(fits: Fits, start: float, error: float, late: Sequence[int]) -> float:
    """Lag of some torques at which all joints together are explained best.

    Bodies are common to all joints here, and residuals have Student's t distribution, so that it is
    more accurate than from single joints, but takes more time. If it is far from the lags of single
    joints, a missing effect has influenced it, and it is not changed.

    Parameters
    ----------
    fits : Fits
        Rows.
    start : float, s
        Approximate lag.
    error : float, s
        Standard error of the start.
    late : sequence of int
        Joints, from 0, whose torque is late; that of others is not.

    Returns
    -------
    float, s
    """
    lag = peak(JointFit(fits, late).likelihood_at, start, NEAR)
    return lag if abs(lag - start) < max(2 * error, FAR) else start


def lag_gain(fits: Fits, lag: float, late: Sequence[int]) -> float:
    """Log-likelihood that a lag of some torques gains, with bodies common to all joints.

    Parameters
    ----------
    fits : Fits
        Rows.
    lag : float, s
    late : sequence of int
        Joints, from 0.
    """
    together = JointFit(fits, late)
    return sum(gains_of(together.fit(fits.torque), together.fit_at(lag)))


def sliding(fits: Fits, signals: Signals, joint: int) -> NDArray[np.bool_]:
    """Rows in which a joint slides in one direction; friction changes sign while it sticks."""
    speed = (signals.dq[:, joint] / signals.unit[joint]).reshape(fits.n_rows, -1)
    fast = np.abs(speed).min(axis=1) > SLIDING
    return np.asarray(fast & (np.abs(np.sign(speed).sum(axis=1)) == speed.shape[1]))


def own_columns(signals: Signals, joint: int) -> Array:
    """Columns of a joint in addition to those of the bodies."""
    ones = np.ones(signals.n_samples)
    return np.column_stack([friction(signals, joint), _bent_friction(signals, joint), ones])


def _bent_friction(signals: Signals, joint: int) -> Array:
    """Friction that falls or rises with speed; as viscous friction it would look like a lead."""
    speed = signals.dq[:, joint] / signals.unit[joint]
    sign = signals.sign[:, joint]
    falling = [sign * np.exp(-np.abs(speed) / slow) for slow in (0.03, 0.1, 0.3)]
    return np.column_stack([*falling, speed * np.abs(speed)])
