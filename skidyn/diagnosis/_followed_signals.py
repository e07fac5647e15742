# SPDX-License-Identifier: BSD-3-Clause
"""Which signals a residual follows, whatever the form, judged on folds left out.

The functions that the diagnosis knows by form are tried anyway. This finds the signals of those it
does not know, in two ways. Boosted trees need no form at all; how much worse they predict with one
signal shuffled says how much of the residual hangs on it [1]_. They do not see a product of two
signals that do nothing alone, such as two velocities: so all products of two simple functions of
the signals are tried one by one, and a second and third beside the best.

References
----------
.. [1] L. Breiman (2001), Random forests, Machine Learning 45, 5-32.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import ttest_1samp
from sklearn.ensemble import HistGradientBoostingRegressor

from skidyn._signals import Array
from skidyn.diagnosis._proposal import pursue
from skidyn.diagnosis._variables import average_at_rows, averaged_signals
from skidyn.evidence import Problem

#: Rows looked at, and signals of a set, at most.
MOST_ROWS, MOST_SIGNALS = 2000, 3
#: Share of the squared residual that must be predictable, and the chance that it only seems so.
LEAST_SHARE, CHANCE = 0.03, 0.005
#: A signal counts if shuffling it costs this share of what shuffling the strongest one costs.
COUNTS = 0.1
#: A further product must bring this share of the squared residual.
WORTH = 0.05


def followed_signals(problem: Problem, joint: int, residual: Array) -> list[tuple[str, ...]]:
    """Sets of signals that the residual of a joint may be a function of.

    Parameters
    ----------
    problem : Problem
        Rows and folds.
    joint : int
        Joint, from 0.
    residual : ndarray of shape (n_samples,)
        Torque that the model leaves, N m or N.

    Returns
    -------
    list of tuple of str
        Different sets of one to three signals; empty where the motion predicts nothing.
    """
    y = average_at_rows(problem, joint, residual)
    step = max(1, -(-len(y) // MOST_ROWS))
    signals = {name: x[::step] for name, x in averaged_signals(problem, joint).items()}
    y = y[::step]
    # numbered without gaps: trajectories that were dropped must not leave an empty quarter below
    numbers, fold = np.unique(problem.fold[joint][::step], return_inverse=True)
    if len(numbers) < 4:
        return []
    found = [*_by_trees(signals, y, fold), *_by_products(signals, y, fold)]
    return list(dict.fromkeys(found))


def _predictable(y: Array, left: Array, fold: NDArray[np.int64]) -> bool:
    """Whether a learner takes away more of the folds left out than chance would.

    The gain of a fold is relative to its own error, so that one lively fold does not decide.
    """
    before, after = np.bincount(fold, y**2), np.bincount(fold, left)
    gain = (before - after) / np.maximum(np.maximum(before, after), 1e-300)
    enough = bool(left.sum() < (1 - LEAST_SHARE) * np.sum(y**2))
    return enough and float(ttest_1samp(gain, 0.0, alternative="greater").pvalue) < CHANCE


def _by_trees(
    signals: dict[str, Array], y: Array, fold: NDArray[np.int64]
) -> list[tuple[str, ...]]:
    """The strongest signal, it and the second, and so on."""
    names = list(signals)
    X = np.column_stack([signals[name] for name in names])
    left, cost = np.zeros(len(y)), np.zeros(len(names))
    rng = np.random.default_rng(0)
    parts = [fold % 4 == k for k in range(4)]
    trees = []
    for out in parts:
        learner = HistGradientBoostingRegressor(
            max_iter=50, learning_rate=0.15, max_leaf_nodes=12, early_stopping=False, random_state=0
        )
        trees.append(learner.fit(X[~out], y[~out]))
        left[out] = (y[out] - learner.predict(X[out])) ** 2
    if not _predictable(y, left, fold):
        return []
    for out, learner in zip(parts, trees, strict=True):
        for i in range(len(names)):
            shuffled = X[out]
            shuffled[:, i] = rng.permutation(shuffled[:, i])
            cost[i] += np.sum((y[out] - learner.predict(shuffled)) ** 2)
    cost -= left.sum()
    order = [i for i in np.argsort(-cost) if cost[i] > COUNTS * cost.max()][:MOST_SIGNALS]
    return [tuple(names[i] for i in order[: n + 1]) for n in range(len(order))]


def _by_products(
    signals: dict[str, Array], y: Array, fold: NDArray[np.int64]
) -> list[tuple[str, ...]]:
    """The signals of the best products of two simple functions."""
    names, simple = [], []
    for name, x in signals.items():
        functions = _simple_functions(name, x)
        names += [name] * len(functions)
        simple += functions
    pairs = list(itertools.combinations(range(len(simple)), 2))
    columns = np.column_stack([*simple, *(simple[i] * simple[k] for i, k in pairs)])
    of = [{name} for name in names] + [{names[i], names[k]} for i, k in pairs]
    columns = (columns - columns.mean(0)) / np.maximum(columns.std(0), 1e-300)

    def together(chosen: Sequence[int]) -> set[str]:
        return set().union(*(of[i] for i in chosen))

    def admissible(chosen: Sequence[int]) -> NDArray[np.bool_]:
        used = together(chosen)
        return np.array([len(used | o) <= MOST_SIGNALS for o in of])

    worth = WORTH * float(y @ y)
    chosen, _ = pursue(columns, y, fold, worth=worth, longest=len(of), admissible=admissible)
    if not chosen:
        return []
    left = np.zeros(len(y))
    for f in np.unique(fold):
        out = fold == f
        weights = np.linalg.lstsq(columns[~out][:, chosen], y[~out], rcond=None)[0]
        left[out] = (y[out] - columns[out][:, chosen] @ weights) ** 2
    if not _predictable(y, left, fold):
        return []
    return [tuple(sorted(of[chosen[0]])), tuple(sorted(together(chosen)))]


def _simple_functions(name: str, x: Array) -> list[Array]:
    if name.startswith("q"):
        return [x, np.sin(x), np.cos(x), np.sin(2 * x), np.cos(2 * x)]
    if name.startswith("dq"):
        return [x, np.abs(x), np.sign(x)]
    return [x]
