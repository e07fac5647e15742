# SPDX-License-Identifier: BSD-3-Clause
"""Physically consistent least squares as a semidefinite program, through cvxpy and Clarabel.

References
----------
C. Sousa, R. Cortesao (2014), Physical feasibility of robot base inertial parameter identification:
a linear matrix inequality approach, Int. J. Robotics Research 33(6), 931-944.
"""

from __future__ import annotations

import warnings

import numpy as np
from scipy.linalg import block_diag

from skidyn._optional import import_optional
from skidyn._signals import Array
from skidyn.rigid_body._log_det import BASIS, Linear, local_units, taken_inside

#: Pull toward the start, relative to the data, where the data says nothing.
PULL = 1e-5


def solve_conic(
    factor: Array, target: Array, start: Array, nominal: Array, linear: Linear
) -> Array:
    """Least squares over bodies that can exist, by interior-point steps on a cone program.

    Parameters
    ----------
    factor, target : ndarray of shape (k, n), (k,)
        Columns and torque, of unit size.
    start : ndarray of shape (n,)
        Bodies and coefficients that strictly keep everything that is known.
    nominal : ndarray of shape (n_bodies, 10)
        Bodies toward which open directions are pulled.
    linear : Linear
        Limits and equations.

    Returns
    -------
    ndarray of shape (n,)
        Strictly inside all limits.

    Raises
    ------
    RuntimeError
        The solver gave up.
    """
    cp = import_optional("cvxpy", extra="conic")
    import_optional("clarabel", extra="conic")
    n = nominal.size
    whole, _ = local_units(nominal, nominal)
    # Unknowns in which one is a whole body: x = units z.
    units = block_diag(*whole, np.eye(len(start) - n))
    z = cp.Variable(len(start))
    x = units @ z
    conditions = []
    for body in range(len(nominal)):
        matrix = sum(x[10 * body + k] * BASIS[k] for k in range(10))
        # Congruence with the nominal body makes all eigenvalues comparable.
        root = np.linalg.inv(np.linalg.cholesky(_matrix(nominal[body])))
        conditions.append(root @ matrix @ root.T >> 0)
    if len(linear.b):
        conditions.append(linear.C @ x <= linear.b)
    if len(linear.e):
        conditions.append(linear.E @ x == linear.e)
    at = np.linalg.solve(units[:n, :n], nominal.ravel())
    error = cp.sum_squares(factor @ x - target) + PULL**2 * cp.sum_squares(z[:n] - at)
    problem = cp.Problem(cp.Minimize(error), conditions)
    with warnings.catch_warnings():
        # An answer of reduced accuracy is still checked and taken inside.
        warnings.filterwarnings("ignore", message="Solution may be inaccurate")
        problem.solve(solver=cp.CLARABEL)
    if z.value is None:
        raise RuntimeError(
            f"the conic solver ended with status {problem.status!r}; use solver='interior_point'"
        )
    return taken_inside(units @ z.value, start, n, linear)


def _matrix(parameters: Array) -> Array:
    return np.asarray(np.tensordot(parameters, BASIS, 1))
