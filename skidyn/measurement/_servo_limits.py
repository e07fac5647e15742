# SPDX-License-Identifier: BSD-3-Clause
r"""Gain and limit of position servos, from the torque that their motion takes.

The torque of a servo is computed from its error of position. A servo at a limit supplies less than
that, so that its error grows although the motion takes no more torque. The largest torque is

.. math:: |\tau| \le L \mp \frac{L}{\omega_0} \dot q,

where :math:`L` is the limit of the current, or the torque at rest, from which the torque falls to
nothing at the speed :math:`\omega_0` because the voltage is used up [1]_. What the motion takes
follows from bodies and friction that are fitted to rows below the limit. A simulation of the loop
would not show it: a limit that is a little too low loses the joint, and one that is too high does
not change the motion.

References
----------
.. [1] M. Duclusaud, G. Passault, V. Padois, O. Ly (2024), Extended friction models for the
   physics simulation of servo actuators.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array
from skidyn.measurement._fits import SAMPLES, Fits
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._reading import Reading
from skidyn.measurement._robust import ROUNDS, student_weights
from skidyn.measurement._torque import readable_fits

#: Share of rows that are certainly below a limit at first, and share of a limit that is later.
BELOW, JUST_BELOW = 0.8, 0.97
#: Rows that follow each other and belong to the same half; weight of the size of coefficients.
BLOCK, RIDGE = 20, 1e-4
#: Limits that are tried, as quantiles of the torque; torques at rest and speeds of a voltage that
#: are tried, as multiples of this limit and of the largest speed.
LIMITS = np.r_[np.linspace(0.5, 0.95, 19), np.linspace(0.955, 0.999, 15)]
STALLS, SPEEDS = np.linspace(0.9, 2.5, 17), np.linspace(0.6, 3.0, 13)
#: Limits at most that are tried from there.
STEPS = 80
#: Rows at a limit, share of their squared error that it must remove, and share of the squared error
#: of all rows that it may leave.
ROWS, DROP, LEFT = 5, 0.95, 0.75
#: Share of rows that must be below the limit, and share of the variance of their torque that bodies
#: and friction may leave there: what they do not explain below it says nothing beyond it.
FREE, UNEXPLAINED = 0.5, 0.05
#: Share of the error with a limit of the current that one of the voltage may leave.
FALLS = 0.7
#: Share of the largest torque below which a limit is other than the stated one.
WITHIN = 0.95
#: Blocks of rows that are left out in turn for the standard error.
BLOCKS = 10


@dataclass(frozen=True)
class Servo:
    """The servo of a joint as its motion shows it.

    Attributes
    ----------
    limit : ndarray of shape (1,) or (2,)
        Largest torque, N m or N; if it falls with the speed, that at rest, and the speed at which
        nothing is left of it, rad/s or m/s.
    half : ndarray of the same shape
        Half the widths of their 95 % intervals; NaN if the limit is not needed.
    rows : int
        Rows at the limit.
    left : float
        Share of their squared error that the limit leaves.
    drop : float
        Share of the squared error of all rows that the limit removes.
    is_limited : bool
        Whether the limit is needed.
    gain, error : float
        What the torque is of that of the stated bodies below the limit, and its standard error.
    unexplained : float
        Share of the variance of the torque that the stated bodies leave at this gain.
    gain_drop : float
        Share of the squared error of the stated bodies that this gain removes.
    """

    limit: Array
    half: Array
    rows: int
    left: float
    drop: float
    is_limited: bool
    gain: float
    error: float
    unexplained: float
    gain_drop: float

    @property
    def falls(self) -> bool:
        """Whether the limit falls with the speed."""
        return len(self.limit) > 1


def servos_seen(measurement: Measurement) -> dict[int, Servo]:
    """Servos of the joints that move, by joint from 0."""
    fits = readable_fits(measurement) if measurement.of_servos else None
    if fits is None:
        return {}
    return {j: _seen(fits, j) for j in range(fits.n_joints) if fits.usable(j)}


def _seen(fits: Fits, j: int) -> Servo:
    torque, speed = (x[:, j].reshape(-1, SAMPLES) for x in (fits.torque, fits.signals.dq))
    mean, use = fits.mean_torque(j)
    most = np.abs(torque).max(axis=1)
    design, _ = fits.felt(j)
    needed_of = partial(_needed, design, mean)
    below = float(np.quantile(most[use], BELOW))
    for _ in range(2):
        needed = needed_of(use & (most < below))
        below = JUST_BELOW * _first_limit(needed, torque, use, most)
    needed = needed_of(use & (most < below))
    error_of = _Error(needed, torque, speed, use)
    own = _limit(error_of, _first_limit(needed, torque, use, most))
    supplied = clipped(torque, speed, own).mean(axis=1)
    hit = use & (np.abs(supplied - mean) > 1e-9 * own[0])
    before, after = ((needed - x)[use] for x in (mean, supplied))
    at = hit[use]
    left = float(np.sum(after[at] ** 2) / max(np.sum(before[at] ** 2), 1e-300))
    total = float(np.sum(after**2) / max(np.sum(before**2), 1e-300))
    free = use & ~hit
    unseen = np.sum((mean - needed)[free] ** 2) / max(free.sum() * np.var(mean[free]), 1e-300)
    is_limited = bool(
        int(at.sum()) >= ROWS
        and free.sum() > FREE * use.sum()
        and unseen < UNEXPLAINED
        and left < 1 - DROP
        and total < LEFT
        and (own[0] < WITHIN * np.abs(torque).max() or len(own) > 1)
    )
    half = np.full(len(own), np.nan)
    if is_limited:
        low = use & (most < below)
        half = _half(
            hit,
            lambda kept: _Error(needed_of(low & kept), torque, speed, use & kept).least(own),
        )
    used = free if is_limited else use
    stated = np.column_stack([fits.columns(Reading())[:, :, j], np.ones(len(mean))])
    gain = _gain(stated[used], mean[used])
    return Servo(own, half, int(at.sum()), left, 1 - total, is_limited, *gain)


def _half(hit: NDArray[np.bool_], again: Callable[[NDArray[np.bool_]], Array]) -> Array:
    """Half the widths of 95 % intervals of a limit, from blocks of rows that are left out in turn.

    Each block has its part of the rows at the limit, which are few, and of the others.
    """
    from scipy.special import stdtrit  # scipy.stats takes longer to import

    n_blocks = min(BLOCKS, int(hit.sum()))
    block = np.empty(len(hit), dtype=np.int64)
    for rows in (hit, ~hit):
        block[rows] = np.arange(rows.sum()) * n_blocks // max(rows.sum(), 1)
    found: Array = np.array([again(block != k) for k in range(n_blocks)])
    spread = np.sum((found - found.mean(axis=0)) ** 2, axis=0)
    return np.asarray(stdtrit(n_blocks - 1, 0.975) * np.sqrt((n_blocks - 1) / n_blocks * spread))


def _needed(design: Array, mean: Array, low: NDArray[np.bool_]) -> Array:
    """What the motion takes, by bodies and friction fitted to low rows of the other half."""
    half = np.arange(len(mean)) // BLOCK % 2
    needed = np.zeros(len(mean))
    size = np.sqrt(np.mean(design**2, axis=0)) + 1e-300
    a = design / size
    for part in (0, 1):
        rows = low & (half != part)
        gram = a[rows].T @ a[rows] + RIDGE * max(rows.sum(), 1) * np.eye(a.shape[1])
        needed[half == part] = a[half == part] @ np.linalg.solve(gram, a[rows].T @ mean[rows])
    return needed


def clipped(torque: Array, speed: Array, limit: Array) -> Array:
    """Torque within a limit, which may fall with the speed.

    Parameters
    ----------
    torque, speed : ndarray
        N m and rad/s, or N and m/s.
    limit : ndarray of shape (1,) or (2,)
        Largest torque, and the speed at which nothing is left of it.
    """
    fall = limit[0] * speed / limit[1] if len(limit) > 1 else 0.0
    return np.asarray(np.clip(torque, -limit[0] - fall, limit[0] - fall))


@dataclass(frozen=True)
class _Error:
    """Squared error of what a servo supplies within a limit, in the rows that count."""

    needed: Array
    torque: Array
    speed: Array
    use: NDArray[np.bool_]

    def __call__(self, limit: Array) -> float:
        if np.any(limit <= 0):
            return np.inf
        supplied = clipped(self.torque, self.speed, limit).mean(axis=1)
        return float(np.sum((self.needed - supplied)[self.use] ** 2))

    def least(self, start: Array) -> Array:
        """The best limit near one."""
        from scipy.optimize import minimize  # half a second of imports that few logs need

        size = self(start) + 1e-300
        found = minimize(
            lambda x: self(x * start) / size,
            np.ones(len(start)),
            method="Nelder-Mead",
            options={"maxiter": STEPS, "xatol": 1e-4, "fatol": 1e-6},
        )
        return np.asarray(found.x * start)


def _first_limit(needed: Array, torque: Array, use: NDArray[np.bool_], most: Array) -> float:
    """Limit of the current, of those that are tried, that explains what the motion takes best."""
    error = _Error(needed, torque, torque, use)
    tried: Array = np.asarray(np.quantile(most[use], LIMITS))
    return float(tried[int(np.argmin([error(np.array([x])) for x in tried]))])


def _limit(error: _Error, first: float) -> Array:
    """Limit of the current, or torque at rest and speed without torque where that is better."""
    fastest = float(np.quantile(np.abs(error.speed[error.use]), 0.999)) + 1e-9
    tried = np.array([[first * a, fastest * w] for a in STALLS for w in SPEEDS])
    constant: Array = np.array([first])
    falling: Array = tried[int(np.argmin([error(x) for x in tried]))]
    if min(error(constant), error(falling)) > LEFT * error(np.array([np.inf])):
        return constant
    constant, falling = error.least(constant), error.least(falling)
    return falling if error(falling) < FALLS * error(constant) else constant


def _gain(columns: Array, torque: Array) -> tuple[float, float, float, float]:
    """Multiple of the stated bodies' torque, its standard error, what they leave, and the gain.

    The error is that by blocks that are left out in turn, what is left a share of the variance, and
    the gain the share of the squared error at the stated multiple that it removes.
    """
    block = np.arange(len(torque)) * BLOCKS // max(len(torque), 1)
    found: Array = np.array(
        [_multiple(columns[block != k], torque[block != k]) for k in range(-1, BLOCKS)]
    )
    gains = found[1:, 0]
    spread = np.sum((gains - gains.mean()) ** 2)
    error = float(np.sqrt((BLOCKS - 1) / BLOCKS * spread))
    _, as_stated = _multiple(columns[:, 1:], torque - columns[:, 0])
    variances = float(np.var(torque - columns[:, 0])), max(float(np.var(torque)), 1e-300)
    before = as_stated * variances[0] / variances[1]
    drop = 1 - float(found[0, 1]) / max(before, 1e-300)
    return float(found[0, 0]), error, float(found[0, 1]), float(drop)


def _multiple(columns: Array, torque: Array) -> tuple[float, float]:
    """Robust; friction of any sign, since damping of a servo with another gain is left in it."""
    weight = np.ones(len(torque))
    for _ in range(ROUNDS):
        root = np.sqrt(weight)
        x = np.linalg.lstsq(columns * root[:, None], torque * root, rcond=1e-9)[0]
        residual = torque - columns @ x
        scale = np.sqrt(np.mean(weight * residual**2)) + 1e-300
        weight = student_weights(residual, float(scale))
    return float(x[0]), float(scale**2 / max(np.var(torque), 1e-300))
