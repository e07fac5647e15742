# SPDX-License-Identifier: BSD-3-Clause
"""An effect on several joints, compared with other effects on each of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace

import numpy as np

from skidyn.diagnosis._acceptance import JudgingSearch
from skidyn.diagnosis._candidates import Candidate
from skidyn.diagnosis._confidence import SEPARATES
from skidyn.diagnosis._hypothesis import (
    UNKNOWN,
    Hypothesis,
    margin_over,
    on_pairs,
    on_single_joints,
    ranked_with,
    rivals_among,
)
from skidyn.diagnosis._rule import COMPARABLE
from skidyn.effects import get_effect


class DuellingSearch(JudgingSearch):
    """A search that compares effects by joint."""

    def on_each_joint(self, best: Hypothesis) -> Hypothesis:
        """An effect on several joints, without those on which another effect is preferred.

        One effect on all joints explains more than another one on each, so that it may also be
        chosen for a joint on which it only resembles the right one. There, the rule for the choice
        is applied to this joint alone. Joints of one robot have the same design: another effect
        must explain more than the common one. A coupling of several pairs is compared with effects
        of the single joints of each pair, which it resembles if its ratio is large.

        Parameters
        ----------
        best : Hypothesis
            Known effect that was judged.

        Returns
        -------
        Hypothesis
            The effect on at least one of its joints, with what its terms were compared with.
        """
        apart = on_single_joints(best)
        if len(best.candidates) < 2 or not (apart or on_pairs(best)):
            return best
        kept, alone, lost = [], [], []
        for candidate in best.candidates:
            with self._beside_the_others(best, candidate):
                ranking = self._rivals_alone(best.kind, candidate)
                other = self.pick(ranking)
            own = next((h for h in ranking if h.kind == best.kind), None)
            if own is None or other is None:
                kept.append(candidate)
                continue
            margin = margin_over(own, rivals_among(own, ranking))
            compared = ranked_with(replace(own, margin=margin), ranking)
            alike = apart and self.same_design(candidate, best.candidates)
            if other.kind == best.kind or (alike and not self._explains_more(other, own)):
                kept.append(candidate)
                alone.append(compared)
            else:
                lost.append(compared)
        if not kept:
            return replace(best, alone=tuple(lost))
        if lost:
            best = self._of_terms(best, kept)
        return replace(best, alone=tuple(alone))

    def same_design(self, candidate: Candidate, others: Sequence[Candidate]) -> bool:
        """Whether some of the others acts on another joint of the same type, as it turns or slides.

        Parameters
        ----------
        candidate : Candidate
            Term of a joint.
        others : sequence of Candidate
            Terms of joints.
        """
        slides = self.problem.signals.prismatic
        (own,) = {bool(slides[j]) for j in candidate.joints}
        return any(slides[j] == own for c in others for j in set(c.joints) - set(candidate.joints))

    def _explains_more(self, other: Hypothesis, own: Hypothesis) -> bool:
        """Whether another effect on a joint is better than one that is found on others, too."""
        if get_effect(other.kind).is_exact:
            more = float((other.gain - own.gain).sum())
            return more > SEPARATES * self._price(other.candidates)
        return (1 - self.settings.simpler_share) * other.score > own.score

    def _of_terms(self, best: Hypothesis, kept: Sequence[Candidate]) -> Hypothesis:
        """Some terms of an explanation, with their own score."""
        pairs = zip(best.candidates, best.chances, strict=True)
        chances = tuple(chance for c, chance in pairs if c in kept)
        best = replace(best, candidates=tuple(kept), chances=chances)
        for found in self._finals([list(kept)], refined=0):
            best = replace(
                best,
                gain=found.gain,
                score=found.score,
                n_parameters=found.n_parameters,
                errors=found.errors,
            )
        return best

    @contextmanager
    def _beside_the_others(self, best: Hypothesis, candidate: Candidate) -> Iterator[None]:
        """The present model with the other terms of an explanation."""
        chosen = self.chosen
        self.chosen = [*chosen, *(c for c in best.candidates if c is not candidate)]
        try:
            yield
        finally:
            self.chosen = chosen

    def _rivals_alone(self, kind: str, candidate: Candidate) -> list[Hypothesis]:
        """A term and other known effects on its joints, best first; empty without others."""
        joints = set(candidate.joints)
        found = self.strongest(
            lambda c: (c.kind, c.joints),
            lambda c: joints.issuperset(c.joints) and c.kind != UNKNOWN,
        )
        drops = {id(c): drop for c, drop in zip(self.ranked, self.drops, strict=True)}
        own = found.pop((kind, candidate.joints), None)
        least = np.inf if own is None else COMPARABLE * drops[id(own)]
        near = [c for c in found.values() if drops[id(c)] > least]
        near = sorted(near, key=lambda c: -drops[id(c)])[: self.settings.refined]
        if not near:
            return []
        ranking = self._finals([[c] for c in (candidate, *near)], refined=len(near) + 1)
        return sorted(ranking, key=lambda h: -h.score)
