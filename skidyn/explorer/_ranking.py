# SPDX-License-Identifier: BSD-3-Clause
"""Held-out error of one joint, row by row, with each candidate effect beside the refitted model.

A candidate changes the estimate of the rigid body, so its effect on the error cannot be found from
its own columns alone. As in the search of a diagnosis, the model's columns are eliminated from the
candidate's (block elimination), fold by fold. Here the residual of one joint is kept as well: its
sums over the whole log or over a selected interval of time are exactly those of the fit with the
candidate.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array
from skidyn.diagnosis import CANDIDATE_RIDGE, Candidate
from skidyn.evidence import Normal, Problem, column_sizes, fold_products, fold_slices

Block = dict[int, Array]


@dataclass(frozen=True)
class HeldOutRows:
    """Held-out ``residual`` of the rows of a joint, N m or N.

    ``then``, of shape (n_rows, n_candidates), is its square with each candidate of ``index`` added:
    those that act on the joint and have physically possible coefficients.
    """

    residual: Array
    index: NDArray[np.int64]
    then: Array

    def drops(self, rows: NDArray[np.bool_] | slice = slice(None)) -> Array:
        """Share of the squared error in some rows that each candidate removes."""
        before = float(np.sum(self.residual[rows] ** 2))
        left: Array = self.then[rows].sum(0) / max(before, 1e-300)
        return 1 - left


@dataclass(frozen=True)
class FoldedModel:
    """A model fitted to all folds, and without each.

    ``blocks`` are columns beside the rigid body, ``design`` all columns of every joint, and
    ``weight`` that of a row of every joint. Coefficients that can be identified from a single
    recording only (``own``) are not held out with it.
    """

    blocks: list[Block]
    design: list[Array]
    weight: Array
    fits: list[Normal]
    whole: Normal
    own: NDArray[np.bool_]


class Ranking:
    """Held-out error of a joint with each candidate; the target is the averaged torque."""

    def __init__(
        self, problem: Problem, candidates: Sequence[Candidate], target: Sequence[Array]
    ) -> None:
        self.problem, self.candidates, self.target = problem, list(candidates), list(target)
        self._folds = [list(fold_slices(fold, problem.n_folds)) for fold in problem.fold]
        widths = [c.width for c in self.candidates]
        ends = np.cumsum([0, *widths])
        self._columns = [np.arange(a, b) for a, b in zip(ends[:-1], ends[1:], strict=True)]
        members = [
            [i for i, c in enumerate(self.candidates) if j in c.rows]
            for j in range(problem.n_joints)
        ]
        self._where = [self._columns_of(np.array(some, dtype=int)) for some in members]
        self._blocks = [
            np.hstack([np.zeros((int(n), 0)), *(self.candidates[i].rows[j] for i in some)])
            for j, (n, some) in enumerate(zip(problem.rows.counts, members, strict=True))
        ]
        everyone = dict(self._by_width(np.arange(len(widths))))
        self._own = {k: self._grams(index) for k, index in everyone.items()}
        self._at = {int(i): n for index in everyone.values() for n, i in enumerate(index)}
        self._rigid: Block = dict(enumerate(problem.rigid_rows))
        self._target = self._folded_all(
            [y[:, None] for y in self.target], self._blocks, self._where
        )
        self._cross: dict[int, tuple[Block, Array]] = {}

    def model(
        self, blocks: Sequence[Block], sigma: Array, own: NDArray[np.bool_] | None = None
    ) -> FoldedModel:
        """Fit a model to all folds and without each fold.

        ``own`` are coefficients that can be identified from a single recording only; none by
        default.
        """
        design = self.problem.design(blocks)
        weight = 1 / np.asarray(sigma) ** 2
        grams, cross = fold_products(self.problem, design, sigma, self.target)
        gram, right = grams.sum(0), cross.sum(0)
        size = column_sizes(gram)
        fits = [Normal(gram - g, right - r, size) for g, r in zip(grams, cross, strict=True)]
        own = np.zeros(len(size), dtype=bool) if own is None else own
        return FoldedModel(list(blocks), design, weight, fits, Normal(gram, right, size), own)

    def residual(self, model: FoldedModel, joint: int) -> Array:
        """Residual of every row of a joint, counted from 0, under the fit without its fold."""
        y, a = self.target[joint], model.design[joint]
        pairs = zip(model.fits, self._folds[joint], strict=True)
        whole = model.whole.solution
        return np.concatenate(
            [y[rows] - a[rows] @ np.where(model.own, whole, fit.solution) for fit, rows in pairs]
        )

    def noise(self, model: FoldedModel) -> Array:
        """Root mean square of the residual rows of every joint under the fit to all folds."""
        pairs = zip(self.target, model.design, strict=True)
        residuals = [y - a @ model.whole.solution for y, a in pairs]
        return np.array([np.sqrt(np.mean(r**2)) + 1e-100 if len(r) else 1.0 for r in residuals])

    def held_out(self, model: FoldedModel, joint: int) -> HeldOutRows:
        """Held-out residual of a joint's rows, now and with every candidate."""
        index = np.array([i for i, c in enumerate(self.candidates) if joint in c.rows], dtype=int)
        columns = self._columns_of(index)
        parts = (self._crossed(b) for b in (self._rigid, *model.blocks))
        cross = np.concatenate([np.tensordot(model.weight, p, 1) for p in parts], axis=1)
        cross = cross[:, :, columns]
        target = np.tensordot(model.weight, self._target[:, :, 0], 1)[:, columns]
        now = self.residual(model, joint)
        then = np.empty((len(now), len(index)))
        for f, (fit, rows) in enumerate(zip(model.fits, self._folds[joint], strict=True)):
            left = cross.sum(0) - cross[f], target.sum(0) - target[f]
            gain, change = self._gain(fit, *left, index, f, model.weight)
            explained = self._explained(joint, rows, gain)
            then[rows] = (now[rows, None] - explained + model.design[joint][rows] @ change) ** 2
        gain, _ = self._gain(model.whole, cross.sum(0), target.sum(0), index, None, model.weight)
        allowed = np.array(
            [self._allowed(i, g) for i, g in zip(index, gain, strict=True)], dtype=bool
        )
        return HeldOutRows(now, index[allowed], then[:, allowed])

    # ------------------------------------------------------------------ products, once
    def _columns_of(self, index: NDArray[np.int64]) -> NDArray[np.int64]:
        none = np.zeros(0, dtype=np.int64)
        return np.concatenate([none, *(self._columns[i] for i in index)])

    def _by_width(self, index: NDArray[np.int64]) -> Iterator[tuple[int, NDArray[np.int64]]]:
        """Positions in ``index`` of candidates with the same number of columns."""
        members: dict[int, list[int]] = defaultdict(list)
        for at, i in enumerate(index):
            members[self.candidates[int(i)].width].append(at)
        for width, places in members.items():
            yield width, np.array(places, dtype=np.int64)

    def _folded_all(
        self, left: Sequence[Array], right: Sequence[Array], where: Sequence[NDArray[np.int64]]
    ) -> Array:
        """Products of every joint and fold, (n_joints, n_folds, columns of left, all columns)."""
        n_columns = sum(len(c) for c in self._columns)
        out = np.zeros((len(left), self.problem.n_folds, left[0].shape[1], n_columns))
        for j, (a, b) in enumerate(zip(left, right, strict=True)):
            for f, rows in enumerate(self._folds[j]):
                out[j, f][:, where[j]] = a[rows].T @ b[rows]
        return out

    def _crossed(self, block: Block) -> Array:
        """Products of a block of the model and all candidates; made once for every block."""
        known = self._cross.get(id(block))
        if known is not None and known[0] is block:
            return known[1]
        n_columns = next(iter(block.values())).shape[1]
        left = [
            block.get(j, np.zeros((int(n), n_columns)))
            for j, n in enumerate(self.problem.rows.counts)
        ]
        found = self._folded_all(left, self._blocks, self._where)
        self._cross[id(block)] = block, found
        return found

    def _grams(self, index: NDArray[np.int64]) -> Array:
        """Gram matrices of candidates of one width, (n_joints, n_folds, n_candidates, k, k)."""
        k = self.candidates[int(index[0])].width
        shape = (self.problem.n_joints, self.problem.n_folds, len(index), k, k)
        grams = np.zeros(shape)
        for n, candidate in enumerate(self.candidates[int(i)] for i in index):
            for j, block in candidate.rows.items():
                for f, rows in enumerate(self._folds[j]):
                    grams[j, f, n] = block[rows].T @ block[rows]
        return grams

    # ------------------------------------------------------------------ one fold
    def _gain(
        self,
        fit: Normal,
        cross: Array,
        target: Array,
        index: NDArray[np.int64],
        fold: int | None,
        weight: Array,
    ) -> tuple[list[Array], Array]:
        """Coefficients of every candidate, and the change of the model's coefficients by it."""
        swept = fit.solve(cross)
        slope = target - cross.T @ fit.solution
        change = np.empty((len(cross), len(index)))
        gains: list[Array] = [np.zeros(0)] * len(index)
        starts = np.cumsum([0, *(self.candidates[i].width for i in index)])
        for k, at in self._by_width(index):
            columns = starts[at][:, None] + np.arange(k)
            own = self._own[k][:, :, [self._at[int(i)] for i in index[at]]]
            total = np.tensordot(weight, own.sum(1) if fold is None else _without(own, fold), 1)
            left, right = cross[:, columns], swept[:, columns]
            block = total - np.einsum("pck,pcl->ckl", left, right)
            ridge = CANDIDATE_RIDGE * np.einsum("ckk->ck", total) + 1e-12
            block += np.eye(k) * ridge[:, None, :]
            gain = np.linalg.solve(block, slope[columns][:, :, None])[:, :, 0]
            change[:, at] = np.einsum("pck,ck->pc", right, gain)
            for n, g in zip(at, gain, strict=True):
                gains[n] = g
        return gains, change

    def _explained(self, joint: int, rows: slice, gain: list[Array]) -> Array:
        """Part of some rows of a joint that each candidate alone explains."""
        block = self._blocks[joint][rows]
        scaled = block * np.concatenate([np.zeros(0), *gain])
        starts = np.cumsum([0, *(len(g) for g in gain)])[:-1]
        if not len(starts):
            return np.zeros((len(block), 0))
        return np.add.reduceat(scaled, starts, axis=1)

    def _allowed(self, candidate: int, gain: Array) -> bool:
        c = self.candidates[candidate]
        return not bool(np.any((gain < c.lowest) | (np.abs(gain) > c.limits)))


def _without(grams: Array, fold: int) -> Array:
    return np.asarray(grams.sum(1) - grams[:, fold])
