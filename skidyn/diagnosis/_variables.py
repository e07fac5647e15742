# SPDX-License-Identifier: BSD-3-Clause
"""Signals on which an unknown torque depends: a test for each, on held-out folds.

A flexible learner (random Fourier features, ridge regression; Rahimi, Recht 2007) predicts the
joint's residual including the unknown torque from a set of signals. A signal is needed if leaving
it out makes the error of the held-out folds larger, fold against fold (one-sided paired t-test of
the logarithm of their ratio); one outside the set is missing if adding it makes them smaller. Folds
are whole trajectories if there are enough, so that autocorrelation within one does not matter.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import ttest_1samp

from skidyn._cholesky import factored, solved
from skidyn._signals import Array
from skidyn.evidence import Problem

FEATURES = 120
#: Lengths over which the learned function varies, in standard deviations of its inputs.
LENGTHS = (1.0, 3.0)
RIDGES = 10.0 ** np.arange(-3.0, 4.0)
#: P-value below which a signal of the set is kept, and below which another one is added (divided by
#: the number tried); least gain, as a share of the predictable error.
KEPT, TAKEN_IN, LEAST_SHARE = 0.05, 0.01, 0.05


@dataclass(frozen=True)
class VariableTest:
    """Whether an unknown torque depends on a signal.

    Parameters
    ----------
    variable : str
        Signal, joints counted from 1: ``"q1"``, ``"dq3"``, ``"ddq2"``, ``"temp1"``.
    share : float
        Share of the predictable squared error that is lost without it, or gained with it.
    p_value : float
        Probability of this share if the torque did not depend on the signal.
    needed : bool
        Whether the torque depends on it.

    Examples
    --------
    >>> VariableTest("q2", 0.6, 1e-5, True).needed
    True
    """

    variable: str
    share: float
    p_value: float
    needed: bool


def row_signals(problem: Problem, joint: int) -> dict[str, Array]:
    """Signals averaged at the rows of a joint, by name.

    Parameters
    ----------
    problem : Problem
        Rows and signals.
    joint : int
        Joint, from 0.

    Returns
    -------
    dict of str to ndarray of shape (n_rows, k)
        One column each, two for the joint's own velocity: with its direction.
    """
    averaged = averaged_signals(problem, joint)
    direction = average_at_rows(problem, joint, problem.signals.sign)
    rows = {name: x[:, None] for name, x in averaged.items()}
    for k in range(problem.n_joints):
        rows[f"dq{k + 1}"] = np.column_stack([averaged[f"dq{k + 1}"], direction[:, k]])
    scaled = {}
    for name, x in rows.items():
        spread = x.std(0)
        moves = spread > 1e-9
        if moves.any():
            scaled[name] = (x[:, moves] - x[:, moves].mean(0)) / spread[moves]
    return scaled


def averaged_signals(problem: Problem, joint: int) -> dict[str, Array]:
    """Signals averaged at the rows of a joint, by name, in SI units.

    Parameters
    ----------
    problem : Problem
        Rows and signals.
    joint : int
        Joint, from 0.

    Returns
    -------
    dict of str to ndarray of shape (n_rows,)
        Positions, velocities and accelerations of all joints, and the joint's own temperature. The
        latter is left out if it mostly tells recordings apart and these are not held out as a
        whole: a flexible function of it would be one of the recording.
    """
    s, weights = problem.sampled(problem.rows.step)
    columns = {
        f"{kind}{k + 1}": table[:, k]
        for k in range(problem.n_joints)
        for kind, table in (("q", s.q), ("dq", s.dq), ("ddq", s.ddq))
    }
    if s.temperature is not None:
        own_temperature = s.temperature[:, joint]
        if problem.whole_trajectories or not _tells_apart(own_temperature, s.trajectory):
            columns[f"temp{joint + 1}"] = own_temperature
    own = weights[joint]
    total = own @ np.ones(s.n_samples)
    averages = own @ np.column_stack(list(columns.values()))
    return dict(zip(columns, averages.T / total, strict=True))


def _tells_apart(values: Array, trajectory: NDArray[Any]) -> bool:
    """Whether most of the variance of a signal is that between trajectories."""
    number = np.unique(trajectory, return_inverse=True)[1]
    mean = np.bincount(number, values) / np.bincount(number)
    return bool(np.mean((values - mean[number]) ** 2) < 0.5 * np.var(values))


def row_weights(problem: Problem, joint: int) -> Array:
    """Weight of every row of a joint: its value for a constant signal."""
    return problem.rows.average(np.ones(problem.signals.n_samples), joint)


def average_at_rows(problem: Problem, joint: int, values: Array) -> Array:
    """Weighted means of signals, (n_samples,) or (n_samples, k), at every row of a joint."""
    weights = row_weights(problem, joint)
    return np.asarray((problem.rows.average(values, joint).T / weights).T)


def depends_on(
    problem: Problem,
    joint: int,
    residual: Array,
    hypothesis: Sequence[str],
    columns: Array,
    without: Callable[[Array], Array],
) -> list[VariableTest]:
    """Test on which signals the residual of a joint depends.

    Parameters
    ----------
    problem : Problem
        Rows and folds.
    joint : int
        Joint, from 0.
    residual : ndarray of shape (n_rows,)
        Residual rows of the joint including the unknown torque.
    hypothesis : sequence of str
        Signals of the fitted function.
    columns : ndarray of shape (n_rows, k)
        Rows used for ``"time"``: those of that function if it is periodic in time, or the time
        since the start of the recording.
    without : callable
        Function that removes from rows the part that known terms of the model can represent.

    Returns
    -------
    list of VariableTest
        The needed signals first, then the others by their share.
    """
    signals = row_signals(problem, joint)
    fold, n_folds = problem.fold[joint], problem.n_folds
    weights = row_weights(problem, joint)[:, None]
    if "time" in hypothesis:
        signals["time"] = columns / np.maximum(columns.std(0), 1e-300)

    def errors(names: Sequence[str]) -> Array:
        if not names:
            return np.asarray(np.bincount(fold, residual**2, minlength=n_folds), dtype=float)
        x = np.column_stack([signals[name] for name in names])
        tried = (without(_features(x, length) * weights) for length in LENGTHS)
        return _held_out_errors(tried, residual, fold, n_folds)

    chosen = [v for v in hypothesis if v in signals]
    if not chosen:
        return []
    outside = [v for v in signals if v not in chosen]
    reached = errors(chosen)
    nothing = errors([])
    whole = max(float((nothing - reached).sum()), 1e-300)
    tests = {}
    for name in outside:
        better = errors([*chosen, name])
        share, p = float((reached - better).sum()) / whole, _p_value(reached, better)
        needed = p < TAKEN_IN / max(1, len(outside)) and share > LEAST_SHARE
        tests[name] = VariableTest(name, share, p, needed)
    # The strongest one is used: others may only be correlated with it.
    best = max((t for t in tests.values() if t.needed), key=lambda t: t.share, default=None)
    if best is not None:
        chosen.append(best.variable)
        reached = errors(chosen)
        tests = {
            n: t if t is best else VariableTest(n, t.share, t.p_value, False)
            for n, t in tests.items()
        }
    for name in chosen:
        worse = errors([v for v in chosen if v != name])
        share, p = float((worse - reached).sum()) / whole, _p_value(worse, reached)
        tests[name] = VariableTest(name, share, p, p < KEPT and share > LEAST_SHARE)
    return sorted(tests.values(), key=lambda t: (not t.needed, -t.share))


def _p_value(worse: Array, better: Array) -> float:
    """P-value of the errors, fold by fold, if the second set were no better than the first."""
    ratio = np.log(np.maximum(worse, 1e-300) / np.maximum(better, 1e-300))
    if np.ptp(ratio) == 0:
        return 1.0
    return float(ttest_1samp(ratio, 0.0, alternative="greater").pvalue)


def _held_out_errors(
    tried: Iterable[Array], residual: Array, fold: NDArray[np.int64], n_folds: int
) -> Array:
    """Held-out squared error of every fold, (n_folds,), with the best features and ridge."""
    table = np.concatenate([_ridge_errors(f, residual, fold, n_folds) for f in tried])
    return np.asarray(table[np.argmin(table.sum(1))])


def _features(x: Array, length: float) -> Array:
    rng = np.random.default_rng(0)
    phase = x @ (rng.normal(size=(x.shape[1], FEATURES // 2)) / length)
    return np.column_stack([np.ones(len(x)), x, np.cos(phase), np.sin(phase)])


def _ridge_errors(features: Array, residual: Array, fold: NDArray[np.int64], n_folds: int) -> Array:
    """Held-out squared errors, shape (n_ridges, n_folds)."""
    parts = [(features[fold == f], residual[fold == f]) for f in range(n_folds)]
    grams = np.array([a.T @ a for a, _ in parts])
    cross = np.array([a.T @ y for a, y in parts])
    total, right = grams.sum(0), cross.sum(0)
    errors = np.zeros((len(RIDGES), n_folds))
    for f, (a, y) in enumerate(parts):
        others, along = total - grams[f], right - cross[f]
        for k, ridge in enumerate(RIDGES):
            weight = ridge_solution(others, along, ridge * len(residual) / n_folds)
            errors[k, f] = np.sum((y - a @ weight) ** 2)
    return errors


def ridge_solution(gram: Array, right: Array, ridge: float) -> Array:
    """Coefficients of least squares with a ridge, from products of columns.

    Triangular factors for every ridge take a part of the time of eigenvectors, which would serve
    all ridges.

    Parameters
    ----------
    gram : ndarray of shape (k, k)
        Products of the columns with themselves.
    right : ndarray of shape (k,)
        Products of the columns and the residual.
    ridge : float
        Added to the diagonal.

    Returns
    -------
    ndarray of shape (k,)
    """
    normal, diagonal = gram.copy(order="F"), np.arange(len(gram))
    normal[diagonal, diagonal] += ridge
    return solved(factored(normal), right)
