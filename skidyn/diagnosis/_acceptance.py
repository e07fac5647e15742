# SPDX-License-Identifier: BSD-3-Clause
"""Acceptance of a chosen explanation by the rule."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from skidyn._signals import Array
from skidyn.diagnosis._candidates import Candidate, rows_together
from skidyn.diagnosis._choice import ChoosingSearch
from skidyn.diagnosis._confidence import SEPARATES
from skidyn.diagnosis._hypothesis import (
    UNKNOWN,
    Hypothesis,
    grouped_by_joints,
    in_part,
    is_plain_friction,
    of_one_family,
    on_pairs,
    removed_share,
    simplicity_of,
    some_recordings,
    within_recordings,
)
from skidyn.diagnosis._rule import (
    ALL_LEFT,
    BEYOND_FORMULAS,
    IMITATED,
    NEARLY,
    ON_ONE_OF_TWO,
    TAKEN_BACK,
    TWIN,
)
from skidyn.diagnosis._tester import Tester
from skidyn.effects import get_effect


class JudgingSearch(ChoosingSearch):
    """A search that judges the explanations that it chose."""

    def judged(self, hypothesis: Hypothesis, beside: Sequence[Candidate] = ()) -> Hypothesis | None:
        """The hypothesis with those of its terms that are significant in addition to the others.

        Parameters
        ----------
        hypothesis : Hypothesis
            Known effect or unknown function.
        beside : sequence of Candidate, optional
            Terms in addition to those of the model.
        """
        if hypothesis.torque is not None:  # judged on single samples, by its line
            chance = hypothesis.chances[0]
            tried = self.tried()
            return replace(hypothesis, tried=tried) if self.significant(chance) else None
        candidates = list(hypothesis.candidates)
        if len(candidates) > 2 and within_recordings(hypothesis):
            return self._judged_together(hypothesis)
        while candidates:
            chances = [
                self.chance(c, [*self.chosen, *beside, *(o for o in candidates if o is not c)])
                for c in candidates
            ]
            worst = int(np.argmax(chances))
            if self.significant(chances[worst], candidates[worst]):
                seen = [self._acts_on_both(c, candidates) for c in candidates]
                if not all(seen):
                    del candidates[int(np.argmax(np.where(seen, -1.0, chances)))]
                    continue
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

    def _acts_on_both(self, candidate: Candidate, together: Sequence[Candidate]) -> bool:
        """Whether a coupling is seen on both of its joints, and contradicted by neither.

        What depends on the motion of another joint, but has no reaction on it, is not a coupling:
        most of the reaction would have to be taken back, or nothing of it is seen.
        """
        if candidate.term.effect.scope != "pair":
            return True
        tester = self.tester([*self.chosen, *(c for c in together if c is not candidate)])
        size, _ = tester.estimate(candidate.rows)
        beside = tester.beside([candidate.rows])
        for joint, columns in candidate.rows.items():
            own = {joint: columns}
            rest = [{j: other} for j, other in candidate.rows.items() if j != joint]
            if tester.beside(rest).test(own).chance > self.settings.member:
                return False
            torque, change = columns @ size, columns @ beside.estimate(own)[0]
            if torque @ torque < candidate.width * self.sigma[joint] ** 2:
                return False  # too little to be seen, such as where a free ratio has no bound
            taken_back = torque @ change < -TAKEN_BACK * (torque @ torque)
            if taken_back and self.significant(beside.test(own).chance, candidate):
                return False
        return True

    def _judged_together(self, hypothesis: Hypothesis) -> Hypothesis | None:
        """Terms that differ between recordings: significant together, and each alone at 10 %.

        Each recording alone would have to be significant among all candidates, and one that is not
        would bias the test of the others. A part common to all recordings may be due to bodies, so
        each recording in turn is the reference for the others.
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
        """Those of some recordings that are significant at 10 % in addition to the others."""
        while rest:
            chances = [self.chance(c, [*others, *(o for o in rest if o is not c)]) for c in rest]
            worst = int(np.argmax(chances))
            if chances[worst] <= self.settings.member:
                return rest
            rest = [c for i, c in enumerate(rest) if i != worst]
        return rest

    def due_to_positions(self, hypothesis: Hypothesis) -> bool:
        """Whether noise of the positions alone explains much of what an explanation removes."""
        reached = {j for c in hypothesis.candidates for j in c.rows}
        if hypothesis.torque is not None:
            return False
        tester = self.tester(self.chosen)
        removed = sum(tester.test(c.rows).drop for c in hypothesis.candidates)
        if self.power_of_positions(reached) <= IMITATED * removed:
            return False
        imitation = self.imitation()
        rows = (imitation.problem.term_rows(c.term) for c in hypothesis.candidates)
        imitated = sum(imitation.test(own).drop for own in rows)
        return imitated > IMITATED * removed

    def shadow(self, hypothesis: Hypothesis) -> bool:
        """Whether an explanation is small enough to be an error of earlier, imperfect formulas."""
        # Its gain may be on other joints: what is wrong on one also changes the bodies of others.
        joints = range(self.problem.n_joints)
        settings, tolerance = self.settings, self._tolerance(hypothesis)
        own, earlier = self._removed(self.left, hypothesis.gain), self.start - self.left
        if not self._mostly_small(joints, hypothesis, hypothesis.gain, own, tolerance * earlier):
            return False
        if self._beyond_formulas(hypothesis):
            return False
        # The error of an imperfect formula does not become noise by one known effect.
        known = hypothesis.kind != UNKNOWN and not within_recordings(hypothesis)
        most = self._mostly_small(joints, hypothesis, hypothesis.gain, own, 0.5 * self.left)
        if not known or most or self._second_of_velocity(hypothesis):
            return True
        # Nor does it vanish on several joints by one force.
        several = all(len(c.rows) > 1 for c in hypothesis.candidates)
        least = ALL_LEFT * self.left
        if several and not self._mostly_small(joints, hypothesis, hypothesis.gain, own, least):
            return False
        return self._price(hypothesis.candidates) > settings.white

    def _second_of_velocity(self, hypothesis: Hypothesis) -> bool:
        """Whether an earlier effect follows the velocity of the same joints.

        What one formula of friction leaves, another one may well describe.
        """

        def joints_of(h: Hypothesis) -> set[int]:
            return {
                j
                for c in h.candidates
                if c.term.effect.scope == "joint" and c.term.effect.drawn_against == "dq"
                for j in c.joints
            }

        own = joints_of(hypothesis)
        before = {j for h in [*self.earlier, *self.findings] for j in joints_of(h)}
        return set(hypothesis.joints) <= own & before

    def _beyond_formulas(self, hypothesis: Hypothesis) -> bool:
        """Whether no other formulas of the earlier effects could explain what an explanation does.

        The error of a formula of positions is a function of the same positions, and that of
        velocities one of velocities. Beside free functions of these, the explanation has to remain
        significant, and to explain most of what it explains without them.
        """
        if within_recordings(hypothesis):
            return False
        free: dict[Candidate, None] = {}
        for earlier in [*self.earlier, *self.findings]:
            for candidate in earlier.candidates:
                own = self._in_any_form(candidate)
                if not own:
                    return False
                free.update(dict.fromkeys(own))
        tester = self.tester(self.chosen)
        beside = tester.beside([c.rows for c in free])
        for candidate in hypothesis.candidates:
            shares = [_share_of_error(t, candidate) for t in (tester, beside)]
            if shares[1] < BEYOND_FORMULAS * shares[0]:
                return False
            if not self.significant(beside.test(candidate.rows, candidate.zeros).chance, candidate):
                return False
        return True

    def _in_any_form(self, candidate: Candidate) -> list[Candidate]:
        """Free functions of the signals on which an effect depends, on the joints it reaches.

        There are none for an effect that depends on other signals than positions, or velocities, of
        its joints at the same moment.
        """
        term, signal = candidate.term, candidate.term.effect.drawn_against
        plain = signal == "dq" or (signal == "q" and not term.is_dry)
        known = candidate.kind != UNKNOWN and term.effect.scope in ("joint", "pair")
        always = not (some_recordings(candidate) or term.spans or term.course)
        if not (plain and known and always and term.is_pointwise):
            return []
        signals = {f"{signal}{j + 1}" for j in candidate.joints}
        return [
            c
            for c in self.whole_pool
            if c.kind == UNKNOWN
            and c.variables
            and signals.issuperset(c.variables)
            and set(c.joints) <= set(candidate.rows)
        ]

    def without_pieces(self, hypothesis: Hypothesis) -> tuple[Hypothesis, bool]:
        """The hypothesis without terms that are only parts of a force found before.

        A spring and a stop found one after another on a joint are mostly one force over its
        position with another form, especially if the second explains little, or if the first is
        unknown.

        Parameters
        ----------
        hypothesis : Hypothesis
            Known effect that would be added.

        Returns
        -------
        hypothesis : Hypothesis
            Unchanged if all or none of its terms are parts.
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
        """Whether this is a part of a force over the position of a joint that was found before."""
        return self.of_one_position(hypothesis, joint) and any(
            self.of_one_position(h, joint) and (small or h.kind == UNKNOWN) for h in self.findings
        )

    def _tolerance(self, beside: Hypothesis) -> Array:
        """Share of the removed squared error that imperfect formulas may leave, by joint.

        The formula of an oscillating link is of first order: it leaves more to an unknown function,
        and to a delay, which is the first order of any lag. A part of the recordings is chosen for
        what the formula leaves there. Of a family, the simplest formula that explains nearly as
        much as the best one is used, which leaves the rest. A function of the same signals, also
        one with a size in each recording, is the error of a formula rather than another effect, up
        to the same share.
        """
        settings = self.settings
        first_order = beside.kind == UNKNOWN or any(
            c.term.effect.is_slow for c in beside.candidates
        )
        signals = set(beside.variables) - {"trajectory"} if beside.kind == UNKNOWN else set()
        shares = np.full(self.problem.n_joints, settings.exact_tolerance)
        for h in [*self.earlier, *self.findings]:
            if h.kind == UNKNOWN and h.torque is not None:
                continue
            nameless = h.kind == UNKNOWN
            for c in h.candidates:
                if c.term.effect.is_exact:
                    continue
                swings = c.term.effect.moves_link and first_order
                loose = nameless or swings or in_part(beside)
                share = settings.nameless_tolerance if loose else settings.form_tolerance
                same = bool(signals) and signals <= _signals_of(c)
                if c.term.effect.family or same:
                    share = max(share, 1 - settings.family_share)
                reached = list(c.rows)
                shares[reached] = np.maximum(shares[reached], share)
        return shares

    def _mostly_small(
        self, joints: Sequence[int], of: Hypothesis, gain: Array, own: Array, least: Array
    ) -> bool:
        """Whether most of a gain is on joints of which less than the least share is removed.

        It is judged by joint: otherwise a joint whose error another effect reduced by a thousandth
        would make every gain seem small. A coupling has the same evidence on both of its joints, of
        which another effect may have reduced the error of one by far more.
        """
        gained = np.maximum(gain, 0.0)
        large = [j for j in joints if own[j] >= least[j]]
        share = ON_ONE_OF_TWO if on_pairs(of) else 0.5
        return bool(gained[large].sum() < share * gained[list(joints)].sum())

    def _removed(self, errors: Array, gain: Array) -> Array:
        """Reduction of the squared error of every joint by a gain of log-likelihood."""
        return errors * removed_share(gain, self.problem.rows.counts)

    def _at_its_limit(self, hypothesis: Hypothesis) -> Hypothesis | None:
        """The hypothesis, or the simpler kind that is equivalent to its unresolved terms.

        Pre-sliding that is too short to be resolved is Coulomb friction, and friction that differs
        between the directions by a constant only is an offset. Resolved terms are then
        searched again in addition to it. A shape parameter at the far end of its range indicates
        another effect.
        """
        inside = tuple(c for c in hypothesis.candidates if not self._beyond(c))
        if not inside:
            return None
        if len(inside) < len(hypothesis.candidates):
            hypothesis = replace(hypothesis, candidates=inside)
        together = hypothesis.candidates
        unresolved = {c: kind for c in together if (kind := self._limit_kind(c, together))}
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
        """Whether the first shape parameter of a known effect is at the far end of its range."""
        effect, shapes = candidate.term.effect, candidate.term.effect.shapes
        if candidate.kind == UNKNOWN or effect.search != "grid" or not shapes:
            return False  # a line in a spectrum may be at its end
        if shapes[0].name not in candidate.term.shape:
            return False
        _, high = shapes[0].range_on(self.problem.signals, candidate.joints[0])
        return bool(candidate.term.shape[shapes[0].name] >= self.settings.far_end * high)

    def _limit_kind(self, candidate: Candidate, together: Sequence[Candidate]) -> str:
        """The simpler kind that is equivalent to a candidate with an unresolved shape or size."""
        for shape in candidate.term.effect.shapes:
            low, _ = shape.range_on(self.problem.signals, candidate.joints[0])
            value = candidate.term.shape.get(shape.name, np.inf)
            if shape.limit_kind and value < self.settings.resolved * low:
                return shape.limit_kind
        kinds = [c.limit_kind for c in candidate.term.coefficients]
        if not any(kinds) or candidate.term.trajectories is not None:
            return ""
        rest = [c for c in together if c is not candidate]
        tester = self.tester([*self.chosen, *rest])
        chance = tester.test(candidate.rows, np.array([bool(kind) for kind in kinds])).chance
        return "" if self.significant(chance, candidate) else next(filter(None, kinds))

    def _richer_known(self, hypothesis: Hypothesis) -> bool:
        """Whether an equally complex member of the family was found on the same joints."""
        return any(
            of_one_family(hypothesis, h)
            and set(hypothesis.joints) <= set(h.joints)
            and simplicity_of(h) >= simplicity_of(hypothesis)
            for h in self.findings
        )

    def _alike(self, best: Hypothesis, rivals: Sequence[Hypothesis]) -> bool:
        """Whether a known effect on other joints, or with an equal torque, explains equally much.

        It says nothing against friction that every joint has. Where the bodies differ, the torque
        may be the same: that of a rotor on a vertical slide is an offset with a heavier slide.
        """
        if is_plain_friction(best):
            return False
        known = [h for h in rivals if h.kind != UNKNOWN]
        least = (1 - self.settings.alike) * best.score
        return any(
            h.score >= least if h.joints != best.joints else self._is_twin(h, best) for h in known
        )

    @staticmethod
    def _is_twin(rival: Hypothesis, best: Hypothesis) -> bool:
        """Whether two exact explanations of equally many numbers remove about equally much."""
        exact = best.kind != UNKNOWN and all(get_effect(h.kind).is_exact for h in (rival, best))
        differ = abs(float((rival.gain - best.gain).sum()))
        return exact and rival.n_parameters == best.n_parameters and differ < TWIN

    def on_neighbours(self, best: Hypothesis) -> Hypothesis:
        """An effect with the other joints on which it explains equally much.

        With parallel axes, the bodies compensate the difference between pairs of joints, so that a
        small one is no evidence. Of pairs that the data cannot separate, one of neighbours is
        named, which a transmission mostly couples. Bodies of other masses also compensate the
        difference between torque gains of some joints and of others.
        """
        found = self._on_other_joints(best)
        sites = list(dict.fromkeys(h.candidates[-1].joints for h in found))
        coupling = len(best.candidates) == 1 and len(best.candidates[0].joints) == 2
        if coupling and found and not self._adjoin(best.candidates[0].joints):
            most = SEPARATES * self._price(best.candidates)
            for other in sorted(found, key=lambda h: -h.score):
                (candidate,) = other.candidates
                behind = float((best.gain - other.gain).sum())
                near = behind < most and self._adjoin(candidate.joints)
                if near and (judged := self.judged(other)) is not None:
                    sites[sites.index(candidate.joints)] = best.candidates[0].joints
                    return replace(judged, elsewhere=tuple(sites))
        return replace(best, elsewhere=tuple(sites))

    def _on_other_joints(self, best: Hypothesis) -> list[Hypothesis]:
        """An effect with one of its terms on other joints, as far as they are as good.

        A coupling is tried on pairs that share a joint with its own, and what a sensor adds to the
        torque of one joint on each other one.
        """
        close = max(self.settings.least_gain, (1 - NEARLY) * best.score)
        if best.kind == UNKNOWN or within_recordings(best):
            return []
        pairs = [c for c in best.candidates if len(c.joints) == 2]
        gains = [c for c in best.candidates if len(c.joints) == 1 and c.term.effect.sees_model]
        if not (pairs or (gains and self.problem.rigid_body)):
            return []
        taken = {c.joints for c in best.candidates}
        forms = {c.form for c in best.candidates}
        others = self.strongest(
            lambda c: c.joints,
            lambda c: c.kind == best.kind and c.joints not in taken and c.form in forms,
        )
        found: list[Hypothesis] = []
        for own in pairs or gains:
            rest = [c for c in best.candidates if c is not own]
            alike = [joints for joints in sorted(others) if len(joints) == len(own.joints)]
            near = [others[at] for at in alike if own in gains or set(at) & set(own.joints)]
            found += [
                h
                for h in self._finals([[*rest, other] for other in near], refined=len(near))
                if best.score - h.score < close
            ]
        return found

    def _adjoin(self, joints: Sequence[int]) -> bool:
        """Whether one of two joints, from 0, carries the other."""
        i, j = sorted(joints)
        robot = self.problem.robot
        if robot is None or robot.tree.n_bodies != self.problem.n_joints:
            return j - i == 1  # bodies that follow others have no joints of their own
        return int(robot.tree.parents[j]) == i


def _signals_of(candidate: Candidate) -> set[str]:
    """Names of the signals of its own joints on which an effect mostly depends."""
    term = candidate.term
    own = {"temperature": "temp"}.get(term.effect.drawn_against, term.effect.drawn_against)
    signals = {own, "dq"} if term.is_dry else {own}
    return {f"{signal}{j + 1}" for signal in signals for j in term.places}


def _share_of_error(tester: Tester, candidate: Candidate) -> float:
    """Share of the squared error of its joints that a candidate removes beside a model."""
    error = sum(float(tester.residual[j] @ tester.residual[j]) for j in candidate.rows)
    return tester.estimate(candidate.rows)[1] / max(error, 1e-300)
