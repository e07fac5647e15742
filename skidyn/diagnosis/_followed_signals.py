# SPDX-License-Identifier: BSD-3-Clause
"""Signals on which a residual depends, in any form, judged on held-out folds.

Functions of known form are tried in any case. This finds the signals of functions with unknown
form, in two ways. Boosted trees need no form; the increase of their error with one signal shuffled
measures the dependence of the residual on it [1]_. They do not detect a product of two signals that
have no effect alone, such as two velocities: so all products of two simple functions of the signals
are tried one by one, and a second and third in addition to the best, and those of three signals of
joints that are close.

References
----------
.. [1] L. Breiman (2001), Random forests, Machine Learning 45, 5-32.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array
from skidyn.diagnosis._changing_sizes import changing_size
from skidyn.diagnosis._signal_products import (
    LEAST_SHARE,
    MOST_SIGNALS,
    Product,
    by_fold,
    predictable,
    product_of_three,
    product_with_load,
    products_of_two,
)
from skidyn.diagnosis._variables import average_at_rows, averaged_signals
from skidyn.evidence import Problem

#: Most rows that are used.
MOST_ROWS = 2000
#: Number of trees of a first test for any dependence, and of the full test.
TREES = (15, 50)
#: A signal counts if shuffling it increases the error by this share of that of the strongest one.
COUNTS = 0.1
#: Number of nearest joints among which sums of positions and products of three signals are formed,
#: and waves of the sums per rad.
MOST_NEAR, WAVES, SIGNS = 8, (0.5, 1.0, 2.0), (1.0, -1.0)
#: Relative rounding error of a sum.
ROUNDING = 1e-6

#: Joints, from 0, and the factor of the position of each.
Sum = tuple[tuple[int, ...], tuple[float, ...]]


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
    changing : list of Product
        The best function of a signal with a size of its own in each recording.
    loaded : list of Product
        The best product of the load and a function of a signal.
    """

    sets: list[tuple[str, ...]]
    sums: list[Sum]
    products: list[Product]
    changing: list[Product]
    loaded: list[Product]


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
    rows = problem.rows
    own = changing_size(signals, y, rows.trajectory[joint][::step], rows.quarter[joint][::step])
    changing = [] if own is None else [own]
    # numbered without gaps: dropped trajectories must not leave an empty quarter below
    numbers, fold = np.unique(problem.fold[joint][::step], return_inverse=True)
    if len(numbers) < 4:
        return Followed([], [], [], changing, [])
    sets, products = products_of_two(signals, y, fold)
    found = [*_by_trees(signals, y, fold), *sets]
    nearest = _nearest(joint, range(problem.n_joints))
    close = {name: x for name, x in signals.items() if _joint_of(name) in nearest}
    triple = product_of_three(close, y, fold, products)
    if triple is not None:
        products.append(triple)
        found.append(tuple(sorted(factor.signal for factor in triple[0])))
    loaded = []
    if problem.robot is not None and problem.signals.load is not None:
        load = average_at_rows(problem, joint, problem.signals.load[:, joint])[::step]
        # friction under load is in the catalogue
        others = {name: x for name, x in signals.items() if name != f"dq{joint + 1}"}
        one = product_with_load(others, load, y, fold)
        loaded = [] if one is None else [one]
    turning = np.flatnonzero(~problem.signals.prismatic).tolist()
    positions = {k: signals[f"q{k + 1}"] for k in sorted(_nearest(joint, turning))}
    sums = _by_sums(positions, y, fold)
    return Followed(list(dict.fromkeys(found)), sums, products, changing, loaded)


def _nearest(joint: int, joints: Iterable[int]) -> list[int]:
    """Those of some joints, from 0, that are nearest to one, nearest first."""
    return sorted(joints, key=lambda k: abs(k - joint))[:MOST_NEAR]


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
    return int(able[best]) if predictable(energy, left[:, best]) else None


def _solved(gram: Array, right: Array) -> Array:
    """Solutions of many small systems, shape (..., k)."""
    return np.asarray(np.linalg.solve(gram, right[..., None])[..., 0])


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
    if not predictable(by_fold(y**2, fold), by_fold(left, fold)):
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
