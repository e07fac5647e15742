# SPDX-License-Identifier: BSD-3-Clause
"""Smooth and piecewise linear functions of a signal on the range that it covers, and beyond it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array, Signals, blocks_held_out

#: Share of the samples of a trajectory left out at either end of its range.
_OUTSIDE = 0.002
#: Number of trajectories, or of blocks that are held out, that must reach a value for a function to
#: be fitted there.
_REACHING = 3
#: Share of the range over which the secant is computed that continues a function beyond it.
_SECANT = 0.15
#: Range of a signal that is more than rounding, as a share of its values.
_LEAST_RANGE = 1e-9


def splines(x: Array, low: float, high: float, count: int) -> Array:
    """Cubic B-splines on a range, continued beyond it, shape (n_samples, count).

    Their sum is a constant, which the model may lack. The recursion is that of Cox and de Boor
    [1]_, for the four splines that are not zero at a sample.

    References
    ----------
    .. [1] L. Piegl, W. Tiller (1997), The NURBS book, 2nd ed., Springer, algorithm A2.2.
    """
    if not high - low > _LEAST_RANGE * max(abs(low), abs(high)):
        return np.zeros((len(x), count))  # a joint at one place, but for rounding
    degree = 3
    n_pieces = count - degree
    knots = np.r_[[low] * degree, np.linspace(low, high, n_pieces + 1), [high] * degree]

    def functions(inside: Array) -> Array:
        inside = np.clip(inside, low, high - 1e-9 * (high - low))
        piece = ((inside - low) * (n_pieces / (high - low))).astype(np.int64)
        piece = np.minimum(piece, n_pieces - 1)
        before = [inside - knots[piece + degree - k] for k in range(degree)]
        after = [knots[piece + degree + 1 + k] - inside for k in range(degree)]
        values: list[Any] = [1.0]
        for order in range(1, degree + 1):
            carried, raised = 0.0, []
            for r, value in enumerate(values):
                part = value / (after[r] + before[order - 1 - r])
                raised.append(carried + after[r] * part)
                carried = before[order - 1 - r] * part
            values = [*raised, carried]
        columns = np.zeros((len(inside), count))
        place = np.arange(0, columns.size, count) + piece
        for r, value in enumerate(values):
            columns.ravel()[place + r] = value
        return columns

    return continued(functions, x, low, high)


def supported_range(signals: Signals, x: Array) -> tuple[float, float]:
    """Range of a signal that several trajectories cover, so that no single one decides.

    In a log of few trajectories, blocks of them are held out, and count instead.
    """
    (found,) = supported_ranges(signals, x[:, None])
    return found


def range_of(signals: Signals, name: str) -> tuple[float, float]:
    """:func:`supported_range` of a signal by its name, joints counted from 1, such as ``"q2"``."""
    return signals.once(  # type: ignore[no-any-return]
        ("range", name),
        lambda: supported_range(signals, signals.named(name)),
        of_fit=name.startswith("tau"),
    )


def supported_ranges(signals: Signals, x: Array) -> list[tuple[float, float]]:
    """:func:`supported_range` of several signals, shape (n_samples, n_signals)."""
    rows, reaching = signals.once("rows held out", lambda: _rows_held_out(signals))
    ends = np.array([np.quantile(x[own], [_OUTSIDE, 1 - _OUTSIDE], axis=0) for own in rows])
    ends.sort(axis=0)
    at = reaching - 1
    return [
        (float(low[at]), float(high[-1 - at]))
        if high[-1 - at] > low[at]
        else (float(low[0]), float(high[-1]))
        for low, high in np.moveaxis(ends, 2, 0).transpose(0, 2, 1)
    ]


def _rows_held_out(signals: Signals) -> tuple[list[NDArray[np.int64]], int]:
    """Rows of every trajectory or block, and the number of these that must reach a value."""
    names = np.unique(signals.trajectory)
    blocks = blocks_held_out(len(names))
    every = [np.flatnonzero(signals.trajectory == k) for k in names]
    parts = [part for own in every for part in np.array_split(own, blocks) if len(part)]
    return parts, min(_REACHING, (len(names) + 1) // 2)


def continued(functions: Callable[[Array], Array], x: Array, low: float, high: float) -> Array:
    """Functions on a range, continued beyond it along their secants over its outer parts."""
    values = functions(np.clip(x, low, high))
    reach = _SECANT * (high - low)
    for beyond, edge, inner in (
        (np.minimum(x - low, 0.0), low, low + reach),
        (np.maximum(x - high, 0.0), high, high - reach),
    ):
        rows = np.flatnonzero(beyond)
        if len(rows):
            at_edge, inside = functions(np.array([edge, inner]))
            values[rows] += np.outer(beyond[rows] / (edge - inner), at_edge - inside)
    return values


def knots_of(signals: Signals, name: str, count: int) -> tuple[float, ...]:
    """Knots of piecewise linear functions of a signal, within its :func:`range_of`.

    They are two thirds of the way from equal distances to equal numbers of samples between them: a
    function can change where the signal mostly is, but not only where a joint rests.

    Parameters
    ----------
    signals : Signals
    name : str
        Signal, joints counted from 1, such as ``"q2"``.
    count : int
        Number of knots, the ends of the range included.

    Returns
    -------
    tuple of float
        In the unit of the signal.
    """

    def make() -> tuple[float, ...]:
        return tuple(knots_between(signals.named(name), *range_of(signals, name), count).tolist())

    key = ("knots", name, count)
    return signals.once(key, make, of_fit=name.startswith("tau"))  # type: ignore[no-any-return]


def knots_between(x: Array, low: float, high: float, count: int) -> Array:
    """Knots of :func:`knots_of` for values, (n_samples,), in a range, (count,)."""
    share = np.linspace(0.0, 1.0, count)
    if not high - low > _LEAST_RANGE * max(abs(low), abs(high)):
        return low + share  # a signal of one value
    quantiles = np.quantile(np.clip(x, low, high), share)
    return np.asarray((2 * quantiles + low + (high - low) * share) / 3)


def hats(x: Array, knots: Sequence[float] | Array) -> Array:
    """Piecewise linear functions that are 1 at one knot and 0 at the others, constant outside.

    They are local: a function drawn to zero is small where there is no data.

    Parameters
    ----------
    x : ndarray of shape (n_samples,)
        Values of a signal.
    knots : sequence of float
        Increasing.

    Returns
    -------
    ndarray of shape (n_samples, n_knots)
        Their sum is 1.
    """
    places = np.interp(x, knots, np.arange(len(knots)))
    below = np.minimum(places.astype(np.int64), max(len(knots) - 2, 0))
    values, rows = np.zeros((len(x), len(knots))), np.arange(len(x))
    values[rows, below] = 1.0 - (places - below)
    if len(knots) > 1:
        values[rows, below + 1] = places - below
    return values


def products(functions: Sequence[Array]) -> Array:
    """All products of one function of each of several signals.

    Parameters
    ----------
    functions : sequence of ndarray of shape (n_samples, k_i)
        Functions of each signal.

    Returns
    -------
    ndarray of shape (n_samples, k_1 * k_2 * ...)
        The functions of the last signal change first.
    """
    columns, *others = functions
    for other in others:
        columns = (columns[:, :, None] * other[:, None, :]).reshape(len(columns), -1)
    return columns
