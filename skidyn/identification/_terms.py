# SPDX-License-Identifier: BSD-3-Clause
"""Effects of a model whose shape parameters or columns are known only after a fit."""

from __future__ import annotations

from collections.abc import Sequence

from skidyn.effects import Term
from skidyn.evidence import Fit, Gain, Problem, best_on_grid, refine_term

#: Rounds of weights, loads and shape parameters, and with effects of the motor's torque, which
#: contains them: each round leaves the share of the torque that is friction of the load.
ROUNDS, ROUNDS_OF_MOTOR = 3, 12


def find_terms(problem: Problem) -> Fit:
    """Weights, loads and shape parameters in turn, from simple models to the full one."""
    given = list(problem.terms)
    early = [t for t in given if not t.effect.needs_fit and not to_search(t)]
    fit = problem.fit(early, passes=2)
    searched = [t for t in given if t.effect.sees_motor and to_search(t)]
    terms = early
    of_motor = any(t.effect.sees_motor for t in given)
    for round_ in range(ROUNDS_OF_MOTOR if of_motor else ROUNDS):
        problem.set_fit(fit)
        again = [t for t, own in zip(terms, given, strict=False) if round_ and own in searched]
        terms = _shaped(problem, given if round_ == 0 else terms, fit, again)
        fit = problem.fit(terms, sigma=fit.noise, passes=2)
        if not any(t.effect.needs_fit or t.effect.shapes for t in terms):
            break
    return fit


def _shaped(
    problem: Problem, terms: Sequence[Term], fit: Fit, again: Sequence[Term] = ()
) -> list[Term]:
    """Terms with their open shape parameters found and refined, those of some once more."""
    shaped = list(terms)
    open_ = [i for i, t in enumerate(terms) if t in fit.terms or not to_search(t)]
    for i, term in enumerate(terms):
        if not to_search(term) and term not in again:
            continue
        others = [problem.term_rows(shaped[k]) for k in open_ if k != i]
        gain = Gain(problem, others, fit.noise, problem.target)
        known = term in again
        start = term if known else best_on_grid(problem, term.kind, term.places, gain)
        shaped[i] = refine_term(problem, start, gain)
        if not known:
            open_.append(i)
    return shaped


def to_search(term: Term) -> bool:
    """Whether a term has open shape parameters that are found on a grid."""
    return term.is_open and term.effect.search == "grid"
