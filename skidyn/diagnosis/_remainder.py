# SPDX-License-Identifier: BSD-3-Clause
"""Remaining error of a completed model, by cause.

Noise is due to the sensors: the torque sensor's fast noise, and the torque caused by the noise of
the encoders through differentiation and inertia. Predictable is the part of the residual that the
logged signals still explain. The remainder is neither.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array, Signals
from skidyn.diagnosis._blocks import variance_inflation
from skidyn.diagnosis._comparison import Comparison
from skidyn.diagnosis._noise import as_measured, sensor_noise
from skidyn.diagnosis._rule import (
    COLOURED_ALIKE,
    COLOURED_FEWEST_JOINTS,
    COLOURED_MOST,
    REMAINDER_CORRELATED,
    REMAINDER_PREDICTABLE_SHARE,
    REMAINDER_SHARE_OF_RANGE,
    REMAINDER_SLOW_SHARE_OF_RANGE,
    REMAINDER_SLOW_TIMES_NOISE,
    REMAINDER_TIMES_NOISE,
    SLOW_ALIKE,
)
from skidyn.evidence import Fit, Problem, smooth_motion

#: Quantiles that define the range of the torque.
RANGE = (0.005, 0.995)
#: Number of samples on which the noise of the positions is propagated to the torque.
MOST_SAMPLES = 4000


@dataclass(frozen=True)
class Remainder:
    """Error of the completed model on the samples judged, by cause.

    Parameters
    ----------
    sensor_noise : ndarray of shape (n_joints,), N m or N
        Noise of the torque sensor, which changes faster than any motion.
    position_noise : ndarray of shape (n_joints,), N m or N
        Torque of the model caused by the noise of the logged positions.
    predictable : ndarray of shape (n_joints,), N m or N
        Error that a function of the logged signals would still remove.
    left : ndarray of shape (n_joints,), N m or N
        Remaining error due to none of these.
    inflation : ndarray of shape (n_joints,)
        Inflation of the variance of slow torques by the autocorrelation of the error: about 1 for
        white noise, up to 2 for coloured noise, more for a missing torque.
    material : ndarray of shape (n_joints,) of bool
        Whether the error exceeds noise and the usual error of a healthy robot; or its slow part is
        correlated, unlike noise, and exceeds averaged noise; or the predictable part exceeds the
        noise.
    coloured : bool
        Whether the error exceeds the fast noise by a similar factor on all joints, as noise that is
        correlated in time does; a missing torque is larger on some joints than on others.
    extrapolated : ndarray of shape (n_joints,) of bool or None
        Joints whose torque the model explains up to noise if it is fitted to the whole log: their
        held-out error is due to extrapolation.

    Examples
    --------
    >>> diagnosis.remainder.left  # doctest: +SKIP
    array([0.02, 0.41])
    """

    sensor_noise: Array
    position_noise: Array
    predictable: Array
    left: Array
    inflation: Array
    material: NDArray[np.bool_]
    coloured: bool = False
    extrapolated: NDArray[np.bool_] | None = None

    @property
    def noise(self) -> Array:
        """Noise of torque and position sensors together, (n_joints,), N m or N."""
        total: Array = np.hypot(np.nan_to_num(self.sensor_noise), self.position_noise)
        return total

    @property
    def coarse(self) -> NDArray[np.bool_]:
        """Joints on which the noise of positions is more than twice that of the torque."""
        return np.asarray(self.position_noise > 2 * np.nan_to_num(self.sensor_noise))


def torque_range(torque: Array) -> Array:
    """Range of the measured torque of every joint without its outliers, (n_joints,)."""
    low, high = np.quantile(torque, RANGE, axis=0)
    return np.asarray(high - low)


def root_mean_square(values: Array) -> float:
    """Root mean square of some values in their unit, 0 of none."""
    return float(np.sqrt(np.mean(values**2))) if len(values) else 0.0


def find_remainder(
    problem: Problem,
    fit: Fit,
    noises: tuple[Array, Array, Array],
    comparison: Comparison,
    share: Array,
) -> Remainder:
    """Split the error of the completed model by cause.

    Parameters
    ----------
    problem : Problem
        Motion and rows.
    fit : Fit
        Fit of the completed model, with the residual of averaged rows.
    noises : tuple of three ndarrays of shape (n_joints,), N m or N
        Noise of the torque sensor, of positions, and of these in averaged rows
        (:func:`position_noises`).
    comparison : Comparison
        Measured torque and its held-out prediction by this model.
    share : ndarray of shape (n_joints,)
        Share of the squared error of averaged rows that is predictable.
    """
    (sensor, position, slow_position), averaged = noises, fit.residual
    noise = np.hypot(np.nan_to_num(sensor), position)
    rmse = comparison.rmse(judged=True)
    excess = np.maximum(rmse**2 - noise**2, 0.0)
    predictable = np.sqrt(np.minimum(share * rmse**2, excess))
    left = np.sqrt(np.maximum(excess - predictable**2, 0.0))
    span = torque_range(comparison.measured)
    material = (rmse > REMAINDER_TIMES_NOISE * noise) & (left > REMAINDER_SHARE_OF_RANGE * span)
    extrapolated = np.zeros_like(material)
    if material.any():
        fitted = _error_of_fit(problem, fit, comparison)
        extrapolated = material & (fitted <= REMAINDER_TIMES_NOISE * noise)
        material &= ~extrapolated
    rows = np.array([root_mean_square(e) for e in averaged])
    inflation = variance_inflation(problem, averaged, range(len(averaged)))
    # averaged rows have the scale of white noise, which that of positions is not
    at_rows = np.hypot(np.nan_to_num(sensor), slow_position)
    slow = (inflation > REMAINDER_CORRELATED) & (rows > REMAINDER_SLOW_TIMES_NOISE * at_rows)
    material |= slow & (left > REMAINDER_SLOW_SHARE_OF_RANGE * span)
    coloured = bool(material.any()) and _is_alike(rmse, noise, COLOURED_ALIKE, COLOURED_MOST)
    coloured &= _is_alike(rows, at_rows, SLOW_ALIKE)
    if coloured:
        material[:] = False
    material |= (predictable > noise) & (predictable > REMAINDER_PREDICTABLE_SHARE * span)
    extrapolated &= ~material
    return Remainder(
        sensor, position, predictable, left, inflation, material, coloured, extrapolated
    )


def _error_of_fit(problem: Problem, fit: Fit, comparison: Comparison) -> Array:
    """Error of a fit on the samples judged of the log that it was fitted to, (n_joints,), N m or N.

    It includes what the coefficients took of the noise of averaged rows.
    """
    residual = problem.torque - problem.explained(fit)
    fitted = replace(comparison, predicted=comparison.measured - residual)
    n_rows = sum(map(len, fit.residual))
    taken = n_rows / max(n_rows - len(fit.coefficients), 1)
    return np.asarray(fitted.rmse(judged=True) * np.sqrt(taken))


def _is_alike(errors: Array, noise: Array, factor: float, most: float = np.inf) -> bool:
    """Whether errors exceed the noise by a similar, small factor on all of several joints."""
    moves = noise > 0
    ratio = errors[moves] / noise[moves]
    few = moves.sum() < COLOURED_FEWEST_JOINTS
    return not few and bool(ratio.max() < min(most, factor * ratio.min()))


def noise_level(problem: Problem, residual: Array) -> Array:
    """Noise of torque and position sensors together, with which errors are compared.

    Parameters
    ----------
    problem : Problem
        Motion and rows.
    residual : ndarray of shape (n_samples, n_joints), N m or N
        Held-out residual of a model.

    Returns
    -------
    ndarray of shape (n_joints,), N m or N
    """
    sensor = np.nan_to_num(sensor_noise(problem.signals, residual, problem.measured))
    return np.asarray(np.hypot(sensor, position_noise(problem)))


def position_noise(problem: Problem, fit: Fit | None = None) -> Array:
    """Torque of a model caused by the noise of the logged positions, (n_joints,).

    See :func:`position_noises`.
    """
    return position_noises(problem, fit)[0]


def position_noises(problem: Problem, fit: Fit | None = None) -> tuple[Array, Array]:
    """Torque of a model caused by the noise of the logged positions, and that in averaged rows.

    Both of shape (n_joints,), N m or N. Without a fit, only the rigid body of the robot is used;
    rotors, which it does not include, may cause most of this torque.

    The noise is the part that the smoother removes from the positions. The same amount, drawn at
    random, is added to the smoothed positions and propagated through the smoother and the inverse
    dynamics. If an encoder has visible steps, the smoothed positions are rounded to them instead:
    for slow motion such noise is slow, too, and passes the smoother.
    """
    signals, motion, robot = problem.logged, problem.signals, problem.robot
    quiet = np.zeros(problem.n_joints)
    if robot is None or signals is None or motion.half_width == 0:
        return quiet, quiet
    shaken, again = signals.once(
        ("shaken motion", motion.half_width), lambda: _shaken(signals, motion)
    )
    use = shaken.usable & again.usable
    change = np.where(use, _torque(problem, fit, shaken) - _torque(problem, fit, again), 0.0)
    counts = np.maximum(use.sum(0), 1)
    return np.sqrt(np.sum(change**2, axis=0) / counts), _at_rows(problem, change)


def _at_rows(problem: Problem, change: Array) -> Array:
    """Root of the mean square of a torque of the first samples in averaged rows, (n_joints,)."""
    inside, values = np.zeros((2, problem.signals.n_samples))
    inside[: len(change)] = 1.0
    found = np.zeros(problem.n_joints)
    for j in range(problem.n_joints):
        values[: len(change)] = change[:, j]
        some = problem.rows.average(inside, j) > 0
        if some.any():
            found[j] = root_mean_square(problem.rows.average(values, j)[some])
    return found


def _shaken(logged: Signals, motion: Signals) -> tuple[Signals, Signals]:
    """The smoothed motion with and without the noise of positions, both smoothed again."""
    part = slice(0, min(logged.n_samples, MOST_SAMPLES))
    smooth = motion.take(part)
    shaken = smooth.with_(q=as_measured(logged, motion, smooth.q, shifted=True))
    return smooth_motion(shaken), smooth_motion(smooth)


def _torque(problem: Problem, fit: Fit | None, motion: Signals) -> Array:
    """Torque of the bodies and of effects that are smooth functions of the motion, N m or N."""
    s, robot = motion, problem.robot
    assert robot is not None
    own = None if fit is None else problem.inertial_parameters(fit)
    torque = robot.inverse_dynamics(s.q, s.dq, s.ddq, parameters=own)
    if fit is None:
        return torque
    for term, place in fit.terms.slices(len(problem.rigid_index)):
        if not term.is_dry and not term.effect.needs:
            for j, block in term.torque_columns(s).items():
                torque[:, j] += block @ fit.coefficients[place]
    return torque
