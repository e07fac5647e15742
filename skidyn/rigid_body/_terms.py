# SPDX-License-Identifier: BSD-3-Clause
"""Effects of a model whose shape parameters or columns are known only after a fit."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from skidyn.effects import Term, get_effect
from skidyn.evidence._problem import Fit, Problem
from skidyn.evidence._shapes import Gain, best_on_grid, refine_term

#: Rounds of weights, loads and shape parameters.
ROUNDS = 3


def find_terms(problem: Problem) -> Fit:
    """Weights, loads and shape parameters in turn, from simple to whole."""
    given = list(problem.terms)
    early = [t for t in given if not needs_model(t) and not to_search(t)]
    fit = problem.fit(early, passes=2)
    terms = early
    for round_ in range(ROUNDS):
        problem.with_fit(fit)
        terms = _shaped(problem, given if round_ == 0 else terms, fit)
        fit = problem.fit(terms, sigma=fit.noise, passes=2)
        if not any(needs_model(t) or get_effect(t.kind).shapes for t in terms):
            break
    return fit


def _shaped(problem: Problem, terms: Sequence[Term], fit: Fit) -> list[Term]:
    """Terms with the shape parameters that were left open found and refined."""
    shaped = list(terms)
    open_ = [i for i, t in enumerate(terms) if t in fit.terms or not to_search(t)]
    for i, term in enumerate(terms):
        if not to_search(term):
            continue
        others = [problem.term_rows(shaped[k]) for k in open_ if k != i]
        gain = Gain(problem, others, fit.noise, problem.target)
        start = best_on_grid(problem, term.kind, term.joints, gain)
        shaped[i] = refine_term(problem, start, gain)
        open_.append(i)
    return shaped


def needs_model(term: Term) -> bool:
    """Whether the columns of a term see the torque of the fitted model."""
    return bool({"load", "model_torque"} & set(get_effect(term.kind).needs))


def to_search(term: Term) -> bool:
    """Whether shape parameters of a term were left open."""
    effect = get_effect(term.kind)
    if effect.search != "grid" or term.shape:
        return False
    return bool(effect.shapes) or type(effect).grid is not _plain_grid()


def is_linear(term: Term) -> bool:
    """Whether the columns of a term are known before any fit."""
    shapes = get_effect(term.kind).shapes
    return not (needs_model(term) or to_search(term) or (shapes and not term.shape))


def _plain_grid() -> Any:
    from skidyn.effects import Effect

    return Effect.grid
