# SPDX-License-Identifier: BSD-3-Clause
"""Signals on which a residual depends, in any form, judged on held-out folds.

Functions of known form are tried in any case. This finds the signals of functions with unknown
form, in two ways: by functions of any form of one to three signals, and by all products of two
simple functions of the signals, and of three signals of joints that are close.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array
from skidyn.diagnosis._absorbed import left_of, thinned
from skidyn.diagnosis._changing_sizes import changing_size
from skidyn.diagnosis._signal_products import (
    LEAST_SHARE,
    Product,
    predictable,
    product_of_three,
    product_of_two,
    product_with_load,
)
from skidyn.diagnosis._signal_sets import (
    errors_of_folds,
    product_with_function,
    sets_of_signals,
    solved,
)
from skidyn.diagnosis._variables import average_at_rows, averaged_signals
from skidyn.effects import Factor
from skidyn.evidence import Problem

#: Most rows that are used.
MOST_ROWS = 2000
#: Number of nearest joints among which sums of positions, sets of signals and products of three are
#: formed, and waves of the sums per rad.
MOST_NEAR, WAVES, SIGNS = 8, (0.5, 1.0, 2.0), (1.0, -1.0)
#: Penalty of the squared coefficients of waves.
RIDGE = 1e-3
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
    partly : list of tuple of Factor, tuple of str and int
        For the best sets of two and of three signals, the best product of a simple function of one
        and a free function of the others, with the number of products of which it is the best.
    """

    sets: list[tuple[str, ...]]
    sums: list[Sum]
    products: list[Product]
    changing: list[Product]
    loaded: list[Product]
    partly: list[tuple[Factor, tuple[str, ...], int]]


def followed_signals(problem: Problem, joint: int, residual: Array, absorbed: Array) -> Followed:
    """Sets of signals, and sums of positions, on which the residual of a joint may depend.

    Parameters
    ----------
    problem : Problem
        Rows and folds.
    joint : int
        Joint, from 0.
    residual : ndarray of shape (n_samples,)
        Residual of the model, N m or N.
    absorbed : ndarray of shape (n_rows_j, k)
        Directions of the rows of the joint that the model takes in.
    """
    y = average_at_rows(problem, joint, residual)
    step = max(1, -(-len(y) // MOST_ROWS))
    signals = {name: x[::step] for name, x in averaged_signals(problem, joint).items()}
    y, absorbed = y[::step], thinned(absorbed, step)
    rows = problem.rows
    own = changing_size(signals, y, rows.trajectory[joint][::step], rows.quarter[joint][::step])
    changing = [] if own is None else [own]
    # numbered without gaps: dropped trajectories must not leave an empty quarter below
    numbers, fold = np.unique(problem.fold[joint][::step], return_inverse=True)
    if len(numbers) < 4:
        return Followed([], [], [], changing, [], [])
    nearest = _nearest(joint, range(problem.n_joints))
    close = {name: x for name, x in signals.items() if _joint_of(name) in nearest}
    if problem.signals.time is not None and len(rows.recordings) > 2:
        # other recordings have the same times as what is held out
        since = average_at_rows(problem, joint, problem.signals.since_start)[::step]
        signals, close = signals | {"since_start": since}, close | {"since_start": since}
    sets = sets_of_signals(signals, y, fold, close, absorbed)
    several = [names for names in sets if len(names) > 1]
    with_function = [product_with_function(signals, y, fold, n, absorbed) for n in several]
    partly = [product for product in with_function if product is not None]
    pair = product_of_two(signals, y, fold, absorbed)
    triple = product_of_three(close, y, fold, pair, absorbed)
    products = [product for product in (pair, triple) if product is not None]
    sets += [tuple(sorted({factor.signal for factor in factors})) for factors, _ in products]
    loaded = []
    if problem.robot is not None and problem.signals.load is not None:
        load = average_at_rows(problem, joint, problem.signals.load[:, joint])[::step]
        # friction under load, and a gain that drifts, are in the catalogue
        named = {f"dq{joint + 1}", "since_start"}
        others = {name: x for name, x in signals.items() if name not in named}
        one = product_with_load(others, load, y, fold, absorbed)
        loaded = [] if one is None else [one]
    turning = np.flatnonzero(~problem.signals.prismatic).tolist()
    positions = {k: signals[f"q{k + 1}"] for k in sorted(_nearest(joint, turning))}
    sums = _by_sums(positions, y, fold, absorbed)
    return Followed(list(dict.fromkeys(sets)), sums, products, changing, loaded, partly)


def _nearest(joint: int, joints: Iterable[int]) -> list[int]:
    """Those of some joints, from 0, that are nearest to one, nearest first."""
    return sorted(joints, key=lambda k: abs(k - joint))[:MOST_NEAR]


def _joint_of(signal: str) -> int:
    """Joint of a signal, from 0."""
    return int(signal.lstrip("abcdefghijklmnopqrstuvwxyz")) - 1


def _by_sums(
    positions: dict[int, Array], y: Array, fold: NDArray[np.int64], absorbed: Array
) -> list[Sum]:
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
        best = _best_block(waves.view(float), y, fold, absorbed) if sums else None
        if best is not None:
            found.append(sums[best])
    return found


def _best_block(blocks: Array, y: Array, fold: NDArray[np.int64], absorbed: Array) -> int | None:
    """The block of columns whose fit predicts held-out folds best, if any does.

    Parameters
    ----------
    blocks : ndarray of shape (n_blocks, n_rows, k)
    y : ndarray of shape (n_rows,)
    fold : ndarray of shape (n_rows,)
    absorbed : ndarray of shape (n_rows, m)
        Directions that the model takes in.
    """
    y = y - y.mean()
    blocks = left_of(blocks - blocks.mean(axis=1, keepdims=True), absorbed)
    right, gram = y @ blocks, blocks.transpose(0, 2, 1) @ blocks
    weights = solved(gram + RIDGE * len(y) * np.eye(blocks.shape[2]), right)
    # No fit predicts held-out rows better than it fits them when they are included.
    gain = np.sum(weights * (2 * right - np.matmul(gram, weights[..., None])[..., 0]), axis=1)
    able = np.flatnonzero(gain > (1 - ROUNDING) * LEAST_SHARE * float(y @ y))
    if not len(able):
        return None
    parts = [np.flatnonzero(fold == f) for f in range(int(fold.max()) + 1)]
    energy = np.array([y[rows] @ y[rows] for rows in parts])
    left = errors_of_folds(blocks[able], y, parts, RIDGE)
    best = int(np.argmin(left.sum(1)))
    return int(able[best]) if predictable(energy, left[best]) else None
