# SPDX-License-Identifier: BSD-3-Clause
"""Parameters of a joint in its loop, fitted to half of the pieces and tested on the other half.

A step of the simulation takes the same time for one model as for a hundred, so all models of a
joint are fitted together.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from skidyn._signals import Array
from skidyn.forward import JointLoop
from skidyn.simulation._servo_laws import Range, units_of

#: Most steps of a fit, the decrease of the squared error that ends it, dampings tried at once.
ROUNDS, SMALL = 10, 3e-3
DAMPING = (0.0, 1e-3, 1e-2, 0.1, 1.0, 10.0)
#: Most numbers in a table of simulated positions, some 16 MB.
MOST = 2_000_000


@dataclass(frozen=True)
class Fit:
    """Values of the parameters, mean over the halves, and mean squared error of every piece.

    ``left_out`` is the error with the fit to the other half, (n_pieces,); NaN without one.
    """

    values: dict[str, float]
    left_out: Array

    @property
    def mean(self) -> float:
        """Mean over the pieces."""
        return float(np.nanmean(self.left_out))


def fit_all(
    loop: JointLoop,
    models: Sequence[Mapping[str, Range]],
    start: Mapping[str, float],
    parts: Sequence[int] = (0, 1),
) -> list[Fit]:
    """Fit models to each half of the pieces and test them on the other.

    A model is given by the ranges of its parameters, ``start`` has initial values by parameter, and
    ``parts`` are the halves that are fitted.
    """
    searches = [_Search(loop, ranges, start, k) for ranges in models for k in parts]
    # Gears and presliding are simulated with other equations.
    groups: dict[tuple[bool, bool], list[_Search]] = {}
    for search in searches:
        equations = "compliance" in search.names, "presliding" in search.names
        groups.setdefault(equations, []).append(search)
    for group in groups.values():
        _descend(loop, group)
    fits = []
    for i in range(len(models)):
        own = searches[i * len(parts) : (i + 1) * len(parts)]
        left = np.full(loop.q.shape[1], np.nan)
        for search in own:
            other = ~search.half
            left[other] = (search.error[:, other] ** 2).sum(axis=0)
            left[other] /= np.maximum(loop.valid[:, other].sum(axis=0), 1)
        mean = np.mean([search.x for search in own], axis=0)
        fits.append(Fit(dict(zip(own[0].names, map(float, mean), strict=True)), left))
    return fits


def covariance(
    loop: JointLoop, ranges: Mapping[str, Range], values: Mapping[str, float]
) -> tuple[list[str], Array]:
    """Names and covariance of the parameters of a fitted model, robust to correlated errors.

    Errors of the simulated position last for tenths of a second: they are summed over blocks of a
    second, which are taken as independent.
    """
    search = _Search(loop, ranges, values, 0)
    (errors,) = _errors(loop, search.names, [search], [search.beside()])
    slope = (errors[1:] - errors[0]) / search.step[:, None, None]
    seconds: Any = np.floor(loop.time - loop.time[0]).astype(int)
    block: Any = seconds + (seconds.max() + 1) * np.arange(errors.shape[2])
    size = search.size  # parameters have very different units
    flat = (slope * size[:, None, None]).reshape(len(size), -1)
    sums = [np.bincount(block.ravel(), x * errors[0].ravel()) for x in flat]
    score: Array = np.array(sums, dtype=np.float64)[:, np.unique(block)]
    n, p = score.shape[1], len(size)
    inverse = np.linalg.pinv(flat @ flat.T, rcond=1e-10, hermitian=True)
    spread = inverse @ (score @ score.T) @ inverse * n / max(n - p, 1)
    return search.names, spread * np.outer(size, size)


class _Search:
    """One model that is fitted to one half."""

    def __init__(
        self, loop: JointLoop, ranges: Mapping[str, Range], start: Mapping[str, float], part: int
    ) -> None:
        units = units_of(loop)
        table = [(r.start, r.low, r.high, r.size) for r in ranges.values()]
        scale = [units[r.unit] for r in ranges.values()]
        first, self.low, self.high, self.size = np.array(table).T * np.array(scale)
        self.names = list(ranges)
        given = [start.get(name, value) for name, value in zip(self.names, first, strict=True)]
        self.x = np.clip(given, self.low, self.high)
        self.half = np.arange(loop.q.shape[1]) % 2 == part
        self.cost = np.inf
        self.error = np.zeros(0)
        self.done = False

    def beside(self) -> Array:
        """The values, and neighbouring values for a derivative."""
        self.step = np.where(self.x + 1e-2 * self.size > self.high, -1e-2, 1e-2) * self.size
        return np.vstack([self.x, self.x + np.diag(self.step)])

    def steps(self, errors: Array) -> Array:
        """Damped Gauss-Newton steps within the limits."""
        self.error = errors[0]
        here = errors[:, :, self.half].reshape(len(errors), -1)
        slope = (here[1:] - here[0]) / (self.step / self.size)[:, None]
        self.cost = float(here[0] @ here[0])
        gram, along = slope @ slope.T, slope @ here[0]
        floor = (1e-9 * np.trace(gram) + np.finfo(float).tiny) * np.eye(len(self.x))
        moves = [np.linalg.solve(gram + d * np.diag(np.diag(gram)) + floor, along) for d in DAMPING]
        return np.asarray(np.clip(self.x - self.size * np.array(moves), self.low, self.high))

    def take(self, tried: Array, errors: Array) -> None:
        """Take the best of the steps; end if it brings no gain."""
        costs = (errors[:, :, self.half] ** 2).sum(axis=(1, 2))
        best = int(np.argmin(costs))
        if not costs[best] < self.cost:
            self.done = True
            return
        self.x, self.error = tried[best], errors[best].copy()
        self.done = bool(costs[best] > (1 - SMALL) * self.cost)


def _descend(loop: JointLoop, searches: list[_Search]) -> None:
    """Steps of all searches, simulated together."""
    names = list(dict.fromkeys(name for search in searches for name in search.names))
    for _ in range(ROUNDS):
        open_ = [search for search in searches if not search.done]
        if not open_:
            break
        here = _errors(loop, names, open_, [search.beside() for search in open_])
        tried = [search.steps(error) for search, error in zip(open_, here, strict=True)]
        found = _errors(loop, names, open_, tried)
        for search, values, error in zip(open_, tried, found, strict=True):
            search.take(values, error)


def _errors(
    loop: JointLoop, names: list[str], searches: list[_Search], values: list[Array]
) -> list[Array]:
    """Errors of several values of every search, each of shape (n_values, n_samples, n_pieces)."""
    table = np.zeros((sum(map(len, values)), len(names)))
    ends = np.cumsum([len(x) for x in values])
    for search, x, end in zip(searches, values, ends, strict=True):
        table[end - len(x) : end, [names.index(name) for name in search.names]] = x
    size = max(1, MOST // loop.q.size)
    parts = [table[k : k + size] for k in range(0, len(table), size)]
    errors = [loop.errors({k: part[:, i] for i, k in enumerate(names)}) for part in parts]
    return np.split(np.concatenate(errors), ends[:-1])
