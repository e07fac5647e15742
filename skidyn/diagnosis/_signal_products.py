# SPDX-License-Identifier: BSD-3-Clause
"""Products of two and of three simple functions of signals that predict a residual."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import ttest_1samp

from skidyn._signals import Array
from skidyn.diagnosis._pursuit import Products, pursue
from skidyn.effects import Factor

#: Most signals of a set.
MOST_SIGNALS = 3
#: Least share of the squared residual that must be predictable, and largest p-value.
LEAST_SHARE, CHANCE = 0.03, 0.05
#: A further product must remove this share of the squared residual.
WORTH = 0.05
#: A product that varies by a smaller share of its squares counts as constant.
CONSTANT = 1e-10
#: Rows of the search for products of three functions, and ratio of the mean square of successive
#: differences to the variance (2 for white noise; von Neumann 1941, Ann. Math. Stat. 12(4)) above
#: which a residual is left as noise by it.
ROWS_OF_TRIPLES, NOISY = 1000, 1.8

#: Name of the load of a joint among the functions of a product.
LOAD = "load"
#: Functions that are multiplied, and the number of products of which theirs was the best.
Product = tuple[tuple[Factor, ...], int]


def predictable(before: Array, after: Array) -> bool:
    """Whether a learner reduces the squared errors of held-out folds significantly.

    The gain of a fold is relative to its own error and that of an average fold, so that neither a
    single fold with large errors nor one without predictable error decides.

    Parameters
    ----------
    before, after : ndarray of shape (n_folds,)
        Squared error of every fold without and with the learner.
    """
    gain = (before - after) / np.maximum(np.maximum(before, after) + before.mean(), 1e-300)
    enough = bool(after.sum() < (1 - LEAST_SHARE) * before.sum())
    return enough and float(ttest_1samp(gain, 0.0, alternative="greater").pvalue) < CHANCE


def by_fold(values: Array, fold: NDArray[np.int64]) -> Array:
    """Sums of values, (n_rows,), over the rows of every fold, (n_folds,)."""
    return np.bincount(fold, values).astype(float)


def products_of_two(
    signals: dict[str, Array], y: Array, fold: NDArray[np.int64]
) -> tuple[list[tuple[str, ...]], list[Product]]:
    """The signals of the best products of two simple functions, and the best product itself.

    Parameters
    ----------
    signals : dict of str to ndarray of shape (n_rows,)
        By name.
    y : ndarray of shape (n_rows,)
        Residual, N m or N.
    fold : ndarray of shape (n_rows,)
        Fold of every row, from 0.

    Returns
    -------
    sets : list of tuple of str
        Signals of the best product, and of all chosen ones; empty if they predict nothing.
    products : list of Product
        The best one, or none.
    """
    pairs = _Pairs.of(signals)
    of = pairs.signal[np.array([pairs.first, pairs.second])]

    def admissible(chosen: Sequence[int]) -> NDArray[np.bool_]:
        used = np.unique(of[:, chosen][of[:, chosen] >= 0])
        new = (of >= 0) & ~np.isin(of, used)
        more = new.sum(0) - (new[0] & (of[0] == of[1]))
        return np.asarray(len(used) + more <= MOST_SIGNALS)

    worth = WORTH * float(y @ y)
    products = pairs.products(y, fold)
    chosen, _ = pursue(products, worth=worth, longest=of.shape[1], admissible=admissible)
    if not chosen or not _predicted_by([pairs.column(k) for k in chosen], y, fold):
        return [], []
    names = list(signals)
    sets = [{names[i] for i in of[:, k] if i >= 0} for k in chosen]
    best = pairs.factors_of(chosen[0]), of.shape[1]
    return [tuple(sorted(sets[0])), tuple(sorted(set().union(*sets)))], [best]


def product_of_three(
    signals: dict[str, Array], y: Array, fold: NDArray[np.int64], pairs: Sequence[Product]
) -> Product | None:
    """The best product of functions of three signals, if it predicts more than those of two.

    Parameters
    ----------
    signals : dict of str to ndarray of shape (n_rows,)
        By name.
    y : ndarray of shape (n_rows,)
        Residual, N m or N.
    fold : ndarray of shape (n_rows,)
        Fold of every row, from 0.
    pairs : sequence of Product
        Products of two functions that predict it.
    """
    step = max(1, -(-len(y) // ROWS_OF_TRIPLES))
    y, fold = y[::step] - y[::step].mean(), fold[::step]
    if len(y) < 2 or not np.mean(np.diff(y) ** 2) < NOISY * np.mean(y**2):
        return None
    signals = {name: x[::step] for name, x in signals.items()}
    least = WORTH * float(y @ y)
    for pair, _ in pairs:
        if all(factor.signal in signals for factor in pair):
            column = _without_mean([factor.of(signals[factor.signal]) for factor in pair])
            least += float(column @ y) ** 2 / max(float(column @ column), 1e-300)
    factors = [
        factor
        for name, x in signals.items()
        for factor in simple_functions(name, x)
        if factor.function in ("value", "side", "size")
    ]
    values = values_of(factors, signals)
    own = np.unique([factor.signal for factor in factors], return_inverse=True)[1]
    best, gain, among = _best_triple(values, own, y)
    if gain <= least or not _predicted_by([_without_mean(values[:, best].T)], y, fold):
        return None
    return tuple(factors[k] for k in best), among


def product_with_load(
    signals: dict[str, Array], load: Array, y: Array, fold: NDArray[np.int64]
) -> Product | None:
    """The best product of a function of a signal with the load of the joint, or its magnitude.

    Parameters
    ----------
    signals : dict of str to ndarray of shape (n_rows,)
        By name.
    load : ndarray of shape (n_rows,)
        Load, N m or N.
    y : ndarray of shape (n_rows,)
        Residual, N m or N.
    fold : ndarray of shape (n_rows,)
        Fold of every row, from 0.
    """
    factors = [f for name, x in signals.items() for f in simple_functions(name, x)]
    loads = [Factor(LOAD, "value"), Factor(LOAD, "size")]
    values = values_of(factors, signals)
    columns = np.hstack([f.of(load)[:, None] * values for f in loads])
    columns -= columns.mean(axis=0)
    size = np.sum(columns**2, axis=0)
    tells = size > CONSTANT * len(y) * float(load @ load / len(y))
    gain = np.where(tells, (y @ columns) ** 2 / np.where(tells, size, 1.0), 0.0)
    best = int(np.argmax(gain))
    if gain[best] <= WORTH * float(y @ y) or not _predicted_by([columns[:, best]], y, fold):
        return None
    kind, of = divmod(best, len(factors))
    return (loads[kind], factors[of]), columns.shape[1]


def _best_triple(values: Array, own: NDArray[np.int64], y: Array) -> tuple[list[int], float, int]:
    """The three functions whose product removes most, what it removes, and the number tried.

    Parameters
    ----------
    values : ndarray of shape (n_rows, n_functions)
    own : ndarray of shape (n_functions,)
        Number of the signal behind each; those of a product differ.
    y : ndarray of shape (n_rows,)
    """
    number = np.arange(len(own))
    differ = own[:, None] != own
    best, most, among = [0, 0, 0], 0.0, 0
    for k in number:
        # each set of three functions once: the first of them, with two of the later ones
        free = (number > k) & differ[k]
        others = np.triu(differ, 1) & free & free[:, None]
        third = values[:, [k]]
        along = (values * (third * y[:, None])).T @ values
        mean = (values * third).T @ values / len(y)
        square = (values**2 * third**2).T @ values**2 - len(y) * mean**2
        tells = others & (square > CONSTANT * len(y))
        gain = np.where(tells, along**2 / np.where(tells, square, 1.0), 0.0)
        among += int(others.sum())
        i, j = np.unravel_index(int(np.argmax(gain)), gain.shape)
        if gain[i, j] > most:
            best, most = [int(k), int(i), int(j)], float(gain[i, j])
    return best, most, among


def _without_mean(factors: Sequence[Array] | Array) -> Array:
    """Product of some functions, (n_rows,) each, less its mean."""
    product = np.prod(factors, axis=0)
    return np.asarray(product - product.mean())


def _predicted_by(columns: Sequence[Array], y: Array, fold: NDArray[np.int64]) -> bool:
    """Whether a combination of columns, (n_rows,) each, predicts folds that are left out."""
    table, left = np.column_stack(columns), np.zeros(len(y))
    for f in np.unique(fold):
        out = fold == f
        weights = np.linalg.lstsq(table[~out], y[~out], rcond=None)[0]
        left[out] = (y[out] - table[out] @ weights) ** 2
    return predictable(by_fold(y**2, fold), by_fold(left, fold))


@dataclass(frozen=True)
class _Pairs:
    """Products of two simple functions of the signals, less their means.

    There may be many thousands. The pursuit needs only sums of products of three or four functions,
    which one matrix product gives for all pairs.

    Attributes
    ----------
    values : ndarray of shape (n_rows, n_functions)
        Values of the functions; the last one is constant.
    signal : ndarray of shape (n_functions,)
        Number of the signal behind each, -1 for the constant.
    first, second : ndarray of shape (n_pairs,)
        Functions of each pair: every function alone, then all pairs.
    mean : ndarray of shape (n_pairs,)
        Of each product over all rows.
    factors : list of Factor
        The functions, without the constant.
    """

    values: Array
    signal: NDArray[np.int64]
    first: NDArray[np.int64]
    second: NDArray[np.int64]
    mean: Array
    factors: list[Factor]

    @classmethod
    def of(cls, signals: dict[str, Array]) -> _Pairs:
        functions = [simple_functions(name, x) for name, x in signals.items()]
        factors = [factor for some in functions for factor in some]
        values = values_of(factors, signals)
        count, constant = values.shape[1], np.ones(len(values))
        first, second = np.triu_indices(count, 1)
        first = np.concatenate([np.arange(count), first])
        second = np.concatenate([np.full(count, count), second])
        values = np.column_stack([values, constant])
        signal = np.repeat(np.arange(len(functions)), [len(some) for some in functions])
        mean = (values.T @ values / len(values))[first, second]
        return cls(values, np.append(signal, -1), first, second, mean, factors)

    def factors_of(self, k: int) -> tuple[Factor, ...]:
        """The functions of one product."""
        both = int(self.first[k]), int(self.second[k])
        return tuple(self.factors[i] for i in both if i < len(self.factors))

    def column(self, k: int) -> Array:
        """Values of one product, shape (n_rows,)."""
        return np.asarray(
            self.values[:, self.first[k]] * self.values[:, self.second[k]] - self.mean[k]
        )

    def products(self, y: Array, fold: NDArray[np.int64]) -> Products:
        """Products of all columns with themselves, with a residual and with each other."""
        parts = [np.flatnonzero(fold == f) for f in np.unique(fold)]
        square = np.array([self._squares(self.values[rows]) for rows in parts])
        size = (square + [len(rows) * self.mean**2 for rows in parts]).sum(0)
        tells = square.sum(0) > CONSTANT * size  # else the rest is rounding

        def along(values: Array) -> Array:
            return np.where(tells, [self._with(values[r], self.values[r]) for r in parts], 0.0)

        return Products(
            np.where(tells, square, 0.0),
            along(y),
            np.array([y[rows] @ y[rows] for rows in parts]),
            lambda k: along(self.column(k)),
        )

    def _squares(self, values: Array) -> Array:
        fourth, mixed = (values**2).T @ values**2, values.T @ values
        at = self.first, self.second
        return np.asarray(fourth[at] - 2 * self.mean * mixed[at] + len(values) * self.mean**2)

    def _with(self, y: Array, values: Array) -> Array:
        third = values.T @ (values * y[:, None])
        return np.asarray(third[self.first, self.second] - self.mean * y.sum())


def values_of(factors: Sequence[Factor], signals: dict[str, Array]) -> Array:
    """Values of functions of signals, side by side, each divided by its largest magnitude.

    Parameters
    ----------
    factors : sequence of Factor
        Functions.
    signals : dict of str to ndarray of shape (n_rows,)
        By name.

    Returns
    -------
    ndarray of shape (n_rows, n_functions)
    """
    values = np.column_stack([factor.of(signals[factor.signal]) for factor in factors])
    return np.asarray(values / np.maximum(np.abs(values).max(axis=0), 1e-300))


def simple_functions(name: str, x: Array) -> list[Factor]:
    """Simple functions of a signal; positions are taken from the middle of their range.

    Parameters
    ----------
    name : str
        Signal, joints counted from 1.
    x : ndarray of shape (n_rows,)
        Its values.

    Returns
    -------
    list of Factor
    """
    if name.startswith("q"):
        middle = float((x.min() + x.max()) / 2)
        functions = ("value", "side", "sin", "cos", "sin2", "cos2")
        return [Factor(name, function, middle) for function in functions]
    if name.startswith("dq"):
        return [Factor(name, function) for function in ("value", "size", "side")]
    return [Factor(name, "value")]
