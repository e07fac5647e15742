# SPDX-License-Identifier: BSD-3-Clause
"""Whether another reading explains more than the physical effects that could look like it.

A contact moves the torque of a joint as another zero of its position does, and a spring between two
joints as another sign. So a reading is held against every effect of the catalogue that needs
nothing but motion, on the joints it is about. In both fits bodies may differ from those of the
description: what only wrong bodies speak for gains nothing, and bodies of negative mass cannot take
the place of a sign. How far they may differ is what explains most, so that a description that fits
to 3 % in one reading and to 30 % in another speaks for the first.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from skidyn._signals import Array
from skidyn.effects import Effect, get_effect, list_effects
from skidyn.measurement._fits import FREEDOM, Fits, Reading, friction, student
from skidyn.robots import Robot

#: Shares of a body's mass, times its length and its square for first and second moments, to which a
#: description may be known (one standard deviation); the one that explains most is taken.
KNOWN_TO = (0.03, 0.1, 0.3)
#: Mass of a payload, as a share of the robot's, and its distance in m (one standard deviation).
CARRIED, AWAY = 0.1, 0.2
#: Rounds of the robust fit, and effects that are looked at more closely.
ROUNDS, FINALISTS = 7, 4
#: What each parameter of an effect costs in log-likelihood: half the logarithm of some 150 rows.
COST = 2.5
#: Powers of a length in the ten parameters of a body.
POWERS = np.array([0, 1, 1, 1, 2, 2, 2, 2, 2, 2])
#: Precision of coefficients that nothing is known of, over their scale.
LOOSE = 1e-8


@dataclass(frozen=True)
class Duel:
    """A reading against the effect that takes most of its place.

    Attributes
    ----------
    gain : float
        Log-likelihood that the reading gains over the log as it is, if bodies may differ.
    beside : float
        What it gains where the effect is there as well, and where it is not: the lesser.
    rival : float
        What the effect gains over the log as it is, less the cost of its parameters.
    effect : str
        Title of the effect; empty if none takes anything of the reading's place.
    """

    gain: float
    beside: float
    rival: float = 0.0
    effect: str = ""


def fight(fits: Fits, before: Reading, reading: Reading, joints: Sequence[int]) -> Duel:
    """Compare a reading with the effects that could look like it.

    Parameters
    ----------
    fits : Fits
        Rows.
    before, reading : Reading
        As the log is read, and as it is suspected to have to be read.
    joints : sequence of int
        Joints, from 0, on which effects are tried.
    """
    # both have the scale of the torque that the reading asks for
    gains = np.nan_to_num(fits.nominal(reading).gain)
    inflation = np.maximum(fits.identified(before).inflation, 1.0)
    here, there = (_Bodies(fits, r, gains, inflation) for r in (before, reading))
    plain = here.plain.posterior
    gain = there.plain.posterior - plain
    duel = Duel(gain, gain)
    for effect, columns, cost in _likely(here, joints):
        with_it = here.fit(columns).posterior
        rival, beside = with_it - cost - plain, there.fit(columns).posterior - with_it
        # what only explains something else takes nothing of the reading's place
        if rival > 0 and beside < duel.beside:
            duel = Duel(gain, beside, rival, effect.title)
    return duel


def left_by_effects(fits: Fits, joint: int, rows: NDArray[np.bool_]) -> tuple[float, float]:
    """What some rows leave, and leave at best where an effect acts on their joint.

    Parameters
    ----------
    fits : Fits
        Rows.
    joint : int
        Joint, from 0.
    rows : ndarray of shape (n_rows,) of bool
        Rows of a recording that seems to have another torque: a payload or a force at the tool may
        act in it alone.

    Returns
    -------
    without, least : float
        Root mean squares of the residual over its scale.
    """
    reading = Reading()
    gains = np.nan_to_num(fits.nominal(reading).gain)
    here = _Bodies(fits, reading, gains, np.maximum(fits.identified(reading).inflation, 1.0))
    k = here.joints.index(joint)
    own = rows[here.rows[k]]
    effects = [*_likely(here, [joint]), *_likely(here, [joint], rows)]
    left = [
        float(np.sqrt(np.mean(fit.residuals[k][own] ** 2))) / fit.scales[k]
        for fit in (here.plain, *(here.fit(columns) for _, columns, _ in effects))
    ]
    return left[0], min(left)


@dataclass(frozen=True)
class _Columns:
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
        return int(next(iter(self.by_joint.values())).shape[1])


@dataclass(frozen=True)
class _Fit:
    """A robust fit: what it is worth, its normal equations, weights and residuals."""

    posterior: float
    gram: Array
    weights: list[Array]
    residuals: list[Array]
    scales: list[float]


class _Bodies:
    """Fits of one reading with bodies near those of the description.

    Parameters
    ----------
    fits : Fits
        Rows.
    reading : Reading
        How they are read.
    gains : ndarray of shape (n_joints,)
        Scale of every column of the torque.
    inflation : ndarray of shape (n_joints,)
        By how much rows of a column look surer than they are.
    """

    def __init__(self, fits: Fits, reading: Reading, gains: Array, inflation: Array) -> None:
        robot = fits.robot
        if reading.gravity is not None:
            robot = replace(robot, gravity=np.asarray(reading.gravity))
        self.fits, self.signals = fits, fits.motion(reading).with_(robot=robot)
        stated = np.asarray(robot.inertial_parameters, dtype=float).ravel()
        every = np.arange(stated.size)
        regressor = fits.mean_regressor(robot, self.signals, every)
        size = sizes(robot)
        read = [fits.torque_column(reading, j) for j in range(fits.n_joints)]
        self.joints = [j for j, (column, _) in enumerate(read) if fits.usable(column)]
        self.inflation = [float(inflation[read[j][0]]) for j in self.joints]
        self.n_bodies, self.size = stated.size, stated.size + 4 * len(self.joints)
        self.rows: list[NDArray[np.bool_]] = []
        self.designs: list[Array] = []
        self.places: list[NDArray[np.int64]] = []
        self.targets: list[Array] = []
        self.positive: list[int] = []
        for first, j in zip(range(stated.size, self.size, 4), self.joints, strict=True):
            column, sign = read[j]
            torque, use = fits.mean_torque(column)
            y, own = torque[use], gains[column] * regressor[use, j]
            rubs = fits.average(friction(self.signals, j))[use]
            rubs = np.column_stack([rubs / (np.abs(rubs).max(axis=0) + 1e-12), np.ones(len(y))])
            moved = np.flatnonzero(own.any(axis=0))  # not by bodies before the joint
            self.rows.append(use)
            self.designs.append(np.hstack([(own * size)[:, moved], (np.std(y) + 1e-12) * rubs]))
            self.places.append(np.append(moved, first + np.arange(4)))
            self.positive += range(first, first + 3)  # negative friction would feed energy
            self.targets.append(sign * y - own @ stated)

    @cached_property
    def plain(self) -> _Fit:
        """Fit without any effect."""
        return self.fit()

    def fit(self, extra: _Columns | None = None) -> _Fit:
        """Fit, with the columns of an effect where there are some."""
        return max((self._fit(share, extra) for share in KNOWN_TO), key=lambda fit: fit.posterior)

    def _fit(self, share: float, extra: _Columns | None) -> _Fit:
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
                weighted = d * w[:, None]
                gram[np.ix_(place, place)] += weighted.T @ d
                right[place] += weighted.T @ y
            found = _solved(gram, right, positive)
            residuals = [
                y - d @ found[p] for d, p, y in zip(designs, places, self.targets, strict=True)
            ]
            scales = [
                float(np.sqrt(np.mean(w * r**2))) + 1e-12
                for w, r in zip(trust, residuals, strict=True)
            ]
            trust = [
                (FREEDOM + 1) / (FREEDOM + (r / s) ** 2)
                for r, s in zip(residuals, scales, strict=True)
            ]
        alike = [
            student(r, s) / i for r, s, i in zip(residuals, scales, self.inflation, strict=True)
        ]
        bodies = slice(self.n_bodies)
        departure = 0.5 * float(np.sum((found[bodies] / share) ** 2))
        if extra is not None:
            departure += 0.5 * float(np.sum(extra.precision * found[-extra.count :] ** 2))
        # bodies are integrated out: a description that is known well has less to choose from
        narrowed = 0.5 * float(np.linalg.slogdet(gram[bodies, bodies] * share**2)[1])
        return _Fit(sum(alike) - departure - narrowed, gram, weights, residuals, scales)

    def promise(self, extra: _Columns, factor: _Factored) -> float:
        """About what columns gain: with the weights of the fit without them."""
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
        return 0.5 * float(right @ np.linalg.solve(left, right))


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


class _Factored:
    """Normal equations, solved in units in which every column has size one."""

    def __init__(self, gram: Array) -> None:
        self.scale = 1 / np.sqrt(np.maximum(np.diag(gram), np.finfo(float).tiny))
        even = gram * self.scale * self.scale[:, None]
        even[np.diag_indices(len(even))] += ROUNDING
        self.factor = cho_factor(even)

    def solve(self, right: Array) -> Array:
        scale = self.scale if right.ndim == 1 else self.scale[:, None]
        return np.asarray(scale * cho_solve(self.factor, scale * right))


def _solved(gram: Array, right: Array, positive: Sequence[int]) -> Array:
    """Least squares in which coefficients that would be negative and must not are left out."""
    free = np.ones(len(right), dtype=bool)
    found = np.zeros(len(right))
    for _ in range(len(positive) + 1):
        use = np.flatnonzero(free)
        found = np.zeros(len(right))
        found[use] = _Factored(gram[np.ix_(use, use)]).solve(right[use])
        negative = [k for k in positive if found[k] < 0]
        if not negative:
            break
        free[negative] = False
    return found


def _effects() -> Iterator[Effect]:
    """Effects of the catalogue that follow from the motion of every moment alone."""
    for kind in list_effects():
        effect = get_effect(kind)
        plain = not set(effect.needs) - {"robot"} and effect.search != "spectrum"
        # the direction of gravity is a reading itself
        if plain and not effect.nameless and effect.family != "hysteresis" and kind != "base_tilt":
            yield effect


def _likely(
    bodies: _Bodies, joints: Sequence[int], rows: NDArray[np.bool_] | None = None
) -> list[tuple[Effect, _Columns, float]]:
    """Effects on some joints that promise most, in their best shapes, and what they cost.

    Where rows are given, the effects are those that may act in one recording alone, in them.
    """
    factor = _Factored(bodies.plain.gram)
    promising = []
    for effect in _effects():
        if rows is not None and not (effect.by_recording or effect.search == "trajectories"):
            continue
        tried = [
            (bodies.promise(columns, factor), columns)
            for columns in _shapes(effect, bodies, joints, rows)
        ]
        if tried:
            gain, columns = max(tried, key=lambda pair: pair[0])
            counted = sum(not c.is_zero for c in effect.coefficients) + len(effect.shapes)
            cost = COST * counted
            promising.append((gain - cost, effect, columns, cost))
    promising.sort(key=lambda item: -item[0])
    return [(effect, columns, cost) for _, effect, columns, cost in promising[:FINALISTS]]


def _shapes(
    effect: Effect, bodies: _Bodies, joints: Sequence[int], rows: NDArray[np.bool_] | None
) -> Iterator[_Columns]:
    """Columns of an effect on some joints, in all shapes of its grid."""
    signals, fits = bodies.signals, bodies.fits
    positive = tuple(k for k, c in enumerate(effect.coefficients) if c.sign == 1)
    spread = np.full(len(effect.coefficients), np.inf)
    if effect.kind == "payload" and signals.robot is not None:  # it is but another body
        masses = np.asarray(signals.robot.inertial_parameters, dtype=float).reshape(-1, 10)[:, 0]
        positive, spread = (0,), CARRIED * float(masses.sum()) * AWAY**POWERS
    for site in effect.sites(signals):
        if not set(site) & set(joints):
            continue
        if effect.scope != "robot" and any(effect.not_shown(signals, j) for j in site):
            continue
        # a payload or a wrench is tried in all recordings: those without it are known then
        grid = effect.grid(signals, site) if effect.search == "grid" else [{}]
        for shape in grid:
            if not effect.admissible(signals, site, shape):
                continue
            columns = {
                j: fits.average(np.asarray(values))
                for j, values in effect.torque_columns(signals, site, **shape).items()
            }
            if rows is not None:
                columns = {j: c * rows[:, None] for j, c in columns.items()}
            size = np.sqrt(sum(np.mean(c**2, axis=0) for c in columns.values())) + 1e-12
            scaled = {j: c / size for j, c in columns.items()}
            yield _Columns(scaled, positive, LOOSE + 1 / (spread * size) ** 2)
