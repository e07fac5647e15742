# SPDX-License-Identifier: BSD-3-Clause
"""Held-out error with noise re-estimated, and refinement of shape parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array
from skidyn.diagnosis._candidates import Candidate
from skidyn.diagnosis._held_out import told_alone
from skidyn.evidence import (
    RIDGE,
    Gain,
    Problem,
    felt_columns,
    refine_term,
    soft_prior,
    solve_left_out,
)

#: Interleaved parts of a trajectory.
QUARTERS = 4


def profile_error(
    problem: Problem,
    blocks: Sequence[dict[int, Array]],
    sigma: Array,
    target: Sequence[Array],
    passes: int = 2,
    *,
    within: bool = False,
    soft: Sequence[float] = (),
) -> Array:
    """Held-out squared error of every fold and joint, noise re-estimated from it.

    Parameters
    ----------
    problem : Problem
        Rows and folds.
    blocks : sequence of dict
        Columns of the model beside the rigid body.
    sigma : ndarray of shape (n_joints,)
        Initial noise of one row.
    target : sequence of ndarray
        Averaged torque of every joint.
    passes : int, default=2
        Number of rounds of weighting.
    within : bool, default=False
        Leave out interleaved parts of every trajectory instead of whole ones: an effect in a single
        trajectory cannot be learnt from the others.
    soft : sequence of float, default=()
        For each of the last blocks, the share by which its coefficients are drawn to zero where no
        row determines them.

    Returns
    -------
    ndarray of shape (n_folds, n_joints), (N m)^2 or N^2
    """
    grams, width = _joint_grams(problem, blocks, target, within)
    counts = problem.rows.counts
    errors = np.zeros((len(grams[0][1]), len(grams)))
    places = _places(blocks, soft, width)
    widths = [next(iter(block.values())).shape[1] for block in blocks]
    for _ in range(passes):
        joined = np.zeros((len(errors), width + 1, width + 1))
        for (own, gram), s in zip(grams, sigma, strict=True):
            joined[:, own[:, None], own] += gram / s**2
        pull = soft_prior(joined[:, :-1, :-1].sum(0), places) if places else None
        products, cross = joined[:, :-1, :-1], joined[:, :-1, -1]
        kept = told_alone(products, widths)
        _, left = solve_left_out(products, cross, pull, ridge=10 * RIDGE, kept=kept)
        b = np.column_stack([-left, np.ones(len(left))])
        for j, (own, gram) in enumerate(grams):
            part = b[:, own]
            errors[:, j] = np.sum(np.matmul(gram, part[:, :, None])[:, :, 0] * part, axis=1)
        # A joint at rest has no rows; its weight has no effect but must be finite.
        sigma = np.where(counts > 0, np.sqrt(errors.sum(0) / np.maximum(counts, 1)) + 1e-100, 1.0)
    return errors


def _places(
    blocks: Sequence[dict[int, Array]], soft: Sequence[float], end: int
) -> list[tuple[slice, float]]:
    """Columns of the last blocks, those that are drawn to zero."""
    places = []
    for block, share in zip(reversed(blocks), reversed(soft), strict=False):
        start = end - next(iter(block.values())).shape[1]
        if share:
            places.append((slice(start, end), share))
        end = start
    return places


def _joint_grams(
    problem: Problem,
    blocks: Sequence[dict[int, Array]],
    target: Sequence[Array],
    within: bool,
) -> tuple[list[tuple[NDArray[np.int64], Array]], int]:
    """Gram matrices of [columns | torque] by fold, for the columns that act on a joint.

    Returns
    -------
    grams : list of (ndarray of shape (k,), ndarray of shape (n_folds, k, k))
        By joint, the indices of its columns, and the products.
    width : int
        Number of columns of the model, which is the index of the torque.
    """
    felt, width = felt_columns(problem, blocks)
    labels = problem.rows.quarter if within else problem.fold
    n_folds = QUARTERS if within else problem.n_folds
    grams = []
    for own, y, label in zip(felt, target, labels, strict=True):
        a = np.column_stack([own.rows, y])
        parts = [a[label == f] for f in range(n_folds)]
        grams.append((np.append(own.places, width), np.array([x.T @ x for x in parts])))
    return grams, width


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
    """Refine the shape parameters of candidates one after another, with the model refitted.

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
    """
    refined = list(candidates)
    for i, candidate in enumerate(refined):
        if candidate.n_shapes == 0:
            continue
        others = [c.rows for k, c in enumerate(refined) if k != i]
        gain = Gain.beside(problem, [*fixed, *others], sigma, target)
        term = refine_term(problem, candidate.term, gain)
        refined[i] = replace(candidate, term=term, rows=problem.term_rows(term))
    return refined
