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
    of_one_family,
    on_pairs,
    on_single_joints,
    ranked_with,
    rivals_among,
)
from skidyn.diagnosis._rule import COMPARABLE, NEARLY
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

    def name_alike(self) -> None:
        """Use the kind of another joint if it explains nearly as much.

        Joints of one robot have the same design: an effect of one of them is more likely on another
        than a different effect that looks like it. If either kind is possible for both, the one
        that explains more is used for both. Members of a family differ in the formula only: one is
        used for all joints on which together it explains nearly as much.
        """
        for old in list(self.findings):
            if old.kind == UNKNOWN or get_effect(old.kind).is_exact:
                continue  # an exact formula that explains equally much is right
            for other in list(self.findings):
                if old is other or not all(map(on_single_joints, (old, other))):
                    continue
                same = self._in_kind_of(old, other)
                if same is None:
                    continue
                place = self.findings.index(old)
                self.chosen = [c for c in self.chosen if c not in old.candidates]
                judged = self.judged(same)
                if judged is None or judged.joints != old.joints:
                    self.chosen += old.candidates
                    continue
                # members of a family are no rivals
                further = max(0.0, 1 - old.score / same.score)
                margin = old.margin if of_one_family(old, same) else further
                new = ranked_with(replace(judged, margin=margin), [old, *old.others])
                self.chosen += new.candidates
                self.findings[place] = new
                self.refit()
                self.sigma = self.weights()
                break

    def _in_kind_of(self, old: Hypothesis, other: Hypothesis) -> Hypothesis | None:
        """A finding in the kind of another one on other joints, if it should have this kind."""
        if set(old.joints) & set(other.joints) or old.kind == other.kind:
            return None
        same, reverse = self._also(old, other), self._also(other, old)
        if same is None:
            return None
        related = of_one_family(old, other)
        if not related and not all(self.same_design(c, other.candidates) for c in old.candidates):
            return None
        if reverse is None:
            return same
        in_own, in_other = old.score, other.score
        if related:
            in_own, in_other = old.score + reverse.score, other.score + same.score
        return None if in_own > in_other else same

    def _also(self, finding: Hypothesis, other: Hypothesis) -> Hypothesis | None:
        """The kind of another finding on the joints of one, if it explains nearly as much.

        Members of a family differ little, and are rivals of each other in any case: all their
        joints together count.
        """
        kind = other.kind
        alike = of_one_family(finding, other)
        share = NEARLY if alike else 1 - self.settings.simpler_share
        given = other.score if alike else 0.0

        def of_kind(own: Hypothesis) -> list[Hypothesis]:
            return [h for h in own.others if h.kind == kind and h.joints == own.joints]

        def enough(score: float, own: float) -> bool:
            return score + given >= share * (own + given)

        # a term that was found together with those of other joints was compared alone
        same = [own for own in finding.alone if own.joints == finding.joints]
        near = [h for own in (finding, *same) for h in of_kind(own) if enough(h.score, own.score)]
        if near or len(finding.joints) == 1:
            return max(near, key=lambda h: h.score, default=None)
        each = [max(of_kind(own), key=lambda h: h.score, default=None) for own in finding.alone]
        parts = [h for h in each if h is not None]
        score = sum(h.score for h in parts)
        whole = {j for h in parts for j in h.joints} == set(finding.joints)
        if not whole or not enough(score, sum(own.score for own in finding.alone)):
            return None
        return replace(
            parts[0],
            candidates=tuple(c for h in parts for c in h.candidates),
            gain=np.sum([h.gain for h in parts], axis=0),
            score=score,
            n_parameters=sum(h.n_parameters for h in parts),
            errors=None,
        )
