# SPDX-License-Identifier: BSD-3-Clause
"""Held-out error with noise re-estimated, and refinement of shape parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array
from skidyn.diagnosis._candidates import Candidate
from skidyn.evidence._problem import RIDGE, Problem
from skidyn.evidence._shapes import Gain, refine_term


def profile_error(
    problem: Problem,
    blocks: Sequence[dict[int, Array]],
    sigma: Array,
    target: Sequence[Array],
    passes: int = 2,
) -> Array:
    """Held-out squared error of every fold and joint, noise re-estimated from it.

    Parameters
    ----------
    problem : Problem
        Rows and folds.
    blocks : sequence of dict
        Columns of the model beside the rigid body.
    sigma : ndarray of shape (n_joints,)
        First guess of the noise of one row.
    target : sequence of ndarray
        Averaged torque of every joint.
    passes : int, default=2
        Rounds of weighting.

    Returns
    -------
    ndarray of shape (n_folds, n_joints), (N m)^2 or N^2
    """
    grams = _joint_grams(problem, blocks, target)
    counts = problem.rows.counts
    errors = np.zeros(grams.shape[:2])
    for _ in range(passes):
        weight = 1 / sigma**2
        total = np.einsum("fjab,j->ab", grams, weight)
        scale = np.sqrt(np.diag(total))
        scale[scale == 0] = 1.0
        scale[-1] = 1.0
        ridge = 10 * RIDGE * np.eye(len(scale) - 1)
        for f, gram in enumerate(grams):
            train = (total - np.einsum("jab,j->ab", gram, weight)) / scale[:, None] / scale
            solution = np.linalg.solve(train[:-1, :-1] + ridge, train[:-1, -1]) / scale[:-1]
            b = np.append(-solution, 1.0)
            errors[f] = np.einsum("a,jab,b->j", b, gram, b)
        # A joint that rests has no rows; its weight is of no account but must be finite.
        sigma = np.where(counts > 0, np.sqrt(errors.sum(0) / np.maximum(counts, 1)) + 1e-100, 1.0)
    return errors


def _joint_grams(
    problem: Problem, blocks: Sequence[dict[int, Array]], target: Sequence[Array]
) -> Array:
    """Gram matrix of [columns | torque] of every fold and joint."""
    design = problem.design(blocks)
    p = design[0].shape[1] + 1
    grams = np.zeros((problem.n_folds, problem.n_joints, p, p))
    for j, (block, y) in enumerate(zip(design, target, strict=True)):
        a = np.column_stack([block, y])
        edges = np.searchsorted(problem.fold[j], np.arange(problem.n_folds + 1))
        for f, (i, k) in enumerate(zip(edges[:-1], edges[1:], strict=True)):
            grams[f, j] = a[i:k].T @ a[i:k]
    return grams


def log_likelihood_gain(before: Array, after: Array, counts: NDArray[np.int64]) -> Array:
    """Twice the gain of held-out log-likelihood per joint, noise profiled out, (n_joints,)."""
    old, new = (np.maximum(errors.sum(0), 1e-300) for errors in (before, after))
    gain: Array = counts * np.log(old / new)
    return gain


def refine(
    problem: Problem,
    fixed: Sequence[dict[int, Array]],
    candidates: Sequence[Candidate],
    sigma: Array,
    target: Sequence[Array],
) -> list[Candidate]:
    """Refine the shape parameters of candidates, one after the other, the model refitted.

    Parameters
    ----------
    problem : Problem
        Rows.
    fixed : sequence of dict
        Columns of the model beside the rigid body.
    candidates : sequence of Candidate
        Terms found on the grid.
    sigma : ndarray of shape (n_joints,)
        Noise of one row.
    target : sequence of ndarray
        Averaged torque.

    Returns
    -------
    list of Candidate
    """
    refined = list(candidates)
    for i, candidate in enumerate(refined):
        if candidate.n_shapes == 0:
            continue
        others = [c.rows for k, c in enumerate(refined) if k != i]
        gain = Gain(problem, [*fixed, *others], sigma, target)
        term = refine_term(problem, candidate.term, gain)
        refined[i] = replace(candidate, term=term, rows=problem.term_rows(term))
    return refined
