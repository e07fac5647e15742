# SPDX-License-Identifier: BSD-3-Clause
"""Choice of an explanation from a ranking: the best one, or a simpler one that is as good."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from skidyn._signals import Array
from skidyn.diagnosis._candidates import rows_together
from skidyn.diagnosis._confidence import SEPARATES
from skidyn.diagnosis._hypothesis import (
    UNKNOWN,
    Hypothesis,
    family_of,
    in_part,
    is_plain_friction,
    removed_share,
    simplicity_of,
    within_recordings,
)
from skidyn.diagnosis._ranking import RankingSearch
from skidyn.diagnosis._rule import FRICTION_SHARE, NEARER, STANDS_OUT
from skidyn.effects import NamelessEffect, get_effect
from skidyn.evidence import weighted_least_squares


class ChoosingSearch(RankingSearch):
    """A search that chooses explanations."""

    def pick(self, ranking: list[Hypothesis]) -> Hypothesis | None:
        """The best explanation, or a simpler one that is as good.

        A simpler one is as good if its score is lower by no more than the standard error and a
        small share of the score; compared with a further form, by any difference if the form adds
        nothing to it.
        """
        if not ranking:
            return None
        best = self._named(ranking)
        for rival in ranking[1:]:
            if best.errors is None or rival.errors is None or rival.kind == best.kind:
                continue  # forms of one kind have one name: the best fit is used
            part = self._on_joints_of(rival, best)
            if (
                part.errors is None
                or rival.n_parameters > part.n_parameters
                or simplicity_of(rival) >= simplicity_of(part)
                or self.denied(rival, best)
                # Equal recordings on several joints were chosen; one change of the log was not.
                or (len(rival.candidates) > 1 and in_part(rival) and not within_recordings(best))
            ):
                continue
            errors, own = part.errors, rival.errors
            if errors.shape != own.shape:
                # one occurs in some recordings only: both are judged by parts of recordings
                errors, own = (self._errors(h, within=True) for h in (part, rival))
            variance = errors.sum(0) / np.maximum(self.problem.rows.counts, 1)
            variance = np.where(variance > 0, variance, 1.0)  # a joint at rest
            behind = ((own - errors) / variance).sum(1)
            error = behind.std(ddof=1) * np.sqrt(len(behind))
            cap = self.settings.simpler_share * part.score
            # Required gain for every further parameter (G. Schwarz 1978, Annals of Statistics 6),
            # with the actual correlation of the residual.
            least = np.log(self.problem.rows.counts[list(part.joints)].sum())
            least *= self._price(part.candidates) * max(1, part.n_parameters - rival.n_parameters)
            near = behind.sum() < min(max(error, least), cap)
            if near or (behind.sum() < error and self._encompassed(part, rival)):
                best = rival
            elif part.is_further_form and not rival.is_further_form:
                simpler = simplicity_of(rival) < get_effect(part.kind).simplicity
                if simpler and self._as_good(own, errors, part):
                    best = rival
        best = self._nearest_to_description(self._simplest_of_family(best, ranking), ranking)
        best = self._by_its_size(best, ranking)
        return self._with_fewest_numbers(self._plain_friction_first(best, ranking), ranking)

    def _with_fewest_numbers(self, best: Hypothesis, ranking: Sequence[Hypothesis]) -> Hypothesis:
        """Of forms of one effect that the data cannot separate, the one with the fewest numbers."""
        if best.kind == UNKNOWN or within_recordings(best):
            return best
        least = best.score - SEPARATES * self._price(best.candidates)
        equal = [
            h
            for h in ranking
            if (h.kind, h.joints) == (best.kind, best.joints)
            and h.n_parameters < best.n_parameters
            and h.score > least
            and not within_recordings(h)
        ]
        return min(equal, key=lambda h: (h.n_parameters, -h.score), default=best)

    def _by_its_size(self, best: Hypothesis, ranking: Sequence[Hypothesis]) -> Hypothesis:
        """The kind that an effect of its size usually is, if that is nearly as good."""
        if best.kind == UNKNOWN or len(best.candidates) != 1:
            return best
        (own,) = best.candidates
        size, _ = self.tester(self.chosen).estimate(own.rows)
        kind = own.term.effect.usually(size, own.term.shape, self.problem.few, own.joints)
        least = (1 - self.settings.simpler_share) * best.score
        when = own.term.trajectories
        near = [h for h in ranking if h.kind == kind and h.score >= least]
        near = [h for h in near if all(c.term.trajectories == when for c in h.candidates)]
        return max(near, key=lambda h: h.score, default=best)

    def _plain_friction_first(self, best: Hypothesis, ranking: Sequence[Hypothesis]) -> Hypothesis:
        """Plain friction that the model lacks, before what may only resemble it.

        Every joint has viscous and Coulomb friction. Where the model has neither, a power of the
        velocity explains more than each of them alone.
        """
        if best.kind == UNKNOWN or get_effect(best.kind).is_exact or within_recordings(best):
            return best

        def removed(h: Hypothesis) -> float:
            return float(removed_share(h.gain, self._counts)[list(best.joints)].sum())

        plain = [
            h
            for h in ranking
            if is_plain_friction(h) and removed(h) > FRICTION_SHARE * removed(best)
        ]
        return max(plain, key=lambda h: h.score, default=best)

    def _nearest_to_description(
        self, best: Hypothesis, ranking: Sequence[Hypothesis]
    ) -> Hypothesis:
        """Of explanations that the data cannot separate, one with bodies like those described.

        The force of a counterweight and the inertia of a rotor on a vertical slide, for example,
        differ by the mass that is identified only.
        """
        if not self.problem.rigid_body or best.kind == UNKNOWN or within_recordings(best):
            return best
        most = SEPARATES * self._price(best.candidates)
        equal = [
            h
            for h in ranking
            if h.kind not in (UNKNOWN, best.kind)
            and h.joints == best.joints
            and not within_recordings(h)
            and h.n_parameters <= best.n_parameters
            and h.is_further_form <= best.is_further_form
            and abs(float((h.gain - best.gain).sum())) < most
        ]
        if not equal:
            return best
        distances = [self._from_description(h) for h in equal]
        nearest = int(np.argmin(distances))
        nearer = distances[nearest] < NEARER * self._from_description(best)
        return equal[nearest] if nearer else best

    def _from_description(self, hypothesis: Hypothesis) -> float:
        """Torque on its joints by which bodies identified with it differ from those described.

        The root of the sum of squares, in units of the noise.
        """
        problem, joints = self.problem, list(hypothesis.joints)
        design = problem.design(self.blocks_with([*self.chosen, *hypothesis.candidates]))
        found = weighted_least_squares(design, self.target, self.sigma)[: len(problem.rigid_index)]
        changes = [problem.rigid_rows[j] @ found / self.sigma[j] for j in joints]
        return float(np.linalg.norm(np.concatenate(changes)))

    def _on_joints_of(self, rival: Hypothesis, best: Hypothesis) -> Hypothesis:
        """The terms of a further form on the joints of a rival that has fewer of them.

        On a single joint, a simpler effect may be as good as a form that is free on all of them.
        Explanations other than terms of single joints are compared as a whole.
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
        """Whether a plain formula leaves little enough of what a further form removes."""
        left, own = errors.sum(0), list(further.joints)
        if (plain.sum(0)[own] > STANDS_OUT * left[own]).any():
            return False
        removed = left * np.expm1(np.maximum(further.gain, 0) / self._counts)
        return self._good_enough(plain.sum(0), left, removed, own)

    def _encompassed(self, best: Hypothesis, rival: Hypothesis) -> bool:
        """Whether a simpler explanation encompasses a further form [1]_.

        Held-out errors of an effect in few recordings differ by chance between two formulas that
        fit equally well.

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
        """The first explanation, or a more specific one with a sufficiently good formula.

        A known effect is more specific than a function of signals with at least as many parameters,
        and an effect that is equal in all recordings more than one with a separate size in each.
        """
        best = ranking[0]
        single = within_recordings(best)
        if best.errors is None or not (best.kind == UNKNOWN or single):
            return best
        left, removed = self.left_and_removed(best)
        for rival in ranking[1:]:
            if rival.kind == UNKNOWN or rival.errors is None or within_recordings(rival):
                continue
            covered = [c for c in best.candidates if set(c.joints) <= set(rival.joints)]
            # An effect that differs between recordings is one finding per joint; a function of
            # signals is not, and may act on joints that it does not explain.
            joints = sorted({j for c in covered for j in c.joints}) if single else list(best.joints)
            # the choice of a part of the recordings counts as parameters, too
            width = best.n_parameters if in_part(best) else sum(c.width for c in covered)
            enough = (
                rival.n_parameters <= width if single else bool(set(joints) & set(rival.joints))
            )
            if not joints or not enough:
                continue
            if not single and best.score - rival.score < self.settings.least_gain:
                return rival  # the function does not add enough to be a finding in addition
            if not single and self.denied(rival, best):
                continue
            if not single and rival.n_parameters > best.n_parameters:
                continue  # a law of fewer numbers that explains more is the more specific one
            errors = rival.errors
            if errors.shape != best.errors.shape:
                errors = self._errors(rival, within=single)
            left_over: float | None = None
            if family_of(rival):
                left_over = 1 - self.settings.family_share  # as between its members
            elif rival.is_further_form:
                left_over = self.settings.further_tolerance
            if self._good_enough(errors.sum(0), left, removed, joints, left_over):
                return rival
        return best

    def left_and_removed(self, hypothesis: Hypothesis) -> tuple[Array, Array]:
        """Held-out squared error of every joint with an explanation, and what that removes.

        Parameters
        ----------
        hypothesis : Hypothesis
            Explanation with held-out errors.

        Returns
        -------
        left, removed : ndarray of shape (n_joints,)
        """
        assert hypothesis.errors is not None
        left = hypothesis.errors.sum(0)
        return left, left * np.expm1(np.maximum(hypothesis.gain, 0) / self._counts)

    def denied(self, name: Hypothesis, function: Hypothesis) -> bool:
        """Whether the fitted function differs from what a known effect can do.

        Parameters
        ----------
        name, function : Hypothesis
            Known effect and unknown function that explain about equally much.
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
        """Whether a known effect leaves at most the permitted part of what a function removes.

        Parameters
        ----------
        errors : ndarray of shape (n_joints,)
            Held-out squared error with the known effect.
        least : ndarray of shape (n_joints,)
            Held-out squared error with the function.
        removed : ndarray of shape (n_joints,)
            Squared error that the function removes.
        joints : sequence of int
            Joints, from 0, on which they are compared, each in units of its residual.
        tolerance : float, optional
            Permitted share of what the function removes; that of a plain formula by default.
        """
        tolerance = self.settings.form_tolerance if tolerance is None else tolerance
        own = list(joints)
        weight = 1 / np.maximum(least[own], 1e-300)
        behind = float(weight @ (errors - least)[own])
        return behind <= tolerance * float(weight @ removed[own])

    def _simplest_of_family(self, best: Hypothesis, ranking: list[Hypothesis]) -> Hypothesis:
        """The simplest member of a family among those with nearly the best score.

        Of its forms, the best one is used.
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
