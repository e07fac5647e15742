# SPDX-License-Identifier: BSD-3-Clause
"""Explanations of the present residual, ranked by their held-out gain."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidyn._cores import each
from skidyn._signals import Array
from skidyn.diagnosis._candidates import Candidate
from skidyn.diagnosis._courses import course_candidates
from skidyn.diagnosis._hypothesis import (
    UNKNOWN,
    Hypothesis,
    in_part,
    says_little,
    some_recordings,
    within_recordings,
)
from skidyn.diagnosis._line_search import LineSearch
from skidyn.diagnosis._looked_at import LookedAt
from skidyn.diagnosis._parts import part_candidates
from skidyn.diagnosis._profile import log_likelihood_gain, refine
from skidyn.diagnosis._recordings import DRIFT, FRICTION, own_effects
from skidyn.diagnosis._rule import (
    ALL_LEFT,
    MASKED,
    NEARLY,
    ROUNDS,
)
from skidyn.diagnosis._screen import Model, Screen
from skidyn.diagnosis._spans import FOLLOWS_ANY, span_candidates
from skidyn.diagnosis._split import prepare_splits, recordings_with, split_effects
from skidyn.diagnosis._tester import Tester
from skidyn.effects import FunctionOfSignals, FunctionOfSum, SizeByRecording, Term, get_effect

Mask = NDArray[np.bool_]
#: Indices in the pool of the added candidates, and the reduction of the held-out error.
_Greedy = tuple[list[int], float]
#: Number of kinds of which other forms are tried.
FORMS_TRIED = 3
#: Initial shapes of each further form that are refined, at most, and what such a shape removes at
#: least, as a share of what the first one does.
STARTS, START_SHARE = 3, 0.5
#: Name of the group of products of signals, which are unknown functions.
PRODUCTS = "products"


def _is_near(one: float, other: float) -> bool:
    """Whether neither of two scores is much above the other."""
    return min(one, other) > NEARLY * max(one, other)


class RankingSearch(LineSearch):
    """A search that ranks explanations."""

    def rank(self) -> list[Hypothesis]:
        """Explanations of the residual, best first."""
        screening, recordings = self._screening(self.looked), self.by_kind_of_recording()
        prepare_splits(self.problem, self.kinds)  # once, and not in each of the processes
        once = [self.lines, self._splits, self._parts, self._spans, self._courses]
        looks: list[Callable[[], Any]] = [*once, self.in_every_recording, *screening, *recordings]
        text = f"{self._round}: screening effects"
        lines, splits, (parts, in_parts), spans, courses, sizes, *found = each(
            lambda look: look(), looks, text
        )
        rough = sorted(self._found(found[: len(screening)]) + splits, key=lambda item: item[1])
        ranking = self._finals([candidates for candidates, _ in rough[: self.settings.finalists]])
        ranking += [self.against_functions(h, ranking) for h in lines]
        ranking += self._finals([own for of_kind in found[len(screening) :] for own in of_kind])
        ranking += self._finals(parts, refined=0)  # their shapes are refined already
        ranking += self._finals([*spans, *courses, *sizes], refined=0)
        ranking = [h for h in ranking if not self._follows_one_joint(h.candidates, h.gain)]
        ranking += self._other_forms(ranking)
        ranking += self._finals(self._on_one_joint(ranking), refined=0)
        self.looked.keep("lines", chain.from_iterable(h.joints for h in lines))
        self.looked.keep("parts", in_parts)
        of_recordings = chain.from_iterable(found[len(screening) :])
        for name, own in {"spans": spans, "courses": courses, "recordings": of_recordings}.items():
            self.looked.keep(name, (j for part in own for c in part for j in c.rows))
        # The least specific explanations are last: differences between recordings, and vibration.
        return sorted(ranking, key=lambda h: (self._is_last(h, ranking), -h.score))

    def _is_last(self, own: Hypothesis, ranking: Sequence[Hypothesis]) -> bool:
        """Whether any other possible explanation is more specific.

        A function of a signal with another size in each recording is one that explains much more
        than what is equal in all of them, or acts in some.
        """
        if any(isinstance(c.term.effect, SizeByRecording) for c in own.candidates):
            least = self.settings.recordings_share * own.score
            others = [h for h in ranking if h is not own and set(own.joints) & set(h.joints)]
            return any(h.score > least for h in others)
        return says_little(own) or self._holds_in_all(own, ranking)

    def _on_one_joint(self, ranking: Sequence[Hypothesis]) -> list[list[Candidate]]:
        """Torques between two joints of which one feels nothing, as torques on the other one."""
        effect, found = get_effect("function_of_sum"), []
        assert isinstance(effect, FunctionOfSum)
        for h in ranking:
            gain = np.maximum(h.gain, 0.0)
            joint = int(np.argmax(gain))
            for c in h.candidates if gain[joint] > ALL_LEFT * gain.sum() else ():
                of_sum = c.kind == UNKNOWN and len(c.joints) == 2 and "ratio" in c.term.shape
                if of_sum and joint in c.joints:
                    weights = 1.0, float(c.term.shape["ratio"])
                    shape = effect.shape_of(self.problem.few, c.joints, weights)
                    term = Term.at(effect.kind, (joint,), shape)
                    rows = self.problem.term_rows(term)
                    found.append([Candidate(UNKNOWN, term, rows, c.variables)])
        return found

    def _other_forms(self, ranking: Sequence[Hypothesis]) -> list[Hypothesis]:
        """Other forms of the best kinds, if their residual is not noise.

        It is not if it is correlated, or if an unknown function of the same joints explains more.
        On the grid, the form with the best screening score need not be the one that fits best.
        Forms of a kind that explains nearly as much as another one are tried as well, also if it
        does so in another form.
        """
        found: list[Hypothesis] = []
        tried: set[tuple[str, tuple[int, ...]]] = set()
        while True:
            names = [
                h for h in (*ranking, *found) if h.kind != UNKNOWN and not within_recordings(h)
            ]
            best = {(h.kind, h.joints): h for h in sorted(names, key=lambda h: h.score)}
            first = sorted(best.values(), key=lambda h: -h.score)[:FORMS_TRIED]
            new = [
                h
                for h in first
                if (h.kind, h.joints) not in tried and self._is_rough(h, first, ranking)
            ]
            if not new:
                return found
            tried |= {(h.kind, h.joints) for h in new}
            forms = [form for h in new for form in self._in_other_forms(h)]
            found += self._finals(forms, refined=len(forms))

    def _is_rough(
        self, own: Hypothesis, others: Sequence[Hypothesis], ranking: Sequence[Hypothesis]
    ) -> bool:
        """Whether another form of an explanation may matter."""
        if own.torque is not None or not get_effect(own.kind).forms:
            return False
        near = any(h.kind != own.kind and _is_near(h.score, own.score) for h in others)
        best = max((u.score for u in ranking if self._nameless_there(u, own)), default=0.0)
        inexact = best > own.score + self.settings.least_gain
        rough = get_effect(own.kind).is_slow  # the plain formula is an approximation
        return near or inexact or rough or self._price(own.candidates) > self.settings.white

    @staticmethod
    def _nameless_there(function: Hypothesis, named: Hypothesis) -> bool:
        """Whether an explanation is an unknown function of joints of another one."""
        return (
            function.kind == UNKNOWN
            and not within_recordings(function)
            and bool(set(function.joints) & set(named.joints))
        )

    def _in_other_forms(self, hypothesis: Hypothesis) -> list[list[Candidate]]:
        """The terms of a hypothesis in each other form of its kind, with several initial shapes.

        That which removes most before its shape is refined may lead to a worse one.
        """
        sites = {c.joints: c.form for c in hypothesis.candidates}
        starts: dict[tuple[frozenset[str], tuple[int, ...]], list[int]] = {}
        for i in np.argsort(-self.drops, kind="stable").tolist():
            c = self.ranked[i]
            if c.kind != hypothesis.kind or c.joints not in sites:
                continue
            own = starts.setdefault((c.form, c.joints), [])
            if not own or (len(own) < STARTS and self.drops[i] > START_SHARE * self.drops[own[0]]):
                own.append(i)
        forms: list[list[Candidate]] = []
        for form in dict.fromkeys(form for form, _ in starts):
            if any(form != other for other in sites.values()):
                places = zip(*(starts.get((form, joints), []) for joints in sites), strict=False)
                forms += [[self.ranked[i] for i in some] for some in places]
        return forms

    def strongest(
        self, group: Callable[[Candidate], Any], wanted: Callable[[Candidate], bool]
    ) -> dict[Any, Candidate]:
        """Of each group of candidates, the one that alone removes most."""
        best: dict[Any, int] = {}
        for i, candidate in enumerate(self.ranked):
            if not wanted(candidate):
                continue
            key = group(candidate)
            if key not in best or self.drops[i] > self.drops[best[key]]:
                best[key] = i
        return {key: self.ranked[i] for key, i in best.items()}

    def _holds_in_all(self, own: Hypothesis, ranking: Sequence[Hypothesis]) -> bool:
        """Whether an effect common to all recordings explains nearly as much as separate ones."""
        recordings = {k for c in own.candidates for k in c.term.trajectories or ()}
        few = len(recordings) <= self.settings.most_recordings and not in_part(own)
        if few or not within_recordings(own):
            return False
        # A function of time may describe the same difference between recordings.
        return any(
            h.score > (1.0 if "time" in h.variables else self.settings.recordings_share) * own.score
            for h in ranking
            if not within_recordings(h) and set(own.joints) <= set(h.joints)
        )

    def _greedy_by_kind(self, nameless: bool = True) -> list[tuple[list[Candidate], float]]:
        """For each kind, terms added joint by joint while each reduces the held-out error."""
        looks = self._screening(self.looked_alone, nameless)
        return self._found(each(lambda look: look(), looks))

    def _found(self, greedy: Iterable[_Greedy]) -> list[tuple[list[Candidate], float]]:
        """Added candidates of every kind, and minus their gain."""
        rough = [([self.ranked[i] for i in places], drop) for places, drop in greedy if places]
        return [(own, -(drop - 2 * sum(c.width for c in own))) for own, drop in rough]

    def _screening(self, looked: LookedAt, nameless: bool = True) -> list[Callable[[], _Greedy]]:
        """One result for each kind, and one for products of signals.

        These have a single coefficient, so that a function that explains more seems more expensive
        as long as the noise is not known.
        """
        tester = self.tester(self.chosen)
        looked.compare([r * s for r, s in zip(tester.residual, self.sigma, strict=True)])
        pool = self.pool if nameless else [c for c in self.pool if c.kind != UNKNOWN]
        self.ranked = list(filter(looked.is_open, pool))
        kinds = np.array([c.kind if c.n_chosen == 1 else PRODUCTS for c in self.ranked])
        screen = Screen(self.problem, self.sigma, self.ranked, self.target)
        base = screen.model(self.blocks)
        removed = screen.removed(base, np.ones(len(self.ranked), dtype=bool))
        # What removes too little from the error of all rows removes even less if folds are held
        # out: for it, the usual difference of twice the number of coefficients is assumed.
        self.drops = removed - 2.0 * screen.widths
        near = self._near(screen, removed)
        within = self._judged_within(near)
        looks: list[Callable[[], _Greedy]] = []
        for some, inside in ((near & ~within, False), (near & within, True)):
            if not some.any():
                continue
            if inside:
                screen = screen.of_parts()
                base = screen.model(self.blocks)
            first = screen.step(base, some)
            self.drops[some] = base.errors.sum() - first[some].sum(1)
            looks += [
                partial(
                    self._greedy, screen, some & (kinds == kind), kinds == kind, base, first, tester
                )
                for kind in dict.fromkeys(kinds[some])
            ]
        looked.keep_weak(self.ranked, self.drops, self.settings.least_gain)
        return looks

    def _near(self, screen: Screen, removed: Array) -> Mask:
        """Candidates that may remove enough of the held-out error."""
        near: Mask = removed - screen.widths > self.settings.least_share * screen.n_rows
        return near

    def _judged_within(self, wanted: Mask) -> Mask:
        """Those of some candidates that are held out by parts of recordings."""
        within = np.zeros(len(wanted), dtype=bool)
        for i in np.flatnonzero(wanted):
            within[i] = self.is_judged_within(self.ranked[i])
        return within

    def _greedy(
        self,
        screen: Screen,
        near: Mask,
        of_kind: Mask,
        base: Model,
        first: Array,
        tester: Tester,
    ) -> _Greedy:
        pool, errors, model, now = near, first, base, base.errors
        index: list[int] = []
        chosen: list[Candidate] = []
        # A further form was chosen from all possible ones, so it must be better by this much.
        further = self.settings.least_gain * screen.further_forms
        while pool.any():
            drops = np.where(pool, now.sum() - errors.sum(1), -np.inf)
            if not np.isfinite(drops).any():
                break
            # Unknown functions have very different numbers of coefficients: each coefficient has a
            # penalty, in units of the noise left by the best of them.
            price = 2.0
            if self.ranked[int(np.argmax(drops))].kind == UNKNOWN:
                price = self._price([self.ranked[int(np.argmax(drops))]], chosen) / 3
            order = drops - price * screen.widths - further
            found = self._first_significant(drops, order, tester, chosen)
            if found is None:
                break
            candidate = self.ranked[found]
            index.append(found)
            chosen.append(candidate)
            now = errors[found]
            of_kind = of_kind & self._still_open(candidate, chosen)
            if not of_kind.any():
                break
            model = screen.beside(model, candidate.rows)
            pool = self._near(screen, screen.removed(model, of_kind))
            pool &= self._judged_within(pool) == screen.within
            errors = screen.step(model, pool)
            tester = self.tester([*self.chosen, *chosen])
        return index, float(base.errors.sum() - now.sum())

    def _first_significant(
        self, drops: Array, order: Array, tester: Tester, chosen: Sequence[Candidate]
    ) -> int | None:
        """The first of the best few candidates that is large enough and significant.

        Between the shapes of the grid lie others, such as planes of other directions, that remove
        more: if none is significant among all that were tried, the first of every form that is by
        itself is tested with its shape refined, as it will be judged later.
        """
        near: dict[frozenset[str], int] = {}
        for i in map(int, np.argsort(-order)[: self.settings.shapes_tested]):
            candidate = self.ranked[i]
            n_rows = int(self.problem.rows.counts[list(candidate.joints)].sum())
            if not drops[i] > self.settings.least_share * n_rows:
                continue
            passes = partial(self.significant, candidate=candidate)
            chance = tester.test(candidate.rows, candidate.zeros, passes).chance
            if passes(chance):
                return i
            if candidate.n_shapes and chance < self.settings.level:
                near.setdefault(candidate.form, i)
        model = self.blocks_with([*self.chosen, *chosen]) if near else []
        for i in near.values():
            (refined,) = refine(self.problem, model, [self.ranked[i]], self.sigma, self.target)
            chance = tester.test(refined.rows, refined.zeros).chance
            if self.significant(chance, refined):
                return i
        return None

    def _still_open(self, added: Candidate, chosen: list[Candidate]) -> Mask:
        """Candidates that may be added to one of the same kind."""
        if len(added.joints) == self.problem.n_joints and self.problem.n_joints > 1:
            return np.zeros(len(self.ranked), dtype=bool)  # acts on the whole robot already
        if added.kind == UNKNOWN:
            same = set(added.variables)
            if len(chosen) >= 3:
                return np.zeros(len(self.ranked), dtype=bool)
            return np.array(
                [c.joints != added.joints and set(c.variables) == same for c in self.ranked]
            )
        taken = {c.joints for c in chosen}
        whole = self.problem.n_joints > 1
        return np.array(
            [
                c.joints not in taken and not (whole and len(c.joints) == self.problem.n_joints)
                for c in self.ranked
            ]
        )

    def _splits(self) -> list[tuple[list[Candidate], float]]:
        """Payloads and tool forces of some trajectories."""
        splits = split_effects(
            self.problem, self.kinds, self.blocks, self.sigma, self.target, self.chosen
        )
        found = []
        for split in splits:
            if split.drop.sum() > 0:
                candidate = self._carried(split.candidate)
                if not self.can_be(candidate, self.chosen):
                    continue
                own = self.with_own_sizes(candidate) if split.apart else [candidate]
                found.append((own, -float(split.drop.sum()) + 2 * sum(c.width for c in own)))
        return found

    def _carried(self, candidate: Candidate) -> Candidate:
        """A payload, in the other recordings if its mass is negative in these.

        The identified bodies contain what most recordings carry, so that both explain equally much.
        One without a mass is that of fewer recordings.
        """
        if not candidate.term.effect.grows or candidate.term.trajectories is None:
            return candidate
        tester, names = self.tester(self.chosen), self.problem.rows.recordings
        free = ~recordings_with(candidate.kind, [*self.chosen, candidate], names)
        rest = tuple(names[free].tolist())
        size = tester.test(candidate.rows).coefficients
        fewer = 0 < len(rest) < len(candidate.term.trajectories)
        if size[0] >= 0 and not (fewer and candidate.allows(-size)):
            return candidate
        term = candidate.term.with_shape(trajectories=rest)
        other = replace(candidate, term=term, rows=self.problem.term_rows(term))
        carries = tester.test(other.rows).coefficients
        return other if carries[0] > 0 or (fewer and other.allows(carries)) else candidate

    def _parts(self) -> tuple[list[list[Candidate]], set[int]]:
        """Effects of a part of the recordings, those that may be possible, and their joints.

        The joints are those of all effects that are significant in any part.
        """

        def refined(candidate: Candidate) -> Candidate:
            return refine(self.problem, self.blocks, [candidate], self.sigma, self.target)[0]

        tester, least = self.tester(self.chosen), self.settings.least_gain
        pool = [c for c in self.pool if c.term.effect.comes_and_goes and not some_recordings(c)]
        # where friction has changed already, it has changed again
        changed = {c.joints for c in self.chosen if c.kind == DRIFT and some_recordings(c)}
        pool += own_effects(self.problem, self.kinds, self.terms)
        pool = [c for c in pool if c.kind not in FRICTION or c.joints not in changed]
        found, joints = list[list[Candidate]](), set[int]()
        for some in (pool, self._of_changing_signals()):
            open_to = list(filter(self.looked.may_find("parts"), some))
            own, there = part_candidates(open_to, tester, self.significant, refined, least)
            found += own
            joints |= there
        return [own for own in found if all(self.can_be(c, self.chosen) for c in own)], joints

    def _of_changing_signals(self) -> list[Candidate]:
        """Free functions of the signals of which one differs between the recordings."""
        few, found = self.problem.few, []
        for c in self.pool:
            if isinstance(c.term.effect, SizeByRecording):
                for effect in map(get_effect, ("function_of_signal", "low_order_of_signal")):
                    assert isinstance(effect, FunctionOfSignals)
                    shape = effect.shape_of(few, (c.term.shape["of"],))
                    term = Term.at(effect.kind, c.joints, shape)
                    rows, variables = self.problem.term_rows(term), effect.variables(0, shape)
                    found.append(Candidate(UNKNOWN, term, rows, variables, n_chosen=c.n_chosen))
        return found

    def _spans(self) -> list[list[Candidate]]:
        """Effects that begin or end within recordings, those that may be possible."""
        tester, least = self.tester(self.chosen), self.settings.least_gain
        # intervals of their own for the same kind again would follow any torque
        already = {c.kind for c in self.chosen if c.term.spans}
        kinds = [kind for kind in self.kinds if kind not in already]
        among = self.looked.may_find("spans")
        found = span_candidates(self.problem, kinds, tester, self.significant, least, among)
        found = [own for own in found if all(self.can_be(c, self.chosen) for c in own)]
        return [self._in_time(own) for own in found]

    def _follows_one_joint(self, own: Sequence[Candidate], gain: Array) -> bool:
        """Whether a load in intervals of many recordings, or one, explains a single joint only.

        Or a force or a tilt with different sizes in many recordings. A force whose torque on
        several joints has the right ratios is a force; one that explains a single joint has enough
        coefficients to follow whatever is missing there.
        """
        own_sizes = len(own) > 1 and not own[0].term.effect.grows
        names = [name for c in own for name, *_ in c.term.spans]
        names += [name for c in own for name in c.term.trajectories or ()] if own_sizes else []
        several = any(len(c.rows) > 1 for c in own)
        if not names or not several or 1 < len(set(names)) <= self.settings.most_recordings:
            return False
        return bool(gain.max() > ALL_LEFT * np.maximum(gain, 0.0).sum())

    def _in_time(self, own: list[Candidate]) -> list[Candidate]:
        """An offset or friction in intervals of many recordings as an unknown function of time.

        With intervals of its own in every recording it would follow any missing torque.
        """
        timed = {name for c in own for name, *_ in c.term.spans}
        if own[0].kind not in FOLLOWS_ANY or len(timed) <= self.settings.most_recordings:
            return own
        return [replace(c, kind=UNKNOWN, variables=("time",)) for c in own]

    def _courses(self) -> list[list[Candidate]]:
        """Effects that change steadily, those that may be possible."""
        tester, least = self.tester(self.chosen), self.settings.least_gain
        already = {c.kind for c in self.chosen if c.term.course}
        kinds = [kind for kind in self.kinds if kind not in already]
        possible, among = partial(self.can_be, others=self.chosen), self.looked.may_find("courses")
        return course_candidates(
            self.problem, kinds, tester, possible, self.significant, least, among
        )

    def _finals(self, rough: list[list[Candidate]], refined: int | None = None) -> list[Hypothesis]:
        """Compare the best kinds with re-estimated noise, the first of them with refined shapes."""
        if not rough:
            return []
        refined = self.settings.refined if refined is None else refined
        _ = self.errors_now(), self.tester(self.chosen)  # before processes that would all find them
        text = f"{self._round}: refining the best"
        tasks = [(own, k < refined) for k, own in enumerate(rough)]
        found = each(lambda task: self._final(*task), tasks, text, short=not refined)
        return [h for h in found if h is not None and h.score > self.settings.least_gain]

    def _final(self, candidates: list[Candidate], refined: bool) -> Hypothesis | None:
        """An explanation with its score; None if it is impossible, physically or numerically."""
        try:
            return self._scored(candidates, refined)
        except np.linalg.LinAlgError:
            return None  # a refined shape without bound, whose columns are those of the model

    def _scored(self, candidates: list[Candidate], refined: bool) -> Hypothesis | None:
        """The same, unless the model with it has no solution."""
        kind = candidates[0].kind
        candidates = [replace(c, rows=self.problem.term_rows(c.term)) for c in candidates]
        within = any(map(self.is_judged_within, candidates))
        hypothesis = Hypothesis(kind, tuple(candidates), np.zeros(0), 0.0, 0)
        if refined and any(c.n_shapes for c in candidates):
            candidates, after = self._refined(candidates, within)
            hypothesis = replace(hypothesis, candidates=tuple(candidates))
        else:
            after = self._errors(hypothesis, within)
        for c in candidates:
            if not self.can_be(c, [*self.chosen, *(o for o in candidates if o is not c)]):
                return None
        gain = log_likelihood_gain(self.errors_now(within), after, self.problem.rows.counts)
        count = self._n_parameters(candidates)
        price = 2 * self._price(candidates)
        score = float(gain.sum()) - price * count
        if hypothesis.is_further_form:
            score -= self.settings.least_gain
        if kind == UNKNOWN and not in_part(hypothesis):
            # The held-out error includes the penalty for its coefficients already, but not if
            # other parts of the same few recordings are held out, which repeat their paths.
            score = float(gain.sum()) - price * min(count, self.settings.nameless_price)
            score -= sum(2 * float(np.log(c.n_chosen)) for c in candidates)
        return Hypothesis(kind, tuple(candidates), gain, score, count, errors=after)

    def _refined(self, candidates: list[Candidate], within: bool) -> tuple[list[Candidate], Array]:
        """Candidates with their shapes refined, and the held-out errors with them.

        A candidate that removes most of a joint's error is refined again with the remaining noise,
        because the joint had too low a weight before.
        """
        sigma, reached = self.sigma, sorted({j for c in candidates for j in c.rows})
        for _ in range(ROUNDS):
            candidates = refine(self.problem, self.blocks, candidates, sigma, self.target)
            errors = self._errors(Hypothesis("", tuple(candidates), np.zeros(0), 0.0, 0), within)
            left = errors.sum(0)[reached] / np.maximum(self.problem.rows.counts[reached], 1)
            if np.all(left > (1 - MASKED) * sigma[reached] ** 2):
                break
            sigma = sigma.copy()
            sigma[reached] = np.sqrt(left) + 1e-100
        return candidates, errors
