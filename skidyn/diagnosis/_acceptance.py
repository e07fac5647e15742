# SPDX-License-Identifier: BSD-3-Clause
"""Which explanation of a ranking is taken, and whether the rule accepts it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from skidyn._signals import Array
from skidyn.diagnosis._candidates import Candidate, rows_together
from skidyn.diagnosis._hypothesis import (
    UNKNOWN,
    Hypothesis,
    family_of,
    grouped_by_joints,
    simplicity_of,
    within_recordings,
)
from skidyn.diagnosis._ranking import RankingSearch
from skidyn.effects import NamelessEffect, get_effect


class JudgingSearch(RankingSearch):
    """A search that picks and judges explanations."""

    def pick(self, ranking: list[Hypothesis]) -> Hypothesis | None:
        """The best explanation, or a simpler one that is as good.

        It is where it falls behind by no more than the standard error and a small share of the
        score; beside a further form, by whatever the error is if that form says nothing more.
        """
        if not ranking:
            return None
        best = self._named(ranking)
        for rival in ranking[1:]:
            if best.errors is None or rival.errors is None or rival.kind == best.kind:
                continue  # forms of one kind have one name: the best fit is taken
            part = self._on_joints_of(rival, best)
            if (
                part.errors is None
                or rival.n_parameters > part.n_parameters
                or simplicity_of(rival) >= simplicity_of(part)
                or self.denied(rival, best)
            ):
                continue
            errors, own = part.errors, rival.errors
            if errors.shape != own.shape:
                if within_recordings(best) or within_recordings(rival):
                    continue  # one is of some recordings, judged on other folds
                # one shows in one recording alone: both are judged by parts of recordings
                errors, own = (self._errors(h, within=True) for h in (part, rival))
            variance = errors.sum(0) / np.maximum(self.problem.rows.counts, 1)
            variance = np.where(variance > 0, variance, 1.0)  # a joint that rests
            behind = ((own - errors) / variance).sum(1)
            error = behind.std(ddof=1) * np.sqrt(len(behind))
            cap = self.settings.simpler_share * part.score
            # What every further parameter must gain (G. Schwarz 1978, Annals of Statistics 6), with
            # what is left as correlated as it is.
            least = np.log(self.problem.rows.counts[list(part.joints)].sum())
            least *= self._price(part.candidates) * max(1, part.n_parameters - rival.n_parameters)
            near = behind.sum() < min(max(error, least), cap)
            if near or (behind.sum() < error and self._encompassed(part, rival)):
                best = rival
            elif part.is_further_form and not rival.is_further_form:
                simpler = simplicity_of(rival) < get_effect(part.kind).simplicity
                if simpler and self._as_good(own, errors, part):
                    best = rival
        return self._simplest_of_family(best, ranking)

    def _on_joints_of(self, rival: Hypothesis, best: Hypothesis) -> Hypothesis:
        """The terms of a further form on the joints of a rival that has fewer of them.

        Joint by joint, a simpler effect may do as well as a form that is free on all of them. What
        is not made of terms of single joints is compared as it is.
        """
        apart = all(len(c.joints) == 1 for h in (rival, best) for c in h.candidates)
        fewer = set(rival.joints) < set(best.joints)
        if not (best.is_further_form and apart and fewer) or within_recordings(rival):
            return best
        own = [c for c in best.candidates if c.joints[0] in rival.joints]
        within = any(map(self.is_judged_within, best.candidates))
        errors = self._errors(replace(best, candidates=tuple(own)), within)
        gain = np.where(np.isin(np.arange(len(best.gain)), rival.joints), best.gain, 0.0)
        count = self._n_parameters(own)
        score = float(gain.sum()) - 2 * self._price(own) * count
        return replace(
            best, candidates=tuple(own), gain=gain, score=score, n_parameters=count, errors=errors
        )

    def _as_good(self, plain: Array, errors: Array, further: Hypothesis) -> bool:
        """Whether a plain formula leaves no more than it may of what a further form removes."""
        left = errors.sum(0)
        removed = left * np.expm1(np.maximum(further.gain, 0) / self._counts)
        return self._good_enough(plain.sum(0), left, removed, further.joints)

    def _encompassed(self, best: Hypothesis, rival: Hypothesis) -> bool:
        """Whether a further form says nothing beside a simpler explanation, which says it all [1]_.

        Held-out errors of an effect that few recordings show differ by luck between two formulas
        of which either would do.

        References
        ----------
        .. [1] G. E. Mizon, J.-F. Richard (1986), The encompassing principle and its application to
           testing non-nested hypotheses, Econometrica 54(3).
        """
        if not best.is_further_form:
            return False
        rows = rows_together(best.candidates, self.problem.rows.counts)
        chance = self.tester([*self.chosen, *rival.candidates]).test(rows).chance
        return chance > self.settings.member

    def _named(self, ranking: list[Hypothesis]) -> Hypothesis:
        """The first explanation, or one that says more whose formula is good enough beside it.

        A name says more than a function of signals, and an effect that holds in every recording
        more than one that has its own size in each.
        """
        best = ranking[0]
        single = within_recordings(best)
        if best.errors is None or not (best.kind == UNKNOWN or single):
            return best
        left = best.errors.sum(0)
        removed = left * np.expm1(np.maximum(best.gain, 0) / self._counts)
        for rival in ranking[1:]:
            if rival.kind == UNKNOWN or rival.errors is None or within_recordings(rival):
                continue
            covered = [c for c in best.candidates if set(c.joints) <= set(rival.joints)]
            # What differs between recordings is one finding a joint; a function of signals is not,
            # and may reach joints that it does not explain.
            joints = sorted({j for c in covered for j in c.joints}) if single else list(best.joints)
            width = sum(c.width for c in covered)
            enough = (
                rival.n_parameters <= width if single else bool(set(joints) & set(rival.joints))
            )
            if not joints or not enough:
                continue
            if not single and best.score - rival.score < self.settings.least_gain:
                return rival  # the function does not say enough more to be a finding beside it
            if not single and self.denied(rival, best):
                continue
            errors = rival.errors
            if errors.shape != best.errors.shape:
                errors = self._errors(rival, within=single)
            left_over = self.settings.further_tolerance if rival.is_further_form else None
            if self._good_enough(errors.sum(0), left, removed, joints, left_over):
                return rival
        return best

    def denied(self, name: Hypothesis, function: Hypothesis) -> bool:
        """Whether what a function turned out to be cannot be what a known effect does.

        Parameters
        ----------
        name, function : Hypothesis
            Known effect, and function without a name, that explain about as much.
        """
        found = [(c.term.effect, c.term.shape) for c in function.candidates]
        return any(
            isinstance(effect, NamelessEffect) and effect.denies(get_effect(name.kind), shape)
            for effect, shape in found
        )

    def _good_enough(
        self,
        errors: Array,
        least: Array,
        removed: Array,
        joints: Sequence[int],
        tolerance: float | None = None,
    ) -> bool:
        """Whether a name leaves no more than its formula may leave of what a function removes.

        Parameters
        ----------
        errors : ndarray of shape (n_joints,)
            Held-out squared error with the name.
        least : ndarray of shape (n_joints,)
            That with the function.
        removed : ndarray of shape (n_joints,)
            Squared error that the function removes.
        joints : sequence of int
            Joints, from 0, on which they are compared, each in units of what is left there.
        tolerance : float, optional
            Share of what the function removes; that of a plain formula by default.
        """
        tolerance = self.settings.form_tolerance if tolerance is None else tolerance
        own = list(joints)
        weight = 1 / np.maximum(least[own], 1e-300)
        behind = float(weight @ (errors - least)[own])
        return behind <= tolerance * float(weight @ removed[own])

    def _simplest_of_family(self, best: Hypothesis, ranking: list[Hypothesis]) -> Hypothesis:
        """Members of a family differ only in motion made for it: the simplest near one is named.

        Of its forms, the one that explains most.
        """
        family = family_of(best)
        if not family:
            return best
        near = [
            h
            for h in ranking
            if family_of(h) == family
            and h.joints == best.joints
            and h.score >= self.settings.family_share * best.score
        ]
        kind = min([best, *near], key=lambda h: get_effect(h.kind).simplicity).kind
        return max((h for h in [best, *near] if h.kind == kind), key=lambda h: h.score)

    def judged(self, hypothesis: Hypothesis) -> Hypothesis | None:
        """The hypothesis with those of its terms that are more than chance beside the others."""
        if hypothesis.torque is not None:  # judged on single samples, by its line
            chance = hypothesis.chances[0]
            tried = self.tried()
            return replace(hypothesis, tried=tried) if self.significant(chance) else None
        candidates = list(hypothesis.candidates)
        if len(candidates) > 2 and within_recordings(hypothesis):
            return self._judged_together(hypothesis)
        while candidates:
            chances = [
                self.chance(c, [*self.chosen, *(o for o in candidates if o is not c)])
                for c in candidates
            ]
            worst = int(np.argmax(chances))
            if self.significant(chances[worst], candidates[worst]):
                kept = [j for c in candidates for j in c.rows]
                gain = np.where(np.isin(np.arange(len(hypothesis.gain)), kept), hypothesis.gain, 0)
                gain = hypothesis.gain if len(candidates) == len(hypothesis.candidates) else gain
                return replace(
                    hypothesis,
                    candidates=tuple(candidates),
                    chances=tuple(chances),
                    tried=self.tried(candidates[worst]),
                    gain=gain,
                )
            del candidates[worst]
        return None

    def _judged_together(self, hypothesis: Hypothesis) -> Hypothesis | None:
        """What differs between recordings: more than chance together, each by itself at 5 %.

        Each recording by itself would have to stand out of all candidates, and one that does not
        would spoil the test of the others. What all recordings have is partly what bodies do:
        one after the other is the one that the others are held against.
        """
        kept: list[Candidate] = []
        parts = grouped_by_joints(hypothesis.candidates)
        for part in parts:
            others = [*self.chosen, *(c for p in parts if p is not part for c in p)]
            kept += self._each_beside_the_others(part, others)
        if not kept:
            return None
        rows = rows_together(kept, self.problem.rows.counts)
        chance = self.tester(self.chosen).test(rows).chance
        if not self.significant(chance, kept[0]):
            return None
        chances = (chance,) * len(kept)
        tried = self.tried(kept[0])
        return replace(hypothesis, candidates=tuple(kept), chances=chances, tried=tried)

    def _each_beside_the_others(
        self, rest: list[Candidate], others: Sequence[Candidate]
    ) -> list[Candidate]:
        """Those of some recordings that are more than chance at 5 % beside the rest of them."""
        while rest:
            chances = [self.chance(c, [*others, *(o for o in rest if o is not c)]) for c in rest]
            worst = int(np.argmax(chances))
            if chances[worst] <= self.settings.member:
                return rest
            rest = [c for i, c in enumerate(rest) if i != worst]
        return rest

    def shadow(self, hypothesis: Hypothesis) -> bool:
        """Whether an explanation is so small that earlier ones' imperfect formulas may leave it."""
        joints = sorted({j for c in hypothesis.candidates for j in c.rows})
        settings, tolerance = self.settings, self._tolerance(hypothesis)
        own, earlier = self._removed(self.left, hypothesis.gain), self.start - self.left
        if not self._mostly_small(joints, hypothesis.gain, own, tolerance * earlier):
            return False
        # What an imperfect formula leaves does not become noise by one known effect.
        known = hypothesis.kind != UNKNOWN and not within_recordings(hypothesis)
        most = self._mostly_small(joints, hypothesis.gain, own, 0.5 * self.left)
        return not known or most or self._price(hypothesis.candidates) > settings.white

    def without_pieces(self, hypothesis: Hypothesis) -> tuple[Hypothesis, bool]:
        """The hypothesis without terms that are but pieces of a force that was found before.

        A spring and a stop on one joint that are found after each other are mostly one force over
        its position, of another form, above all where the second does little, or where the first
        has no name.

        Parameters
        ----------
        hypothesis : Hypothesis
            Known effect that would be added.

        Returns
        -------
        hypothesis : Hypothesis
            As it was given where all of its terms are pieces, or none is.
        is_piece : bool
            Whether all of them are.
        """
        own = self._removed(self.left, hypothesis.gain)
        small = own < self.settings.nameless_tolerance * (self.start - self.left)
        kept = [
            k
            for k, c in enumerate(hypothesis.candidates)
            if not all(self._holds_force(hypothesis, j, bool(small[j])) for j in c.joints)
        ]
        if not 0 < len(kept) < len(hypothesis.candidates):
            return hypothesis, not kept
        rest = replace(
            hypothesis,
            candidates=tuple(hypothesis.candidates[k] for k in kept),
            chances=tuple(hypothesis.chances[k] for k in kept),
        )
        return rest, False

    def _holds_force(self, hypothesis: Hypothesis, joint: int, small: bool) -> bool:
        """Whether a force over the position of a joint was found that this is a piece of."""
        return self.of_one_position(hypothesis, joint) and any(
            self.of_one_position(h, joint) and (small or h.kind == UNKNOWN) for h in self.findings
        )

    def of_one_position(self, hypothesis: Hypothesis, joint: int) -> bool:
        """Whether on a joint it is a force over the position of this joint, in all recordings.

        Parameters
        ----------
        hypothesis : Hypothesis
            A known effect, or a function without a name.
        joint : int
            Joint, from 0.
        """
        if within_recordings(hypothesis) or joint not in hypothesis.joints:
            return False
        if hypothesis.kind == UNKNOWN:
            return hypothesis.torque is None and hypothesis.variables == (f"q{joint + 1}",)
        own = [c.term for c in hypothesis.candidates if joint in c.joints]
        return all(term.follows_position for term in own)

    def _tolerance(self, beside: Hypothesis) -> Array:
        """Share of the squared error removed so far that formulas may have left, by joint.

        How a link swings is a formula of first order: it leaves more to a nameless function, and
        to a delay, which is the first order of any lag.
        """
        settings = self.settings
        first_order = beside.kind == UNKNOWN or any(
            c.term.effect.is_slow for c in beside.candidates
        )
        shares = np.full(self.problem.n_joints, settings.exact_tolerance)
        for h in self.findings:
            if h.kind == UNKNOWN and h.torque is not None:
                continue
            nameless = h.kind == UNKNOWN
            for c in h.candidates:
                if c.term.effect.is_exact:
                    continue
                swings = c.term.effect.moves_link and first_order
                loose = nameless or swings
                share = settings.nameless_tolerance if loose else settings.form_tolerance
                reached = list(c.rows)
                shares[reached] = np.maximum(shares[reached], share)
        return shares

    def _mostly_small(self, joints: Sequence[int], gain: Array, own: Array, least: Array) -> bool:
        """Whether most of a gain is had on joints of which less is removed than what is least.

        Joint by joint: one whose error fell by a thousandth through another effect would call
        everything small, whatever it does elsewhere.
        """
        gained = np.maximum(gain, 0.0)
        large = [j for j in joints if own[j] >= least[j]]
        return bool(gained[large].sum() < 0.5 * gained[list(joints)].sum())

    def _removed(self, errors: Array, gain: Array) -> Array:
        """Squared error of every joint that a gain of log-likelihood takes away."""
        counts = np.maximum(self.problem.rows.counts, 1)
        share: Array = -np.expm1(-np.maximum(gain, 0.0) / counts)
        return errors * share

    def _at_its_limit(self, hypothesis: Hypothesis) -> Hypothesis | None:
        """The hypothesis, or the simpler kind that its unresolved terms are; what has them waits.

        Pre-sliding shorter than can be seen is Coulomb friction. The terms that are resolved are
        found again beside it. What is at the far end of its range is no such effect.
        """
        inside = tuple(c for c in hypothesis.candidates if not self._beyond(c))
        if not inside:
            return None
        if len(inside) < len(hypothesis.candidates):
            hypothesis = replace(hypothesis, candidates=inside)
        unresolved = {c: kind for c in hypothesis.candidates if (kind := self._limit_kind(c))}
        if not unresolved:
            return hypothesis
        simple = [
            c
            for c in self.pool
            if (c.kind, c.joints) in {(kind, c.joints) for c, kind in unresolved.items()}
        ]
        for found in self._finals([simple] if simple else []):
            return found
        rest = tuple(c for c in hypothesis.candidates if c not in unresolved)
        return replace(hypothesis, candidates=rest) if rest else None

    def _beyond(self, candidate: Candidate) -> bool:
        """Whether the first shape parameter of a name ends at the far end of its range."""
        effect, shapes = candidate.term.effect, candidate.term.effect.shapes
        if candidate.kind == UNKNOWN or effect.search != "grid" or not shapes:
            return False  # a line in a spectrum ends where the spectrum does
        if shapes[0].name not in candidate.term.shape:
            return False
        unit = self.problem.signals.unit[candidate.joints[0]] if shapes[0].scales else 1.0
        far = self.settings.far_end * shapes[0].high * unit
        return bool(candidate.term.shape[shapes[0].name] >= far)

    def _limit_kind(self, candidate: Candidate) -> str:
        """The kind that a candidate cannot be told from, for a shape that is not resolved."""
        unit = self.problem.signals.unit[candidate.joints[0]]
        for shape in candidate.term.effect.shapes:
            low = shape.low * (unit if shape.scales else 1.0)
            value = candidate.term.shape.get(shape.name, np.inf)
            if shape.limit_kind and value < self.settings.resolved * low:
                return shape.limit_kind
        return ""

    def _richer_known(self, hypothesis: Hypothesis) -> bool:
        """Whether a member of the same family that is as rich was found on the same joints."""
        family = family_of(hypothesis)
        return any(
            family
            and family_of(h) == family
            and set(hypothesis.joints) <= set(h.joints)
            and simplicity_of(h) >= simplicity_of(hypothesis)
            for h in self.findings
        )

    def _alike(self, best: Hypothesis, rivals: Sequence[Hypothesis]) -> bool:
        """Whether a known effect on other joints explains as much."""
        return any(
            h.kind != UNKNOWN
            and h.joints != best.joints
            and h.score >= (1 - self.settings.alike) * best.score
            for h in rivals
        )

    def _elsewhere(self, best: Hypothesis) -> tuple[tuple[int, ...], ...]:
        """Other pairs of joints on which a coupling explains as much.

        Where axes are parallel, bodies take up what couples one pair in place of another.
        """
        pairs = [c for c in best.candidates if len(c.joints) == 2]
        if best.kind == UNKNOWN or within_recordings(best) or not pairs:
            return ()
        sites = {c.joints for c in best.candidates}
        others = self.strongest(
            lambda c: c.joints, lambda c: c.kind == best.kind and c.joints not in sites
        )
        found: list[tuple[int, ...]] = []
        for own in pairs:
            rest = [c for c in best.candidates if c is not own]
            near = [others[joints] for joints in sorted(others) if set(joints) & set(own.joints)]
            found += [
                h.candidates[-1].joints
                for h in self._finals([[*rest, other] for other in near], refined=len(near))
                if best.score - h.score < self.settings.least_gain
            ]
        return tuple(found)
