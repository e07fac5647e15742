# SPDX-License-Identifier: BSD-3-Clause
"""Products of two and of three simple functions of signals that predict a residual."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import ttest_1samp

from skidyn._signals import Array
from skidyn.diagnosis._absorbed import left_of, thinned
from skidyn.effects import Factor

#: Least share of the squared residual that must be predictable, and largest p-value.
LEAST_SHARE, CHANCE = 0.03, 0.05
#: Share from which on it may be predictable in few folds, those in which the torque acts.
MOST_SHARE = 0.5
#: A product must remove this share of the squared residual.
WORTH = 0.05
#: A product that varies by a smaller share of its squares counts as constant, and one of which the
#: model leaves less than the other share as taken in.
CONSTANT, LEFT = 1e-10, 0.01
#: Rows of the search for products of three functions, and ratio of the mean square of successive
#: differences to the variance (2 for white noise; von Neumann 1941, Ann. Math. Stat. 12(4)) above
#: which a residual is left as noise by it.
ROWS_OF_TRIPLES, NOISY = 1000, 1.8
#: Products of three with each function of which it is found what the model takes in.
TRIPLES = 8

#: Name of the load of a joint among the functions of a product.
LOAD = "load"
#: Functions that are multiplied, and the number of products of which theirs was the best.
Product = tuple[tuple[Factor, ...], int]


def predictable(before: Array, after: Array) -> bool:
    """Whether a learner reduces the squared errors of held-out folds significantly, or to a half.

    The gain of a fold is relative to its own error and that of an average fold, so that neither a
    single fold with large errors nor one without predictable error decides. A torque that hardly
    acts in most of the folds is not significant in this way, however well it is predicted.

    Parameters
    ----------
    before, after : ndarray of shape (n_folds,)
        Squared error of every fold without and with the learner.
    """
    share = 1 - after.sum() / max(float(before.sum()), 1e-300)
    if not LEAST_SHARE < share <= MOST_SHARE:
        return bool(share > MOST_SHARE)
    gain = (before - after) / np.maximum(np.maximum(before, after) + before.mean(), 1e-300)
    return float(ttest_1samp(gain, 0.0, alternative="greater").pvalue) < CHANCE


def by_fold(values: Array, fold: NDArray[np.int64]) -> Array:
    """Sums of values, (n_rows,), over the rows of every fold, (n_folds,)."""
    return np.bincount(fold, values).astype(float)


def product_of_two(
    signals: dict[str, Array], y: Array, fold: NDArray[np.int64], absorbed: Array
) -> Product | None:
    """The best simple function of one signal or product of two, if it predicts the residual.

    Parameters
    ----------
    signals : dict of str to ndarray of shape (n_rows,)
        By name.
    y : ndarray of shape (n_rows,)
        Residual, N m or N.
    fold : ndarray of shape (n_rows,)
        Fold of every row, from 0.
    absorbed : ndarray of shape (n_rows, m)
        Directions that the model takes in.
    """
    y = y - y.mean()
    factors = [factor for name, x in signals.items() for factor in simple_functions(name, x)]
    # times a constant, a function is one of a single signal
    values = np.column_stack([values_of(factors, signals), np.ones(len(y))])
    mean = values.T @ values / len(y)
    along = values.T @ (values * y[:, None])
    gain = _gains(along, (values**2).T @ values**2, mean, len(y), _taken(values, absorbed))
    gain[np.tril_indices(len(gain))] = 0.0
    best = np.unravel_index(int(np.argmax(gain)), gain.shape)
    (column,) = _gains_of(values[:, best].prod(axis=1, keepdims=True), y, absorbed)[0].T
    if gain[best] <= WORTH * float(y @ y) or not _predicted_by([column], y, fold):
        return None
    among = len(factors) * (len(factors) + 1) // 2
    return tuple(factors[k] for k in best if k < len(factors)), among


def product_of_three(
    signals: dict[str, Array],
    y: Array,
    fold: NDArray[np.int64],
    pair: Product | None,
    absorbed: Array,
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
    pair : Product or None
        The product of two functions that predicts it.
    absorbed : ndarray of shape (n_rows, m)
        Directions that the model takes in.
    """
    step = max(1, -(-len(y) // ROWS_OF_TRIPLES))
    y, fold, absorbed = y[::step] - y[::step].mean(), fold[::step], thinned(absorbed, step)
    if len(y) < 2 or not np.mean(np.diff(y) ** 2) < NOISY * np.mean(y**2):
        return None
    signals = {name: x[::step] for name, x in signals.items()}
    least = WORTH * float(y @ y)
    if pair is not None and all(factor.signal in signals for factor in pair[0]):
        product = np.prod([factor.of(signals[factor.signal]) for factor in pair[0]], axis=0)
        least += float(_gains_of(product[:, None], y, absorbed)[1][0])
    factors = [
        factor
        for name, x in signals.items()
        for factor in simple_functions(name, x)
        if factor.function in ("value", "side", "size")
    ]
    values = values_of(factors, signals)
    own = np.unique([factor.signal for factor in factors], return_inverse=True)[1]
    best, column, among = _best_triple(values, own, y, absorbed)
    gain = float(column @ y) ** 2 / max(float(column @ column), 1e-300)
    if gain <= least or not _predicted_by([column], y, fold):
        return None
    return tuple(factors[k] for k in best), among


def product_with_load(
    signals: dict[str, Array],
    load: Array,
    y: Array,
    fold: NDArray[np.int64],
    absorbed: Array,
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
    absorbed : ndarray of shape (n_rows, m)
        Directions that the model takes in.
    """
    factors = [f for name, x in signals.items() for f in simple_functions(name, x)]
    loads = [Factor(LOAD, "value"), Factor(LOAD, "size")]
    values = values_of(factors, signals)
    size = max(float(np.sqrt(load @ load / len(y))), 1e-300)
    columns = np.hstack([f.of(load / size)[:, None] * values for f in loads])
    columns, gain = _gains_of(columns, y, absorbed)
    best = int(np.argmax(gain))
    if gain[best] <= WORTH * float(y @ y) or not _predicted_by([columns[:, best]], y, fold):
        return None
    kind, of = divmod(best, len(factors))
    return (loads[kind], factors[of]), columns.shape[1]


def _best_triple(
    values: Array, own: NDArray[np.int64], y: Array, absorbed: Array
) -> tuple[list[int], Array, int]:
    """The three functions whose product removes most, what is left of it, and the number tried.

    What the model takes in is found for the best products with each function only. There are none
    if no product varies.

    Parameters
    ----------
    values : ndarray of shape (n_rows, n_functions)
    own : ndarray of shape (n_functions,)
        Number of the signal behind each; those of a product differ.
    y : ndarray of shape (n_rows,)
    absorbed : ndarray of shape (n_rows, m)
        Directions that the model takes in.
    """
    number = np.arange(len(own))
    differ = own[:, None] != own
    tried: list[list[int]] = []
    among = 0
    for k in number:
        # each set of three functions once: the first of them, with two of the later ones
        free = (number > k) & differ[k]
        others = np.triu(differ, 1) & free & free[:, None]
        third = values[:, [k]]
        along = (values * (third * y[:, None])).T @ values
        mean = (values * third).T @ values / len(y)
        square = (values**2 * third**2).T @ values**2
        gain = np.where(others, _gains(along, square, mean, len(y)), 0.0)
        among += int(others.sum())
        first = np.argsort(-gain, axis=None, kind="stable")[:TRIPLES]
        first = first[gain.ravel()[first] > 0.0]
        i, j = np.unravel_index(first, gain.shape)
        tried += [[int(k), *pair] for pair in zip(i.tolist(), j.tolist(), strict=True)]
    if not tried:
        return [], np.zeros(len(y)), among
    columns = np.prod([values[:, list(some)] for some in zip(*tried, strict=True)], axis=0)
    columns, gain = _gains_of(columns, y, absorbed)
    best = int(np.argmax(gain))
    return tried[best], columns[:, best], among


def _gains_of(columns: Array, y: Array, absorbed: Array) -> tuple[Array, Array]:
    """What is left of columns, (n_rows, k), and what each removes of a residual without mean."""
    columns = columns - columns.mean(axis=0)
    varies = np.sum(columns**2, axis=0)
    left = left_of(columns, absorbed)
    size = np.sum(left**2, axis=0)
    tells = (varies > CONSTANT * len(y)) & (size > LEFT * varies)
    return left, np.where(tells, (y @ left) ** 2 / np.where(tells, size, 1.0), 0.0)


def _taken(values: Array, absorbed: Array) -> Array:
    """Sums of squares of the products of functions that a model takes in, (n_functions,) * 2."""
    taken = np.zeros((values.shape[1],) * 2)
    for direction in (absorbed - absorbed.mean(axis=0)).T:
        taken += (values.T @ (values * direction[:, None])) ** 2
    return taken


def _gains(
    along: Array, square: Array, mean: Array, count: int, taken: Array | float = 0.0
) -> Array:
    """What products of functions remove of the square of a residual without mean.

    Parameters
    ----------
    along : ndarray of shape (n_functions, n_functions)
        Sums of the products times the residual.
    square : ndarray of shape (n_functions, n_functions)
        Sums of their squares.
    mean : ndarray of shape (n_functions, n_functions)
        Their means over the rows.
    count : int
        Number of rows.
    taken : ndarray of shape (n_functions, n_functions), default=0
        Sums of their squares that the model takes in.

    Returns
    -------
    ndarray of shape (n_functions, n_functions)
        Zero for products that do not vary, or of which the model takes in nearly all.
    """
    varies = square - count * mean**2
    tells = (varies > CONSTANT * count) & (varies - taken > LEFT * varies)
    varies = varies - taken
    return np.where(tells, along**2 / np.where(tells, varies, 1.0), 0.0)


def _predicted_by(columns: Sequence[Array], y: Array, fold: NDArray[np.int64]) -> bool:
    """Whether a combination of columns, (n_rows,) each, predicts folds that are left out."""
    table, left = np.column_stack(columns), np.zeros(len(y))
    for f in np.unique(fold):
        out = fold == f
        weights = np.linalg.lstsq(table[~out], y[~out], rcond=None)[0]
        left[out] = (y[out] - table[out] @ weights) ** 2
    return predictable(by_fold(y**2, fold), by_fold(left, fold))


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
    if name == "since_start":  # grows, or changes its sign
        return [Factor(name, "value", middle) for middle in (0.0, float(x.max() / 2))]
    return [Factor(name, "value")]
