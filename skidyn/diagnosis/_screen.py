# SPDX-License-Identifier: BSD-3-Clause
"""Held-out error of every candidate, with the whole model refitted, from fold Gram matrices.

Leaving a fold out needs no second pass over the rows: its Gram matrix is subtracted. Adding a
candidate needs no refit of the model: the model's columns are swept out of the candidate's (block
elimination), so a candidate costs one small solve a fold.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array
from skidyn.diagnosis._candidates import Candidate
from skidyn.evidence import Normal, Problem, column_sizes, fold_slices

#: Diagonal added to a candidate's swept block: what the model already spans brings nothing.
CANDIDATE_RIDGE = 1e-6
#: Share of the largest column's square that a column without any row counts as.
TINY = 1e-9


@dataclass(frozen=True)
class _Group:
    """Candidates that reach the same joints with the same number of columns."""

    index: NDArray[np.int64]
    rows: dict[int, Array]  # (n_rows_j, n_candidates * n_columns)
    width: int
    own: Array  # (n_folds, n_candidates, width, width)
    target: Array  # (n_folds, n_candidates * width)
    signs: Array  # (n_candidates, width)
    limits: Array  # (n_candidates, width)
    ridge: Array  # (n_candidates, width)


class Screen:
    """Cross-validated error drops of candidates.

    Parameters
    ----------
    problem : Problem
        Rows and folds.
    sigma : ndarray of shape (n_joints,)
        Noise of one row of every joint.
    candidates : list of Candidate
        What might be missing.
    target : list of ndarray
        Averaged torque of every joint.
    """

    def __init__(
        self,
        problem: Problem,
        sigma: Array,
        candidates: Sequence[Candidate],
        target: Sequence[Array],
    ) -> None:
        self.problem = problem
        self.sigma = sigma
        self.target = [y / s for y, s in zip(target, sigma, strict=True)]
        self.folds = [list(fold_slices(fold, problem.n_folds)) for fold in problem.fold]
        self.candidates = list(candidates)
        self._groups = self._group()

    def _folded(self, a: Array, b: Array, joint: int) -> Array:
        """Products a.T @ b of every fold, shape (n_folds, columns of a, columns of b)."""
        return np.stack([a[rows].T @ b[rows] for rows in self.folds[joint]])

    def _group(self) -> list[_Group]:
        members: dict[tuple[tuple[int, ...], int], list[int]] = defaultdict(list)
        for i, candidate in enumerate(self.candidates):
            members[tuple(sorted(candidate.rows)), candidate.width].append(i)
        groups = []
        for (joints, k), index in members.items():
            rows = {
                j: np.hstack([self.candidates[i].rows[j] for i in index]) / self.sigma[j]
                for j in joints
            }
            own = np.zeros((self.problem.n_folds, len(index), k, k))
            target = np.zeros((self.problem.n_folds, len(index) * k))
            for j, block in rows.items():
                for f, here in enumerate(self.folds[j]):
                    own[f] += _products(block[None, here], block[None, here], k)[0]
                    target[f] += self.target[j][here] @ block[here]
            signs = np.array([self.candidates[i].signs for i in index])
            limits = np.array([self.candidates[i].limits for i in index])
            soft = np.array([self.candidates[i].term.effect.softness for i in index])
            ridge = soft[:, None] * np.einsum("fckk->ck", own).max(1, keepdims=True)
            groups.append(_Group(np.array(index), rows, k, own, target, signs, limits, ridge))
        return groups

    def model(self, blocks: Sequence[dict[int, Array]]) -> _Model:
        """Prepare the model with some blocks of columns added to the rigid body."""
        design = [
            block / s for block, s in zip(self.problem.design(blocks), self.sigma, strict=True)
        ]
        gram = sum(self._folded(a, a, j) for j, a in enumerate(design))
        cross = sum(
            self._folded(a, y[:, None], j)[:, :, 0]
            for j, (a, y) in enumerate(zip(design, self.target, strict=True))
        )
        square = sum(
            self._folded(y[:, None], y[:, None], j)[:, 0, 0] for j, y in enumerate(self.target)
        )
        return _Model(design, np.asarray(gram), np.asarray(cross), np.asarray(square))

    def held_out(self, model: _Model) -> Array:
        """Squared error of every fold when it is left out, in units of the noise, (n_folds,)."""
        return model.errors

    def step(self, model: _Model, wanted: NDArray[np.bool_] | None = None) -> Array:
        """Held-out error of every fold after each candidate is added, (n_candidates, n_folds).

        Candidates that are not ``wanted``, and those whose coefficients come out with a sign or a
        magnitude that physics forbids, get infinity.
        """
        errors = np.full((len(self.candidates), self.problem.n_folds), np.inf)
        for group in self._groups:
            pick = np.arange(len(group.index))
            if wanted is not None:
                pick = pick[wanted[group.index]]
                if not len(pick):
                    continue
            columns = (pick[:, None] * group.width + np.arange(group.width)).ravel()
            cross = np.asarray(
                sum(
                    self._folded(model.design[j], block[:, columns], j)
                    for j, block in group.rows.items()
                )
            )
            own, target = group.own[:, pick], group.target[:, columns]
            ridge = group.ridge[pick]
            errors[group.index[pick]] = _swept_errors(model, cross, own, target, ridge).T
            signs, limits = group.signs[pick], group.limits[pick]
            if signs.any() or np.isfinite(limits).any():
                a, b, c = (x.sum(0, keepdims=True) for x in (cross, own, target))
                gain = _gain([model.fitted], a, b, c, ridge)[0][0]
                forbidden = (gain * signs < 0) | (np.abs(gain) > limits)
                errors[group.index[pick[forbidden.any(axis=1)]]] = np.inf
        return errors


@dataclass(frozen=True)
class _Model:
    design: list[Array]
    gram: Array  # (n_folds, p, p)
    cross: Array  # (n_folds, p)
    square: Array  # (n_folds,)

    @cached_property
    def trained(self) -> list[Normal]:
        """The model fitted without each fold in turn."""
        return [self._fit(g, c) for g, c in zip(self.gram, self.cross, strict=True)]

    @cached_property
    def fitted(self) -> Normal:
        """The model fitted to all folds."""
        return self._fit(0.0, 0.0)

    @cached_property
    def solutions(self) -> Array:
        """Its coefficients without each fold in turn, shape (n_folds, p)."""
        return np.array([train.solution for train in self.trained])

    @cached_property
    def errors(self) -> Array:
        """Squared error of every fold when it is left out, shape (n_folds,)."""
        b = self.solutions
        bent = np.matmul(self.gram, b[:, :, None])[:, :, 0]
        return np.asarray(self.square + np.sum(b * (bent - 2 * self.cross), axis=1))

    def _fit(self, gram: Array | float, cross: Array | float) -> Normal:
        total = self.gram.sum(0)
        return Normal(total - gram, self.cross.sum(0) - cross, column_sizes(total))


def _products(a: Array, b: Array, k: int) -> Array:
    """Products a.T @ b of the k columns of each candidate, (n_folds, n_candidates, k, k)."""
    if k == 1:
        return np.asarray(np.einsum("fpc,fpc->fc", a, b)[:, :, None, None])
    parted = (x.reshape(*x.shape[:2], x.shape[2] // k, k) for x in (a, b))
    left, right = (x.transpose(0, 2, 1, 3) for x in parted)
    return np.asarray(np.matmul(left.transpose(0, 1, 3, 2), right))


def _gain(
    trained: Sequence[Normal], cross: Array, own: Array, target: Array, ridge: Array
) -> tuple[Array, Array]:
    """Coefficients of every candidate beside fitted models, and how these mimic it.

    Parameters
    ----------
    trained : sequence of Normal
        The model fitted to some rows, and to others.
    cross : ndarray of shape (n_fits, p, n_candidates * width)
        Products of the model's columns and the candidates' on the rows of each fit.
    own : ndarray of shape (n_fits, n_candidates, width, width)
        Gram matrix of each candidate.
    target : ndarray of shape (n_fits, n_candidates * width)
        Products of the candidates' columns and the torque.
    ridge : ndarray of shape (n_candidates, width)
        Added to the diagonal of the Gram matrices.

    Returns
    -------
    gain : ndarray of shape (n_fits, n_candidates, width)
    swept : ndarray of shape (n_fits, p, n_candidates * width)
    """
    k = own.shape[2]
    swept = np.array([train.solve(x) for train, x in zip(trained, cross, strict=True)])
    solutions = np.array([train.solution for train in trained])
    gradient = target - np.matmul(solutions[:, None], cross)[:, 0]
    diagonal = np.einsum("fckk->fck", own)
    size = diagonal.max(axis=2, keepdims=True)
    size = np.where(size > 0, size, 1 / (CANDIDATE_RIDGE * TINY))  # no row at all here
    added = CANDIDATE_RIDGE * (diagonal + TINY * size) + ridge
    block = own - _products(cross, swept, k) + np.eye(k) * added[:, :, None, :]
    return np.linalg.solve(block, gradient.reshape(*diagonal.shape, 1))[:, :, :, 0], swept


def _swept_errors(model: _Model, cross: Array, own: Array, target: Array, ridge: Array) -> Array:
    """Held-out error of every fold for the candidates of a group, (n_folds, n_candidates)."""
    rest = [x.sum(0) - x for x in (cross, own, target)]
    gain, swept = _gain(model.trained, rest[0], rest[1], rest[2], ridge)
    # The same change judged on the fold left out.
    b, k = model.solutions[:, :, None], own.shape[2]
    remainder = model.cross[:, :, None] - np.matmul(model.gram, b)
    slope = target - np.sum(cross * b, axis=1) - np.sum(swept * remainder, axis=1)
    mixed = _products(swept, cross, k)
    bent = _products(swept, np.matmul(model.gram, swept), k)
    curve = own - mixed - mixed.transpose(0, 1, 3, 2) + bent
    linear = np.sum(gain * slope.reshape(gain.shape), axis=2)
    quadratic = np.sum(gain * np.matmul(curve, gain[:, :, :, None])[:, :, :, 0], axis=2)
    return np.asarray(model.errors[:, None] - 2 * linear + quadratic)
