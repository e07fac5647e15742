# SPDX-License-Identifier: BSD-3-Clause
"""What a fitted model takes in of a torque that it lacks.

Bodies that are identified take in a part of any missing torque: a function of two positions, for
example, looks like gravity in a few recordings. The residual holds only what they leave, and the
functions of signals that are compared with it have to be reduced in the same way, or they do not
resemble it.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from skidyn._signals import Array
from skidyn.effects import Term
from skidyn.evidence import Problem

#: Directions of the coefficients of which the rows determine less than this share of the best one,
#: and directions of a joint's rows of which the model takes in less than this share, are left out.
UNDETERMINED, LITTLE = 1e-9, 0.1


def absorbed_directions(problem: Problem, terms: Iterable[Term], sigma: Array) -> list[Array]:
    """Directions of each joint's averaged rows of which the fit of a model takes in a part.

    Of a torque ``x`` on one joint alone, with any torque of the other joints explained as before,
    ``x - d @ (d.T @ x)`` is left there.

    Parameters
    ----------
    problem : Problem
        Rows.
    terms : iterable of Term
        Effects of the model beside the bodies.
    sigma : ndarray of shape (n_joints,)
        Noise of one row, by which joints are weighted.

    Returns
    -------
    list of ndarray of shape (n_rows_j, k_j)
        Orthogonal columns ``d`` of each joint, of a length of 1 at most.
    """
    design = problem.design([problem.term_rows(term) for term in terms])
    design = [columns / s for columns, s in zip(design, sigma, strict=True)]
    size = np.sqrt(sum(np.sum(columns**2, axis=0) for columns in design))
    used = size > 0
    design = [columns[:, used] / size[used] for columns in design]
    values, vectors = np.linalg.eigh(sum(columns.T @ columns for columns in design))
    kept = values > UNDETERMINED * values[-1:]
    whitened = vectors[:, kept] / np.sqrt(values[kept])
    found = []
    for columns in design:
        # By the products of few columns; LAPACK's singular values of all rows may not converge.
        own = columns @ whitened
        share, directions = np.linalg.eigh(own.T @ own)
        found.append(own @ directions[:, share > LITTLE])
    return found


def left_of(columns: Array, directions: Array) -> Array:
    """What a model leaves of columns, of shape (..., n_rows, k), on one joint.

    Parameters
    ----------
    columns : ndarray of shape (..., n_rows, k)
        Torques on the joint.
    directions : ndarray of shape (n_rows, m)
        Those of :func:`absorbed_directions`.
    """
    return np.asarray(columns - directions @ (directions.T @ columns))


def thinned(directions: Array, step: int) -> Array:
    """The directions at one of every ``step`` rows, which stands for its neighbours, too."""
    return np.asarray(directions[::step] * np.sqrt(step))
