# SPDX-License-Identifier: BSD-3-Clause
"""Estimators that are regularised toward the bodies of the URDF.

Both measure the distance of bodies from those of the URDF by their pseudo-inertias, so that units
and frames do not matter: ridge by the squared relative change, the quadratic part of the log-det
divergence; the entropic estimator by the divergence itself, under which all bodies remain possible.

References
----------
T. Lee, P. Wensing, F. C. Park (2020), Geometric robot dynamic identification: a convex programming
approach, IEEE Trans. Robotics 36(2), 348-365.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag

from skidyn._signals import Array
from skidyn.evidence import solve_left_out
from skidyn.identification._interior_point import minimise_with_divergence
from skidyn.identification._log_det import existing_bodies, local_units
from skidyn.identification._regression import Regression, Solution
from skidyn.robots import find_base_parameters

#: Relative uncertainties of the URDF that are tried.
CANDIDATES = (0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0)
#: Least noise of a joint: relative to that of the noisiest, and in N m.
LEAST_NOISE, LEAST_TORQUE = 1e-7, 1e-9


@dataclass(frozen=True)
class _Whole:
    """The regression in all inertial parameters, as changes of the nominal bodies."""

    nominal: Array
    grams: Array
    cross: Array
    noise: Array
    joined: Array
    precision: Array
    squares: Array

    @property
    def n(self) -> int:
        return self.nominal.size


def ridge(regression: Regression, prior_std: float | None = None) -> Solution:
    """Least squares with a quadratic pull toward the bodies of the URDF.

    Minimises ``sum (residual / noise)^2 + |relative change of bodies|^2 / prior_std^2``.
    """
    regression, moved = _from_existing(regression)
    whole = _whole(regression)
    std = _chosen(whole) if prior_std is None else prior_std
    prior = (whole.precision / std**2, np.zeros(len(whole.precision)))
    solution, left = solve_left_out(whole.grams, whole.cross, prior)
    root = np.asarray(np.linalg.cholesky(whole.precision[: whole.n, : whole.n]).T / std)
    return _solution(regression, whole, solution, left, root, std, moved)


def entropic(regression: Regression, prior_std: float | None = None) -> Solution:
    """Least squares with a pull toward the bodies of the URDF by the log-det divergence.

    Minimises ``sum (residual / noise)^2 + 2 divergence / prior_std^2``.
    """
    regression, moved = _from_existing(regression)
    whole = _whole(regression)
    std = _chosen(whole) if prior_std is None else prior_std
    factor, target = _rows(regression, whole)
    nominal = whole.nominal
    start = np.r_[nominal.ravel(), np.zeros(whole.grams.shape[1] - whole.n)]
    target = target + factor @ start
    x = minimise_with_divergence(factor, target, start, nominal, 1 / std**2)
    change = x.copy()
    change[: whole.n] -= nominal.ravel()
    # Without a fold: one Newton step from the whole solution.
    units, gradient = local_units(x[: whole.n].reshape(-1, 10), nominal)
    root = np.linalg.inv(block_diag(*units)) / std
    pull, push = np.zeros_like(whole.precision), np.zeros(len(x))
    pull[: whole.n, : whole.n] = root.T @ root
    push[: whole.n] = root.T @ gradient.ravel() / std
    _, left = solve_left_out(whole.grams, whole.cross, (pull, pull @ change - push))
    return _solution(regression, whole, change, left, root, std, moved)


def _whole(regression: Regression) -> _Whole:
    """Products of the folds in all parameters, weighted by the noise of a weighted fit."""
    from skidyn.identification._estimators import weighted

    robot = regression.robot
    nominal = existing_bodies(robot.inertial_parameters)
    base = find_base_parameters(robot)
    p = regression.design[0].shape[1]
    regrouping = base.regrouping if regression.n_rigid else np.zeros((0, nominal.size))
    joined = block_diag(regrouping, np.eye(p - regression.n_rigid))
    noise = weighted(regression).noise
    # Without noise the prior would have no influence, and numbers would not be finite.
    noise = np.maximum(noise, LEAST_NOISE * noise.max() + LEAST_TORQUE)
    grams, cross = regression.products(noise)
    units, _ = local_units(nominal, nominal)
    inverse = np.linalg.inv(block_diag(*units))
    precision = np.zeros((joined.shape[1], joined.shape[1]))
    precision[: nominal.size, : nominal.size] = inverse.T @ inverse
    squares = np.zeros(regression.n_folds)
    for y, s, fold in zip(regression.target, noise, regression.fold, strict=True):
        np.add.at(squares, fold, (y / s) ** 2)
    return _Whole(
        nominal,
        joined.T @ grams @ joined,
        cross @ joined,
        noise,
        joined,
        precision,
        squares,
    )


def _from_existing(regression: Regression) -> tuple[Regression, Array]:
    """The regression in changes from possible bodies, and the change of these from the URDF.

    Coefficients are changes from the URDF, some of whose bodies may be impossible.
    """
    parameters = regression.robot.inertial_parameters
    moved = np.zeros(regression.design[0].shape[1])
    if regression.n_rigid:
        base = find_base_parameters(regression.robot)
        moved[: regression.n_rigid] = base.values(existing_bodies(parameters) - parameters)
    rows = zip(regression.design, regression.target, strict=True)
    return replace(regression, target=[y - a @ moved for a, y in rows], fit=None), moved


def _rows(regression: Regression, whole: _Whole) -> tuple[Array, Array]:
    """Triangular factor of all weighted rows, in all parameters."""
    rows = [
        np.column_stack([a, y]) / s
        for a, y, s in zip(regression.design, regression.target, whole.noise, strict=True)
    ]
    factor: Array = np.asarray(np.linalg.qr(np.vstack(rows), mode="r"))
    return factor[:, :-1] @ whole.joined, factor[:, -1]


def _chosen(whole: _Whole) -> float:
    """Uncertainty of the URDF with which left-out folds are predicted best."""
    if len(whole.grams) < 2:
        return 1.0
    errors = []
    for std in CANDIDATES:
        prior = (whole.precision / std**2, np.zeros(len(whole.precision)))
        _, left = solve_left_out(whole.grams, whole.cross, prior)
        quadratic = np.einsum("fi,fij,fj->", left, whole.grams, left)
        errors.append(float(quadratic - 2 * np.sum(left * whole.cross) + whole.squares.sum()))
    return CANDIDATES[int(np.argmin(errors))]


def _solution(
    regression: Regression,
    whole: _Whole,
    change: Array,
    left: Array,
    root: Array,
    std: float,
    moved: Array,
) -> Solution:
    coefficients = whole.joined @ change
    return Solution(
        coefficients + moved,
        left @ whole.joined.T + moved,
        regression.noise(coefficients),
        whole.nominal + change[: whole.n].reshape(-1, 10) if regression.n_rigid else None,
        np.hstack([root, np.zeros((len(root), len(change) - whole.n))]),
        {"prior_std_": float(std)},
    )
