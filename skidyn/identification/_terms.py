# SPDX-License-Identifier: BSD-3-Clause
"""Effects of a model whose shape parameters or columns are known only after a fit."""

from __future__ import annotations

from collections.abc import Sequence

from skidyn.effects import Term
from skidyn.evidence import Fit, Gain, Problem, best_on_grid, refine_term

#: Rounds of weights, loads and shape parameters.
ROUNDS = 3


def find_terms(problem: Problem) -> Fit:
    """Weights, loads and shape parameters in turn, from simple models to the full one."""
    given = list(problem.terms)
    early = [t for t in given if not t.effect.needs_fit and not to_search(t)]
    fit = problem.fit(early, passes=2)
    terms = early
    for round_ in range(ROUNDS):
        problem.set_fit(fit)
        terms = _shaped(problem, given if round_ == 0 else terms, fit)
        fit = problem.fit(terms, sigma=fit.noise, passes=2)
        if not any(t.effect.needs_fit or t.effect.shapes for t in terms):
            break
    return fit


def _shaped(problem: Problem, terms: Sequence[Term], fit: Fit) -> list[Term]:
    """Terms with their open shape parameters found and refined."""
    shaped = list(terms)
    open_ = [i for i, t in enumerate(terms) if t in fit.terms or not to_search(t)]
    for i, term in enumerate(terms):
        if not to_search(term):
            continue
        others = [problem.term_rows(shaped[k]) for k in open_ if k != i]
        gain = Gain(problem, others, fit.noise, problem.target)
        start = best_on_grid(problem, term.kind, term.places, gain)
        shaped[i] = refine_term(problem, start, gain)
        open_.append(i)
    return shaped


def to_search(term: Term) -> bool:
    """Whether a term has open shape parameters that are found on a grid."""
    return term.is_open and term.effect.search == "grid"
