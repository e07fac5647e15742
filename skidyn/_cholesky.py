# SPDX-License-Identifier: BSD-3-Clause
"""Solution of normal equations by Cholesky factors.

A diagnosis solves thousands of small systems. SciPy's functions spend four fifths of the time of
such a system on checks and on the choice of a routine; these call LAPACK at once, with the same
results.
"""

from __future__ import annotations

import numpy as np
import scipy  # its parts are imported when first used, after the first output of a check

from skidyn._signals import Array


def factored(normal: Array) -> Array:
    """Upper triangular factor of a symmetric positive definite matrix; its lower part is arbitrary.

    The matrix is overwritten if its columns are contiguous; a LinAlgError is raised if it is not
    positive definite.
    """
    factor, info = scipy.linalg.lapack.dpotrf(normal, lower=0, clean=0, overwrite_a=1)
    if info:
        raise np.linalg.LinAlgError(f"leading minor {info} is not positive definite")
    return np.asarray(factor)


def solved(factor: Array, right: Array) -> Array:
    """Solution for a factor of :func:`factored` and right sides of shape (p,) or (p, k)."""
    if not len(factor):  # a model without coefficients
        return np.zeros(right.shape)
    return np.asarray(scipy.linalg.lapack.dpotrs(factor, right, lower=0)[0])
