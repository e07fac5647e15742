# SPDX-License-Identifier: BSD-3-Clause
"""Explanations by effects that differ between the recordings."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from scipy.linalg import null_space

from skidyn._signals import Array
from skidyn.diagnosis._candidates import Candidate, rows_together
from skidyn.diagnosis._hypothesis import UNKNOWN, grouped_by_joints, some_recordings
from skidyn.diagnosis._recordings import DRIFT, FRICTION, choose, drifting, every_recording
from skidyn.diagnosis._rule import ALL_LEFT, SURE_SIGN, SURE_SIGN_SHARE
from skidyn.diagnosis._search_state import SearchState
from skidyn.diagnosis._tester import Tester


class RecordingSearch(SearchState):
    """A search that compares recordings."""

    def by_kind_of_recording(self) -> list[Callable[[], list[list[Candidate]]]]:
        """Changes between recordings for each kind."""
        open_to = list(filter(self.looked.may_find("recordings"), self.by_recording))

        def look(kind: str) -> list[list[Candidate]]:
            pool = [c for c in open_to if c.kind == kind]
            chosen = choose(pool, lambda more: self.tester([*self.chosen, *more]), self.significant)
            chosen = [
                c
                for c in chosen
                if self.can_be(c, [*self.chosen, *(o for o in chosen if o is not c)])
            ]
            return self._same_or_own(chosen) if chosen else []

        known = {c.kind for c in self.chosen if some_recordings(c)}
        known |= set(FRICTION) if DRIFT in known else set()
        kinds = dict.fromkeys(c.kind for c in open_to)
        return [partial(look, kind) for kind in kinds if kind not in known]

    def can_be(self, candidate: Candidate, others: Sequence[Candidate]) -> bool:
        """Whether a candidate's coefficients, together with others, are physically possible."""
        tester, few, term = self.tester(others), self.problem.few, candidate.term
        size = tester.test(candidate.rows).coefficients
        if not candidate.can_have(size, few):
            return False
        weights = term.effect.positive(few, term.places, term.shape)
        return weights is None or not (
            weights @ size < 0 and self._is_sure(weights, candidate, tester)
        )

    def _is_sure(self, weights: Array, candidate: Candidate, tester: Tester) -> bool:
        """Whether a sum of a candidate's coefficients is not zero, by what is lost where it is.

        In units of the noise that is left with the candidate: most of that without it may be the
        torque of the candidate.
        """
        zero = null_space(weights[None] / np.linalg.norm(weights))
        bound = {j: block @ zero for j, block in candidate.rows.items()}
        removed = tester.estimate(candidate.rows)[1]
        lost = removed - tester.estimate(bound)[1]
        reached = list(candidate.rows)
        error = float(np.sum(self.left[reached] / self.sigma[reached] ** 2))
        error -= 0.0 if candidate in self.chosen else min(removed, error)
        noise = min(1.0, error / max(1.0, float(self._counts[reached].sum())))
        least = max(SURE_SIGN * noise * self._price([candidate]), SURE_SIGN_SHARE * removed)
        return bool(lost >= least)

    def _same_or_own(self, chosen: Sequence[Candidate]) -> list[list[Candidate]]:
        """Effects of few recordings as known effects, those of many recordings as unknown.

        Separate sizes in many recordings can be due to any missing slow torque, unless the
        remainder of the joint is white, or they explain nearly all that is missing on it.
        """
        most, white = self.settings.most_recordings, self.settings.white
        few, drift, many = [], [], []
        for part in grouped_by_joints(chosen):
            named = len(part) <= most or self._price(part) <= white or self._leaves_little(part)
            changes = drifting(self.problem, self.kinds, part, self.terms) if named else []
            drift += changes
            few += part if named and not changes else []
            many += [] if named else part
        many = [replace(c, kind=UNKNOWN, variables=("trajectory",)) for c in many]
        return [part for part in (few, drift, many) if part]

    def _leaves_little(self, part: Sequence[Candidate]) -> bool:
        """Whether effects that vary within recordings remove nearly all the error."""
        if part[0].kind == "offset":
            return False
        tester, joints = self.tester(self.chosen), {j for c in part for j in c.joints}
        left = tester.beside([c.rows for c in part]).residual
        had, has = (sum(float(r[j] @ r[j]) for j in joints) for r in (tester.residual, left))
        return has < (1 - ALL_LEFT) * had

    def in_every_recording(self) -> list[list[Candidate]]:
        """Effects of the whole robot with other sizes in the recordings, those of significance."""
        known, tester = {c.kind for c in self.chosen}, self.tester(self.chosen)
        kinds = [kind for kind in self.kinds if kind not in known]
        counts, found = self.problem.rows.counts, []
        for own in every_recording(self.problem, kinds):
            together, _ = tester.test_each(rows_together(own, counts), self.significant)
            if self.significant(together.chance):
                found.append(self._joined(own))
        return [own for own in found if len(own) > 1]

    def with_own_sizes(self, candidate: Candidate) -> list[Candidate]:
        """Effects of some recordings, with a common size for those that do not differ."""
        return self._joined([self._of(candidate, (k,)) for k in candidate.term.trajectories or ()])

    def _of(self, candidate: Candidate, recordings: tuple[int, ...]) -> Candidate:
        term = candidate.term.with_shape(trajectories=recordings)
        return replace(candidate, term=term, rows=self.problem.term_rows(term))

    def _joined(self, own: list[Candidate]) -> list[Candidate]:
        """Effects of recordings, of which those that do not differ have a common size.

        One by one, the two groups of recordings whose sizes differ least are joined, as long as the
        penalty for separate sizes exceeds what these explain.
        """
        while len(own) > 1:
            tester = self.tester([*self.chosen, *own])
            gain, i, j = tester.least_difference(len(own), own[0].width)
            if gain > 2 * self._price(own) * own[0].width:
                break
            first, second = (own[k].term.trajectories or () for k in (i, j))
            both = self._of(own[i], tuple(sorted(first + second)))
            rest = [c for k, c in enumerate(own) if k not in (i, j)]
            own = sorted([*rest, both], key=lambda c: c.term.trajectories or ())
        return own
