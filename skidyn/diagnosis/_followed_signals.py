# SPDX-License-Identifier: BSD-3-Clause
"""Signals on which a residual depends, in any form, judged on held-out folds.

Functions of known form are tried in any case. This finds the signals of functions with unknown
form, in two ways. Boosted trees need no form; the increase of their error with one signal shuffled
measures the dependence of the residual on it [1]_. They do not detect a product of two signals that
have no effect alone, such as two velocities: so all products of two simple functions of the signals
are tried one by one, and a second and third in addition to the best.

References
----------
.. [1] L. Breiman (2001), Random forests, Machine Learning 45, 5-32.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import ttest_1samp

from skidyn._signals import Array
from skidyn.diagnosis._pursuit import Products, pursue
from skidyn.diagnosis._variables import average_at_rows, averaged_signals
from skidyn.effects import Factor
from skidyn.evidence import Problem

#: Most rows that are used, and most signals of a set.
MOST_ROWS, MOST_SIGNALS = 2000, 3
#: Number of trees of a first test for any dependence, and of the full test.
TREES = (15, 50)
#: Least share of the squared residual that must be predictable, and largest p-value.
LEAST_SHARE, CHANCE = 0.03, 0.05
#: A signal counts if shuffling it increases the error by this share of that of the strongest one.
COUNTS = 0.1
#: A further product must remove this share of the squared residual.
WORTH = 0.05
#: Number of nearest joints among which sums of positions are formed, and their waves per rad.
MOST_NEAR, WAVES, SIGNS = 8, (0.5, 1.0, 2.0), (1.0, -1.0)
#: Relative rounding error of a sum.
ROUNDING = 1e-6
#: A product that varies by a smaller share of its squares counts as constant.
CONSTANT = 1e-10

#: Rows of the search for products of three functions, and ratio of the mean square of successive
#: differences to the variance (2 for white noise; von Neumann 1941, Ann. Math. Stat. 12(4)) above
#: which a residual is left as noise by it.
ROWS_OF_TRIPLES, NOISY = 1000, 1.8

#: Joints, from 0, and the factor of the position of each.
Sum = tuple[tuple[int, ...], tuple[float, ...]]
#: Functions that are multiplied, and the number of products of which theirs was the best.
Product = tuple[tuple[Factor, ...], int]


class Followed(NamedTuple):
    """Possible arguments of the residual of a joint; empty if the motion does not predict it.

    Attributes
    ----------
    sets : list of tuple of str
        Different sets of one to three signals.
    sums : list of Sum
        The best sums of two and of three positions, each added or subtracted.
    products : list of Product
        The best product of two simple functions, and of three, each with the number of products of
        which it is the best.
    """

    sets: list[tuple[str, ...]]
    sums: list[Sum]
    products: list[Product]


def followed_signals(problem: Problem, joint: int, residual: Array) -> Followed:
    """Sets of signals, and sums of positions, on which the residual of a joint may depend.

    Parameters
    ----------
    problem : Problem
        Rows and folds.
    joint : int
        Joint, from 0.
    residual : ndarray of shape (n_samples,)
        Residual of the model, N m or N.
    """
    y = average_at_rows(problem, joint, residual)
    step = max(1, -(-len(y) // MOST_ROWS))
    signals = {name: x[::step] for name, x in averaged_signals(problem, joint).items()}
    y = y[::step]
    # numbered without gaps: dropped trajectories must not leave an empty quarter below
    numbers, fold = np.unique(problem.fold[joint][::step], return_inverse=True)
    if len(numbers) < 4:
        return Followed([], [], [])
    sets, products = _by_products(signals, y, fold)
    found = [*_by_trees(signals, y, fold), *sets]
    close = [name for name in signals if abs(_joint_of(name) - joint) <= MOST_NEAR // 2]
    triple = _by_triples({name: signals[name] for name in close}, y, fold, products)
    if triple is not None:
        products.append(triple)
        found.append(tuple(sorted(factor.signal for factor in triple[0])))
    turning = np.flatnonzero(~problem.signals.prismatic).tolist()
    near = sorted(sorted(turning, key=lambda k: abs(k - joint))[:MOST_NEAR])
    positions = {k: signals[f"q{k + 1}"] for k in near}
    return Followed(list(dict.fromkeys(found)), _by_sums(positions, y, fold), products)


def _joint_of(signal: str) -> int:
    """Joint of a signal, from 0."""
    return int(signal.lstrip("abcdefghijklmnopqrstuvwxyz")) - 1


def _by_sums(positions: dict[int, Array], y: Array, fold: NDArray[np.int64]) -> list[Sum]:
    """The best sums of two and of three positions, if they predict the residual."""
    # waves of a sum are products of those of the positions, as complex numbers
    turned = {k: np.exp(1j * np.outer(q, WAVES)) for k, q in positions.items()}
    signed = {(k, sign): x if sign > 0 else x.conj() for k, x in turned.items() for sign in SIGNS}
    found = []
    for count in (2, 3):
        sums: list[Sum] = [
            (places, (1.0, *weights))
            for places in itertools.combinations(positions, count)
            for weights in itertools.product(SIGNS, repeat=count - 1)
        ]
        waves = np.empty((len(sums), len(y), len(WAVES)), dtype=complex)
        for into, of in zip(waves, sums, strict=True):
            first, second, *others = (signed[k, sign] for k, sign in zip(*of, strict=True))
            np.multiply(first, second, out=into)
            for other in others:
                into *= other
        best = _best_block(waves.view(float), y, fold) if sums else None
        if best is not None:
            found.append(sums[best])
    return found


def _best_block(blocks: Array, y: Array, fold: NDArray[np.int64]) -> int | None:
    """The block of columns whose fit predicts held-out folds best, if any does.

    Parameters
    ----------
    blocks : ndarray of shape (n_blocks, n_rows, k)
    y : ndarray of shape (n_rows,)
    fold : ndarray of shape (n_rows,)
    """
    y = y - y.mean()
    right, mean = np.moveaxis(np.stack([y, np.full(len(y), 1 / len(y))]) @ blocks, 1, 0)
    gram = blocks.transpose(0, 2, 1) @ blocks - len(y) * mean[:, :, None] * mean[:, None]
    ridge = 1e-3 * len(y) * np.eye(blocks.shape[2])
    weights = _solved(gram + ridge, right)
    # No fit predicts held-out rows better than it fits them when they are included.
    gain = np.sum(weights * (2 * right - np.matmul(gram, weights[..., None])[..., 0]), axis=1)
    able = np.flatnonzero(gain > (1 - ROUNDING) * LEAST_SHARE * float(y @ y))
    if not len(able):
        return None
    x = blocks[able] - mean[able, None]
    parts = [np.flatnonzero(fold == f) for f in range(int(fold.max()) + 1)]
    inside = [x[:, rows] for rows in parts]
    own = np.array([a.transpose(0, 2, 1) @ a for a in inside])
    along = np.array([y[rows] @ a for a, rows in zip(inside, parts, strict=True)])
    energy = np.array([y[rows] @ y[rows] for rows in parts])
    weights = _solved(own.sum(0) - own + ridge, along.sum(0) - along)
    left = energy[:, None] - 2 * np.einsum("fbk,fbk->fb", weights, along)
    left += np.einsum("fbk,fbkl,fbl->fb", weights, own, weights, optimize=True)
    best = int(np.argmin(left.sum(0)))
    return int(able[best]) if _predictable(energy, left[:, best]) else None


def _solved(gram: Array, right: Array) -> Array:
    """Solutions of many small systems, shape (..., k)."""
    return np.asarray(np.linalg.solve(gram, right[..., None])[..., 0])


def _predictable(before: Array, after: Array) -> bool:
    """Whether a learner reduces the squared errors of held-out folds significantly.

    The gain of a fold is relative to its own error and that of an average fold, so that neither a
    single fold with large errors nor one without predictable error decides.
    """
    gain = (before - after) / np.maximum(np.maximum(before, after) + before.mean(), 1e-300)
    enough = bool(after.sum() < (1 - LEAST_SHARE) * before.sum())
    return enough and float(ttest_1samp(gain, 0.0, alternative="greater").pvalue) < CHANCE


def _by_fold(values: Array, fold: NDArray[np.int64]) -> Array:
    return np.bincount(fold, values).astype(float)


def _by_trees(
    signals: dict[str, Array], y: Array, fold: NDArray[np.int64]
) -> list[tuple[str, ...]]:
    """The strongest signal, then the two strongest, and so on."""
    # not needed to read a report
    from sklearn.ensemble import HistGradientBoostingRegressor

    names = list(signals)
    X = np.column_stack([signals[name] for name in names])
    left, cost = np.zeros(len(y)), np.zeros(len(names))
    rng = np.random.default_rng(0)
    parts = [fold % 4 == k for k in range(4)]
    trees: list[HistGradientBoostingRegressor] = []
    seen = np.zeros(len(y), dtype=bool)
    for out in parts:
        learner = HistGradientBoostingRegressor(
            learning_rate=0.15,
            max_leaf_nodes=12,
            early_stopping=False,
            warm_start=True,
            random_state=0,
        )
        seen |= out
        for count in TREES if not trees else TREES[-1:]:
            learner.set_params(max_iter=count).fit(X[~out], y[~out])
            left[out] = (y[out] - learner.predict(X[out])) ** 2
            if left[seen].sum() >= np.sum(y[seen] ** 2):
                return []  # noise: trees that fit it are worse than none
        trees.append(learner)
    if not _predictable(_by_fold(y**2, fold), _by_fold(left, fold)):
        return []
    for out, learner in zip(parts, trees, strict=True):
        shuffled = np.repeat(X[None, out], len(names), axis=0)
        for i, one in enumerate(shuffled):
            one[:, i] = rng.permutation(one[:, i])
        predicted = learner.predict(shuffled.reshape(-1, len(names)))
        cost += np.sum((y[out] - predicted.reshape(len(names), -1)) ** 2, axis=1)
    cost -= left.sum()
    order = [i for i in np.argsort(-cost) if cost[i] > COUNTS * cost.max()][:MOST_SIGNALS]
    return [tuple(names[i] for i in order[: n + 1]) for n in range(len(order))]


def _by_products(
    signals: dict[str, Array], y: Array, fold: NDArray[np.int64]
) -> tuple[list[tuple[str, ...]], list[Product]]:
    """The signals of the best products of two simple functions, and the best one itself."""
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
    if not chosen:
        return [], []
    columns = np.column_stack([pairs.column(k) for k in chosen])
    left = np.zeros(len(y))
    for f in np.unique(fold):
        out = fold == f
        weights = np.linalg.lstsq(columns[~out], y[~out], rcond=None)[0]
        left[out] = (y[out] - columns[out] @ weights) ** 2
    if not _predictable(_by_fold(y**2, fold), _by_fold(left, fold)):
        return [], []
    names = list(signals)
    sets = [{names[i] for i in of[:, k] if i >= 0} for k in chosen]
    best = pairs.factors_of(chosen[0]), of.shape[1]
    return [tuple(sorted(sets[0])), tuple(sorted(set().union(*sets)))], [best]


def _by_triples(
    signals: dict[str, Array], y: Array, fold: NDArray[np.int64], pairs: Sequence[Product]
) -> Product | None:
    """The best product of functions of three signals, if it predicts more than those of two."""
    step = max(1, -(-len(y) // ROWS_OF_TRIPLES))
    y, fold = y[::step] - y[::step].mean(), fold[::step]
    if len(y) < 2 or not np.mean(np.diff(y) ** 2) < NOISY * np.mean(y**2):
        return None
    signals = {name: x[::step] for name, x in signals.items()}
    least = WORTH * float(y @ y)
    for pair, _ in pairs:
        if all(factor.signal in signals for factor in pair):
            column = np.prod([f.of(signals[f.signal]) for f in pair], axis=0)
            column -= column.mean()
            least += float(column @ y) ** 2 / max(float(column @ column), 1e-300)
    factors = [
        factor
        for name, x in signals.items()
        for factor in _simple_functions(name, x)
        if factor.function in ("value", "side", "size")
    ]
    values = np.column_stack([f.of(signals[f.signal]) for f in factors])
    values /= np.maximum(np.abs(values).max(axis=0), 1e-300)
    own = np.array([f.signal for f in factors])
    among, best, most = 0, (0, 0, 0), least
    later = np.triu(own[:, None] != own, 1)
    for k in range(len(factors) - 2):
        others = later & (np.arange(len(factors)) > k)[:, None] & (own != own[k])
        others &= (own != own[k])[:, None]
        third = values[:, [k]]
        along = (values * (third * y[:, None])).T @ values
        mean = (values * third).T @ values / len(y)
        square = (values**2 * third**2).T @ values**2 - len(y) * mean**2
        tells = others & (square > CONSTANT * len(y))
        gain = np.where(tells, along**2 / np.where(tells, square, 1.0), 0.0)
        among += int(others.sum())
        i, j = np.unravel_index(int(np.argmax(gain)), gain.shape)
        if gain[i, j] > most:
            most, best = float(gain[i, j]), (k, int(i), int(j))
    if best == (0, 0, 0):
        return None
    column = values[:, list(best)].prod(axis=1)
    column -= column.mean()
    left = np.zeros(len(y))
    for f in np.unique(fold):
        out = fold == f
        size = column[~out] @ y[~out] / max(float(column[~out] @ column[~out]), 1e-300)
        left[out] = (y[out] - size * column[out]) ** 2
    if not _predictable(_by_fold(y**2, fold), _by_fold(left, fold)):
        return None
    return tuple(factors[k] for k in best), among


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
        functions = [_simple_functions(name, x) for name, x in signals.items()]
        factors = [factor for some in functions for factor in some]
        values = np.column_stack([f.of(signals[f.signal]) for f in factors])
        values = values / np.maximum(np.abs(values).max(axis=0), 1e-300)
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


def _simple_functions(name: str, x: Array) -> list[Factor]:
    """Simple functions of a signal; positions are taken from the middle of their range."""
    if name.startswith("q"):
        middle = float((x.min() + x.max()) / 2)
        functions = ("value", "side", "sin", "cos", "sin2", "cos2")
        return [Factor(name, function, middle) for function in functions]
    if name.startswith("dq"):
        return [Factor(name, function) for function in ("value", "size", "side")]
    return [Factor(name, "value")]
