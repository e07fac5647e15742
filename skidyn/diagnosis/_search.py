# SPDX-License-Identifier: BSD-3-Clause
"""Search for missing effects: add the best kind, refit, repeat until none is significant."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np

from skidyn.diagnosis._candidates import Candidate
from skidyn.diagnosis._hypothesis import UNKNOWN, Hypothesis, SearchResult
from skidyn.diagnosis._reconsideration import ReconsideringSearch
from skidyn.diagnosis._rule import Settings
from skidyn.effects import Term
from skidyn.evidence import Problem


def search(
    problem: Problem,
    kinds: Sequence[str],
    settings: Settings,
    *,
    nameless: bool = True,
    vibration: bool = True,
    among: Callable[[Candidate], bool] | None = None,
    earlier: Sequence[Hypothesis] = (),
    given: Iterable[Term] = (),
) -> SearchResult:
    """Fit the model, and find the missing effects.

    Parameters
    ----------
    problem : Problem
        Rows, folds and the user's model.
    kinds : sequence of str
        Kinds of the catalogue to try.
    settings : Settings
        Thresholds.
    nameless : bool, default=True
        Whether unknown functions of the signals are candidates.
    vibration : bool, default=True
        Whether a wave in time is one of them.
    among : callable, optional
        Whether a candidate of the catalogue is tried; all, and functions of signals, by default.
    earlier : sequence of Hypothesis, optional
        Findings of another search, whose terms are in the model: what removes little of what they
        removed may be an error of their formulas.
    given : iterable of Term, optional
        Effects of the user's model, for which the same holds if their formulas are not exact.
    """
    searcher = _Search(problem, kinds, settings, nameless)
    searcher.vibration &= vibration
    if among is not None:
        searcher.pool = list(filter(among, searcher.pool))
        searcher.nameless = False
    searcher.earlier = [*_as_found(problem, given), *earlier]
    return searcher.run()


def _as_found(problem: Problem, terms: Iterable[Term]) -> list[Hypothesis]:
    """Effects of the given model with imperfect formulas, as findings of an earlier search."""
    found = []
    for term in terms:
        if not term.effect.is_exact:
            kind = UNKNOWN if term.effect.nameless else term.kind
            candidate = Candidate(kind, term, problem.term_rows(term))
            gain = np.zeros(problem.n_joints)
            found.append(Hypothesis(kind, (candidate,), gain, 0.0, term.width))
    return found


class _Search(ReconsideringSearch):
    """The loop: rank, accept, add, withdraw, reconsider."""

    def run(self) -> SearchResult:
        """Add one finding after the other."""
        self.start = self.left_without(self.earlier)
        for _ in range(self.settings.max_findings):
            self.sigma = self.weights()
            self.left = self._left()
            self.start = np.maximum(self.start, self.left)
            if self.findings:
                self.follow_fit()
                self.follow_again()
            best = self.accepted(self.rank())
            if best is None:
                break
            self.add(best)
            best = self.withdraw(best) or best
            self.refit()
            self.reconsider(self._settled(best))
        self.sigma = self.weights()
        self.withdraw()
        self.name_alike()
        # Unknown functions have no limits, and their columns take much memory.
        named = [c for c in self.pool if not c.term.effect.nameless]
        found = [c.term for h in self.findings for c in h.candidates]
        self.problem.keep([*self.problem.terms, *found, *(c.term for c in named)])
        return SearchResult(self.findings, self.fit, self.ripple, named, self.n_tests)
