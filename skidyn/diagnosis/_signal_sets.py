# SPDX-License-Identifier: BSD-3-Clause
"""Sets of one to three signals of which a function of any form predicts a residual.

A function of a signal is a sum of hats (piecewise linear functions), and one of several signals a
sum of products of their hats, as in the terms that are then fitted. Every signal, every pair of
signals of near joints and, if one of these predicts anything, the best pairs with a third signal
are fitted to all folds but one at a time; the set that predicts the folds left out best is the set
on which the residual depends.
Held-out errors need only the products of the columns within each fold.
"""

from __future__ import annotations

import itertools
from collections.abc import Collection, Sequence

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array
from skidyn.diagnosis._absorbed import left_of, thinned
from skidyn.diagnosis._signal_products import LEAST_SHARE, predictable, simple_functions
from skidyn.effects import Factor, hats, knots_between, products

#: Most rows that are used.
MOST_ROWS = 1000
#: Knots of the hats of each signal of a set of one, two and three.
KNOTS = (20, 7, 4)
#: Penalty of the squared coefficients, relative to the largest mean square of what is left of a
#: column.
RIDGE = 1e-2
#: Number of the best pairs to which a third signal is added.
PAIRS = 3
#: Share of the error of the best smaller set that a further signal must remove.
FURTHER = 0.1
#: Least size of what is left of a function, which is about 1.
TINY = 1e-3
#: Number of sets whose columns are held at once.
AT_ONCE = 32

#: Names of signals.
Names = tuple[str, ...]


def sets_of_signals(
    signals: dict[str, Array],
    y: Array,
    fold: NDArray[np.int64],
    near: Collection[str],
    absorbed: Array,
) -> list[Names]:
    """The best set of one, of two and of three signals, as far as each predicts more.

    Parameters
    ----------
    signals : dict of str to ndarray of shape (n_rows,)
        By name.
    y : ndarray of shape (n_rows,)
        Residual, N m or N.
    fold : ndarray of shape (n_rows,)
        Fold of every row, from 0.
    near : collection of str
        Signals of which all pairs are tried, and thirds; others only with the best single one.
    absorbed : ndarray of shape (n_rows, m)
        Directions that the model takes in.

    Returns
    -------
    list of tuple of str
        Up to three sets, fewest signals first; empty if none predicts the residual.
    """
    signals, y, parts, absorbed = _thinned(signals, y, fold, absorbed)
    moving = {name: x for name, x in signals.items() if np.ptp(x) > 0}
    if not moving:
        return []
    singles = _ranked([(name,) for name in moving], moving, y, parts, absorbed)
    first = singles[0][0][0]
    close = [name for name in moving if name in near]
    others = [name for name in moving if name != first and not {name, first} <= {*close}]
    sets = [*itertools.combinations(close, 2), *((first, name) for name in others)]
    pairs = _ranked(sets, moving, y, parts, absorbed)
    energy = np.array([y[rows] @ y[rows] for rows in parts])
    if not any(predictable(energy, ranked[0][1]) for ranked in (singles, pairs) if ranked):
        return []
    more = {frozenset((*pair, name)) for pair, _ in pairs[:PAIRS] for name in close}
    triples = _ranked(
        sorted(tuple(sorted(s)) for s in more if len(s) == 3), moving, y, parts, absorbed
    )
    found: list[Names] = []
    most = float(energy.sum())
    for names, left in (ranked[0] for ranked in (singles, pairs, triples) if ranked):
        if predictable(energy, left) and left.sum() < most:
            found.append(tuple(sorted(names)))
            most = (1 - FURTHER) * float(left.sum())
    return found


def product_with_function(
    signals: dict[str, Array],
    y: Array,
    fold: NDArray[np.int64],
    names: Names,
    absorbed: Array,
) -> tuple[Factor, Names, int] | None:
    """The best product of a simple function of one signal and a free function of the others.

    Parameters
    ----------
    signals : dict of str to ndarray of shape (n_rows,)
        By name.
    y : ndarray of shape (n_rows,)
        Residual, N m or N.
    fold : ndarray of shape (n_rows,)
        Fold of every row, from 0.
    names : tuple of str
        The two or three signals.
    absorbed : ndarray of shape (n_rows, m)
        Directions that the model takes in.

    Returns
    -------
    tuple of Factor, tuple of str and int, or None
        The simple function, the other signals, and the number of products that were tried; None if
        no product predicts the residual.
    """
    own = {name: signals[name] for name in names}
    own, y, parts, absorbed = _thinned(own, y, fold, absorbed)
    tried, blocks = [], []
    for name, x in own.items():
        others = tuple(other for other in names if other != name)
        free = products([_hats(own[other], KNOTS[len(others)]) for other in others])
        for factor in simple_functions(name, x):
            values = factor.of(x)
            tried.append((factor, others))
            blocks.append(values[:, None] / max(np.sqrt(np.mean(values**2)), 1e-300) * free)
    left = errors_of_folds(_left(np.stack(blocks), absorbed), y, parts, RIDGE)
    best = int(np.argmin(left.sum(1)))
    energy = np.array([y[rows] @ y[rows] for rows in parts])
    return (*tried[best], len(tried)) if predictable(energy, left[best]) else None


def _thinned(
    signals: dict[str, Array], y: Array, fold: NDArray[np.int64], absorbed: Array
) -> tuple[dict[str, Array], Array, list[NDArray[np.int64]], Array]:
    """Signals and centred residual at no more rows than are used, rows of folds, directions."""
    step = max(1, -(-len(y) // MOST_ROWS))
    y, fold = y[::step] - y[::step].mean(), fold[::step]
    parts = [np.flatnonzero(fold == f) for f in np.unique(fold)]
    return {name: x[::step] for name, x in signals.items()}, y, parts, thinned(absorbed, step)


def _ranked(
    sets: Sequence[Names],
    signals: dict[str, Array],
    y: Array,
    parts: Sequence[NDArray[np.int64]],
    absorbed: Array,
) -> list[tuple[Names, Array]]:
    """Sets of equally many signals with their held-out error of every fold, least error first."""
    if not sets:
        return []
    functions = {name: _hats(x, KNOTS[len(sets[0]) - 1]) for name, x in signals.items()}
    left: list[Array] = []
    for start in range(0, len(sets), AT_ONCE):
        some = [[functions[name] for name in names] for names in sets[start : start + AT_ONCE]]
        blocks = _left(np.stack([*map(products, some)]), absorbed)
        left.extend(_errors(blocks, y, parts))
    return sorted(zip(sets, left, strict=True), key=lambda item: float(item[1].sum()))


def _errors(blocks: Array, y: Array, parts: Sequence[NDArray[np.int64]]) -> Array:
    """As :func:`errors_of_folds`, of those blocks exactly that may predict anything.

    A fit predicts held-out rows worse than it fits them when they are included, for noise by twice
    the number of columns. That is assumed for blocks that would have to lose less than half of it.
    """
    _, n, k = blocks.shape
    energy = np.array([y[rows] @ y[rows] for rows in parts])
    gram, right = blocks.transpose(0, 2, 1) @ blocks, y @ blocks
    weights = solved(gram + RIDGE * n * np.eye(k), right)
    fitted = np.sum(weights * (2 * right - (gram @ weights[..., None])[..., 0]), axis=1)
    share = fitted / max(float(energy.sum()), np.finfo(float).tiny)
    left: Array = (1 - share + 2 * k / n)[:, None] * energy
    able = share - k / n > LEAST_SHARE
    if able.any():
        left[able] = errors_of_folds(blocks[able], y, parts, RIDGE)
    return left


def errors_of_folds(
    blocks: Array, y: Array, parts: Sequence[NDArray[np.int64]], ridge: float
) -> Array:
    """Squared error of every fold with the fit of a block of columns to all others.

    Parameters
    ----------
    blocks : ndarray of shape (n_blocks, n_rows, k)
        Columns; each block is fitted alone.
    y : ndarray of shape (n_rows,)
        What is fitted.
    parts : sequence of ndarray of int
        Rows of every fold.
    ridge : float
        Penalty of the squared coefficients, as a share of the number of rows.

    Returns
    -------
    ndarray of shape (n_blocks, n_folds)
    """
    inside = [blocks[:, rows] for rows in parts]
    own = np.array([a.transpose(0, 2, 1) @ a for a in inside])
    along = np.array([y[rows] @ a for a, rows in zip(inside, parts, strict=True)])
    energy = np.array([y[rows] @ y[rows] for rows in parts])
    penalty = ridge * len(y) * np.eye(blocks.shape[2])
    weights = solved(own.sum(0) - own + penalty, along.sum(0) - along)
    left = energy[:, None] - 2 * np.einsum("fbk,fbk->fb", weights, along)
    left += np.einsum("fbk,fbkl,fbl->fb", weights, own, weights, optimize=True)
    return np.asarray(left.T)


def solved(gram: Array, right: Array) -> Array:
    """Solutions of many small systems.

    Parameters
    ----------
    gram : ndarray of shape (..., k, k)
    right : ndarray of shape (..., k)

    Returns
    -------
    ndarray of shape (..., k)
    """
    return np.asarray(np.linalg.solve(gram, right[..., None])[..., 0])


def _left(blocks: Array, absorbed: Array) -> Array:
    """What a model leaves of blocks of columns, the largest of each with a mean square of 1.

    The ridge must not depend on how much the model takes in.
    """
    left = left_of(blocks, absorbed)
    size = np.sqrt(np.mean(left**2, axis=1).max(axis=1))
    return np.asarray(left / np.maximum(size, TINY)[:, None, None])


def _hats(x: Array, count: int) -> Array:
    """Piecewise linear functions of a signal, shape (n_rows, count)."""
    return hats(x, knots_between(x, float(x.min()), float(x.max()), count))
