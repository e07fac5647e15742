# SPDX-License-Identifier: BSD-3-Clause
"""Physical consistency: every body has a mass distribution that can exist.

A body's ten parameters are consistent when its pseudo-inertia, a symmetric 4x4 matrix, is positive
definite. Writing it as L L^T with a triangular L whose diagonal is positive makes every value of
the 10 numbers in L (log diagonal) a consistent body.

References
----------
P. Wensing, S. Kim, J.-J. Slotine (2018), Linear matrix inequalities for physically consistent
inertial parameter identification, IEEE RA-L 3(1), 60-67.
C. Rucker, P. Wensing (2022), Smooth parameterization of rigid-body inertia, IEEE RA-L 7(2).
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares

from skidyn._signals import Array

#: Entries (row, column) of the lower triangle, in the order of the ten numbers.
_LOWER = [(0, 0), (1, 1), (2, 2), (3, 3), (1, 0), (2, 0), (3, 0), (2, 1), (3, 1), (3, 2)]
#: Pull toward the given parameters, relative to the data, where the data says nothing.
PRIOR = 1e-4
MOST_EVALUATIONS = 60
#: Least eigenvalue of a pseudo-inertia, as a share of its largest; far below what torque shows.
LEAST_EIGENVALUE = 1e-10


def pseudo_inertia(parameters: Array) -> Array:
    """Pseudo-inertia matrices of bodies.

    Parameters
    ----------
    parameters : ndarray of shape (n_bodies, 10)
        (m, m cx, m cy, m cz, Ixx, Ixy, Ixz, Iyy, Iyz, Izz) about the frame origin; kg, kg m,
        kg m^2.

    Returns
    -------
    ndarray of shape (n_bodies, 4, 4)
        Second moments of mass (upper left, kg m^2), first moments (kg m) and mass (kg).
    """
    m, hx, hy, hz, xx, xy, xz, yy, yz, zz = np.asarray(parameters, dtype=float).T
    half = (xx + yy + zz) / 2
    rows = [
        [half - xx, -xy, -xz, hx],
        [-xy, half - yy, -yz, hy],
        [-xz, -yz, half - zz, hz],
        [hx, hy, hz, m],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def from_pseudo_inertia(matrices: Array) -> Array:
    """Inertial parameters of pseudo-inertia matrices; the inverse of :func:`pseudo_inertia`.

    Parameters
    ----------
    matrices : ndarray of shape (n_bodies, 4, 4)
        Pseudo-inertia matrices.

    Returns
    -------
    ndarray of shape (n_bodies, 10)
    """
    p = np.asarray(matrices)
    sxx, syy, szz = p[:, 0, 0], p[:, 1, 1], p[:, 2, 2]
    sxy, sxz, syz = p[:, 0, 1], p[:, 0, 2], p[:, 1, 2]
    return np.column_stack(
        [
            p[:, 3, 3],
            p[:, 0, 3],
            p[:, 1, 3],
            p[:, 2, 3],
            syy + szz,
            -sxy,
            -sxz,
            sxx + szz,
            -syz,
            sxx + syy,
        ]
    )


def is_consistent(parameters: Array) -> bool:
    """Whether every body has a mass distribution that can exist.

    Parameters
    ----------
    parameters : ndarray of shape (n_bodies, 10)
        Inertial parameters.

    Returns
    -------
    bool
        Whether all pseudo-inertias are positive definite.

    Examples
    --------
    >>> from skidyn.datasets import load_panda
    >>> is_consistent(load_panda().inertial_parameters)
    True
    """
    values = np.linalg.eigvalsh(pseudo_inertia(parameters))
    return bool(np.all(values > 0))


def make_consistent(
    nominal: Array,
    factor: Array,
    target: Array,
    signs: Array,
    start: Array,
) -> tuple[Array, Array]:
    """Least squares under physical consistency.

    Minimises ``|factor @ [parameters, coefficients] - target|^2`` over bodies whose pseudo-inertia
    is positive definite and coefficients of the right sign, with a weak pull toward the nominal
    bodies in the directions that the data leaves open.

    Parameters
    ----------
    nominal : ndarray of shape (n_bodies, 10)
        Parameters to start from; bodies that are not consistent are replaced by small spheres.
    factor : ndarray of shape (k, 10 * n_bodies + n_coefficients)
        Triangular factor of the weighted columns.
    target : ndarray of shape (k,)
        The torque in the same coordinates.
    signs : ndarray of shape (n_coefficients,)
        1 for coefficients that must not be negative.
    start : ndarray of shape (n_coefficients,)
        Coefficients to start from.

    Returns
    -------
    parameters : ndarray of shape (n_bodies, 10)
        Of bodies that can exist.
    coefficients : ndarray of shape (n_coefficients,)
        Of the right sign.

    Examples
    --------
    >>> import numpy as np
    >>> from skidyn.datasets import load_planar_arm
    >>> nominal = load_planar_arm().inertial_parameters
    >>> wrong = nominal.ravel().copy()
    >>> wrong[0] = -1.0  # a negative mass cannot be fitted
    >>> parameters, _ = make_consistent(nominal, np.eye(20), wrong, np.zeros(0), np.zeros(0))
    >>> is_consistent(parameters)
    True
    """
    n = 10 * len(nominal)
    x0 = _log_cholesky(_repaired(nominal))
    size = np.linalg.norm(factor, axis=0)
    typical = float(np.linalg.norm(target)) / np.sqrt(max(len(target), 1)) + 1e-12
    pull = PRIOR * typical
    # Coefficients are solved in units in which their columns have unit size.
    scale = np.where(size[n:] > 0, size[n:], 1.0)

    def residual(z: Array) -> Array:
        x, c = z[:n], z[n:] / scale
        parameters = from_pseudo_inertia(_matrices(x)).ravel()
        return np.r_[factor @ np.r_[parameters, c] - target, pull * (x - x0)]

    def jacobian(z: Array) -> Array:
        top = np.hstack([factor[:, :n] @ _derivative(z[:n]), factor[:, n:] / scale])
        bottom = np.hstack([pull * np.eye(n), np.zeros((n, len(start)))])
        return np.vstack([top, bottom])

    low = np.r_[np.full(n, -np.inf), np.where(signs > 0, 0.0, -np.inf)]
    first = np.where(signs > 0, np.maximum(start, 0.0), start) * scale
    # An interior start: trust regions want one.
    first = np.where((signs > 0) & (first <= 0), 1e-6 * typical, first)
    solution = least_squares(
        residual,
        np.r_[x0, first],
        jac=jacobian,
        bounds=(low, np.inf),
        x_scale="jac",
        method="trf",
        max_nfev=MOST_EVALUATIONS,
        ftol=1e-8,
        xtol=1e-8,
    )
    parameters = from_pseudo_inertia(_lifted(_matrices(solution.x[:n])))
    return parameters, solution.x[n:] / scale


def _repaired(nominal: Array) -> Array:
    """Nominal bodies, small spheres where they are not consistent (a link without mass)."""
    matrices = pseudo_inertia(nominal)
    largest = max(float(nominal[:, 0].max(initial=0.0)), 1e-3)
    repaired = matrices.copy()
    for i, matrix in enumerate(matrices):
        values = np.linalg.eigvalsh(matrix)
        if values[0] <= 1e-9 * max(values[-1], 1e-12):
            mass = max(float(matrix[3, 3]), 1e-3 * largest)
            centre = matrix[:3, 3] / mass
            repaired[i, 3, 3] = mass
            repaired[i, :3, 3] = repaired[i, 3, :3] = mass * centre
            repaired[i, :3, :3] = mass * (np.outer(centre, centre) + 0.03**2 * np.eye(3))
    return repaired


def _lifted(matrices: Array) -> Array:
    """The same matrices, with eigenvalues that rounding may have lost raised above zero."""
    largest = np.linalg.eigvalsh(matrices)[:, -1]
    return matrices + (LEAST_EIGENVALUE * largest)[:, None, None] * np.eye(4)


def _log_cholesky(matrices: Array) -> Array:
    factors = np.linalg.cholesky(matrices)
    rows = []
    for factor in factors:
        rows.append([np.log(factor[i, j]) if i == j else factor[i, j] for i, j in _LOWER])
    return np.ravel(rows)


def _triangles(x: Array) -> Array:
    numbers = x.reshape(-1, 10)
    triangles = np.zeros((len(numbers), 4, 4))
    for k, (i, j) in enumerate(_LOWER):
        # Beyond e^20 nothing physical lies; the clip only keeps a wild trial step finite.
        value = np.exp(np.clip(numbers[:, k], -20, 20)) if i == j else numbers[:, k]
        triangles[:, i, j] = value
    return triangles


def _matrices(x: Array) -> Array:
    triangles = _triangles(x)
    return triangles @ triangles.transpose(0, 2, 1)


def _derivative(x: Array) -> Array:
    """Derivative of all inertial parameters by the numbers, (10 n_bodies, 10 n_bodies)."""
    triangles = _triangles(x)
    n = len(triangles)
    jacobian = np.zeros((10 * n, 10 * n))
    for k, (i, j) in enumerate(_LOWER):
        unit = np.zeros((n, 4, 4))
        unit[:, i, j] = triangles[:, i, j] if i == j else 1.0
        product = unit @ triangles.transpose(0, 2, 1)
        change = from_pseudo_inertia(product + product.transpose(0, 2, 1))
        for body in range(n):
            jacobian[10 * body : 10 * body + 10, 10 * body + k] = change[body]
    return jacobian
