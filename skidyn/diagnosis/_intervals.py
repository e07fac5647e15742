# SPDX-License-Identifier: BSD-3-Clause
"""Confidence intervals of coefficients and shape parameters, by leaving out one fold at a time.

The jackknife over whole trajectories (Efron, Stein 1981, Ann. Stat. 9) is valid for any
autocorrelation within a trajectory. Shape parameters are included through the derivative of the
effect's torque (one Gauss-Newton step from the fitted value in every fold), limited to the spacing
of the grid on which they were found: along a direction that the data does not determine, a linear
step could be arbitrarily large. What acts in one fold only is judged by leaving out interleaved
parts of all recordings, since the other folds do not determine it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student_t

from skidyn._signals import Array
from skidyn.diagnosis._held_out import bases_alone, folds_alone
from skidyn.diagnosis._profile import QUARTERS
from skidyn.effects import Shape, Term, TermSum
from skidyn.evidence import (
    Problem,
    fold_products,
    jackknife,
    left_out_coefficients,
    solve_left_out,
)

CONFIDENCE = 0.95
#: Relative step of the derivative with respect to a shape parameter; largest change of a torque by
#: it, relative to the torque; divisor of a step with a larger change, as of a fine ripple.
STEP, LARGEST_CHANGE, SMALLER = 0.02, 0.3, 8.0
#: Largest logarithm of the ratio of an end of an interval to the value: nearly any size is
#: possible.
LARGEST_LOG = 7.0


@dataclass(frozen=True)
class _Quarters:
    """Interleaved parts of all recordings as folds."""

    fold: list[NDArray[np.int64]]
    n_folds: int = QUARTERS


def _products_of_quarters(
    problem: Problem, design: Sequence[Array], sigma: Array
) -> tuple[Array, Array]:
    """As :func:`fold_products`, of interleaved parts of all recordings."""
    quarter = problem.rows.quarter
    orders = [np.argsort(own, kind="stable") for own in quarter]
    columns = [block[order] for block, order in zip(design, orders, strict=True)]
    torque = [y[order] for y, order in zip(problem.target, orders, strict=True)]
    parts = _Quarters([own[order] for own, order in zip(quarter, orders, strict=True)])
    return fold_products(parts, columns, sigma, torque)


def parameter_intervals(
    problem: Problem, terms: Sequence[Term], sigma: Array, shapes: bool = True
) -> dict[Term, dict[str, Any]]:
    """Physical parameters of every term with 95 % intervals.

    Parameters
    ----------
    problem : Problem
        Rows and folds.
    terms : sequence of Term
        Every effect of the model.
    sigma : ndarray of shape (n_joints,)
        Noise of one row.
    shapes : bool, default=True
        Whether to include the uncertainty of shape parameters. Without it an interval shows whether
        an effect of exactly this shape may be absent.

    Returns
    -------
    dict of Term to dict of str to (value, low, high), or to a plain value where it has none
    """
    blocks = [problem.term_rows(t) for t in terms]
    whole, held = left_out_coefficients(
        problem,
        problem.design(blocks),
        sigma,
        problem.target,
        soft=problem.soft(terms),
        kept=lambda grams: bases_alone(grams, terms),
    )
    places = list(TermSum(terms).slices(len(problem.rigid_index)))
    at = len(whole)
    slopes, owners, spread = _slopes(problem, places if shapes else [], whole)
    design = problem.design([*blocks, *slopes])
    known = np.zeros(at + len(spread))
    known[at:] = 1 / np.square(spread)
    prior = np.diag(known), np.zeros(len(known))
    grams, cross = fold_products(problem, design, sigma, problem.target)
    stay = bases_alone(grams, terms, len(spread))
    full, left_out = solve_left_out(grams, cross, prior, kept=stay)
    # As when it was accepted (``SearchState.is_judged_within``).
    confined = [t.trajectories is None and folds_alone(problem, t).any() for t in terms]
    if any(confined):
        _, in_parts = solve_left_out(*_products_of_quarters(problem, design, sigma), prior)
    result = {}
    for i, (term, own) in enumerate(places):
        left = in_parts if confined[i] else left_out
        apart = _half_width((left if confined[i] else held)[:, own]) < np.abs(whole[own])
        # what others are divided by is zero if it may be zero
        has_value = np.array([not c.is_divisor for c in term.coefficients]) | apart
        fitted = np.where(has_value, whole[own], 0.0)
        value = term.parameters(fitted, problem.signals)
        replicates = []
        # Without its recording an offset of that recording alone is not determined.
        seen = np.all(np.abs(left[:, own]) > 1e-12, axis=1)
        for coefficients in left[seen] if seen.sum() > 2 else left:
            shape = dict(term.shape)
            for column, (owner, name, log) in enumerate(owners):
                if owner == i:
                    move = coefficients[at + column] - full[at + column]
                    shape[name] = shape[name] * np.exp(move) if log else shape[name] + move
            change = np.where(has_value, coefficients[own] - full[own], 0.0)
            moved = term.with_shape(**shape)
            replicates.append(moved.parameters(fitted + change, problem.signals))
            if term.effect.amplitudes:
                replicates[-1] |= _along(term, fitted, change)
        not_zero = {
            c.name for c, is_apart in zip(term.coefficients, apart, strict=True) if is_apart
        }
        result[term] = {
            name: _interval(number, [r[name] for r in replicates if name in r], name in not_zero)
            for name, number in value.items()
        }
        for name in set(term.effect.amplitudes) & set(value):
            result[term][name] = _not_negative(result[term][name])
    return result


def _slopes(
    problem: Problem, places: Sequence[tuple[Term, slice]], whole: Array
) -> tuple[list[dict[int, Array]], list[tuple[int, str, bool]], list[float]]:
    """Derivative of each term's torque by each of its shape parameters, and their spread."""
    slopes, owners, spread = [], [], []
    for i, (term, own) in enumerate(places):
        for shape in term.effect.shapes:
            if shape.name not in term.shape or not shape.has_interval:
                continue
            here = float(term.shape[shape.name])
            if np.isclose(here, shape.low, rtol=1e-6):
                continue  # at the end of its range; beyond, it is another effect
            log = shape.spacing == "log"
            step = STEP * (here if log else max(abs(here), 1e-3))
            change, size, least = np.inf, 0.0, 1e-7 * step
            while change > LARGEST_CHANGE * size and step > least:
                sides = [
                    problem.term_rows(term.with_shape(**{shape.name: v}))
                    for v in (here + step, here - step)
                ]
                apart = {j: (sides[0][j] - sides[1][j]) @ whole[own] for j in sides[0]}
                both = {j: (sides[0][j] + sides[1][j]) @ whole[own] for j in sides[0]}
                change, size = (_norm(torque) for torque in (apart, both))
                width, step = 2 * step / (here if log else 1.0), step / SMALLER
            slopes.append({j: torque[:, None] / width for j, torque in apart.items()})
            owners.append((i, shape.name, log))
            spread.append(_spacing(shape))
    return slopes, owners, spread


def _along(term: Term, coefficients: Array, change: Array) -> dict[str, float]:
    """Lengths and angles of pairs of coefficients after a change, to first order.

    A length is always positive and an angle jumps at half a turn, so that their values at changed
    coefficients are no basis for an interval: a mere turn by the uncertain number of waves, for
    example, would make the amplitude larger.
    """
    here = term.parameters(coefficients)
    ends = [term.parameters(coefficients + side * STEP * change) for side in (1, -1)]
    names = [name for name in here if name not in term.shape]
    return {name: here[name] + (ends[0][name] - ends[1][name]) / (2 * STEP) for name in names}


def _not_negative(interval: Any) -> Any:
    """The interval of a length, which begins at zero if the length may be zero."""
    if not isinstance(interval, tuple):
        return interval
    value, low, high = interval
    return (value, max(low, 0.0), high)


def _norm(torque: dict[int, Array]) -> float:
    return float(np.sqrt(sum(np.sum(own**2) for own in torque.values())))


def _spacing(shape: Shape) -> float:
    """Largest step between neighbours of the grid; of its logarithm if steps are factors."""
    log = shape.spacing == "log"
    grid = np.sort(np.log(shape.grid) if log else np.array(shape.grid, dtype=float))
    if len(grid) < 2:  # only its range is known
        low, high = (np.log(shape.low), np.log(shape.high)) if log else (shape.low, shape.high)
        return float(high - low) / 2
    return float(np.diff(grid).max())


def _half_width(replicates: Array) -> Array:
    """Half the width of the interval of each column of values with one fold left out."""
    quantile = student_t.ppf(0.5 + CONFIDENCE / 2, len(replicates) - 1)
    return np.asarray(quantile * jackknife(replicates))


def _interval(value: Any, replicates: Sequence[Any], not_zero: bool) -> Any:
    """Value with its interval: symmetric for the value, or for its logarithm.

    An uncertain shape, such as the exponent of a power, may make the size uncertain although it is
    not zero with any single shape. Then the interval is that of its logarithm.
    """
    if not isinstance(value, float | int) or isinstance(value, bool):
        return value
    half = float(_half_width(np.array(replicates, dtype=float)))
    if half <= 1e-9 * abs(value):
        return value  # was not estimated
    if not_zero and half >= abs(value):
        factor = float(np.exp(min(half / abs(value), LARGEST_LOG)))
        low, high = sorted((value / factor, value * factor))
        return (float(value), low, high)
    return (float(value), float(value) - half, float(value) + half)
