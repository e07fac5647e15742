# SPDX-License-Identifier: BSD-3-Clause
"""Directions that the data hardly determines are kept as in the URDF.

Least squares sets every direction of the inertial parameters to fit the noise best. If a motion
hardly excites a direction, its value may be arbitrarily large; its effects cancel on the rows of
the fit only. Here every direction is weighted by the precision of the data relative to that of the
URDF.

Directions are those in which both are independent: with ``S`` the information of the data about the
base parameters with the effects eliminated, and ``C`` the covariance of the base parameters for
relative changes of all bodies by 1, they are the eigenvectors of ``S`` with respect to ``C^-1``.
For an eigenvalue ``l`` the relative standard error of the data is ``1/sqrt(l)``. The relative error
of the URDF, ``t``, and the excess of the rows' scatter over white noise, ``f``, maximise the
likelihood of the least-squares coordinates ``z``, which have Student's law with the squared scale
``t^2 + f / l``, times weak priors (empirical Bayes): an effect that the model lacks, such as a
counterweight, moves a few of them far. Where left-out folds contradict ``t^2 / f``, a larger ratio
is used. With ``x = l t^2 / f`` a direction keeps the share ``x^3 / (1 + x^3)`` of its distance from
the URDF. With the third power the transition is sharp: a direction that the data determines ten
times better than the URDF changes by one part in a million.

References
----------
B. Efron, C. Morris (1973), Stein's estimation rule and its competitors: an empirical Bayes
approach, J. American Statistical Association 68, 117-130.
P. C. Hansen (1998), Rank-Deficient and Discrete Ill-Posed Problems, chapter 4 (filter factors).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag
from scipy.optimize import minimize

from skidyn._signals import Array
from skidyn.evidence import solve_left_out
from skidyn.identification._log_det import existing_bodies, local_units
from skidyn.identification._regression import Regression, Solution
from skidyn.robots import Robot, find_base_parameters

#: Power of the transition between directions from the data and from the URDF.
POWER = 3
#: Ranges: relative error of the bodies of a URDF between 10 % and a factor of 1,000, and scatter of
#: rows up to 1,000 times the white noise.
LEAST_SPREAD, MOST_SPREAD, MOST_EXCESS = 0.1, 1e3, 1e6
#: Least noise of a joint, as a share of the largest torque.
LEAST_NOISE = 1e-9
#: Share of the largest eigenvalue below which rounding dominates.
ROUNDING = 1e-13
#: Share of it below which least squares does not resolve a direction, so that its coordinate has no
#: information about scatter.
RESOLVED = 1e-8
#: Usual relative error of URDFs and usual excess of the rows' scatter over white noise, and the
#: factors by which both differ between robots.
USUAL, FACTOR = (0.3, 1.0), (3.0, 10.0)
#: Degrees of freedom of Student's law of the coordinates, of which few are far from the others.
TAIL = 2.0
#: Factor between the ratios that are tried on left-out folds, and the largest one: that of bodies
#: which may be anything, and rows whose scatter is white noise.
RATIO_STEP, MOST_RATIO = 4.0, 1.0
#: Share of the rows, in units of their noise, by which the error of left-out folds must be larger
#: for directions to be released that most likely are weak.
MATERIAL = 0.05
#: Largest pull on a direction relative to its information; keeps the left-out sums finite.
MOST_PULL = 1e12


def keep_weak_directions(
    solution: Solution, kept: NDArray[np.int64], whole: Regression, trusted: bool = True
) -> Solution:
    """Replace the weak directions of a solution by those of the URDF.

    The solution is that of an estimator without a prior; ``kept`` are the rigid-body columns of
    ``whole`` that it has. ``whole`` has the columns of all base parameters and the row weights of
    the estimator, as has the result. If the URDF is not ``trusted`` against the data, it sets only
    undetermined directions.
    """
    n, p = whole.n_rigid, whole.design[0].shape[1]
    if not n:
        return solution
    place = np.r_[kept, np.arange(n, p)]
    coefficients = np.zeros(p)
    coefficients[place] = solution.coefficients
    left = np.zeros((len(solution.left_out), p))
    left[:, place] = solution.left_out

    # Without noise the numbers would not be finite.
    torque = [np.sqrt(np.mean(y**2)) if len(y) else 1.0 for y in whole.target]
    noise = np.maximum(solution.noise, LEAST_NOISE * max(torque) or 1.0)
    grams, cross = whole.products(noise)
    found = _Directions.of(whole, grams.sum(0))
    values, directions, follow = found.values, found.directions, found.follow

    z = found.into @ coefficients[:n]
    spread, excess = _spreads(z, values)
    if not trusted and len(kept) == n:  # all directions are determined
        share = np.ones(n)
    elif whole.instruments is not None or not trusted:
        # Instruments remove a bias that the information does not contain: only open directions are
        # kept.
        share = (values > 0).astype(float)
    else:
        share = _supported(found, spread**2 / excess, grams, cross, float(whole.counts.sum()))
    moved = directions @ ((share - 1) * z)
    coefficients[:n] += moved
    coefficients[n:] -= follow @ moved

    if whole.instruments is None:
        left = _pulled(found, share, grams, cross)
    else:
        shift = left[:, :n] @ (directions @ ((share - 1)[:, None] * found.into)).T
        left = left + np.hstack([shift, -shift @ follow.T])
    open_ = directions * (np.sqrt(1 - share) * spread)
    return replace(
        solution,
        coefficients=coefficients,
        left_out=left,
        urdf_std=spread if trusted else np.inf,
        open=np.hstack([open_.T, -open_.T @ follow.T]),
    )


@dataclass(frozen=True)
class _Directions:
    """Directions in which data and URDF are independent, effects being fitted again.

    Attributes
    ----------
    values : ndarray of shape (n_rigid,)
        Information of the data about each, in ascending order.
    directions, into : ndarray of shape (n_rigid, n_rigid)
        Base parameters by the coordinates in these directions, and the coordinates by them.
    follow : ndarray of shape (n_effects, n_rigid)
        Decrease of the effects' coefficients for an increase of each base parameter.
    """

    values: Array
    directions: Array
    into: Array
    follow: Array

    @classmethod
    def of(cls, whole: Regression, total: Array) -> _Directions:
        """Directions of a regression with the normal equations ``total``."""
        n = whole.n_rigid
        size = np.sqrt(np.diag(total)[n:])
        size[size == 0] = 1.0
        inner = total[n:, n:] / size[:, None] / size
        mixed = total[n:, :n] / size[:, None]
        follow = np.linalg.lstsq(inner, mixed, rcond=1e-10)[0] / size[:, None]
        root = prior_root(whole.robot)
        information = total[:n, :n] - total[:n, n:] @ follow
        values, vectors = np.linalg.eigh(root.T @ information @ root)
        values = np.where(values > ROUNDING * values[-1], values, 0.0)
        return cls(values, root @ vectors, vectors.T @ np.linalg.inv(root), follow)


def _supported(
    found: _Directions, likely: float, grams: Array, cross: Array, n_rows: float
) -> Array:
    """Share of its distance from the URDF that every direction keeps.

    With the least ratio ``t^2 / f``, from the most likely one up to :data:`MOST_RATIO`, whose error
    of left-out folds is that of the best one to within its standard error (L. Breiman et al. 1984,
    Classification and Regression Trees, chapter 3.4.3) or :data:`MATERIAL`. Folds that are alike do
    not show what another motion would, so that a small gain is no reason to trust weak directions.
    """
    tried = [likely]
    while tried[-1] < MOST_RATIO and len(grams) > 1:
        tried.append(min(MOST_RATIO, tried[-1] * RATIO_STEP))
    shares = [_shares(found.values, ratio) for ratio in tried]
    errors = []
    for share in shares:
        left = _pulled(found, share, grams, cross)
        errors.append(
            np.einsum("ki,kij,kj->k", left, grams, left) - 2 * np.sum(left * cross, axis=1)
        )
    behind = [error - min(errors, key=np.sum) for error in errors]
    small = MATERIAL * n_rows
    return next(
        share
        for share, own in zip(shares, behind, strict=True)
        if len(own) < 2 or own.sum() <= max(small, own.std(ddof=1) * np.sqrt(len(own)))
    )


def _pulled(found: _Directions, share: Array, grams: Array, cross: Array) -> Array:
    """Fits without each fold, of whose directions the data keeps the same shares."""
    n, p = len(found.values), cross.shape[-1]
    # In these coordinates the pull toward the URDF is diagonal.
    change = block_diag(found.directions, np.eye(p - n))
    pull = np.zeros(p)
    floor = np.maximum(found.values, ROUNDING * max(found.values[-1], 1e-300))
    pull[:n] = np.minimum((1 - share) / np.maximum(share, 1 / MOST_PULL), MOST_PULL) * floor
    _, left = solve_left_out(
        change.T @ grams @ change, cross @ change, (np.diag(pull), np.zeros(p))
    )
    return np.asarray(left @ change.T)


def prior_root(robot: Robot) -> Array:
    """Root of the base parameters' covariance when all bodies change relatively by 1."""
    units, _ = local_units(*2 * (existing_bodies(robot.inertial_parameters),))
    spread = find_base_parameters(robot).regrouping @ block_diag(*units)
    size = np.linalg.norm(spread, axis=1)
    root = np.linalg.cholesky((spread / size[:, None]) @ (spread / size[:, None]).T)
    return np.asarray(size[:, None] * root)


def _shares(values: Array, ratio: float) -> Array:
    """Share of its distance from the URDF that every direction keeps, for a ratio t^2 / f."""
    known = values * ratio
    return np.asarray(known**POWER / (1 + known**POWER))


def _spreads(z: Array, values: Array) -> tuple[float, float]:
    """Most likely relative error of the URDF and excess of the rows' scatter."""
    seen = values > RESOLVED * max(values.max(initial=0.0), 1e-300)
    if not seen.any():
        return LEAST_SPREAD, 1.0
    squares, noise = z[seen] ** 2, 1 / values[seen]

    def loss(at: Array) -> tuple[float, Array]:
        parts = np.exp(2 * at[0]), np.exp(at[1]) * noise
        variance = parts[0] + parts[1]
        tail = TAIL + squares / variance
        slope = (1 - (TAIL + 1) * squares / variance / tail) / variance
        doubt = (at - np.log(USUAL)) / np.log(FACTOR)
        value = float(np.sum(np.log(variance) + (TAIL + 1) * np.log(tail)) + doubt @ doubt)
        gradient = np.array([2 * parts[0] * slope.sum(), parts[1] @ slope])
        return value, gradient + 2 * doubt / np.log(FACTOR)

    limits = [np.log([LEAST_SPREAD, MOST_SPREAD]), np.log([1.0, MOST_EXCESS])]
    starts = [(a, b) for a in np.log([0.1, 1.0, 10.0]) for b in np.log([1.0, 100.0])]
    found = [minimize(loss, start, jac=True, bounds=limits) for start in starts]
    best = min(found, key=lambda each: float(each.fun)).x
    return float(np.exp(best[0])), float(np.exp(best[1]))
