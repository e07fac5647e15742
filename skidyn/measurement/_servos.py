# SPDX-License-Identifier: BSD-3-Clause
r"""Position servos that are not as stated: their gain, the limit of their current, their voltage.

The torque of a servo is computed from its error of position. A servo at a limit supplies less than
that, so that its error grows although the motion takes no more torque. The largest torque is

.. math:: |\tau| \le L \mp \frac{L}{\omega_0} \dot q,

where :math:`L` is the limit of the current, or the torque at rest, from which the torque falls to
nothing at the speed :math:`\omega_0` because the voltage is used up [1]_. What the motion takes
follows from bodies and friction that are fitted to rows below the limit. It is no effect of the
model, and would be taken for one: all rows beyond the limit have a residual of their own.

References
----------
.. [1] M. Duclusaud, G. Passault, V. Padois, O. Ly (2024), Extended friction models for the
   physics simulation of servo actuators.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from skidyn._signals import Array
from skidyn._text import listed
from skidyn.measurement._check import Check
from skidyn.measurement._fits import FREEDOM, ROUNDS, SAMPLES, Fits, Reading
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._suspicion import Suspicion
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
#: Factor by which a gain must differ, standard errors of it, and share up to which others do not;
#: share of the variance that the stated bodies may leave at that gain: what a gear that gives way
#: leaves is more.
OTHER, SURE, ALIKE, AT_GAIN = 1.2, 5.0, 0.1, 0.02
#: Blocks of rows that are left out in turn for the standard error.
BLOCKS = 10


@dataclass(frozen=True)
class Servo:
    """The servo of a joint as its motion shows it.

    Attributes
    ----------
    limit : float
        Largest torque, N m or N; that at rest where it falls with the speed.
    speed : float
        Speed at which nothing is left of it, rad/s or m/s; infinite if it does not fall.
    rows : int
        Rows at the limit.
    left : float
        Share of their squared error that the limit leaves.
    is_limited : bool
        Whether the limit is needed.
    gain, error : float
        What the torque is of that of the stated bodies below the limit, and its standard error.
    unexplained : float
        Share of the variance of the torque that the stated bodies leave at this gain.
    """

    limit: float
    speed: float
    rows: int
    left: float
    is_limited: bool
    gain: float
    error: float
    unexplained: float


def servos_seen(measurement: Measurement) -> dict[int, Servo]:
    """Servos of the joints that move, by joint from 0."""
    if measurement.servos is None:
        fits = readable_fits(measurement) if measurement.of_servos else None
        joints = [] if fits is None else [j for j in range(fits.n_joints) if fits.usable(j)]
        measurement.servos = {j: _seen(fits, j) for j in joints if fits is not None}
    return measurement.servos


def _seen(fits: Fits, j: int) -> Servo:
    torque, speed = (x[:, j].reshape(-1, SAMPLES) for x in (fits.torque, fits.signals.dq))
    mean, use = fits.mean_torque(j)
    most = np.abs(torque).max(axis=1)
    design, _ = fits.felt(j)
    below = float(np.quantile(most[use], BELOW))
    for _ in range(2):
        needed = _needed(design, mean, use & (most < below))
        below = JUST_BELOW * _first_limit(needed, torque, use, most)
    needed = _needed(design, mean, use & (most < below))
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
    used = free if is_limited else use
    stated = np.column_stack([fits.columns(Reading())[:, :, j], np.ones(len(mean))])
    gain, error, rest = _gain(stated[used], mean[used])
    top = float(own[1]) if len(own) > 1 else np.inf
    return Servo(float(own[0]), top, int(at.sum()), left, is_limited, gain, error, rest)


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


def _gain(columns: Array, torque: Array) -> tuple[float, float, float]:
    """Multiple of the stated bodies' torque, its standard error, and what they leave.

    The error is that by blocks that are left out in turn, what is left a share of the variance.
    """
    block = np.arange(len(torque)) * BLOCKS // max(len(torque), 1)
    found: Array = np.array(
        [_multiple(columns[block != k], torque[block != k]) for k in range(-1, BLOCKS)]
    )
    gains = found[1:, 0]
    spread = np.sum((gains - gains.mean()) ** 2)
    return float(found[0, 0]), float(np.sqrt((BLOCKS - 1) / BLOCKS * spread)), float(found[0, 1])


def _multiple(columns: Array, torque: Array) -> tuple[float, float]:
    """Robust; friction of any sign, since damping of a servo with another gain is left in it."""
    weight = np.ones(len(torque))
    for _ in range(ROUNDS):
        root = np.sqrt(weight)
        x = np.linalg.lstsq(columns * root[:, None], torque * root, rcond=1e-9)[0]
        residual = torque - columns @ x
        scale = np.sqrt(np.mean(weight * residual**2)) + 1e-300
        weight = (FREEDOM + 1) / (FREEDOM + (residual / scale) ** 2)
    return float(x[0]), float(scale**2 / max(np.var(torque), 1e-300))


def _other_gains(seen: dict[int, Servo]) -> dict[int, Servo]:
    """Servos whose gain is another one, while the weight of most other joints fits the stated one.

    Where others do not fit either, the bodies of the description may be wrong just as well.
    """
    fit = {j for j, s in seen.items() if abs(s.gain - 1) < ALIKE and s.error < ALIKE}
    other = {
        j: s
        for j, s in seen.items()
        if s.gain > 0
        and s.unexplained < AT_GAIN
        and abs(np.log(s.gain)) > max(np.log(OTHER), SURE * s.error / s.gain)
    }
    return other if len(fit) >= max(1, len(seen) / 2) else {}


class ServoGain(Check):
    """A position gain that is not the stated one."""

    name = "servo_gain"
    suspects = "position gain of a servo that differs from the stated one (logs without torque)"
    stage = 1
    misnames = True

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        seen = servos_seen(measurement)
        other = _other_gains(seen)
        if not other:
            return
        told = listed([f"{1 / s.gain:.3g} of {measurement.joint(j)}" for j, s in other.items()])
        multiples = ", ".join(f"{s.gain:.3g} ± {1.96 * s.error:.2g}" for s in other.values())
        yield self.suspicion(
            f"the position gain of a servo is not the stated one, but times {told}",
            f"the torque computed from the stated gain is {multiples} times that of the bodies of "
            f"the description (95 %), which is 1 within {100 * ALIKE:.0f} % on most other joints",
            "suspected",
            other,
            ("--controller with this stiffness", "Controller(stiffness=...)"),
        )


class _Limit(Check):
    """A limit that is not stated; subclasses say of what."""

    stage = 1
    misnames = True
    falls: ClassVar[bool]

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        seen = servos_seen(measurement)
        other = _other_gains(seen)  # a limit beside a wrong gain is that of the stated torque
        for j, servo in seen.items():
            if not servo.is_limited or j in other or np.isfinite(servo.speed) != self.falls:
                continue
            option = f"limit={servo.limit:.4g}"
            if self.falls:
                option += f", no_load_speed={servo.speed:.4g}"
            yield self.suspicion(
                self.said(measurement, j, servo),
                f"its error of position asks for more in {servo.rows} rows, where the torque that "
                "bodies and friction fitted to the other rows take is just that: it removes "
                f"{100 * (1 - servo.left):.0f} % of the squared error there. A joint that is "
                "blocked, as a gripper is by what it holds, looks alike",
                "suspected",
                [j],
                (f"--controller with {option} for this joint", f"Controller({option})"),
            )

    @abstractmethod
    def said(self, measurement: Measurement, j: int, servo: Servo) -> str:
        """The suspicion."""


class ServoCurrent(_Limit):
    """A limit of the current that is not stated."""

    name = "servo_current"
    suspects = "limit of the current of a servo that is not stated (logs without torque)"
    falls = False

    def said(self, measurement: Measurement, j: int, servo: Servo) -> str:
        force, _ = _units(measurement, j)
        return (
            f"the servo of {measurement.joint(j)} supplies {servo.limit:.3g} {force} at most, a "
            "limit of its current that is not stated"
        )


class ServoVoltage(_Limit):
    """A voltage that is used up by the speed."""

    name = "servo_voltage"
    suspects = "voltage of a servo that limits its torque at speed (logs without torque)"
    falls = True

    def said(self, measurement: Measurement, j: int, servo: Servo) -> str:
        force, pace = _units(measurement, j)
        return (
            f"the voltage of the servo of {measurement.joint(j)} limits its torque, to "
            f"{servo.limit:.3g} {force} at rest and nothing at {servo.speed:.3g} {pace}"
        )


#: Names of the checks of settings of a servo, without which its joint cannot be simulated.
SERVO_CHECKS = frozenset(check.name for check in (ServoGain, ServoCurrent, ServoVoltage))


def _units(measurement: Measurement, j: int) -> tuple[str, str]:
    """Units of force and speed of a joint."""
    robot = measurement.robot
    slides = robot is not None and robot.joint_types[j] == "prismatic"
    return ("N", "m/s") if slides else ("N m", "rad/s")
