# SPDX-License-Identifier: BSD-3-Clause
"""Gauss-Newton steps of the coefficients of a simulated model.

The cost is a negative logarithm of a likelihood: ``count`` times the sum of the logarithms of the
root mean square errors of all positions and velocities, whose noise is unknown, plus a prior. Its
Gauss-Newton step is a least-squares problem with every error relative to its present size. If the
bodies have to exist, the step is the optimum among those that do; to correct only its result would
move coefficients on which the motion depends strongly in favour of others.

A joint whose torque hardly explains its motion has the smallest error if it hardly moves: inertia
and friction would grow without bound. Bodies of a consistent model are therefore drawn to the URDF,
with its relative error that least squares of the torque has found, and effects to the solution of
the least squares, with a standard deviation at which the torque of the effect would be as large as
that of the joint.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag
from scipy.optimize import lsq_linear

from skidyn._signals import Array
from skidyn.effects import Term, TermSum
from skidyn.identification._consistency import make_consistent
from skidyn.identification._constraints import BodyConstraints
from skidyn.identification._regression import Regression, Solution
from skidyn.identification._weak_directions import prior_root
from skidyn.robots import find_base_parameters

#: Damping of a step, as shares of the largest curvature.
DAMPING = (0.0, 1e-2, 1e-1, 1.0, 10.0)
#: Directions with less influence on the motion, relative to the largest, are not estimated.
WEAK = 1e-3


def sizes(residual: Array) -> Array:
    """Root mean square of the error of every position and velocity, with axes of length 1.

    Errors have the shape (..., n_pieces, n_samples, n_joints or twice that).
    """
    return np.asarray(np.sqrt(np.mean(residual**2, axis=(-3, -2), keepdims=True)) + 1e-12)


@dataclass(frozen=True)
class MotionSteps:
    """Steps of coefficients, from changes of base parameters and the effects' coefficients.

    Attributes
    ----------
    model : RBDRegressor
        Model with its constraints.
    signs : ndarray of shape (n_effects,)
        1 for coefficients that must not be negative in a consistent model.
    rigid_index : ndarray of shape (n_rigid,)
        Base parameters that are estimated.
    pull : ndarray of shape (n_free, n_free)
        Square root of the precision of the prior.
    centre : ndarray of shape (n_free,)
        Mean of the prior.
    count : float
        Number of independent errors of each position and velocity.
    """

    model: Any
    signs: Array
    rigid_index: NDArray[np.int64]
    pull: Array
    centre: Array
    count: float

    @classmethod
    def of(
        cls,
        model: Any,
        inside: list[Term],
        regression: Regression,
        solution: Solution,
        free: NDArray[Any],
        torque: Array,
        count: float,
    ) -> MotionSteps:
        """Steps from a least-squares solution; ``inside`` are the effects that are estimated."""
        n = int(np.sum(free < regression.n_rigid))
        whole = np.sqrt(np.mean(torque**2, axis=0))
        share = np.zeros(len(free) - n)
        for a, size in zip(regression.design, whole, strict=True):
            if len(a) and size > 0:
                share += np.mean(a[:, free[n:]] ** 2, axis=0) / size**2
        bodies: Array = np.zeros((n, n))
        if n and np.isfinite(solution.urdf_std):
            bodies = np.asarray(np.linalg.inv(prior_root(model.robot_)) / solution.urdf_std, float)
        centre = np.r_[np.zeros(n), solution.coefficients[free[n:]]]
        pull = block_diag(bodies, np.diag(np.sqrt(share)))
        if not model.consistent:
            pull = np.zeros_like(pull)  # the data only, as other estimators without a prior
        index = regression.rigid_index[:n]
        return cls(model, TermSum(inside).signs, index, pull, centre, count)

    def cost(self, thetas: Array, residuals: Array) -> Array:
        """Negative logarithm of the likelihood, of one model or several."""
        motion = np.log(sizes(residuals)).sum(axis=(-3, -2, -1))
        away = (thetas - self.centre) @ self.pull.T
        return np.asarray(self.count * motion + 0.5 * np.sum(away**2, axis=-1))

    def tried(self, theta: Array, slopes: Array, residual: Array) -> tuple[Array, list[Any]]:
        """Coefficients after steps with every damping, and their bodies if these have to exist."""
        slopes, residual = self._weighted(slopes, residual)
        slope = np.vstack([slopes.reshape(len(theta), -1).T, self.pull])
        error = np.r_[residual.ravel(), self.pull @ (theta - self.centre)]
        size = np.linalg.norm(slope, axis=0)
        size[size == 0] = 1.0
        q, triangle = np.linalg.qr(slope / size)
        held = np.linalg.norm(triangle, 2) * np.eye(len(theta))
        found = []
        for damping in DAMPING:
            factor = np.vstack([triangle, np.sqrt(damping) * held]) * size
            target = factor @ theta
            target[: len(triangle)] -= q.T @ error
            found.append(self._solved(factor, target, theta))
        return np.array([x for x, _ in found]), [bodies for _, bodies in found]

    def _weighted(self, slopes: Array, residual: Array) -> tuple[Array, Array]:
        """Slopes and errors relative to the present size of the errors."""
        rows = residual.shape[0] * residual.shape[1]
        weight = np.sqrt(self.count / rows) / sizes(residual)
        return slopes * weight, residual * weight

    def _solved(self, factor: Array, target: Array, near: Array) -> tuple[Array, Array | None]:
        """Least squares over the coefficients that the model allows."""
        model, n = self.model, len(self.rigid_index)
        if not model.consistent:
            # A change from the present model, so that weak directions are left as they are.
            size = np.linalg.norm(factor, axis=0)
            size[size == 0] = 1.0
            step = np.linalg.lstsq(factor / size, target - factor @ near, rcond=WEAK)[0]
            return np.asarray(near + step / size, dtype=float), None
        if n == 0:
            low = np.where(self.signs > 0, 0.0, -np.inf)
            return lsq_linear(factor, target, (low, np.inf)).x, model.inertial_parameters_
        known = model.consistent if isinstance(model.consistent, BodyConstraints) else None
        base, nominal = find_base_parameters(model.robot_), model.robot_.inertial_parameters
        regrouping = base.regrouping[np.searchsorted(base.index, self.rigid_index)]
        start = regrouping @ nominal.ravel()
        bodies, effects = make_consistent(
            nominal,
            factor @ block_diag(regrouping, np.eye(len(self.signs))),
            target + factor[:, :n] @ start,
            self.signs,
            near[n:],
            known=known,
            body_names=model.robot_.body_names,
        )
        return np.r_[regrouping @ bodies.ravel() - start, effects], bodies

    def left_out(
        self,
        theta: Array,
        slopes: Array,
        residual: Array,
        fold: NDArray[np.int64],
        n_folds: int,
    ) -> Array:
        """Coefficients after one step without each fold; ``fold`` is that of every error."""
        slopes, residual = self._weighted(slopes, residual)
        p = len(theta)
        grams, sides = [], []
        for k in range(n_folds):
            own = fold == k
            a = slopes[:, own].reshape(p, -1)
            grams.append(a @ a.T)
            sides.append(a @ residual[own].ravel())
        gram, side = np.array(grams), np.array(sides)
        whole = gram.sum(0) + self.pull.T @ self.pull
        slope = side.sum(0) + self.pull.T @ (self.pull @ (theta - self.centre))
        size = np.sqrt(np.diag(whole))
        size[size == 0] = 1.0
        found = []
        for k in range(n_folds):
            inverse = np.linalg.pinv(
                (whole - gram[k]) / np.outer(size, size), rcond=WEAK**2, hermitian=True
            )
            found.append(theta - inverse @ ((slope - side[k]) / size) / size)
        return np.array(found)
