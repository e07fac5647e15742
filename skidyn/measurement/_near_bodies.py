# SPDX-License-Identifier: BSD-3-Clause
"""Robust fits of a reading with bodies near those of the description."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy
from numpy.typing import NDArray

from skidyn._signals import Array
from skidyn.measurement._fits import Fits, friction
from skidyn.measurement._loads import LOAD, by_recording, n_loads
from skidyn.measurement._reading import Reading
from skidyn.measurement._robust import student, student_weights
from skidyn.robots import Robot

#: Shares of a body's mass, times its length and its square for first and second moments, to which a
#: description may be known (one standard deviation); the one that explains most is taken.
KNOWN_TO = (0.03, 0.1, 0.3)
#: Mass of a payload, as a share of the robot's, and its distance in m (one standard deviation).
CARRIED, AWAY = 0.1, 0.2
#: Rounds of the robust fit.
ROUNDS = 7
#: Powers of a length in the ten parameters of a body.
POWERS = np.array([0, 1, 1, 1, 2, 2, 2, 2, 2, 2])
#: Precision of coefficients that nothing is known of, over their scale.
LOOSE = 1e-8
#: How many times as much as any bodies those near the description, with a load on the last body,
#: leave on a joint of another robot, and on how many joints at least. Where masses are off by a
#: fifth, with hidden effects or without, they leave 1.1 times as much at most; those of another arm
#: 1.3 to 2.6 times on two or more joints, or on one (a UR10 for a UR5), which is not told.
TIMES, JOINTS = 1.3, 2


@dataclass(frozen=True)
class ExtraColumns:
    """Columns of an effect, by joint.

    Attributes
    ----------
    by_joint : mapping of int to ndarray of shape (n_rows, n_columns)
    positive : tuple of int
        Coefficients that cannot be negative.
    precision : ndarray of shape (n_columns,)
        Of what is known of the coefficients.
    """

    by_joint: Mapping[int, Array]
    positive: tuple[int, ...]
    precision: Array

    @property
    def count(self) -> int:
        return len(self.precision)


@dataclass(frozen=True)
class NearFit:
    """A robust fit: its likelihood, coefficients, normal equations, weights and residuals."""

    posterior: float
    coefficients: Array
    gram: Array
    weights: list[Array]
    residuals: list[Array]
    scales: list[float]


class NearBodies:
    """Fits of one reading with bodies near those of the description.

    Parameters
    ----------
    fits : Fits
        Rows.
    reading : Reading
        Reading of the rows.
    gains : ndarray of shape (n_joints,)
        Scale of every column of the torque.
    inflation : ndarray of shape (n_joints,)
        Overestimation of the information of rows of a column.
    """

    def __init__(self, fits: Fits, reading: Reading, gains: Array, inflation: Array) -> None:
        robot = fits.robot
        if reading.gravity is not None:
            robot = replace(robot, gravity=np.asarray(reading.gravity))
        self.fits, self.signals = fits, reading.motion(fits.signals).with_(robot=robot)
        self.reading, self.gains = reading, gains
        stated = np.asarray(robot.inertial_parameters, dtype=float).ravel()
        every = np.arange(stated.size)
        regressor = fits.mean_regressor(robot, self.signals, every)
        size = sizes(robot)
        read = [reading.torque_column(j) for j in range(fits.n_joints)]
        self.joints = [j for j, (column, _) in enumerate(read) if fits.usable(column)]
        self.inflation = [float(inflation[read[j][0]]) for j in self.joints]
        self.n_loads = n_loads(fits.carrying)
        self.n_bodies, self.size = stated.size, stated.size + 4 * len(self.joints) + self.n_loads
        self.rows: list[NDArray[np.bool_]] = []
        self.designs: list[Array] = []
        self.places: list[NDArray[np.int64]] = []
        self.targets: list[Array] = []
        self.positive: list[int] = []
        for first, j in zip(
            stated.size + 4 * np.arange(len(self.joints)), self.joints, strict=True
        ):
            column, sign = read[j]
            torque, use = fits.mean_torque(column)
            y, own = torque[use], gains[column] * regressor[use, j]
            rubs = fits.average(friction(self.signals, j))[use]
            rubs = np.column_stack([rubs / (np.abs(rubs).max(axis=0) + 1e-12), np.ones(len(y))])
            moved = np.flatnonzero(own.any(axis=0))  # not by bodies before the joint
            load = gains[column] * regressor[:, j, LOAD] * likely_load(robot)[: len(LOAD)]
            carried = by_recording(load, fits.carrying)[use]
            self.rows.append(use)
            self.designs.append(
                np.hstack([(own * size)[:, moved], (np.std(y) + 1e-12) * rubs, carried])
            )
            loads = self.size - self.n_loads + np.arange(carried.shape[1])
            self.places.append(np.concatenate([moved, first + np.arange(4), loads]))
            self.positive += range(first, first + 3)  # negative friction would generate energy
            self.targets.append(sign * y - own @ stated)

    @cached_property
    def plain(self) -> NearFit:
        """Fit without any effect."""
        return self.fit()

    def fit(self, extra: ExtraColumns | None = None) -> NearFit:
        """Fit, with the columns of an effect if given."""
        return max((self.fit_to(share, extra) for share in KNOWN_TO), key=lambda f: f.posterior)

    def fit_to(self, share: float, extra: ExtraColumns | None = None) -> NearFit:
        """Fit with bodies that are known to a share of their masses and lengths."""
        designs, places, positive, size = self.designs, self.places, self.positive, self.size
        if extra is not None:
            new, size = size + np.arange(extra.count), size + extra.count
            positive = [*positive, *(int(new[k]) for k in extra.positive)]
            designs, places = list(designs), list(places)
            for k, (j, use) in enumerate(zip(self.joints, self.rows, strict=True)):
                if j in extra.by_joint:
                    designs[k] = np.hstack([designs[k], extra.by_joint[j][use]])
                    places[k] = np.append(places[k], new)
        precision = np.full(size, LOOSE)
        precision[: self.n_bodies] = share**-2
        precision[self.size - self.n_loads : self.size] = 1.0
        if extra is not None:
            precision[-extra.count :] = extra.precision
        scales = [float(np.std(y)) + 1e-12 for y in self.targets]
        trust = [np.ones(len(y)) for y in self.targets]
        for _ in range(ROUNDS):
            gram, right = np.diag(precision), np.zeros(size)
            weights = [
                w / (s**2 * i) for w, s, i in zip(trust, scales, self.inflation, strict=True)
            ]
            for d, place, y, w in zip(designs, places, self.targets, weights, strict=True):
                root = np.sqrt(w)
                weighted = d * root[:, None]
                gram[np.ix_(place, place)] += weighted.T @ weighted  # symmetric: half the work
                right[place] += weighted.T @ (root * y)
            found = solved(gram, right, positive)
            residuals = [
                y - d @ found[p] for d, p, y in zip(designs, places, self.targets, strict=True)
            ]
            scales = [
                float(np.sqrt(np.mean(w * r**2))) + 1e-12
                for w, r in zip(trust, residuals, strict=True)
            ]
            trust = [student_weights(r, s) for r, s in zip(residuals, scales, strict=True)]
        alike = [
            student(r, s) / i for r, s, i in zip(residuals, scales, self.inflation, strict=True)
        ]
        bodies = slice(self.n_bodies)
        departure = 0.5 * float(np.sum((found[bodies] / share) ** 2))
        departure += 0.5 * float(np.sum(found[self.size - self.n_loads : self.size] ** 2))
        if extra is not None:
            departure += 0.5 * float(np.sum(extra.precision * found[-extra.count :] ** 2))
        # bodies are integrated out, which penalises an uncertain description
        narrowed = 0.5 * float(np.linalg.slogdet(gram[bodies, bodies] * share**2)[1])
        return NearFit(sum(alike) - departure - narrowed, found, gram, weights, residuals, scales)

    @property
    def parameters(self) -> Array:
        """Inertial parameters that explain most, shape (n_bodies, 10)."""
        robot = self.signals.robot
        assert robot is not None
        found = self.plain.coefficients[: self.n_bodies] * sizes(robot)
        return np.asarray(robot.inertial_parameters + found.reshape(-1, 10))

    def promise(self, extra: ExtraColumns, factor: Factored) -> float:
        """Approximate gain of columns, with the weights of the fit without them."""
        left, right = self.without_bodies(extra, factor)
        return 0.5 * float(right @ np.linalg.solve(left, right))

    def without_bodies(self, extra: ExtraColumns, factor: Factored) -> tuple[Array, Array]:
        """Normal equations of columns after elimination of bodies and friction."""
        m, plain = extra.count, self.plain
        own, right, cross = np.zeros((m, m)), np.zeros(m), np.zeros((self.size, m))
        for k, j in enumerate(self.joints):
            if j in extra.by_joint:
                columns = extra.by_joint[j][self.rows[k]]
                weighted = columns * plain.weights[k][:, None]
                own += weighted.T @ columns
                right += weighted.T @ plain.residuals[k]
                cross[self.places[k]] += self.designs[k].T @ weighted
        left = own - cross.T @ factor.solve(cross)
        left[np.diag_indices(m)] += 1e-6 * np.trace(own) / m + 1e-300
        return left, right


def left_by_near_bodies(near: NearBodies) -> dict[int, float]:
    """Joints, from 0, on which bodies near the description leave far more than any bodies.

    Parameters
    ----------
    near : NearBodies
        Fit of some reading of the rows.

    Returns
    -------
    dict of int to float
        How many times as much; empty unless there are several.
    """
    any_bodies, reading = near.fits.identified(near.reading).scale, near.reading
    scales = near.fit(_carried(near)).scales
    left = {
        j: scale / float(any_bodies[reading.torque_column(j)[0]])
        for j, scale in zip(near.joints, scales, strict=True)
    }
    far = {j: times for j, times in left.items() if times > TIMES}
    return far if len(far) >= JOINTS else {}


def _carried(near: NearBodies) -> ExtraColumns:
    """Columns of a load on the last body, which no description contains."""
    robot = near.signals.robot
    assert robot is not None
    last = np.arange(-10, 0) + np.size(robot.inertial_parameters)
    regressor = near.fits.mean_regressor(robot, near.signals, last) * likely_load(robot)
    columns = {j: near.reading.torque_column(j)[0] for j in near.joints}
    by_joint = {j: near.gains[column] * regressor[:, j] for j, column in columns.items()}
    return ExtraColumns(by_joint, (0,), np.ones(10))


def likely_load(robot: Robot) -> Array:
    """Standard deviations of the ten parameters of a payload, of which nothing else is known."""
    masses = np.asarray(robot.inertial_parameters, dtype=float).reshape(-1, 10)[:, 0]
    return np.asarray(CARRIED * float(masses.sum()) * AWAY**POWERS)


def sizes(robot: Robot) -> Array:
    """Mass of every body, times its length for first moments and its square for second ones."""
    mass, *_, xx, _, _, yy, _, zz = np.abs(
        np.asarray(robot.inertial_parameters, dtype=float).reshape(-1, 10).T
    )
    mass = np.maximum(mass, 1e-4)
    length = np.sqrt(np.maximum(xx + yy + zz, 1e-9) / 2 / mass) + 1e-3
    return np.asarray(mass[:, None] * length[:, None] ** POWERS).ravel()


#: Added to the diagonal of normal equations of unit size: a hundred times what rounding takes.
ROUNDING = 1e-10


class Factored:
    """Normal equations, solved in units in which every column has size one."""

    def __init__(self, gram: Array) -> None:
        self.scale = 1 / np.sqrt(np.maximum(np.diag(gram), np.finfo(float).tiny))
        even = gram * self.scale * self.scale[:, None]
        even[np.diag_indices(len(even))] += ROUNDING
        self.factor = scipy.linalg.cho_factor(even)

    def solve(self, right: Array) -> Array:
        scale = self.scale if right.ndim == 1 else self.scale[:, None]
        return np.asarray(scale * scipy.linalg.cho_solve(self.factor, scale * right))


def solved(gram: Array, right: Array, positive: Sequence[int]) -> Array:
    """Least squares in which coefficients that would be negative, but must not, are left out."""
    free = np.ones(len(right), dtype=bool)
    found = np.zeros(len(right))
    for _ in range(len(positive) + 1):
        use = np.flatnonzero(free)
        found = np.zeros(len(right))
        found[use] = Factored(gram[np.ix_(use, use)]).solve(right[use])
        negative = [k for k in positive if found[k] < 0]
        if not negative:
            break
        free[negative] = False
    return found
