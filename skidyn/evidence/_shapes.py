# SPDX-License-Identifier: BSD-3-Clause
"""Shape parameters: a walk from the grid to the values that explain most, the model refitted."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from skidyn._signals import Array
from skidyn.effects import Shape, Term, get_effect
from skidyn.evidence._folds import RIDGE, Normal, column_sizes
from skidyn.evidence._problem import Problem

#: First step of a refinement (a factor 1.5, or a share of the travel), its shrinkage and rounds.
FIRST_STEP, SHRINK, ROUNDS = 0.5, 2.2, 7
FIRST_SHARE = 0.06


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

    def __call__(self, rows: dict[int, Array], lowest: Array) -> float:
        """Drop of squared error in units of the noise; -inf where a coefficient is too small."""
        z = {j: block / self.sigma[j] for j, block in rows.items()}
        cross = np.asarray(sum(self.design[j].T @ block for j, block in z.items()))
        own = np.asarray(sum(block.T @ block for block in z.values()))
        swept = own - cross.T @ self.model.solve(cross)
        slope = sum(block.T @ self.residual[j] for j, block in z.items())
        swept = swept + (RIDGE * np.trace(own) + np.finfo(float).tiny) * np.eye(len(own))
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
    """Walk along one shape parameter after the other with shrinking steps.

    Parameters
    ----------
    problem : Problem
        Rows.
    term : Term
        Where to start.
    gain : Gain
        Of the model without this term.
    """
    effect = term.effect
    shapes = [s for s in effect.shapes if s.name in term.shape]
    if not shapes or effect.search != "grid":
        return term
    values: dict[str, Any] = dict(term.shape)
    best = gain(problem.term_rows(term), term.lowest)
    # The first parameters are visited again after the last has moved.
    for shape in [*shapes, *shapes[: len(shapes) - 1]]:
        low, high, step = _range(problem, term, shape)
        for _ in range(ROUNDS):
            improved = False
            for way in (1, -1):
                here = values[shape.name]
                there = here * (1 + step) ** way if shape.spacing == "log" else here + way * step
                if not low <= there <= high:
                    continue
                trial = {**values, shape.name: float(there)}
                if not effect.admissible(problem.signals, term.places, trial):
                    continue
                other = term.with_shape(**trial)
                value = gain(problem.term_rows(other), other.lowest)
                if value > best:
                    best, values, improved = value, trial, True
            if not improved:
                step /= SHRINK
    return term.with_shape(**values)


def _range(problem: Problem, term: Term, shape: Shape) -> tuple[float, float, float]:
    """Lowest and highest value of a shape parameter and the first step."""
    unit = float(problem.signals.unit[term.places[0]]) if shape.scales else 1.0
    step = FIRST_STEP
    if shape.spacing == "linear":
        step = FIRST_SHARE * term.effect.travel(problem.signals, term.places, term.shape)
    return shape.low * unit, shape.high * unit, step
