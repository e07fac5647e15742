# SPDX-License-Identifier: BSD-3-Clause
"""Physical consistency: every body has a possible mass distribution.

A body's ten parameters are consistent when its pseudo-inertia, a symmetric 4x4 matrix, is positive
definite. Least squares under this condition is convex, with one optimum. Every iterate is a set of
physically possible bodies, so the result is one as well, for any data.

References
----------
P. Wensing, S. Kim, J.-J. Slotine (2018), Linear matrix inequalities for physically consistent
inertial parameter identification, IEEE RA-L 3(1), 60-67.
S. Boyd, L. Vandenberghe (2004), Convex Optimization, chapter 11.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from skidyn._signals import Array
from skidyn.identification._constraints import BodyConstraints, body_constraints, start_bodies
from skidyn.identification._interior_point import solve_interior_point
from skidyn.identification._log_det import (
    Linear,
    from_pseudo_inertia as from_pseudo_inertia,
    pseudo_inertia as pseudo_inertia,
)

#: Least second moment of mass of a body about its centre, relative to its largest moment.
THICKNESS = 1e-9
#: Torque below this share of the torque of the initial bodies counts as zero.
ZERO = 1e-12
#: Start of coefficients that must not be negative, in units in which the torque has unit size.
ABOVE_ZERO = 1e-3


def is_consistent(parameters: Array) -> bool:
    """Whether every body is physically consistent.

    Parameters
    ----------
    parameters : ndarray of shape (n_bodies, 10)
        (m, m cx, m cy, m cz, Ixx, Ixy, Ixz, Iyy, Iyz, Izz) of every body about its frame; kg, kg m,
        kg m^2.

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
    *,
    known: BodyConstraints | None = None,
    body_names: Sequence[str] | None = None,
) -> tuple[Array, Array]:
    """Solve least squares with physical consistency.

    Minimises ``|factor @ [parameters, coefficients] - target|^2`` over bodies whose pseudo-inertia
    is positive definite, coefficients of the right sign and further constraints. In directions that
    the data does not determine the bodies remain as close as possible to the nominal ones.

    Parameters
    ----------
    nominal : ndarray of shape (n_bodies, 10)
        Initial parameters; inconsistent bodies are replaced by small spheres.
    factor : ndarray of shape (k, 10 * n_bodies + n_coefficients)
        Triangular factor of the weighted columns.
    target : ndarray of shape (k,)
        The torque in the same coordinates.
    signs : ndarray of shape (n_coefficients,)
        1 for coefficients that must not be negative.
    start : ndarray of shape (n_coefficients,)
        Initial coefficients.
    known : BodyConstraints, optional
        Constraints on the bodies.
    body_names : sequence of str, optional
        Names of the bodies in ``known``; ``"0"``, ``"1"``, ... by default.

    Returns
    -------
    parameters : ndarray of shape (n_bodies, 10)
        Parameters of physically consistent bodies.
    coefficients : ndarray of shape (n_coefficients,)
        Coefficients with the required sign.

    Raises
    ------
    ValueError
        The constraints are contradictory.

    Notes
    -----
    The problem is convex and has one optimum. A step of the interior-point method takes a QR
    decomposition with ``10 * n_bodies + n_coefficients`` columns; some 20 steps are needed.

    References
    ----------
    P. Wensing, S. Kim, J.-J. Slotine (2018), Linear matrix inequalities for physically consistent
    inertial parameter identification, IEEE RA-L 3(1), 60-67.

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
    known = BodyConstraints() if known is None else known
    names = [str(i) for i in range(len(nominal))] if body_names is None else list(body_names)
    bodies = start_bodies(known, names, nominal)
    linear = body_constraints(known, names, signs)
    n = bodies.size
    # In units in which target and columns of coefficients have unit size.
    # Zero torque has no size: a share of the torque of the initial bodies is used instead.
    own = [target, ZERO * (factor[:, :n] @ bodies.ravel())]
    size = max(float(np.linalg.norm(t)) for t in own) / np.sqrt(max(len(target), 1)) or 1.0
    scale = np.ones(factor.shape[1])
    length = np.linalg.norm(factor[:, n:], axis=0) / size
    scale[n:] = np.where(length > 0, length, 1.0)
    columns, torque = factor / scale / size, target / size
    scaled = Linear(linear.C / scale, linear.b, linear.E / scale, linear.e)
    first = start * scale[n:]
    first = np.where(signs > 0, np.maximum(first, ABOVE_ZERO), first)
    x = np.r_[bodies.ravel(), first]
    x = solve_interior_point(columns, torque, x, bodies, scaled) / scale
    return _thickened(x[:n].reshape(-1, 10)), x[n:]


def _thickened(parameters: Array) -> Array:
    """Add a small moment of inertia about the centre to bodies that are flat up to rounding.

    Mass, centre of mass and symmetry are unchanged, so known constraints still hold. The added
    moment is larger than the rounding of numbers in a URDF, and far too small to affect the torque.
    """
    values = np.linalg.eigvalsh(pseudo_inertia(parameters))
    flat = values[:, 0] < THICKNESS * values[:, -1]
    # A second moment s in all directions is a moment of inertia 2 s.
    added = np.where(flat, 2 * THICKNESS * values[:, -1], 0.0)
    return np.asarray(parameters + np.outer(added, [0, 0, 0, 0, 1, 0, 0, 1, 0, 1]))
