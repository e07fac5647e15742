# SPDX-License-Identifier: BSD-3-Clause
"""Findings judged together: replacement of functions, reconsideration, withdrawal."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from skidyn._signals import Array
from skidyn.diagnosis._candidates import Candidate
from skidyn.diagnosis._duels import DuellingSearch
from skidyn.diagnosis._hypothesis import (
    UNKNOWN,
    Hypothesis,
    close_shapes,
    grouped_by_joints,
    margin_over,
    of_one_family,
    ranked_with,
    rivals_among,
    some_recordings,
    uses_the_fit,
    within_recordings,
)
from skidyn.diagnosis._profile import log_likelihood_gain, profile_error, refine
from skidyn.diagnosis._recordings import FRICTION
from skidyn.diagnosis._remainder import noise_level
from skidyn.diagnosis._rule import BETWEEN, IN_MOST, NEARLY, REMAINDER_TIMES_NOISE
from skidyn.diagnosis._search_state import still_free
from skidyn.diagnosis._split import recordings_with
from skidyn.effects import Term

#: Effects with another size in most recordings that are one of all of them, which changes.
PLAIN = (*FRICTION, "offset")


class ReconsideringSearch(DuellingSearch):
    """A search that judges findings together."""

    def accepted(self, ranking: list[Hypothesis]) -> Hypothesis | None:
        """The best explanation that the rule accepts, with the terms that it accepts."""
        offered = ranking
        ranking = list(ranking)
        traced: set[int] = set()
        shadows: set[tuple[str, tuple[int, ...]]] = set()
        while (best := self.pick(ranking)) is not None:
            ranking.remove(best)
            if self._richer_known(best):
                continue
            forces = [j for j in best.joints if self.of_one_position(best, j)]
            if traced & (set(best.joints) - set(forces)):
                continue  # another, weaker trace of the same force
            best, beside = self._plain_first(best)
            if not beside:
                best, beside = self._first_of_two_names(best, offered)
            simpler = self._at_its_limit(best)
            judged = None if simpler is None else self.judged(simpler, beside)
            if judged is not None and self.due_to_positions(judged):
                judged = None
            if judged is not None:
                judged, is_piece = self.without_pieces(judged)
                traced |= set(judged.joints) if is_piece else set()
                if is_piece or self.shadow(judged):
                    # one kind in different parts of the log is one competition
                    own = judged.kind, judged.joints
                    judged = None if own in shadows else self._beside_another_kind(judged)
                    shadows.add(own)
            if judged is not None:
                judged = self._offset_later(judged)
                # what equals a simpler kind is no rival of it
                replaced = best.kind if simpler is not None and simpler.kind != best.kind else ""
                rivals = rivals_among(judged, [h for h in offered if h.kind != replaced])
                margin, alike = margin_over(judged, rivals), self._alike(judged, rivals)
                judged = self.on_neighbours(self.on_each_joint(judged))
                return ranked_with(replace(judged, margin=margin, alike=alike), offered)
        return self._first_of_hidden_pair(offered)

    def _first_of_hidden_pair(self, offered: list[Hypothesis]) -> Hypothesis | None:
        """The first of two known effects of which neither is significant without the other.

        On joints with an error far above the noise, of which each of the two leaves so much that it
        hides the other. Beside a finding, two others would take what its formula leaves.
        """
        if self._reconsidering or not self.nameless:
            return None
        best: Hypothesis | None = None
        highest = 0.0
        taken = {j for h in (*self.earlier, *self.findings) for c in h.candidates for j in c.rows}
        for j in self._far_above_noise():
            if j in taken:
                continue
            for name in self._strongest_on((j,)):
                second = self._second_beside(name, (j,))
                if second is None or name.score + second.score <= highest:
                    continue
                judged = self.judged(name, second.candidates)
                if judged is not None and not self.due_to_positions(judged):
                    best, highest = judged, name.score + second.score
        return None if best is None else ranked_with(best, offered)

    def _far_above_noise(self) -> list[int]:
        """Joints, from 0, whose averaged error is above what noise explains in single samples."""
        residual = self.problem.torque - self.ripple - self.problem.explained(self.fit)
        error = np.sqrt(self.left / np.maximum(self._counts, 1))
        material = error > REMAINDER_TIMES_NOISE * noise_level(self.problem, residual)
        return np.flatnonzero(material).tolist()

    def _second_beside(self, first: Hypothesis, joints: Sequence[int]) -> Hypothesis | None:
        """The best known effect of some joints that is significant beside a first one."""
        kept = self._state()
        self.add(first)
        self.refit()
        self.sigma, self.left = self.weights(), self._left()
        names = [h for h in self._known_alone() if set(joints) <= set(h.joints)]
        judged = [h for h in map(self.judged, names) if h is not None]
        self._restore(kept)
        return max(judged, key=lambda h: h.score, default=None)

    def _plain_first(self, best: Hypothesis) -> tuple[Hypothesis, Sequence[Candidate]]:
        """Friction or an offset that changes, instead of sizes for most recordings.

        With the terms of the change, beside which the plain effect has to be significant: with
        one size in all recordings, it leaves more than it removes in some of them.
        """
        names, own = self.problem.rows.recordings, grouped_by_joints(best.candidates)
        shares = [recordings_with(best.kind, some, names).mean() for some in own]
        if best.kind not in PLAIN or min(map(len, own)) < 2 or min(shares) <= IN_MOST:
            return best, ()
        joints = {some[0].joints for some in own}
        plain = [c for c in self.pool if c.kind == best.kind and c.joints in joints]
        first = self._final(plain, refined=False) if plain else None
        if first is None or self._reconsidering:
            return first or best, ()  # the change is a finding already
        second = self._second_beside(first, first.joints)
        return (best, ()) if second is None else (first, second.candidates)

    def _offset_later(self, step: Hypothesis) -> Hypothesis:
        """A step in time, as an offset of the rest of its recording and of the later ones.

        With clocks that start anew, a step in several recordings remains without a name.
        """
        signals, kind = self.problem.signals, "offset"
        if step.kind != UNKNOWN or kind not in self.kinds:
            return step
        names, number, rows = np.unique(signals.trajectory, return_inverse=True, return_counts=True)
        candidates = []
        for c in step.candidates:
            moment = c.term.shape.get("moment")
            if moment is None:
                return step
            share = np.bincount(number, signals.clock >= moment) / rows
            within = names[np.minimum(share, 1 - share) > BETWEEN].tolist()
            later = tuple(map(int, names[share > BETWEEN]))
            if len(within) > 1:
                return step
            end = [float(signals.clock[signals.trajectory == name].max()) for name in within]
            spans = tuple((int(n), float(moment), e) for n, e in zip(within, end, strict=True))
            shape = {"trajectories": later} | ({"spans": spans} if spans else {})
            term = Term.at(kind, c.term.places, shape)
            rows_of_term = self.problem.term_rows(term) if spans else c.rows
            candidates.append(Candidate(kind, term, rows_of_term))
        return replace(step, kind=kind, candidates=tuple(candidates))

    def _first_of_two_names(
        self, best: Hypothesis, ranking: list[Hypothesis]
    ) -> tuple[Hypothesis, Sequence[Candidate]]:
        """An unknown function, or the first of two known effects that together are as good.

        With the terms of the second one if each of the two hides the other: the error that one of
        them leaves is too large for the other to be significant alone.
        """
        if (
            best.kind != UNKNOWN
            or best.errors is None
            or within_recordings(best)
            or self._reconsidering
        ):
            return best, ()
        if (name := self._beside_earlier(best, ranking)) is not None:
            return name, ()
        # one force over the position of a joint is simpler than two that add up to it
        if all(self.of_one_position(best, j) for j in best.joints):
            return best, ()
        tried = set()
        for rival in self._names_on(best, ranking):
            first = self.judged(rival)
            if first is None:
                continue
            if self._second_name(first, best) is not None:
                return rival, ()
            tried.add(rival.kind)
        for rival in self._hidden_names(best, tried):
            second = self._second_name(rival, best)
            if second is not None and self.judged(rival, second.candidates) is not None:
                return rival, second.candidates
        return best, ()

    def _beside_earlier(self, function: Hypothesis, ranking: list[Hypothesis]) -> Hypothesis | None:
        """A known effect as good as a function once an earlier finding has its shape beside it.

        The first of two effects of a joint was fitted to both, so that it leaves to a function what
        neither of them does.
        """
        own = set(function.joints)
        if not any(h.kind != UNKNOWN and own & set(h.joints) for h in self.findings):
            return None
        left, removed = self.left_and_removed(function)
        for rival in self._names_on(function, ranking):
            first = self.judged(rival)
            if first is None:
                continue
            kept = self._state()
            self.add(first)
            self.refit()
            self.sigma, self.left = self.weights(), self._left()
            self.reconsider(self._settled(first))
            as_good = self._good_enough(self.left, left, removed, function.joints)
            self._restore(kept)
            if as_good:
                return rival
        return None

    def _second_name(self, first: Hypothesis, function: Hypothesis) -> Hypothesis | None:
        """A known effect that together with a first one is as good as a function.

        If it is not as it stands, the shape of the first one, which was fitted to both, is searched
        again beside it.
        """
        left, removed = self.left_and_removed(function)
        as_good = partial(self._good_enough, least=left, removed=removed, joints=function.joints)
        kept = self._state()
        self.add(first)
        self.refit()
        self.sigma = self.weights()
        beside = self._state()
        second = None
        for h in self._known_alone():
            if not set(function.joints) <= set(h.joints) or h.errors is None:
                continue
            if as_good(h.errors.sum(0)) or as_good(self._left_once_settled(first, h)):
                second = h
                break
            self._restore(beside)
        self._restore(kept)
        return second

    def _left_once_settled(self, first: Hypothesis, second: Hypothesis) -> Array:
        """Held-out error with a second effect and the shape of the first searched beside it."""
        self.add(second)
        self.refit()
        self._settled(first)
        return self._left()

    def _hidden_names(self, function: Hypothesis, tried: Collection[str]) -> list[Hypothesis]:
        """Known effects on the joint of a function of several signals, significant or not.

        The strongest few kinds but for those that were tried.
        """
        if len(function.joints) > 1 or len(function.variables) < 2:
            return []
        names = self._strongest_on(function.joints, tried)
        return [h for h in names if not self.denied(h, function)]

    def _strongest_on(
        self, joints: tuple[int, ...], except_for: Collection[str] = ()
    ) -> list[Hypothesis]:
        """The strongest few known kinds on exactly these joints, significant or not."""
        strongest: dict[str, Candidate] = {}
        for i in np.argsort(-self.drops, kind="stable").tolist():
            c = self.ranked[i]
            if c.joints == joints and not some_recordings(c):
                strongest.setdefault(c.kind, c)
        kinds = [kind for kind in strongest if kind not in {UNKNOWN, *except_for}]
        return self._finals([[strongest[kind]] for kind in kinds[: self.settings.refined]])

    def _names_on(self, function: Hypothesis, ranking: Sequence[Hypothesis]) -> list[Hypothesis]:
        """The best few known effects of all recordings that may replace a function.

        Each kind once, in its best form.
        """
        names = [h for h in ranking if h.kind != UNKNOWN and not within_recordings(h)]
        names = [h for h in names if set(function.joints) <= set(h.joints)]
        best: dict[str, Hypothesis] = {}
        for h in names:
            if not self.denied(h, function):
                best.setdefault(h.kind, h)
        return list(best.values())[: self.settings.refined]

    def reconsider(self, newest: Hypothesis) -> None:
        """Compare all kinds again for the part of earlier findings, in presence of the newest."""
        replaced = False
        for old in [h for h in self.findings if h is not newest and h.torque is None]:
            for _ in range(self.settings.repeated):
                winner = self._competed_again(old)
                if winner is None:
                    if set(old.joints) & set(newest.joints):
                        self._settled(old)
                    break
                replaced = True
                newest, old = self._settled(newest), winner
                # Columns that depend on the fit were computed with the wrong effect in the model.
                if not any(map(uses_the_fit, newest.candidates)):
                    break
        if replaced and newest.kind == UNKNOWN and newest.torque is None:
            # An unknown effect found with the wrong effect may be a known one with the right
            # effect.
            self._competed_again(newest)

    def _competed_again(self, old: Hypothesis) -> Hypothesis | None:
        """Replace an earlier finding by the now best one: another kind, or a better shape."""
        kept = self._state()
        place = self.findings.index(old)
        self._take_out(old)
        self._reconsidering = True
        ranking = self.rank()
        best = self.accepted(ranking)
        self._reconsidering = False
        if best is not None and any(map(uses_the_fit, best.candidates)):
            best = replace(best, score=self._score_without(best))
        again = self._finals([list(old.candidates)])
        known = best is not None and best.kind != UNKNOWN
        if best is not None and best.kind == old.kind == UNKNOWN:
            best = self._name_in_place(old, ranking, kept.left)
            known = best is not None
            again = []
        if best is None or not known or any(h.score >= best.score for h in again):
            self._restore(kept)
            return None
        self.add(best)
        self.findings.insert(place, self.findings.pop())
        self.refit()
        self.sigma, self.left = self.weights(), self._left()
        return best

    def _take_out(self, old: Hypothesis) -> None:
        """Continue without a finding, whose place is free for others."""
        self.findings.remove(old)
        self.chosen = [c for c in self.chosen if c not in old.candidates]
        self.pool = still_free(self.whole_pool, self.chosen)
        self.refit()
        self.sigma, self.left = self.weights(), self._left()

    def _has_rival(self, old: Hypothesis) -> bool:
        """Whether another known kind, alone in the place of a finding, is nearly as good as it.

        Without one, no other kind can replace it, and :meth:`_competed_again`, which takes several
        times as long, is not needed.
        """
        kept = self._state()
        self._take_out(old)
        again = max((h.score for h in self._finals([list(old.candidates)])), default=0.0)
        best = max((h.score for h in self._known_alone(except_for=old.kind)), default=-np.inf)
        self._restore(kept)
        return bool(best > NEARLY * again)

    def _known_alone(self, except_for: str = "") -> list[Hypothesis]:
        """The best few known kinds, each alone and with refined shapes."""
        known = sorted(self._greedy_by_kind(nameless=False), key=lambda item: item[1])
        others = [own for own, _ in known if own[0].kind != except_for]
        return self._finals(others[: self.settings.refined])

    def _score_without(self, best: Hypothesis) -> float:
        """Score of an explanation by the torque of a model that lacks what it replaces.

        The columns with which it was ranked are those of a model that has it: a gain of a torque
        that contains an end stop explains the stop.
        """
        self.renew(best.candidates)
        return max((h.score for h in self._finals([list(best.candidates)])), default=-np.inf)

    def _name_in_place(
        self, old: Hypothesis, ranking: Sequence[Hypothesis], with_old: Array
    ) -> Hypothesis | None:
        """A known effect that is as good as an unknown one in presence of later findings."""
        own = set(old.joints)
        if any(h.kind == UNKNOWN and own & set(h.joints) for h in self.findings):
            return None  # its part in another function is no evidence for an effect
        removed = self.left - with_old
        for rival in self._names_on(old, ranking):
            first = self.judged(rival)
            if first is None:
                continue
            before = self._state()
            self.add(first)
            self.refit()
            for other in [h for h in self.findings if any(map(uses_the_fit, h.candidates))]:
                self._settled(other)
            left = self._left()
            self._restore(before)
            if self._good_enough(left, with_old, removed, old.joints):
                return ranked_with(first, ranking)
        return None

    def _beside_another_kind(self, shadow: Hypothesis) -> Hypothesis | None:
        """An explanation that may be an error of an earlier finding, if that has the wrong kind.

        Two effects on one joint may first look like a third one, in presence of which the second of
        them is small.
        """
        if self._reconsidering or shadow.kind == UNKNOWN or within_recordings(shadow):
            return None
        if shadow.torque is not None:
            return None  # averaged rows do not contain a line
        own = set(shadow.joints)
        for old in [h for h in self.findings if h.torque is None and own & set(h.joints)]:
            if old.kind == UNKNOWN and all(
                self.of_one_position(h, j) for h in (old, shadow) for j in shadow.joints
            ):
                continue  # two parts of one function are not two effects
            kept = self._state()
            before = self.left
            self.add(shadow)
            self.refit()
            winner = self._competed_again(old) if self._has_rival(old) else None
            if winner is not None and winner.kind != old.kind:
                counts = self.problem.rows.counts
                gain = float(log_likelihood_gain(before[None], self.left[None], counts).sum())
                added = sum(h.n_parameters for h in self.findings)
                added -= sum(h.n_parameters for h in kept.findings)
                if gain - 2 * self._price(self.chosen) * added > self.settings.least_gain:
                    self.findings = [h for h in self.findings if h is not shadow]
                    self.chosen = [c for c in self.chosen if c not in shadow.candidates]
                    self.refit()
                    self.sigma, self.left = self.weights(), self._left()
                    for found in self._finals([list(shadow.candidates)]):
                        return self.judged(found)
            self._restore(kept)
        return None

    def withdraw(self, newest: Hypothesis | None = None) -> Hypothesis | None:
        """Withdraw findings that are no longer valid in presence of later ones.

        Returns the newest finding, with its shapes searched again if it replaced another.
        """
        for old in [h for h in self.findings if h is not newest and h.torque is None]:
            without = [c for c in self.chosen if c not in old.candidates]
            related = newest is not None and of_one_family(old, newest)
            if newest is not None and related and old.joints == newest.joints:
                # A more complex member of the family replaces the simpler one.
                self._replace(old, (), without)
                newest = self._refined_anew(newest)
                continue
            together = len(old.candidates) > 2 and within_recordings(old)
            kept = tuple(
                c
                for c in old.candidates
                if (chance := self.chance(c, [o for o in self.chosen if o is not c]))
                <= self.settings.member
                and (together or self.significant(chance, c))
                and self.can_be(c, [o for o in self.chosen if o is not c])
            )
            if kept and newest is not None and self._needless(old, without):
                kept = ()
            if len(kept) < len(old.candidates):
                self._replace(old, kept, without)
            if not kept and newest is not None:
                newest = self._in_place_of(old, newest)
        return newest

    def _in_place_of(self, old: Hypothesis, function: Hypothesis) -> Hypothesis:
        """A function that explains what a name did, which is the known effect closest to it."""
        if function.kind != UNKNOWN or UNKNOWN == old.kind or function.joints != old.joints:
            return function
        place = self.findings.index(function)
        self.findings[place] = replace(
            function,
            gain=function.gain + old.gain,
            score=function.score + old.score,
            others=(old, *function.others),
        )
        return self.findings[place]

    def _refined_anew(self, finding: Hypothesis) -> Hypothesis:
        """A finding with its shapes searched again after a change of others."""
        if finding.torque is not None or not any(c.n_shapes for c in finding.candidates):
            return finding
        others = [c for c in self.chosen if c not in finding.candidates]
        blocks = self.blocks_with(others)
        better = tuple(
            refine(self.problem, blocks, finding.candidates, self.fit.noise, self.target)
        )
        place = self.findings.index(finding)
        self.findings[place] = replace(finding, candidates=better)
        self.chosen = [*others, *better]
        self.refit()
        return self.findings[place]

    def _settled(self, finding: Hypothesis) -> Hypothesis:
        """A finding with its shapes searched again, repeatedly if its columns depend on the fit."""
        follows = any(map(uses_the_fit, finding.candidates))
        for _ in range(self.settings.repeated if follows else 1):
            shapes = [c.term.shape for c in finding.candidates]
            finding = self._refined_anew(finding)
            again = [c.term.shape for c in finding.candidates]
            if all(map(close_shapes, shapes, again)):
                break
        return finding

    def _needless(self, old: Hypothesis, without: list[Candidate]) -> bool:
        """Whether an earlier finding is now explained by others."""
        within = any(map(self.is_judged_within, old.candidates))
        errors = [
            profile_error(
                self.problem, self.blocks_with(some), self.sigma, self.target, within=within
            )
            for some in (without, self.chosen)
        ]
        before, after = (e.sum(0) for e in errors)
        joints = sorted({j for c in old.candidates for j in c.rows})
        gain = self._counts * np.log(np.maximum(before, 1e-300) / np.maximum(after, 1e-300))
        least = self._tolerance(old) * (self.start - after)
        return self._mostly_small(joints, old, gain, before - after, least)

    def _replace(
        self, old: Hypothesis, kept: tuple[Candidate, ...], without: list[Candidate]
    ) -> None:
        self.chosen = [*without, *kept]
        place = self.findings.index(old)
        if kept:
            chances = tuple(
                p for c, p in zip(old.candidates, old.chances, strict=True) if c in kept
            )
            self.findings[place] = replace(old, candidates=kept, chances=chances)
        else:
            del self.findings[place]
        self.refit()
