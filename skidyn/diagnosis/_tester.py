# SPDX-License-Identifier: BSD-3-Clause
"""The test of a candidate in addition to a model: with which variance, and with which p-value."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cache
from itertools import combinations, pairwise

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array
from skidyn.diagnosis._blocks import block_length, time_blocks, variance_inflation
from skidyn.diagnosis._chance import degrees_of_freedom, hotelling, tail, unbiased_scores
from skidyn.diagnosis._rule import (
    ENOUGH_BLOCKS,
    FEWEST_BLOCKS,
    IN_FEW_BLOCKS,
    LIKE_ELSEWHERE,
    MASKED,
    NEW_SHARE,
    ROUNDING,
    ROUNDS,
    SURE,
)
from skidyn.evidence import RIDGE, Felt, Problem, column_sizes, felt_columns, gram_of, products_with


@dataclass(frozen=True)
class Test:
    """Significance of a candidate in addition to a model.

    Attributes
    ----------
    chance : float
        The larger one of the two p-values.
    coefficients : ndarray of shape (n_coefficients,)
        Coefficients of the candidate, with the model fitted again.
    drop : float
        Squared error removed, in units of the noise.
    """

    __test__ = False

    chance: float
    coefficients: Array
    drop: float


def _any(_: float) -> bool:
    """Every p-value is wanted."""
    return True


class Tester:
    """Tests of candidates in addition to one model.

    Parameters
    ----------
    problem : Problem
        Rows.
    blocks : sequence of dict
        Columns of the model beside the rigid body.
    sigma : ndarray of shape (n_joints,)
        Noise of one row, by which joints are weighted.
    target : sequence of ndarray
        Averaged torque of every joint.

    Attributes
    ----------
    felt : list of Felt
        The model's columns by joint, in units of the noise.
    inverse : ndarray of shape (n_columns, n_columns)
        Inverse of their products.
    residual : list of ndarray of shape (n_rows_j,)
        By joint, in units of the noise.
    """

    __test__ = False

    def __init__(
        self,
        problem: Problem,
        blocks: Sequence[dict[int, Array]],
        sigma: Array,
        target: Sequence[Array],
    ) -> None:
        self.problem, self.sigma = problem, sigma
        felt, width = felt_columns(problem, blocks, sigma)
        y = [t / s for t, s in zip(target, sigma, strict=True)]
        self._duration = float(sum(problem.rows.spans[1]))
        self._fit(felt, gram_of(felt, width), products_with(felt, dict(enumerate(y)), width), y)

    def _fit(self, felt: list[Felt], gram: Array, right: Array, target: list[Array]) -> None:
        scale = column_sizes(gram)
        normal = gram / scale[:, None] / scale + RIDGE * np.eye(len(scale))
        self.felt, self._gram, self._right, self._target = felt, gram, right, target
        self.inverse = np.linalg.inv(normal) / scale[:, None] / scale
        solution = self.inverse @ right
        self.residual = [t - f.rows @ solution[f.places] for f, t in zip(felt, target, strict=True)]
        self._left = right - gram @ solution  # rounding, and the ridge
        self._square = sum(float(r @ r) for r in self.residual)
        self._free = max(1, int(self.problem.rows.counts.sum()) - len(scale))

    def beside(self, blocks: Sequence[dict[int, Array]]) -> Tester:
        """Tests with the same model and further columns.

        Parameters
        ----------
        blocks : sequence of dict of int to ndarray of shape (n_rows_j, k)
            Averaged columns, per joint they reach.
        """
        wider = copy(self)
        felt, gram, right = list(self.felt), self._gram, self._right
        for block in blocks:
            scaled = self._scaled(block)
            cross = products_with(felt, scaled, len(gram))
            own = np.asarray(sum(rows.T @ rows for rows in scaled.values()))
            along = sum(rows.T @ self._target[j] for j, rows in scaled.items())
            for j, rows in scaled.items():
                felt[j] = felt[j].with_columns(len(gram), rows)
            gram = np.block([[gram, cross], [cross.T, own]])
            right = np.append(right, along)
        wider._fit(felt, gram, right, self._target)
        return wider

    def test(
        self,
        rows: dict[int, Array],
        zeros: NDArray[np.bool_] | None = None,
        significant: Callable[[float], bool] = _any,
    ) -> Test:
        """Test the coefficients of some columns together.

        Parameters
        ----------
        rows : dict of int to ndarray of shape (n_rows_j, n_coefficients)
            Averaged columns, per joint they reach.
        zeros : ndarray of shape (n_coefficients,) of bool, optional
            Coefficients that only define the zero of the effect. The others must be significant in
            addition to them, too: the constant of a spring is no evidence for a spring.
        significant : callable, optional
            Function that returns whether a p-value is small enough. Larger ones are not exact.
        """
        test = self._tested(rows, zeros, significant)
        error = sum(float(self.residual[j] @ self.residual[j]) for j in rows)
        if test.drop > MASKED * error:
            if not significant(test.chance):
                test = self._tested(rows, zeros)
            if SURE < test.chance < 1.0:
                again = self._unmasked(rows)._tested(rows, zeros)
                test = replace(test, chance=min(test.chance, again.chance))
        return test

    def _unmasked(self, rows: dict[int, Array]) -> Tester:
        """Tests with the same model, and joints weighted by the noise that some columns leave."""
        tester = self
        for _ in range(ROUNDS):
            left = tester.beside([rows]).residual
            shares = np.ones(len(left))
            for j in rows:
                shares[j] = np.sqrt(np.mean(left[j] ** 2)) + 1e-100 if len(left[j]) else 1.0
            tester = tester._weighted(shares)
        return tester

    def _weighted(self, shares: Array) -> Tester:
        """Tests with the same model and a multiple of the noise of every joint."""
        other = copy(self)
        other.sigma = self.sigma * shares
        felt = [Felt(f.places, f.rows / x) for f, x in zip(self.felt, shares, strict=True)]
        target = [y / x for y, x in zip(self._target, shares, strict=True)]
        width = len(self._gram)
        other._fit(
            felt, gram_of(felt, width), products_with(felt, dict(enumerate(target)), width), target
        )
        return other

    def _tested(
        self,
        rows: dict[int, Array],
        zeros: NDArray[np.bool_] | None,
        significant: Callable[[float], bool] = _any,
    ) -> Test:
        """As :meth:`test`, with the present noise."""
        scaled = self._scaled(rows)
        mimic = self._mimic(scaled)
        least = self._least(scaled, *mimic)
        if not significant(least.chance):
            return least
        new = self._swept(scaled, mimic[1])
        test = self._test(rows, new, self.residual, significant)
        if zeros is None or not zeros.any() or test.chance == 1.0 or not significant(test.chance):
            return test
        own = {j: block[:, ~zeros] for j, block in rows.items()}
        aside = np.concatenate([z[:, zeros] for z in new])
        both = np.column_stack([np.concatenate(self.residual), *np.concatenate(new)[:, ~zeros].T])
        both -= aside @ np.linalg.lstsq(aside, both, rcond=NEW_SHARE)[0]
        parts = self.problem.rows.split(both)
        columns, left = [part[:, 1:] for part in parts], [part[:, 0] for part in parts]
        alone = self._test(own, columns, left, significant)
        return replace(test, chance=max(test.chance, alone.chance))

    def estimate(self, rows: dict[int, Array]) -> tuple[Array, float]:
        """Coefficients of some columns, and the squared error that they remove.

        Parameters
        ----------
        rows : dict of int to ndarray of shape (n_rows_j, n_coefficients)
            Averaged columns, per joint they reach.
        """
        scaled = self._scaled(rows)
        least = self._least(scaled, *self._mimic(scaled))
        return least.coefficients, least.drop

    def least_difference(self, count: int, width: int) -> tuple[float, int, int]:
        """The two of the last effects of the model whose coefficients differ least.

        Parameters
        ----------
        count, width : int
            Number of these effects, and of columns of each.

        Returns
        -------
        difference : float
            Squared error that separate coefficients remove, in units of the remaining noise.
        first, second : int
            Places of the two among these effects.
        """
        own = slice(len(self.inverse) - count * width, None)
        value = (self.inverse @ self._right)[own].reshape(count, width)
        spread = self.inverse[own, own].reshape(count, width, count, width)
        mean = sum(float(r @ r) for r in self.residual) / self._free
        found = []
        for i, j in combinations(range(count), 2):
            d = value[i] - value[j]
            variance = spread[i, :, i] + spread[j, :, j] - spread[i, :, j] - spread[j, :, i]
            found.append((float(d @ np.linalg.lstsq(variance, d, rcond=None)[0]) / mean, i, j))
        return min(found)

    def test_each(
        self, rows: dict[int, Array], significant: Callable[[float], bool]
    ) -> tuple[Test, Iterator[Test]]:
        """Test some columns together and, if requested, each column alone.

        Parameters
        ----------
        rows : dict of int to ndarray of shape (n_rows_j, n_coefficients)
            Averaged columns, per joint they reach.
        significant : callable
            Function that returns whether a p-value is small enough. Larger ones are not exact, and
            columns that are not significant together are not tested alone.
        """
        scaled = self._scaled(rows)
        mimic = self._mimic(scaled)
        least = self._least(scaled, *mimic)
        if not significant(least.chance):
            return least, iter(())
        new = self._swept(scaled, mimic[1])
        alone = (
            self._test(
                {j: block[:, [c]] for j, block in rows.items()},
                [z[:, [c]] for z in new],
                self.residual,
                significant,
            )
            for c in range(new[0].shape[1])
        )
        return self._test(rows, new, self.residual, significant), alone

    def _test(
        self,
        rows: dict[int, Array],
        new: list[Array],
        residual: Sequence[Array],
        significant: Callable[[float], bool] = _any,
    ) -> Test:
        """Test columns from which the part that the model can represent has been removed."""
        k = next(iter(rows.values())).shape[1]
        own = np.asarray(sum(np.sum((b / self.sigma[j]) ** 2, axis=0) for j, b in rows.items()))
        gram = np.asarray(sum(z.T @ z for z in new))
        # Columns that the model can represent have no information.
        told = gram.diagonal() > np.maximum(NEW_SHARE * own, 0.0)
        if not told.any():
            return Test(1.0, np.zeros(k), 0.0)
        if k > 1:
            new, gram, k = [z[:, told] for z in new], gram[np.ix_(told, told)], int(told.sum())
        size = np.sqrt(gram.diagonal())
        new, gram = [z / size for z in new], gram / size[:, None] / size
        score = np.asarray(sum(z.T @ e for z, e in zip(new, residual, strict=True)))
        b = np.linalg.solve(gram + RIDGE * np.eye(k), score)
        left = [e - z @ b for e, z in zip(residual, new, strict=True)]
        drop = float(score @ b)
        inflation = cache(lambda j: float(variance_inflation(self.problem, [left[j]], [j])[0]))
        # The joint with the largest weight of the column, and the slowest possible column.
        factor = inflation(int(np.argmax([float(np.sum(z**2)) for z in new])))
        mean = max(sum(float(r @ r) for r in left) / self._free, 1e-300)
        chance = tail(drop / k / factor / mean, k, max(2.0, self._free / factor))
        if significant(chance):  # blocks can only raise it
            largest = max(map(inflation, rows))
            by_blocks = self._by_blocks(new, left, score, factor * mean, largest)
            chance = max(chance, by_blocks)
        coefficients = np.zeros(len(told))
        coefficients[told] = b / size
        return Test(chance, coefficients, drop)

    def _scaled(self, rows: dict[int, Array]) -> dict[int, Array]:
        """Columns in units of the noise."""
        return {j: b / self.sigma[j] for j, b in rows.items()}

    def _mimic(self, scaled: dict[int, Array]) -> tuple[Array, Array]:
        """Products with the model's columns, and its coefficients that approximate some columns."""
        cross = products_with(self.felt, scaled, len(self.inverse))
        return cross, self.inverse @ cross

    def _swept(self, scaled: dict[int, Array], mimic: Array) -> list[Array]:
        """Columns minus the part that the model can represent, on the rows of every joint."""
        return [scaled.get(j, 0.0) - f.rows @ mimic[f.places] for j, f in enumerate(self.felt)]

    def _least(self, scaled: dict[int, Array], cross: Array, mimic: Array) -> Test:
        """The smallest p-value that some columns can have, from products alone.

        That of a white residual: its correlation can only raise the p-value.
        """
        own = np.asarray(sum(b.T @ b for b in scaled.values()))
        score = np.asarray(sum(b.T @ self.residual[j] for j, b in scaled.items()))
        both = cross.T @ mimic
        gram = own - both - both.T + mimic.T @ (self._gram @ mimic)
        score = score - mimic.T @ self._left
        told = gram.diagonal() > np.maximum(NEW_SHARE * own.diagonal(), 0.0)
        coefficients, k = np.zeros(len(told)), int(told.sum())
        if not k:
            return Test(1.0, coefficients, 0.0)
        if k < len(told):
            gram, score = gram[np.ix_(told, told)], score[told]
        size = np.sqrt(gram.diagonal())
        gram, score = gram / size[:, None] / size, score / size
        b = np.linalg.solve(gram + RIDGE * np.eye(k), score)
        coefficients[told] = b / size
        drop = float(score @ b)
        most = drop * (1 + ROUNDING)
        mean = max((self._square - most) / self._free, 1e-300)
        return Test(tail(most / k / mean, k, self._free), coefficients, drop)

    def _by_blocks(
        self,
        new: list[Array],
        left: list[Array],
        score: Array,
        stationary: float,
        inflation: float,
    ) -> float:
        """P-value of the coefficients for independent scores of blocks.

        Given the variance of the score of an orthonormal column for a stationary residual, and the
        largest inflation of a variance by correlation.
        """
        longest = self._duration / (2 * len(score) + ENOUGH_BLOCKS)
        length = min(block_length(self.problem, inflation), longest)
        block, count = time_blocks(self.problem, length)
        if count < len(score) + FEWEST_BLOCKS:
            return 1.0
        index = np.concatenate(block)
        order = np.argsort(index, kind="stable")
        edges = np.searchsorted(index[order], np.arange(count + 1)).tolist()
        columns, residual = np.concatenate(new)[order], np.concatenate(left)[order]
        parts = [slice(*pair) for pair in pairwise(edges)]
        sums = np.array([columns[rows].T @ residual[rows] for rows in parts])
        grams = np.array([columns[rows].T @ columns[rows] for rows in parts])
        score, sums, share = unbiased_scores(score, sums, grams)
        k, free = len(score), degrees_of_freedom(share)
        own = sums.T @ sums
        many = hotelling(score, own, free)
        # The moderated variance is mostly a known matrix times a size. The law is then F, without
        # the degrees of freedom that Hotelling's takes for the estimated covariances.
        both = free * own + LIKE_ELSEWHERE * stationary * np.eye(k)
        free += LIKE_ELSEWHERE
        few = tail(float(score @ np.linalg.solve(both, score)) * free / k, k, free)
        return min(1.0, many / (1.0 - IN_FEW_BLOCKS), few / IN_FEW_BLOCKS)
