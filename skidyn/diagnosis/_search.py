# SPDX-License-Identifier: BSD-3-Clause
"""Which effects are missing: add the best kind, refit, repeat until nothing significant is left."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from operator import is_not
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidyn._progress import track
from skidyn._signals import Array
from skidyn.diagnosis._candidates import Candidate, catalogue_candidates
from skidyn.diagnosis._clock import LOWEST, clock_line
from skidyn.diagnosis._followed_signals import followed_signals
from skidyn.diagnosis._hypothesis import (
    UNKNOWN,
    Hypothesis,
    SearchResult,
    Step,
)
from skidyn.diagnosis._profile import log_likelihood_gain, profile_error, refine
from skidyn.diagnosis._recordings import choose, recording_candidates
from skidyn.diagnosis._rule import (
    RESOLVED,
    Settings,
    Tester,
    false_discovery_rate,
    variance_inflation,
)
from skidyn.diagnosis._screen import Screen
from skidyn.diagnosis._spectrum import SLOWEST, Line, find_lines, find_vibrations
from skidyn.diagnosis._split import split_effects
from skidyn.effects import FunctionOfSignals, NamelessEffect, Term, get_effect, nameless_kinds
from skidyn.evidence import Problem

Mask = NDArray[np.bool_]


def search(
    problem: Problem,
    kinds: Sequence[str],
    settings: Settings,
    *,
    nameless: bool = True,
    joints: Sequence[int] | None = None,
    vibration: bool = True,
) -> SearchResult:
    """Find the missing effects.

    Parameters
    ----------
    problem : Problem
        Rows, folds and the user's model.
    kinds : sequence of str
        Kinds of the catalogue to try.
    settings : Settings
        Thresholds.
    nameless : bool, default=True
        Whether nameless functions of the signals compete.
    joints : sequence of int, optional
        Joints, from 0, on which effects are tried; all by default.
    vibration : bool, default=True
        Whether waves in time are looked for, which a wrong clock makes by itself.

    Returns
    -------
    SearchResult
    """
    searcher = _Search(problem, kinds, settings, nameless)
    searcher.vibration = vibration and nameless
    if joints is not None:
        searcher.pool = [c for c in searcher.pool if set(c.joints) <= set(joints)]
    return searcher.run()


class _Search:
    def __init__(
        self, problem: Problem, kinds: Sequence[str], settings: Settings, nameless: bool
    ) -> None:
        self.problem = problem
        self.settings = settings
        self.kinds = list(kinds)
        self.vibration = nameless
        self.ripple = np.zeros_like(problem.torque)
        self.chosen: list[Candidate] = []
        self.findings: list[Hypothesis] = []
        base = problem.fit_own()
        self.fit = base
        self.pool = catalogue_candidates(problem, self.kinds)
        if nameless and settings.max_findings:
            self.pool += _nameless_candidates(problem, problem.torque - problem.explained(base))
        self.by_recording = recording_candidates(problem, self.kinds)
        self.n_tests = max(1, len(self.pool) + len(self.by_recording))
        self.whole_pool = self.pool
        self.start = self.left = np.zeros(problem.n_joints)
        self._reconsidering = False
        self._kept_tester: tuple[list[Array], Tester | None] = ([], None)

    # ---------------------------------------------------------------- state of the model so far
    @property
    def target(self) -> list[Array]:
        rows, torque = self.problem.rows, self.problem.torque - self.ripple
        return [rows.average(torque[:, j], j) for j in range(self.problem.n_joints)]

    @property
    def blocks(self) -> list[dict[int, Array]]:
        own = [self.problem.term_rows(term) for term in self.problem.terms]
        return own + [c.rows for c in self.chosen]

    def refit(self) -> None:
        problem = replace_torque(self.problem, self.problem.torque - self.ripple)
        terms = (*self.problem.terms, *(c.term for c in self.chosen))
        self.fit = problem.fit(terms, sigma=self.fit.noise)
        if not any(_uses_the_fit(c) for c in self.chosen):
            return
        # Their columns were made with the model as it was without them, which had bent toward them.
        for _ in range(self.settings.repeated):
            before = self.fit.noise
            self.problem.set_fit(self.fit)
            for candidate in filter(_uses_the_fit, self.chosen):
                candidate.rows.update(self.problem.term_rows(candidate.term))
            problem = replace_torque(self.problem, self.problem.torque - self.ripple)
            self.fit = problem.fit(terms, sigma=before)
            if np.allclose(self.fit.noise, before, rtol=0.01):
                break

    @property
    def _round(self) -> str:
        return f"Round {len(self.findings) + 1}"

    # ---------------------------------------------------------------- the loop
    def run(self) -> SearchResult:
        steps = []
        for _ in range(self.settings.max_findings):
            self.sigma = self.fit.noise
            self.left = self._left()
            self.start = np.maximum(self.start, self.left)
            ranking = self.rank()
            best = self.accepted(ranking)
            if best is None:
                steps.append(Step(ranking, None))
                break
            steps.append(Step([best, *(h for h in ranking if h.kind != best.kind)], best))
            self.add(best)
            self.withdraw(best)
            self.refit()
            best = self._settled(best, steps)
            self.reconsider(best, steps)
        self.sigma = self.fit.noise
        self.withdraw()
        everywhere = range(self.problem.n_joints)
        inflation = variance_inflation(self.problem, self.fit.residual, everywhere)
        return SearchResult(
            self.findings, steps, self.fit, self.ripple, inflation, self.pool, self.n_tests
        )

    def accepted(self, ranking: list[Hypothesis]) -> Hypothesis | None:
        """The best explanation that the rule accepts, with the terms that it accepts."""
        offered = ranking
        ranking = list(ranking)
        while (best := self.pick(ranking)) is not None:
            ranking.remove(best)
            if self._richer_known(best):
                continue
            best = self._first_of_two_names(best, offered)
            simpler = self._at_its_limit(best)
            judged = None if simpler is None else self.judged(simpler)
            if judged is not None and self.shadow(judged):
                judged = self._beside_another_kind(judged)
            if judged is not None:
                rivals = _rivals(judged, offered)
                margin, alike = _margin(judged, rivals), self._alike(judged, rivals)
                return replace(judged, margin=margin, alike=alike)
        return None

    def _alike(self, best: Hypothesis, rivals: Sequence[Hypothesis]) -> bool:
        """Whether a known effect on other joints explains as much."""
        return any(
            h.kind != UNKNOWN
            and h.joints != best.joints
            and h.score >= (1 - self.settings.alike) * best.score
            for h in rivals
        )

    def _first_of_two_names(self, best: Hypothesis, ranking: list[Hypothesis]) -> Hypothesis:
        """A nameless function, or the first of two known effects that together do as well."""
        if best.kind != UNKNOWN or best.errors is None or _within(best) or self._reconsidering:
            return best
        joints = list(best.joints)
        left = best.errors.sum(0)
        weight = 1 / np.maximum(left[joints], 1e-300)
        removed = left * np.expm1(np.maximum(best.gain, 0) / self._counts)
        tolerated = self.settings.form_tolerance * float(weight @ removed[joints])
        rivals = [
            h
            for h in ranking
            if h.kind != UNKNOWN
            and h.errors is not None
            and not _within(h)
            and set(joints) <= set(h.joints)
        ]
        for rival in rivals[: self.settings.refined]:
            first = self.judged(rival)
            if first is None:
                continue
            kept = self._state()
            self.add(first)
            self.refit()
            self.sigma = self.fit.noise
            known = sorted(self._greedy_by_kind(nameless=False), key=lambda item: item[1])
            second = [
                h
                for h in self._finals([c for c, _ in known[: self.settings.refined]])
                if set(joints) <= set(h.joints)
            ]
            errors = [h.errors.sum(0) for h in second if h.errors is not None]
            self._restore(kept)
            if any(float(weight @ (e - left)[joints]) <= tolerated for e in errors):
                return rival
        return best

    # ---------------------------------------------------------------- earlier findings, once more
    def reconsider(self, newest: Hypothesis, steps: list[Step]) -> None:
        """Let every kind compete again for what earlier findings explain, beside the newest."""
        for old in [h for h in self.findings if h is not newest and h.torque is None]:
            step = self._competed_again(old)
            if step is not None:
                steps[:] = [step if s.added is old else s for s in steps]
                newest = self._settled(newest, steps)
            elif set(old.joints) & set(newest.joints):
                self._settled(old, steps)

    def _competed_again(self, old: Hypothesis) -> Step | None:
        """Put what now wins in the place of an earlier finding: another kind, or a better shape."""
        kept = self._state()
        place = self.findings.index(old)
        self.findings.remove(old)
        self.chosen = [c for c in self.chosen if c not in old.candidates]
        taken = {c.site for c in self.chosen}
        self.pool = [c for c in self.whole_pool if c.site not in taken]
        self.refit()
        self.sigma, self.left = self.fit.noise, self._left()
        self._reconsidering = True
        ranking = self.rank()
        best = self.accepted(ranking)
        self._reconsidering = False
        again = self._finals([list(old.candidates)])
        known = best is not None and best.kind != UNKNOWN
        if best is not None and best.kind == old.kind == UNKNOWN:
            best = self._name_in_place(old, ranking, kept)
            known = best is not None
            again = []
        if best is None or not known or any(h.score >= best.score for h in again):
            self._restore(kept)
            return None
        self.add(best)
        self.findings.insert(place, self.findings.pop())
        self.refit()
        self.sigma, self.left = self.fit.noise, self._left()
        return Step([best, *(h for h in ranking if h.kind != best.kind)], best)

    def _name_in_place(
        self, old: Hypothesis, ranking: Sequence[Hypothesis], kept: tuple[Any, ...]
    ) -> Hypothesis | None:
        """A known effect that does as well as a nameless one beside what was found later."""
        joints = list(old.joints)
        bare, with_old = self.left, kept[5]
        weight = 1 / np.maximum(with_old[joints], 1e-300)
        tolerated = self.settings.form_tolerance * float(weight @ (bare - with_old)[joints])
        rivals = [h for h in ranking if h.kind != UNKNOWN and not _within(h)]
        for rival in [h for h in rivals if set(joints) <= set(h.joints)][: self.settings.refined]:
            first = self.judged(rival)
            if first is None:
                continue
            before = self._state()
            self.add(first)
            self.refit()
            for other in [h for h in self.findings if any(map(_uses_the_fit, h.candidates))]:
                self._settled(other, [])
            left = self._left()
            self._restore(before)
            if float(weight @ (left - with_old)[joints]) <= tolerated:
                return first
        return None

    def _beside_another_kind(self, shadow: Hypothesis) -> Hypothesis | None:
        """What looks like the shadow of an earlier finding, if that was the wrong kind.

        Two effects on one joint may first look like a third one, beside which the second of them is
        small.
        """
        if self._reconsidering or shadow.kind == UNKNOWN or _within(shadow):
            return None
        own = set(shadow.joints)
        for old in [h for h in self.findings if h.torque is None and own & set(h.joints)]:
            kept = self._state()
            before = self.left
            self.add(shadow)
            self.refit()
            if self._competed_again(old) is not None:
                counts = self.problem.rows.counts
                gain = float(log_likelihood_gain(before[None], self.left[None], counts).sum())
                added = sum(h.n_parameters for h in self.findings)
                added -= sum(h.n_parameters for h in kept[1])
                if gain - 2 * self._price(self.chosen) * added > self.settings.least_gain:
                    self.findings = [h for h in self.findings if h is not shadow]
                    self.chosen = [c for c in self.chosen if c not in shadow.candidates]
                    self.refit()
                    self.sigma, self.left = self.fit.noise, self._left()
                    for found in self._finals([list(shadow.candidates)]):
                        return self.judged(found)
            self._restore(kept)
        return None

    def _state(self) -> tuple[Any, ...]:
        return (
            self.chosen,
            list(self.findings),
            self.pool,
            self.ripple,
            self.sigma,
            self.left,
            self.start,
        )

    def _restore(self, state: tuple[Any, ...]) -> None:
        self.chosen, self.findings, self.pool, self.ripple, self.sigma, self.left, self.start = (
            state
        )
        self.refit()

    def _at_its_limit(self, hypothesis: Hypothesis) -> Hypothesis | None:
        """The hypothesis, or the simpler kind that its unresolved terms are; what has them waits.

        Pre-sliding shorter than can be seen is Coulomb friction. The terms that are resolved are
        found again beside it.
        """
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
        family = _family(hypothesis)
        return any(
            family
            and _family(h) == family
            and set(hypothesis.joints) <= set(h.joints)
            and _simplicity(h) >= _simplicity(hypothesis)
            for h in self.findings
        )

    def judged(self, hypothesis: Hypothesis) -> Hypothesis | None:
        """The hypothesis with those of its terms that are more than chance beside the others."""
        if hypothesis.torque is not None:  # judged on single samples, by its line
            chance = hypothesis.chances[0]
            tried = self.tried(hypothesis.kind)
            return replace(hypothesis, tried=tried) if self.significant(chance) else None
        candidates = list(hypothesis.candidates)
        if len(candidates) > 2 and _within(hypothesis):
            return self._judged_together(hypothesis)
        while candidates:
            chances = [
                self.chance(c, [*self.chosen, *(o for o in candidates if o is not c)])
                for c in candidates
            ]
            worst = int(np.argmax(chances))
            if self.significant(chances[worst], hypothesis.kind):
                kept = [j for c in candidates for j in c.rows]
                gain = np.where(np.isin(np.arange(len(hypothesis.gain)), kept), hypothesis.gain, 0)
                gain = hypothesis.gain if len(candidates) == len(hypothesis.candidates) else gain
                return replace(
                    hypothesis,
                    candidates=tuple(candidates),
                    chances=tuple(chances),
                    tried=self.tried(hypothesis.kind),
                    gain=gain,
                )
            del candidates[worst]
        return None

    def _judged_together(self, hypothesis: Hypothesis) -> Hypothesis | None:
        """What differs between recordings: more than chance together, each by itself at 5 %.

        Each recording by itself would have to stand out of all candidates, and one that does not
        would spoil the test of the others.
        """
        kept = [
            c
            for c in hypothesis.candidates
            if self.chance(c, [*self.chosen, *(o for o in hypothesis.candidates if o is not c)])
            <= self.settings.member
        ]
        if not kept:
            return None
        reached = sorted({j for c in kept for j in c.rows})
        counts = self.problem.rows.counts
        rows = {
            j: np.hstack([c.rows.get(j, np.zeros((int(counts[j]), c.width))) for c in kept])
            for j in reached
        }
        chance = self.tester(self.chosen).test(rows).chance
        if not self.significant(chance, hypothesis.kind):
            return None
        chances = (chance,) * len(kept)
        tried = self.tried(hypothesis.kind)
        return replace(hypothesis, candidates=tuple(kept), chances=chances, tried=tried)

    def significant(self, chance: float, kind: str = "") -> bool:
        """Whether a candidate is more than chance among all that were tried."""
        return false_discovery_rate(chance, self.tried(kind)) <= self.settings.level

    def tried(self, kind: str) -> int:
        """Candidates tried; nameless ones were chosen among products of functions as well."""
        return self.n_tests * (self.settings.nameless_tried if kind == UNKNOWN else 1)

    def chance(self, candidate: Candidate, others: Sequence[Candidate]) -> float:
        """Chance of a candidate's coefficients beside the model and other candidates."""
        return self.tester(others).test(candidate.rows, candidate.zeros).chance

    def tester(self, others: Sequence[Candidate]) -> Tester:
        """Tests beside the model and some candidates; the last one is kept for the next call."""
        own = [self.problem.term_rows(term) for term in self.problem.terms]
        blocks = [*own, *(c.rows for c in others)]
        made_of = [self.sigma, self.ripple, *(b[j] for b in blocks for j in b)]
        kept, tester = self._kept_tester
        if tester is None or len(kept) != len(made_of) or any(map(is_not, kept, made_of)):
            tester = Tester(self.problem, blocks, self.sigma, self.target)
            self._kept_tester = made_of, tester
        return tester

    def shadow(self, hypothesis: Hypothesis) -> bool:
        """Whether an explanation is so small that earlier ones' imperfect formulas may leave it."""
        joints = sorted({j for c in hypothesis.candidates for j in c.rows})
        settings, tolerance = self.settings, self._tolerance
        own, earlier = self._removed(self.left, hypothesis.gain), self.start - self.left
        if not self._mostly_small(joints, hypothesis.gain, own, tolerance * earlier):
            return False
        # What an imperfect formula leaves does not become noise by one known effect.
        known = hypothesis.kind != UNKNOWN and not _within(hypothesis)
        most = self._mostly_small(joints, hypothesis.gain, own, 0.5 * self.left)
        return not known or most or self._price(hypothesis.candidates) > settings.white

    @property
    def _tolerance(self) -> Array:
        """Share of the squared error removed so far that formulas may have left, by joint."""
        settings = self.settings
        shares = np.full(self.problem.n_joints, settings.exact_tolerance)
        for h in self.findings:
            if h.kind == UNKNOWN and h.torque is not None:
                continue
            nameless = h.kind == UNKNOWN
            for c in h.candidates:
                if c.term.effect.is_exact:
                    continue
                share = settings.nameless_tolerance if nameless else settings.form_tolerance
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

    def _left(self) -> Array:
        """Held-out squared error of every joint with all that was found so far."""
        errors = profile_error(self.problem, self.blocks, self.sigma, self.target)
        left: Array = errors.sum(0)
        return left

    def add(self, best: Hypothesis) -> None:
        if best.torque is not None:
            self.ripple = self.ripple + best.torque
        else:
            self.chosen = [*self.chosen, *best.candidates]
        self.findings.append(best)
        taken = {c.site for c in best.candidates}
        self.pool = [c for c in self.pool if c.site not in taken]

    def withdraw(self, newest: Hypothesis | None = None) -> None:
        """Take back what no longer holds beside all that was added after it."""
        for old in [h for h in self.findings if h is not newest and h.torque is None]:
            without = [c for c in self.chosen if c not in old.candidates]
            richer = newest is not None and _family(old) == _family(newest) != ""
            if richer and newest is not None and old.joints == newest.joints:
                # A richer member of the family takes the place of the simpler one.
                self._replace(old, (), without)
                newest = self._refined_anew(newest)
                continue
            together = len(old.candidates) > 2 and _within(old)
            kept = tuple(
                c
                for c in old.candidates
                if (chance := self.chance(c, [o for o in self.chosen if o is not c]))
                <= self.settings.member
                and (together or self.significant(chance, c.kind))
            )
            if kept and newest is not None and self._needless(old, without):
                kept = ()
            if len(kept) < len(old.candidates):
                self._replace(old, kept, without)

    def _refined_anew(self, finding: Hypothesis) -> Hypothesis:
        """A finding with its shapes found again, now that others have changed."""
        if finding.torque is not None or not any(c.n_shapes for c in finding.candidates):
            return finding
        others = [c for c in self.chosen if c not in finding.candidates]
        own = [self.problem.term_rows(term) for term in self.problem.terms]
        blocks = [*own, *(c.rows for c in others)]
        better = tuple(
            refine(self.problem, blocks, finding.candidates, self.fit.noise, self.target)
        )
        place = self.findings.index(finding)
        self.findings[place] = replace(finding, candidates=better)
        self.chosen = [*others, *better]
        self.refit()
        return self.findings[place]

    def _settled(self, finding: Hypothesis, steps: list[Step]) -> Hypothesis:
        """A finding with its shapes found again; until they stay if its columns follow the fit."""
        follows = any(map(_uses_the_fit, finding.candidates))
        for _ in range(self.settings.repeated if follows else 1):
            shapes = [c.term.shape for c in finding.candidates]
            newer = self._refined_anew(finding)
            steps[:] = [replace(s, added=newer) if s.added is finding else s for s in steps]
            finding = newer
            if all(_close(a, c.term.shape) for a, c in zip(shapes, newer.candidates, strict=True)):
                break
        return finding

    def _needless(self, old: Hypothesis, without: list[Candidate]) -> bool:
        """Whether an earlier finding became the shadow of others."""
        within = _within(old)
        errors = [
            profile_error(
                self.problem,
                [*map(self.problem.term_rows, self.problem.terms), *(c.rows for c in some)],
                self.sigma,
                self.target,
                within=within,
            )
            for some in (without, self.chosen)
        ]
        before, after = (e.sum(0) for e in errors)
        joints = sorted({j for c in old.candidates for j in c.rows})
        gain = self._counts * np.log(np.maximum(before, 1e-300) / np.maximum(after, 1e-300))
        least = self._tolerance * (self.start - after)
        return self._mostly_small(joints, gain, before - after, least)

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

    # ---------------------------------------------------------------- ranking
    def rank(self) -> list[Hypothesis]:
        """Explanations of the residual, best first."""
        rough = self._greedy_by_kind() + self._splits()
        rough.sort(key=lambda item: item[1])
        ranking = self._finals([candidates for candidates, _ in rough[: self.settings.finalists]])
        ranking += [self._against_functions(h, ranking) for h in self._lines()]
        ranking += self._recordings()
        # What says least comes last: differences between recordings, and vibration.
        return sorted(ranking, key=lambda h: (_says_little(h), -h.score))

    def pick(self, ranking: list[Hypothesis]) -> Hypothesis | None:
        """The best explanation, or a simpler one that is as good within its standard error."""
        if not ranking:
            return None
        best = self._named(ranking)
        for rival in ranking[1:]:
            if best.errors is None or rival.errors is None:
                continue
            if rival.n_parameters > best.n_parameters or _simplicity(rival) >= _simplicity(best):
                continue
            if best.errors.shape != rival.errors.shape:
                continue  # one is of some recordings, judged on other folds
            variance = best.errors.sum(0) / np.maximum(self.problem.rows.counts, 1)
            variance = np.where(variance > 0, variance, 1.0)  # a joint that rests
            behind = ((rival.errors - best.errors) / variance).sum(1)
            error = behind.std(ddof=1) * np.sqrt(len(behind))
            cap = self.settings.simpler_share * best.score
            if behind.sum() < min(max(error, 6.0), cap):
                best = rival
        return self._simplest_of_family(best, ranking)

    def _named(self, ranking: list[Hypothesis]) -> Hypothesis:
        """The first explanation, or one that says more whose formula is good enough beside it.

        A name says more than a function of signals, and an effect that holds in every recording
        more than one that has its own size in each.
        """
        best = ranking[0]
        single = _within(best)
        if best.errors is None or not (best.kind == UNKNOWN or single):
            return best
        left = best.errors.sum(0)
        removed = left * np.expm1(np.maximum(best.gain, 0) / self._counts)
        for rival in ranking[1:]:
            if rival.kind == UNKNOWN or rival.errors is None or _within(rival):
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
            errors = rival.errors
            if errors.shape != best.errors.shape:
                errors = self._errors(rival, within=single)
            weight = 1 / np.maximum(left[joints], 1e-300)
            behind = float(weight @ (errors.sum(0) - left)[joints])
            if behind <= self.settings.form_tolerance * float(weight @ removed[joints]):
                return rival
        return best

    @property
    def _counts(self) -> NDArray[np.int64]:
        return np.maximum(self.problem.rows.counts, 1)

    def _errors(self, hypothesis: Hypothesis, within: bool) -> Array:
        """Held-out errors of an explanation on the folds of single recordings, or of all."""
        blocks = [*self.blocks, *(c.rows for c in hypothesis.candidates)]
        soft = [c.term.effect.softness for c in hypothesis.candidates]
        return profile_error(
            self.problem, blocks, self.sigma, self.target, within=within, soft=soft
        )

    def _simplest_of_family(self, best: Hypothesis, ranking: list[Hypothesis]) -> Hypothesis:
        """Members of a family differ only in motion made for it: the simplest near one is named."""
        family = _family(best)
        if not family:
            return best
        near = [
            h
            for h in ranking
            if _family(h) == family
            and h.joints == best.joints
            and h.score >= self.settings.family_share * best.score
        ]
        return min([best, *near], key=_simplicity)

    def _greedy_by_kind(self, nameless: bool = True) -> list[tuple[list[Candidate], float]]:
        """For each kind, terms added joint by joint while each lowers the held-out error."""
        screen = Screen(self.problem, self.sigma, self.pool, self.target)
        kinds = np.array([c.kind for c in self.pool])
        base_model = screen.model(self.blocks)
        base = screen.held_out(base_model)
        first = screen.step(base_model)
        tester = self.tester(self.chosen)
        found = []
        wanted = [kind for kind in dict.fromkeys(kinds) if nameless or kind != UNKNOWN]
        for kind in track(wanted, f"{self._round}: screening effects"):
            chosen, drop = self._greedy(screen, kinds == kind, base, first, tester)
            if chosen:
                found.append((chosen, -(drop - 2 * sum(c.width for c in chosen))))
        return found

    def _greedy(
        self, screen: Screen, wanted: Mask, base: Array, first: Array, tester: Tester
    ) -> tuple[list[Candidate], float]:
        pool, errors, now = wanted.copy(), first, base
        chosen: list[Candidate] = []
        widths = np.array([c.width for c in self.pool])
        while pool.any():
            drops = np.where(pool, now.sum() - errors.sum(1), -np.inf)
            # Nameless functions have very different widths: each coefficient has its price, which
            # is that of the noise left by the best of them.
            price = 2.0
            if self.pool[int(np.argmax(drops))].kind == UNKNOWN:
                price = self._price([self.pool[int(np.argmax(drops))]], chosen) / 3
            found = self._first_significant(drops, drops - price * widths, tester)
            if found is None:
                break
            i, candidate = found, self.pool[found]
            chosen.append(candidate)
            now = errors[i]
            pool &= self._still_open(candidate, chosen)
            if pool.any():
                model = screen.model([*self.blocks, *(c.rows for c in chosen)])
                errors = screen.step(model, pool)
                tester = self.tester([*self.chosen, *chosen])
        return chosen, float(base.sum() - now.sum())

    def _first_significant(self, drops: Array, order: Array, tester: Tester) -> int | None:
        """The first of the best few candidates that is large enough and more than chance."""
        for i in np.argsort(-order)[: self.settings.shapes_tested]:
            candidate = self.pool[i]
            n_rows = int(self.problem.rows.counts[list(candidate.joints)].sum())
            if not drops[i] > self.settings.least_share * n_rows:
                continue
            if self.significant(
                tester.test(candidate.rows, candidate.zeros).chance, candidate.kind
            ):
                return int(i)
        return None

    def _price(self, candidates: Sequence[Candidate], others: Sequence[Candidate] = ()) -> float:
        """Price of a parameter: the inflation of the variance that is left after candidates."""
        fitted = self.tester([*self.chosen, *others, *candidates])
        joints = sorted({j for c in candidates for j in c.joints})
        left = [fitted.residual[j] for j in joints]
        return float(np.max(variance_inflation(self.problem, left, joints)))

    def _still_open(self, added: Candidate, chosen: list[Candidate]) -> Mask:
        """Which candidates may join one of the same kind."""
        if len(added.joints) == self.problem.n_joints and self.problem.n_joints > 1:
            return np.zeros(len(self.pool), dtype=bool)  # acts on the whole robot already
        if added.kind == UNKNOWN:
            same = {added.variables}
            if len(chosen) >= 3:
                return np.zeros(len(self.pool), dtype=bool)
            return np.array(
                [
                    set(c.variables) == set(v) and c.joints != added.joints
                    for c in self.pool
                    for v in same
                ]
            )
        taken = {c.joints for c in chosen}
        whole = self.problem.n_joints > 1
        return np.array(
            [
                c.joints not in taken and not (whole and len(c.joints) == self.problem.n_joints)
                for c in self.pool
            ]
        )

    def _splits(self) -> list[tuple[list[Candidate], float]]:
        """Payloads and tool forces of some trajectories, once."""
        if any(c.term.effect.search == "trajectories" for c in self.chosen):
            return []
        splits = split_effects(self.problem, self.kinds, self.blocks, self.sigma, self.target)
        return [
            ([s.candidate], -float(s.drop.sum()) + 2 * s.candidate.width)
            for s in splits
            if s.drop.sum() > 0
        ]

    def _finals(self, rough: list[list[Candidate]]) -> list[Hypothesis]:
        """Compare the best kinds with their shape refined and the noise re-estimated."""
        before = {
            within: profile_error(self.problem, self.blocks, self.sigma, self.target, within=within)
            for within in (False, True)
        }
        ranking = []
        for i, candidates in enumerate(track(rough, f"{self._round}: refining the best")):
            kind = candidates[0].kind
            candidates = [replace(c, rows=self.problem.term_rows(c.term)) for c in candidates]
            within = any(_some_recordings(c) for c in candidates)
            if i < self.settings.refined:
                candidates = refine(self.problem, self.blocks, candidates, self.sigma, self.target)
            hypothesis = Hypothesis(kind, tuple(candidates), np.zeros(0), 0.0, 0)
            after = self._errors(hypothesis, within)
            gain = log_likelihood_gain(before[within], after, self.problem.rows.counts)
            count = self._n_parameters(candidates)
            price = 2 * self._price(candidates)
            score = float(gain.sum()) - price * count
            if kind == UNKNOWN:
                # The error held out has paid for its coefficients already.
                score = float(gain.sum()) - price * min(count, self.settings.nameless_price)
            ranking.append(Hypothesis(kind, tuple(candidates), gain, score, count, errors=after))
        return [h for h in ranking if h.score > self.settings.least_gain]

    def _n_parameters(self, candidates: Sequence[Candidate]) -> int:
        # What a tool carries is told by its first coefficients; the others ride along.
        count = sum((c.term.effect.leading or c.width) + c.n_shapes for c in candidates)
        if any("trajectories" in c.term.shape for c in candidates):
            count += len(np.unique(self.problem.signals.trajectory)) // 2
        return count

    def _lines(self) -> list[Hypothesis]:
        """Torque ripple and vibration, judged on the residual at the full rate."""
        problem = self.problem
        fit = replace(self.fit, terms=problem.terms + (c.term for c in self.chosen))
        residual = problem.torque - self.ripple - problem.explained(fit)
        found = []
        least = self.settings.least_share
        if "torque_ripple" in self.kinds:
            # A few waves a turn are what a nameless function left of its own edges.
            lines = [
                line
                for line in find_lines(problem, residual)
                if line.term.shape["N"] >= RESOLVED or not self._follows_position(line.joint)
            ]
            found.append(self._of_lines("torque_ripple", "N", 1.0, lines, least))
        if self.vibration:
            # On samples, of which there are many more than rows.
            least = self.settings.least_drop * len(residual) / max(1, problem.rows.counts.max())
            lines = find_vibrations(problem, residual)
            found.append(self._of_lines(UNKNOWN, "frequency", 0.1, lines, least))
        return [h for h in found if h is not None]

    def _of_lines(
        self, kind: str, position: str, width: float, lines: Sequence[Line], least: float
    ) -> Hypothesis | None:
        """The strongest line of every joint that is large enough, more than chance and new."""
        problem = self.problem
        known = [c for h in self.findings if h.torque is not None for c in h.candidates]
        best: dict[int, Line] = {}
        for line in lines:
            at = line.term.shape[position]
            if any(
                c.term.kind == line.term.kind
                and c.joints == (line.joint,)
                and abs(c.term.shape[position] - at) < width
                for c in known
            ):
                continue
            strong = line.gain.sum() > least * int(problem.rows.counts[line.joint])
            if (
                strong
                and self.significant(line.chance)
                and (line.joint not in best or line.gain.sum() > best[line.joint].gain.sum())
            ):
                best[line.joint] = line
        if not best:
            return None
        gain, torque = np.zeros(problem.n_joints), np.zeros_like(problem.torque)
        candidates = []
        for joint, line in best.items():
            gain[joint] = line.gain.sum()
            torque[:, joint] = line.torque
            variables = ("time",) if kind == UNKNOWN else ()
            rows = problem.term_rows(line.term)
            candidates.append(Candidate(kind, line.term, rows, variables))
        count = 3 * len(candidates)
        score = float(gain.sum()) - 2 * count
        chances = tuple(best[c.joints[0]].chance for c in candidates)
        return Hypothesis(kind, tuple(candidates), gain, score, count, chances, torque=torque)

    def _follows_position(self, joint: int) -> bool:
        """Whether a nameless function of the joint's own position was added."""
        own = f"q{joint + 1}"
        return any(
            h.kind == UNKNOWN and own in h.variables and joint in h.joints for h in self.findings
        )

    def _against_functions(self, ripple: Hypothesis, ranking: Sequence[Hypothesis]) -> Hypothesis:
        """A ripple as it is, or judged on rows where a function of the signals says much more.

        Few waves per turn follow any torque that depends on the position, a bump for example.
        """
        rivals = [h for h in ranking if h.kind == UNKNOWN and set(h.joints) & set(ripple.joints)]
        if not rivals or ripple.kind == UNKNOWN:
            return ripple
        before = profile_error(self.problem, self.blocks, self.sigma, self.target)
        blocks = [*self.blocks, *(c.rows for c in ripple.candidates)]
        after = profile_error(self.problem, blocks, self.sigma, self.target)
        score = float(log_likelihood_gain(before, after, self.problem.rows.counts).sum())
        if score > self.settings.ripple_share * max(h.score for h in rivals):
            return ripple
        return replace(ripple, score=min(score, ripple.score))

    def _recordings(self) -> list[Hypothesis]:
        """What changed from one recording to the next."""
        found = []
        for kind in dict.fromkeys(c.kind for c in self.by_recording):
            if any(c.kind == kind and _some_recordings(c) for c in self.chosen):
                continue
            pool = [c for c in self.by_recording if c.kind == kind]
            chosen = choose(pool, lambda more: self.tester([*self.chosen, *more]), self.significant)
            chosen = [c for c in chosen if self._can_be(c, chosen)]
            if chosen:
                found += self._same_or_own(chosen)
        return self._finals(found)

    def _can_be(self, candidate: Candidate, chosen: Sequence[Candidate]) -> bool:
        """Whether a candidate's coefficients have a sign that its effect can have."""
        others = [*self.chosen, *(c for c in chosen if c is not candidate)]
        coefficients = self.tester(others).test(candidate.rows).coefficients
        return not np.any(coefficients * candidate.term.signs < 0)

    def _same_or_own(self, chosen: Sequence[Candidate]) -> list[list[Candidate]]:
        """Effects of few recordings by their name, those of many without one.

        Sizes of its own in many recordings are what any slow torque that is missing leaves, unless
        what remains of the joint is white.
        """
        most, white = self.settings.most_recordings, self.settings.white
        few, many = [], []
        for part in _by_joints(chosen):
            named = len(part) <= most or self._price(part) <= white
            few += part if named else []
            many += [] if named else part
        many = [replace(c, kind=UNKNOWN, variables=("trajectory",)) for c in many]
        return [part for part in (few, many) if part]


def replace_torque(problem: Problem, torque: Array) -> Problem:
    """The same problem with another torque to explain."""
    return replace(problem, torque=torque)


def _uses_the_fit(candidate: Candidate) -> bool:
    effect = candidate.term.effect
    return bool({"robot", "model_torque"} & set(effect.needs)) and effect.search == "grid"


def _close(one: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
    """Whether shape parameters are alike within a hundredth."""
    numbers = [(one[k], other[k]) for k in one if isinstance(one[k], float)]
    return all(np.isclose(a, b, rtol=0.01) for a, b in numbers)


def _some_recordings(candidate: Candidate) -> bool:
    """Whether a candidate acts in some recordings only."""
    return candidate.term.trajectories is not None


def _by_joints(candidates: Sequence[Candidate]) -> list[list[Candidate]]:
    parts: dict[tuple[int, ...], list[Candidate]] = {}
    for candidate in candidates:
        parts.setdefault(candidate.joints, []).append(candidate)
    return list(parts.values())


def _is_vibration(hypothesis: Hypothesis) -> bool:
    return hypothesis.kind == UNKNOWN and hypothesis.torque is not None


def _says_little(hypothesis: Hypothesis) -> bool:
    """Whether an explanation is one in name only: a vibration, or what differs between runs."""
    return _is_vibration(hypothesis) or (hypothesis.kind == UNKNOWN and _within(hypothesis))


def _within(hypothesis: Hypothesis) -> bool:
    return any(map(_some_recordings, hypothesis.candidates))


def _rivals(best: Hypothesis, ranking: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Other explanations of the same joints, members of the same family apart."""
    own = set(best.joints)
    family = _family(best)
    return [
        h
        for h in ranking
        if h.kind != best.kind
        and own & set(h.joints)
        and (not family or _family(h) != family)
        and (_within(best) or not _within(h))  # errors of single recordings are smaller
        and not _is_vibration(h)
    ]


def _margin(best: Hypothesis, rivals: Sequence[Hypothesis]) -> float:
    """Share of the best score by which the rivals fall short."""
    if not rivals or best.score <= 0:
        return 1.0
    return 1.0 - max(h.score for h in rivals) / best.score


def _family(hypothesis: Hypothesis) -> str:
    return "" if hypothesis.kind == UNKNOWN else get_effect(hypothesis.kind).family


def _simplicity(hypothesis: Hypothesis) -> int:
    if hypothesis.kind == UNKNOWN:
        return 100
    return get_effect(hypothesis.kind).simplicity


def _nameless_candidates(problem: Problem, residual: Array) -> list[Candidate]:
    """Nameless functions of the signals for every joint."""
    followed = [followed_signals(problem, j, residual[:, j]) for j in range(problem.n_joints)]
    candidates = []
    for kind in nameless_kinds():
        effect = get_effect(kind)
        assert isinstance(effect, NamelessEffect)
        for joints in effect.sites(problem.signals):
            joint = joints[0]
            if effect.search == "spectrum" or effect.not_shown(problem.signals, joint):
                continue
            shapes = effect.grid(problem.signals, joints)
            if isinstance(effect, FunctionOfSignals):
                sets = [names for names in followed[joint] if len(names) == effect.n_signals]
                shapes = [effect.shape_of(problem.signals, names) for names in sets]
            if effect.search == "clock":
                line = clock_line(
                    problem.signals,
                    residual[:, joint],
                    problem.rows.sliding[:, joint],
                    problem.motion.rate,
                    (LOWEST, SLOWEST),
                )
                shapes = [] if line is None else [{"frequency": line.frequency}]
            for shape in shapes:
                term = Term.at(kind, joints, shape)
                names = effect.variables(joint, shape)
                candidates.append(Candidate(UNKNOWN, term, problem.screening_rows(term), names))
    return candidates
