# SPDX-License-Identifier: BSD-3-Clause
"""Held-out error of every candidate, with the whole model fitted again, from Gram matrices.

Leaving a fold out needs no second pass over the rows: its Gram matrix is subtracted. Adding a
candidate needs no new fit of the model: the model's columns are eliminated from the candidate's
(block elimination), so a candidate takes one small solution per fold.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from copy import copy
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import chain
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidyn._cores import each
from skidyn._signals import Array
from skidyn.diagnosis._candidates import Candidate, side_by_side
from skidyn.diagnosis._held_out import told_alone
from skidyn.diagnosis._profile import QUARTERS
from skidyn.evidence import (
    RIDGE,
    Felt,
    Problem,
    column_sizes,
    felt_columns,
    fold_slices,
    kept_pull,
    solve_left_out,
)

#: Diagonal added to a candidate's reduced block, so that columns in the span of the model have no
#: gain.
CANDIDATE_RIDGE = 1e-6
#: Square assigned to a column without rows, as a share of the largest column's.
TINY = 1e-9
#: Approximate number of columns of candidates that are eliminated at a time.
MOST_COLUMNS = 256


@dataclass(frozen=True)
class _Group:
    """Candidates on the same joints with the same number of columns."""

    index: NDArray[np.int64]
    joints: tuple[int, ...]
    width: int
    lowest: Array  # (n_candidates, width)
    limits: Array  # (n_candidates, width)
    soft: Array  # (n_candidates,)


class Screen:
    """Cross-validated error drops of candidates.

    Parameters
    ----------
    problem : Problem
        Rows and folds.
    sigma : ndarray of shape (n_joints,)
        Noise of one row of every joint.
    candidates : list of Candidate
        Effects that may be missing.
    target : list of ndarray
        Averaged torque of every joint.

    Attributes
    ----------
    within : bool
        Whether interleaved parts of every trajectory are left out instead of whole ones.
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
        self.within = False
        self.folds: list[list[Any]]
        self.folds = [list(fold_slices(fold, problem.n_folds)) for fold in problem.fold]
        self.candidates = list(candidates)
        self._groups = self._group()

    def of_parts(self) -> Screen:
        """The same that leaves out interleaved parts of every trajectory instead of whole ones."""
        inside, quarters = copy(self), self.problem.rows.quarter
        inside.within = True
        inside.folds = [[np.flatnonzero(q == k) for k in range(QUARTERS)] for q in quarters]
        return inside

    @property
    def n_folds(self) -> int:
        """Number of parts that are left out."""
        return len(self.folds[0])

    @cached_property
    def widths(self) -> NDArray[np.int64]:
        """Number of coefficients of every candidate, (n_candidates,)."""
        return np.array([c.width for c in self.candidates])

    @cached_property
    def n_rows(self) -> NDArray[np.int64]:
        """Number of rows of the joints of every candidate, (n_candidates,)."""
        sites = [c.joints for c in self.candidates]
        counts = {joints: self.problem.rows.counts[list(joints)].sum() for joints in set(sites)}
        return np.array([counts[joints] for joints in sites])

    @cached_property
    def further_forms(self) -> Array:
        """1 for candidates in a further form of their kind, else 0; (n_candidates,)."""
        return np.array([float(c.is_further_form) for c in self.candidates])

    def _folded(self, a: Array, b: Array, joint: int) -> Array:
        """Products a.T @ b of every fold, shape (n_folds, columns of a, columns of b)."""
        return np.stack([a[rows].T @ b[rows] for rows in self.folds[joint]])

    def _group(self) -> list[_Group]:
        members: dict[tuple[tuple[int, ...], int], list[int]] = defaultdict(list)
        for i, candidate in enumerate(self.candidates):
            members[tuple(sorted(candidate.rows)), candidate.width].append(i)
        groups = []
        for (joints, k), index in members.items():
            own = [self.candidates[i] for i in index]
            lowest, limits = np.array([c.lowest for c in own]), np.array([c.limits for c in own])
            soft = np.array([c.term.effect.softness for c in own])
            groups.append(_Group(np.array(index), joints, k, lowest, limits, soft))
        return groups

    def model(self, blocks: Sequence[dict[int, Array]]) -> Model:
        """Prepare the model with some blocks of columns added to the rigid body."""
        felt, width = felt_columns(self.problem, blocks, self.sigma)
        n_folds = self.n_folds
        gram, cross = np.zeros((n_folds, width, width)), np.zeros((n_folds, width))
        square = np.zeros(n_folds)
        for j, (own, y) in enumerate(zip(felt, self.target, strict=True)):
            gram[:, own.places[:, None], own.places] += self._folded(own.rows, own.rows, j)
            cross[:, own.places] += self._folded(own.rows, y[:, None], j)[:, :, 0]
            square += self._folded(y[:, None], y[:, None], j)[:, 0, 0]
        return Model(felt, gram, cross, square, tuple(map(_width, blocks)))

    def beside(self, model: Model, rows: dict[int, Array]) -> Model:
        """The model with further columns.

        Parameters
        ----------
        model : Model
            The model without them.
        rows : dict of int to ndarray of shape (n_rows_j, k)
            Averaged columns, per joint they reach.
        """
        felt, start = list(model.felt), model.cross.shape[1]
        k = _width(rows)
        gram = np.pad(model.gram, ((0, 0), (0, k), (0, k)))
        cross = np.pad(model.cross, ((0, 0), (0, k)))
        for j, block in rows.items():
            scaled = block / self.sigma[j]
            both = self._folded(felt[j].rows, scaled, j)
            gram[:, felt[j].places, start:] += both
            gram[:, start:, felt[j].places] += both.transpose(0, 2, 1)
            gram[:, start:, start:] += self._folded(scaled, scaled, j)
            cross[:, start:] += self._folded(scaled, self.target[j][:, None], j)[:, :, 0]
            felt[j] = felt[j].with_columns(start, scaled)
        return Model(felt, gram, cross, model.square, (*model.widths, k))

    def removed(self, model: Model, wanted: NDArray[np.bool_]) -> Array:
        """Squared error that each candidate removes in a fit to all folds, (n_candidates,).

        It takes a small part of the time of :meth:`step`, and no held-out error falls by more. It
        is minus infinity for candidates that are not ``wanted``, and for those with physically
        impossible coefficients.
        """
        removed = np.full(len(self.candidates), -np.inf)
        for own in each(partial(self._removed, model), self._in_parts(wanted), short=True):
            for index, drops in own:
                removed[index] = drops
        return removed

    def step(self, model: Model, wanted: NDArray[np.bool_]) -> Array:
        """Held-out error of every fold after each candidate is added, (n_candidates, n_folds).

        It is infinite for candidates that are not ``wanted``.
        """
        errors = np.full((len(self.candidates), self.n_folds), np.inf)
        found = each(partial(self._errors, model, model.bends), self._in_parts(wanted), short=True)
        for index, own in chain.from_iterable(found):
            errors[index] = own
        return errors

    def _removed(self, model: Model, some: list[_Wanted]) -> list[tuple[NDArray[np.int64], Array]]:
        """Some candidates of each group, and the squared error that they remove."""
        found = []
        for group, pick in some:
            k, (first, *others) = group.width, group.joints
            own, target = np.zeros((len(pick), k, k)), np.zeros(len(pick) * k)
            # the columns of the model that one joint feels are few of all
            places = model.felt[first].places
            if others:
                places = np.arange(model.cross.shape[1])
            cross = np.zeros((len(places), len(pick) * k))
            for j in group.joints:
                columns = self._columns(group, pick, j)
                apart = columns.reshape(len(pick), k, -1)
                own += apart @ apart.transpose(0, 2, 1)
                target += columns @ self.target[j]
                felt = model.felt[j]
                cross[felt.places if others else slice(None)] += felt.rows.T @ columns.T
            mimic = model.inverse[np.ix_(places, places)] @ cross
            along = model.solution[places] @ cross
            swept = _Swept(cross[None], cross[None], mimic[None], along[None])
            ridge = np.einsum("ckk->ck", own).max(1, keepdims=True) * group.soft[pick, None]
            gain, slope = swept.gain(own[None], target[None], ridge)
            lowest, limits = group.lowest[pick], group.limits[pick]
            forbidden = (gain[0] < lowest) | (np.abs(gain[0]) > limits)
            drops = np.sum(gain[0] * slope[0], axis=1)
            found.append((group.index[pick], np.where(forbidden.any(axis=1), -np.inf, drops)))
        return found

    def _errors(
        self, model: Model, bends: Array, some: list[_Wanted]
    ) -> list[tuple[NDArray[np.int64], Array]]:
        """Some candidates of each group, and their held-out errors, (n_candidates, n_folds)."""
        parts = [self._products_of(model, group, pick) for group, pick in some]
        ends = np.cumsum([part.cross.shape[2] for part in parts])
        swept = _Swept.of(model, np.concatenate([part.cross for part in parts], axis=2))
        bent = np.matmul(bends, swept.rest)
        found = []
        for (group, pick), part, end in zip(some, parts, ends.tolist(), strict=True):
            own, target = part.own, part.target
            place = slice(end - part.cross.shape[2], end)
            ridge = np.einsum("fckk->ck", own).max(1, keepdims=True) * group.soft[pick, None]
            ridge = np.broadcast_to(ridge, (len(pick), group.width))
            errors = swept.part(place).errors(model, own, target, ridge, bent[:, :, place]).T
            found.append((group.index[pick], errors))
        return found

    def _columns(self, group: _Group, pick: NDArray[np.int64], joint: int) -> Array:
        """Columns of some candidates in units of the noise, (n_columns, n_rows)."""
        columns = side_by_side([self.candidates[i].rows[joint] for i in group.index[pick]])
        columns /= self.sigma[joint]
        return columns

    def _products_of(self, model: Model, group: _Group, pick: NDArray[np.int64]) -> _Columns:
        """Products of some candidates' columns, which are stacked only temporarily."""
        k, n_folds = group.width, self.n_folds
        own = np.zeros((n_folds, len(pick), k, k))
        target = np.zeros((n_folds, len(pick) * k))
        cross = np.zeros((*model.cross.shape, len(pick) * k))
        for j in group.joints:
            columns = self._columns(group, pick, j)
            felt = model.felt[j]
            for f, here in enumerate(self.folds[j]):
                part = columns[:, here]
                apart = part.reshape(len(pick), k, -1)
                own[f] += apart @ apart.transpose(0, 2, 1)
                target[f] += part @ self.target[j][here]
                cross[f, felt.places] += felt.rows[here].T @ part.T
        return _Columns(cross, own, target)

    def _in_parts(self, wanted: NDArray[np.bool_]) -> Iterator[list[_Wanted]]:
        """Wanted candidates by group, some hundreds of columns at a time."""
        some: list[_Wanted] = []
        count = 0
        for group in self._groups:
            pick = np.flatnonzero(wanted[group.index])
            most = max(1, MOST_COLUMNS // group.width)
            for start in range(0, len(pick), most):
                some.append((group, pick[start : start + most]))
                count += len(some[-1][1]) * group.width
                if count >= MOST_COLUMNS:
                    yield some
                    some, count = [], 0
        if some:
            yield some


def _width(block: dict[int, Array]) -> int:
    return int(next(iter(block.values())).shape[1])


#: A group, and indices of its candidates.
_Wanted = tuple[_Group, NDArray[np.int64]]


class _Columns(NamedTuple):
    """Products of candidates' columns by fold: with the model's, own ones, with the torque.

    Shapes are (n_folds, p, n_candidates * k), (n_folds, n_candidates, k, k) and
    (n_folds, n_candidates * k).
    """

    cross: Array
    own: Array
    target: Array


@dataclass(frozen=True)
class Model:
    """Products of a model's columns by fold, made by :class:`Screen`.

    Attributes
    ----------
    felt : list of Felt
        The columns that act on each joint.
    gram : ndarray of shape (n_folds, p, p)
    cross : ndarray of shape (n_folds, p)
        With the torque.
    square : ndarray of shape (n_folds,)
        Of the torque.
    widths : tuple of int
        Numbers of columns of the effects, the last ones of the model.
    """

    felt: list[Felt]
    gram: Array
    cross: Array
    square: Array
    widths: tuple[int, ...]

    @cached_property
    def solutions(self) -> Array:
        """Its coefficients without each fold in turn, shape (n_folds, p)."""
        return self._solved[1]

    @cached_property
    def solution(self) -> Array:
        """Its coefficients, shape (p,)."""
        return self._solved[0]

    @cached_property
    def _solved(self) -> tuple[Array, Array]:
        return solve_left_out(self.gram, self.cross, kept=self._kept)

    @cached_property
    def _kept(self) -> NDArray[np.bool_]:
        return told_alone(self.gram, self.widths)

    @cached_property
    def inverses(self) -> Array:
        """Of the normal equations without each fold in turn, shape (n_folds, p, p)."""
        pull = kept_pull(self.gram, self._kept)[:, :, None] * np.eye(len(self.gram[0]))
        return self._inverse(self.gram.sum(0) - self.gram + pull)

    @cached_property
    def inverse(self) -> Array:
        """Of the normal equations, shape (p, p)."""
        return self._inverse(self.gram.sum(0))

    @cached_property
    def bends(self) -> Array:
        """Products in the held-out fold of the solution without it, (n_folds, p, p)."""
        return np.asarray(np.matmul(self.inverses, np.matmul(self.gram, self.inverses)))

    @cached_property
    def errors(self) -> Array:
        """Held-out squared error of every fold, shape (n_folds,)."""
        b = self.solutions
        bent = np.matmul(self.gram, b[:, :, None])[:, :, 0]
        return np.asarray(self.square + np.sum(b * (bent - 2 * self.cross), axis=1))

    def _inverse(self, gram: Array) -> Array:
        scale = column_sizes(self.gram.sum(0))
        normal = gram / scale[:, None] / scale + RIDGE * np.eye(len(scale))
        return np.asarray(np.linalg.inv(normal) / scale[:, None] / scale)


def _products(a: Array, b: Array, k: int) -> Array:
    """Products a.T @ b of the k columns of each candidate, (n_folds, n_candidates, k, k)."""
    if k == 1:
        return np.asarray(np.einsum("fpc,fpc->fc", a, b)[:, :, None, None])
    parted = (x.reshape(*x.shape[:2], x.shape[2] // k, k) for x in (a, b))
    left, right = (x.transpose(0, 2, 1, 3) for x in parted)
    return np.asarray(np.matmul(left.transpose(0, 1, 3, 2), right))


@dataclass(frozen=True)
class _Swept:
    """Candidates' columns together with a model fitted to some rows.

    Attributes
    ----------
    cross : ndarray of shape (n_folds, p, m)
        Products of the model's columns and the candidates' in the rows of every fold.
    rest : ndarray of shape (n_fits, p, m)
        The same in the rows of each fit.
    mimic : ndarray of shape (n_fits, p, m)
        The model's coefficients that approximate the columns best there.
    along : ndarray of shape (n_fits, m)
        Products of the columns and the torque that the model explains there.
    """

    cross: Array
    rest: Array
    mimic: Array
    along: Array

    @classmethod
    def of(cls, model: Model, cross: Array) -> _Swept:
        """For the fits without each fold in turn."""
        rest = cross.sum(0) - cross
        along = np.matmul(model.solutions[:, None], rest)[:, 0]
        return cls(cross, rest, np.matmul(model.inverses, rest), along)

    def part(self, place: slice) -> _Swept:
        """Some of the columns."""
        return _Swept(
            self.cross[:, :, place],
            self.rest[:, :, place],
            self.mimic[:, :, place],
            self.along[:, place],
        )

    def gain(self, own: Array, target: Array, ridge: Array) -> tuple[Array, Array]:
        """Coefficients of every candidate added to the model, and slopes of the error before.

        Both have the shape (n_fits, n_candidates, k).

        Parameters
        ----------
        own : ndarray of shape (n_fits, n_candidates, k, k)
            Gram matrix of each candidate.
        target : ndarray of shape (n_fits, n_candidates * k)
            Products of the candidates' columns and the torque.
        ridge : ndarray of shape (n_candidates, k)
            Added to the diagonal of the Gram matrices.
        """
        k = own.shape[2]
        diagonal = np.einsum("fckk->fck", own)
        size = diagonal.max(axis=2, keepdims=True)
        size = np.where(size > 0, size, 1 / (CANDIDATE_RIDGE * TINY))  # no row at all here
        added = CANDIDATE_RIDGE * (diagonal + TINY * size) + ridge
        block = own - _products(self.rest, self.mimic, k) + np.eye(k) * added[:, :, None, :]
        slope = (target - self.along).reshape(diagonal.shape)
        return np.linalg.solve(block, slope[..., None])[..., 0], slope

    def errors(self, model: Model, own: Array, target: Array, ridge: Array, bent: Array) -> Array:
        """Held-out error of every fold for the candidates of a group, (n_folds, n_candidates).

        Parameters
        ----------
        model : Model
            The model.
        own, target, ridge : ndarray
            As in :meth:`gain`, by fold.
        bent : ndarray of shape (n_folds, p, m)
            Product of :attr:`Model.bends` and :attr:`rest`.
        """
        k, b = own.shape[2], model.solutions
        gain, _ = self.gain(own.sum(0) - own, target.sum(0) - target, ridge)
        # The same change evaluated on the held-out fold.
        left = model.cross - np.matmul(model.gram, b[:, :, None])[:, :, 0]
        slope = target - np.matmul(b[:, None], self.cross)[:, 0]
        slope -= np.matmul(left[:, None], self.mimic)[:, 0]
        mixed = _products(self.mimic, self.cross, k)
        curve = own - mixed - mixed.transpose(0, 1, 3, 2) + _products(self.rest, bent, k)
        linear = np.sum(gain * slope.reshape(gain.shape), axis=2)
        quadratic = np.sum(gain * np.matmul(curve, gain[:, :, :, None])[:, :, :, 0], axis=2)
        return np.asarray(model.errors[:, None] - 2 * linear + quadratic)
