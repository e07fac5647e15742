# SPDX-License-Identifier: BSD-3-Clause
"""Held-out error with noise re-estimated, and refinement of shape parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from skidyn._signals import Array
from skidyn.diagnosis._candidates import Candidate
from skidyn.diagnosis._problem import RIDGE, Problem, width
from skidyn.effects import Shape, Term, get_effect

#: First step of a refinement (a factor 1.5, or a share of the travel), its shrinkage and rounds.
FIRST_STEP, SHRINK, ROUNDS = 0.5, 2.2, 7
FIRST_SHARE = 0.06


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
        sigma = np.sqrt(errors.sum(0) / np.maximum(counts, 1)) + 1e-300
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


def log_likelihood_gain(before: Array, after: Array, counts: Array) -> Array:
    """Twice the gain of held-out log-likelihood per joint, noise profiled out, (n_joints,)."""
    return counts * np.log(before.sum(0) / np.maximum(after.sum(0), 1e-300))


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
        shapes = get_effect(candidate.kind).shapes if candidate.kind != "unknown" else ()
        if not shapes or get_effect(candidate.kind).search != "grid":
            continue
        others = [c.rows for k, c in enumerate(refined) if k != i]
        gain = _Gain(problem, [*fixed, *others], sigma, target, candidate.signs)
        refined[i] = _pattern_search(problem, candidate, shapes, gain)
    return refined


class _Gain:
    """Drop of squared error by a block of columns, given the model's columns."""

    def __init__(
        self,
        problem: Problem,
        blocks: Sequence[dict[int, Array]],
        sigma: Array,
        target: Sequence[Array],
        signs: Array,
    ) -> None:
        self.sigma = sigma
        self.signs = signs
        self.design = [a / s for a, s in zip(problem.design(blocks), sigma, strict=True)]
        y = [t / s for t, s in zip(target, sigma, strict=True)]
        gram = sum(a.T @ a for a in self.design)
        scale = np.sqrt(np.diag(np.asarray(gram)))
        scale[scale == 0] = 1.0
        self.scale = scale
        self.factor = cho_factor(gram / scale[:, None] / scale + RIDGE * np.eye(len(scale)))
        cross = sum(a.T @ t for a, t in zip(self.design, y, strict=True)) / scale
        solution = cho_solve(self.factor, cross) / scale
        self.residual = [t - a @ solution for a, t in zip(self.design, y, strict=True)]

    def __call__(self, rows: dict[int, Array]) -> float:
        z = {j: block / self.sigma[j] for j, block in rows.items()}
        cross = sum(self.design[j].T @ block for j, block in z.items()) / self.scale[:, None]
        own = sum(block.T @ block for block in z.values())
        swept = own - cross.T @ cho_solve(self.factor, cross)
        slope = sum(block.T @ self.residual[j] for j, block in z.items())
        k = len(swept)
        swept = swept + (RIDGE * np.trace(own) + 1e-12) * np.eye(k)
        coefficients = np.linalg.solve(swept, slope)
        if np.any(coefficients * self.signs < 0):
            return -np.inf  # a shape at which the effect would do what physics forbids
        return float(slope @ coefficients)


def _pattern_search(
    problem: Problem, candidate: Candidate, shapes: Sequence[Shape], gain: _Gain
) -> Candidate:
    """Walk along one shape parameter after the other with shrinking steps."""
    term = candidate.term
    unit = problem.signals.unit[term.joints[0]]
    values: dict[str, Any] = dict(term.shape)
    rows = candidate.rows
    best = gain(rows)
    # The first parameter is visited again after the others have moved.
    for shape in [*shapes, *shapes[: len(shapes) - 1]]:
        scale = unit if shape.scales else 1.0
        low, high = shape.low * scale, shape.high * scale
        step = FIRST_STEP if shape.spacing == "log" else FIRST_SHARE * _travel(problem, term)
        for _ in range(ROUNDS):
            improved = False
            for way in (1, -1):
                trial = dict(values)
                here = values[shape.name]
                trial[shape.name] = (
                    here * (1 + step) ** way if shape.spacing == "log" else here + way * step
                )
                if not low <= trial[shape.name] <= high:
                    continue
                trial_rows = problem.term_rows(Term(term.kind, term.joints, trial))
                value = gain(trial_rows)
                if value > best:
                    best, rows, values, improved = value, trial_rows, trial, True
            if not improved:
                step /= SHRINK
    return replace(candidate, term=Term(term.kind, term.joints, values), rows=rows)


def _travel(problem: Problem, term: Term) -> float:
    """Range over which a linear shape parameter moves, in its own unit."""
    if "axis" in term.shape:
        assert problem.robot is not None
        position, _ = problem.robot.forward_kinematics(problem.signals.q)
        return float(np.ptp(position[:, int(term.shape["axis"])]))
    if "ratio" in term.shape or "n" in term.shape:
        return 1.0
    return float(np.ptp(problem.signals.q[:, term.joints[0]]))


def total_width(candidates: Sequence[Candidate]) -> int:
    """Number of coefficients of several candidates."""
    return sum(width(c.rows) for c in candidates)
