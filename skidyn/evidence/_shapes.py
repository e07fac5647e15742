# SPDX-License-Identifier: BSD-3-Clause
"""Shape parameters: search from the grid for the values that explain most, with refitting."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from skidyn._signals import Array
from skidyn.effects import Shape, Term, get_effect, starts
from skidyn.evidence._folds import RIDGE, Normal, column_sizes
from skidyn.evidence._problem import Problem

#: First step of a refinement (a factor 1.5, or a share of the travel), its shrinkage and rounds.
FIRST_STEP, SHRINK, ROUNDS = 0.5, 2.2, 7
#: Growth of the step from the second one in the same direction on, and most steps in all.
GROWTH, MOST_MOVES = 1.5, 30
FIRST_SHARE = 0.06
#: Trials of a simplex for each parameter at most, and its size in first steps when it stops.
MOST_TRIALS, CLOSE = 40, 0.01
#: Share of the recordings, and of the samples of one, that is the first step of a moment.
COARSE = 8
#: Squared error, in units of the noise, that a term must remove; less does not determine values.
LEAST_FURTHER = 4.0


class Gain:
    """Drop of squared error by a block of columns, given the model's columns.

    Parameters
    ----------
    problem : Problem
        Rows.
    blocks : sequence of dict
        Columns of the model beside the rigid body.
    sigma : ndarray of shape (n_joints,)
        Noise of one row.
    target : sequence of ndarray
        Averaged torque.
    """

    def __init__(
        self,
        problem: Problem,
        blocks: Sequence[dict[int, Array]],
        sigma: Array,
        target: Sequence[Array],
    ) -> None:
        self.sigma = sigma
        self.design = [a / s for a, s in zip(problem.design(blocks), sigma, strict=True)]
        y = [t / s for t, s in zip(target, sigma, strict=True)]
        gram = np.asarray(sum(a.T @ a for a in self.design))
        right = np.asarray(sum(a.T @ t for a, t in zip(self.design, y, strict=True)))
        self.model = Normal(gram, right, column_sizes(gram))
        self.residual = [t - a @ self.model.solution for a, t in zip(self.design, y, strict=True)]

    @classmethod
    def beside(
        cls,
        problem: Problem,
        blocks: Sequence[dict[int, Array]],
        sigma: Array,
        target: Sequence[Array],
    ) -> Gain:
        """The gain function of a model; a search asks for the same one with many candidates."""
        made_of = [sigma, *problem.rigid_rows, *target, *(b[j] for b in blocks for j in b)]
        gain: Gain = problem.last.get("gain", made_of, lambda: cls(problem, blocks, sigma, target))
        return gain

    def __call__(self, rows: dict[int, Array], lowest: Array) -> float:
        """Drop of squared error in units of the noise; -inf where a coefficient is too small."""
        z = {j: block / self.sigma[j] for j, block in rows.items()}
        cross = np.asarray(sum(self.design[j].T @ block for j, block in z.items()))
        own = np.asarray(sum(block.T @ block for block in z.values()))
        swept = own - cross.T @ self.model.solve(cross)
        slope = sum(block.T @ self.residual[j] for j, block in z.items())
        swept.flat[:: len(own) + 1] += RIDGE * own.trace() + np.finfo(float).tiny
        coefficients = np.linalg.solve(swept, slope)
        if np.any(coefficients < lowest):
            return -np.inf
        return float(slope @ coefficients)


def best_on_grid(problem: Problem, kind: str, joints: tuple[int, ...], gain: Gain) -> Term:
    """The term of a kind whose grid shape explains most."""
    grid = get_effect(kind).grid(problem.signals, joints)
    terms = [Term.at(kind, joints, shape) for shape in grid]
    gains = [gain(problem.term_rows(t), t.lowest) for t in terms]
    return terms[int(np.argmax(gains))] if terms else Term.at(kind, joints)


def refine_term(problem: Problem, term: Term, gain: Gain) -> Term:
    """Search along one shape parameter after another with decreasing steps.

    Parameters with similar effects lie in a narrow valley, along which a simplex search continues
    (Nelder, Mead 1965, The Computer Journal 7(4)).

    Parameters
    ----------
    problem : Problem
        Rows.
    term : Term
        Term to start from.
    gain : Gain
        Gain function of the model without this term.
    """
    effect = term.effect
    shapes = [s for s in effect.shapes if s.name in term.shape]
    if not shapes or effect.search != "grid":
        return term
    ranges = [_range(problem, term, shape) for shape in shapes]
    other = {name: x for name, x in term.shape.items() if name not in {s.name for s in shapes}}

    def with_values(values: Sequence[float]) -> Term:
        return term.with_shape(**other, **{s.name: v for s, v in zip(shapes, values, strict=True)})

    def gain_of(values: Sequence[float]) -> float:
        if not all(low <= v <= high for v, (low, high, _) in zip(values, ranges, strict=True)):
            return -np.inf
        trial = with_values(values)
        if not effect.admissible(problem.signals, term.places, trial.shape):
            return -np.inf
        return gain(problem.term_rows(trial), trial.lowest)

    values = [float(term.shape[s.name]) for s in shapes]
    best = gain(problem.term_rows(term), term.lowest)
    for i, (shape, (_, _, step)) in enumerate(zip(shapes, ranges, strict=True)):
        if shape.spacing == "samples":
            sides = values[:i], values[i + 1 :]

            def gain_since(moment: float, sides: tuple[Any, Any] = sides) -> float:
                return gain_of([*sides[0], moment, *sides[1]])

            values[i], best = _moment(problem, values[i], best, gain_since)
            continue
        came, rounds = 0, 0
        for _ in range(MOST_MOVES):
            improved, before = False, came
            for way in (1, -1):
                if way == -came:
                    continue  # back to a value that explains less
                here = values[i]
                there = here * (1 + step) ** way if shape.spacing == "log" else here + way * step
                trial = [*values[:i], float(there), *values[i + 1 :]]
                if (value := gain_of(trial)) > best:
                    best, values, improved, came = value, trial, True, way
            if not improved:
                step, came = step / SHRINK, 0
            if improved and came == before:
                step *= GROWTH  # far from the best value, which the first steps would not reach
                continue
            rounds += 1
            if rounds == ROUNDS:
                break
    if len(shapes) == 1 or not np.isfinite(best):
        return with_values(values)
    further = _by_simplex(shapes, ranges, values, gain_of)
    return with_values(further if gain_of(further) > best + LEAST_FURTHER else values)


def _moment(
    problem: Problem, here: float, gain: float, gain_since: Callable[[float], float]
) -> tuple[float, float]:
    """The moment from which a term explains most, and its gain.

    It is the start of a recording, unless a moment within one explains more.
    """
    begun = starts(problem.signals)
    if len(begun):
        near = float(begun[np.abs(begun - here).argmin()])
        first = _climbed(begun, near, gain_since(near), len(begun) // COARSE, gain_since)
        here, gain = first if first[1] > gain - LEAST_FURTHER else (here, gain)
    order = np.sort(problem.signals.clock)
    step = len(order) // (COARSE * (len(begun) + 1))
    within, more = _climbed(order, here, gain, step, gain_since)
    return (within, more) if more > gain + LEAST_FURTHER else (here, gain)


def _climbed(
    values: Array, here: float, gain: float, step: int, gain_of: Callable[[float], float]
) -> tuple[float, float]:
    """The best of sorted values, found from one of them with decreasing steps."""
    place, step = int(np.searchsorted(values, here)), max(1, step)
    while step >= 1:
        for there in (place + step, place - step):
            if 0 <= there < len(values) and (more := gain_of(float(values[there]))) > gain:
                place, gain = there, more
                break
        else:
            step //= 2
    return float(values[min(place, len(values) - 1)]), gain


def _by_simplex(
    shapes: Sequence[Shape],
    ranges: Sequence[tuple[float, float, float]],
    values: Sequence[float],
    gain_of: Callable[[Sequence[float]], float],
) -> list[float]:
    """Values that no simplex search improves; its first steps are smaller than the search's."""

    def at(steps: Array) -> list[float]:
        moved = zip(shapes, ranges, values, steps.tolist(), strict=True)
        return [
            v * (1 + step) ** x if shape.spacing == "log" else v + x * step
            for shape, (_, _, step), v, x in moved
        ]

    from scipy.optimize import minimize  # slow to import, and not needed to check a log

    first = np.vstack([np.zeros(len(shapes)), np.eye(len(shapes)) / SHRINK])
    found = minimize(
        lambda steps: -gain_of(at(steps)),
        first[0],
        method="Nelder-Mead",
        options={
            "initial_simplex": first,
            "maxfev": MOST_TRIALS * len(shapes),
            "xatol": CLOSE,
            "fatol": np.inf,
        },
    )
    return at(found.x)


def _range(problem: Problem, term: Term, shape: Shape) -> tuple[float, float, float]:
    """Lowest and highest value of a shape parameter and the first step."""
    step = FIRST_STEP
    if shape.spacing == "linear":
        step = FIRST_SHARE * term.effect.travel(problem.signals, term.places, term.shape)
    return *shape.range_on(problem.signals, term.places[0]), step
