# SPDX-License-Identifier: BSD-3-Clause
"""Distance of bodies from given ones: the log-det divergence of their pseudo-inertias.

The divergence ``D(P, P0) = trace(P0^-1 P) - log det(P0^-1 P) - 4`` of the 4x4 pseudo-inertias is
convex, grows without bound at the limit of the possible bodies, and does not depend on units or
frames. Near the given bodies it is half the squared relative change ``trace((P0^-1 (P - P0))^2)``.

References
----------
T. Lee, P. Wensing, F. C. Park (2020), Geometric robot dynamic identification: a convex programming
approach, IEEE Trans. Robotics 36(2), 348-365.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from skidyn._signals import Array

#: Share of the start that is added to a solution on the border of the possible bodies.
LEAST_SHARE = 1e-9
#: Least ratio of the smallest to the largest eigenvalue of a body with a mass distribution.
FLAT = 1e-9


def pseudo_inertia(parameters: Array) -> Array:
    """Pseudo-inertia matrices of bodies, shape (n_bodies, 4, 4).

    Parameters are (m, m cx, m cy, m cz, Ixx, Ixy, Ixz, Iyy, Iyz, Izz) about the frame origin in kg,
    kg m and kg m^2; matrices have second moments of mass (upper left, kg m^2), first moments (kg m)
    and mass (kg).
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
    """Inertial parameters of pseudo-inertia matrices; the inverse of :func:`pseudo_inertia`."""
    p = np.asarray(matrices)
    xx, yy, zz = p[:, 0, 0], p[:, 1, 1], p[:, 2, 2]
    inertia = [yy + zz, -p[:, 0, 1], -p[:, 0, 2], xx + zz, -p[:, 1, 2], xx + yy]
    return np.column_stack([p[:, 3, 3], p[:, 0, 3], p[:, 1, 3], p[:, 2, 3], *inertia])


def _symmetric_basis() -> Array:
    basis = []
    for i in range(4):
        for j in range(i + 1):
            matrix = np.zeros((4, 4))
            matrix[i, j] = matrix[j, i] = 1.0 if i == j else np.sqrt(0.5)
            basis.append(matrix)
    return np.array(basis)


#: Pseudo-inertia of each of the ten parameters alone, and an orthonormal basis of all of them.
BASIS, SYMMETRIC = pseudo_inertia(np.eye(10)), _symmetric_basis()


def existing_bodies(parameters: Array) -> Array:
    """The given bodies, with small spheres for impossible ones (a link without mass)."""
    bodies = np.array(parameters, dtype=float)
    matrices = pseudo_inertia(bodies)
    masses = matrices[:, 3, 3]
    largest = float(masses.max(initial=0.0)) or 1.0
    size = np.trace(matrices[:, :3, :3], axis1=1, axis2=2)[masses > 1e-3 * largest]
    # Length for which masses and moments have similar size, so that units do not matter.
    length = np.sqrt(max(float((size / masses[masses > 1e-3 * largest]).max(initial=0.0)), 0.0))
    length = length or 0.3
    unit = np.array([length, length, length, 1.0])
    for i, matrix in enumerate(matrices):
        values = np.linalg.eigvalsh(matrix / unit[:, None] / unit)
        if values[0] <= FLAT * max(values[-1], largest * FLAT):
            mass = max(float(matrix[3, 3]), 1e-3 * largest)
            centre = matrix[:3, 3] / mass
            matrix[3, 3] = mass
            matrix[:3, :3] = mass * (np.outer(centre, centre) + (0.1 * length) ** 2 * np.eye(3))
            bodies[i] = from_pseudo_inertia(matrix[None])[0]
    return bodies


def divergence(parameters: Array, nominal: Array) -> float:
    """Log-det divergence of bodies from nominal ones; infinite for an impossible body."""
    try:
        own, other = (np.linalg.cholesky(pseudo_inertia(x)) for x in (parameters, nominal))
    except np.linalg.LinAlgError:
        return float("inf")
    ratio = np.linalg.solve(other, own)
    logs = [np.log(np.diagonal(x, axis1=1, axis2=2)).sum() for x in (own, other)]
    return float(np.sum(ratio**2) - 2 * (logs[0] - logs[1]) - 4 * len(parameters))


def local_units(parameters: Array, nominal: Array) -> tuple[Array, Array]:
    """Changes of bodies in which the divergence has the identity as Hessian, and its gradient.

    With ``P = L L'`` such a change is ``L S L'`` for the members S of an orthonormal basis of the
    symmetric matrices. Units are of shape (n_bodies, 10, 10); columns are changes of a body's
    parameters.
    """
    root = np.linalg.cholesky(pseudo_inertia(parameters))
    changes = np.einsum("nij,ajk,nlk->nail", root, SYMMETRIC, root)
    units = from_pseudo_inertia(changes.reshape(-1, 4, 4)).reshape(-1, 10, 10)
    ratio = np.linalg.solve(np.linalg.cholesky(pseudo_inertia(nominal)), root)
    difference = np.einsum("nki,nkj->nij", ratio, ratio) - np.eye(4)
    return units.transpose(0, 2, 1), np.einsum("nij,aji->na", difference, SYMMETRIC)


@dataclass(frozen=True)
class Linear:
    """Linear constraints on parameters and coefficients: ``C x <= b`` and ``E x = e``."""

    C: Array
    b: Array
    E: Array
    e: Array

    @classmethod
    def none(cls, n: int) -> Linear:
        """No constraints on n unknowns."""
        return cls(np.zeros((0, n)), np.zeros(0), np.zeros((0, n)), np.zeros(0))


def taken_inside(x: Array, start: Array, n: int, linear: Linear) -> Array:
    """The point nearest to x, in the direction of the start, strictly inside all limits.

    The first n unknowns are parameters, possibly on the border of the possible bodies.
    """
    share = LEAST_SHARE
    while share < 1:
        point = (1 - share) * x + share * start
        values = np.linalg.eigvalsh(pseudo_inertia(point[:n].reshape(-1, 10)))
        exists = np.all(values[:, 0] > 1e-13 * values[:, -1])
        if exists and np.all(linear.C @ point < linear.b):
            return np.asarray(point)
        share *= 10
    return start
