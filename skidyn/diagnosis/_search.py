# SPDX-License-Identifier: BSD-3-Clause
"""Which effects are missing: add the best kind, refit, repeat until nothing significant is left."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2
from scipy.stats import t as student_t

from skidyn._progress import track
from skidyn._signals import Array
from skidyn.diagnosis._candidates import Candidate, catalogue_candidates
from skidyn.diagnosis._clock import clock_line
from skidyn.diagnosis._followed_signals import followed_signals
from skidyn.diagnosis._hypothesis import (
    UNKNOWN,
    Hypothesis,
    SearchResult,
    Settings,
    Step,
    variance_inflation,
)
from skidyn.diagnosis._profile import log_likelihood_gain, profile_error, refine
from skidyn.diagnosis._screen import Screen
from skidyn.diagnosis._spectrum import find_lines
from skidyn.diagnosis._split import split_effects, trajectory_offsets
from skidyn.effects import Term, get_effect
from skidyn.effects._catalogue import nameless_kinds
from skidyn.effects._nameless import FunctionOfSignals, NamelessEffect
from skidyn.evidence._folded import left_out_coefficients
from skidyn.evidence._problem import Problem

Mask = NDArray[np.bool_]

#: Waves per turn from which a nameless function of position cannot stand for torque ripple.
RESOLVED = 40.0


def search(
    problem: Problem,
    kinds: Sequence[str],
    settings: Settings,
    *,
    nameless: bool = True,
    joints: Sequence[int] | None = None,
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

    Returns
    -------
    SearchResult
    """
    searcher = _Search(problem, kinds, settings, nameless)
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
        self.ripple = np.zeros_like(problem.torque)
        self.chosen: list[Candidate] = []
        self.findings: list[Hypothesis] = []
        base = problem.fit_own()
        self.fit = base
        self.pool = catalogue_candidates(problem, self.kinds)
        if nameless:
            self.pool += _nameless_candidates(problem, problem.torque - problem.explained(base))
        self.n_tests = len(self.pool)

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
        # Their columns were made with the model as it was without them.
        self.problem.with_fit(self.fit)
        for candidate in filter(_uses_the_fit, self.chosen):
            candidate.rows.update(self.problem.term_rows(candidate.term))
        problem = replace_torque(self.problem, self.problem.torque - self.ripple)
        self.fit = problem.fit(terms, sigma=self.fit.noise)

    @property
    def _round(self) -> str:
        return f"Round {len(self.findings) + 1}"

    # ---------------------------------------------------------------- the loop
    def run(self) -> SearchResult:
        steps = []
        first: Array | None = None
        for _ in range(self.settings.max_findings):
            self.inflation = variance_inflation(self.problem, self.fit.residual)
            self.sigma = self.fit.noise
            ranking = self.rank()
            best = self.pick(ranking)
            while best is not None and self.worth(best, first) and not self.stands(best):
                ranking.remove(best)
                best = self.pick(ranking)
            if best is None or not self.worth(best, first):
                steps.append(Step(ranking, None))
                break
            steps.append(Step([best, *(h for h in ranking if h is not best)], best))
            if first is None:
                first = np.maximum(best.gain, 0)
            self.add(best)
            self.prune(best, first)
            self.refit()
        self.sigma = self.fit.noise
        self.settle()
        inflation = variance_inflation(self.problem, self.fit.residual)
        return SearchResult(self.findings, steps, self.fit, self.ripple, inflation, self.pool)

    def worth(self, best: Hypothesis, first: Array | None) -> bool:
        """Whether an explanation is more than noise, and more than a shadow of the first one."""
        if best.score < self.settings.least_gain:
            return False
        if first is None:
            return True
        rows = sorted({j for c in best.candidates for j in c.rows} | set(best.joints))
        same, anywhere = first[rows].sum(), first.sum()
        least = max(self.settings.second_same * same, self.settings.second_any * anywhere)
        return bool(best.score >= least)

    def stands(self, best: Hypothesis) -> bool:
        """Whether an explanation holds when folds are left out."""
        if best.errors is None:
            return True
        sure = best.score >= self.settings.sure_gain
        most = self.settings.least_chance if sure else self.settings.weak_chance
        return self.chance(best, self.chosen) <= most

    def chance(self, hypothesis: Hypothesis, others: Sequence[Candidate]) -> float:
        """Chance of an explanation's clearest coefficient, beside other terms (jackknife)."""
        own = [self.problem.term_rows(term) for term in self.problem.terms]
        blocks = [*own, *(c.rows for c in (*others, *hypothesis.candidates))]
        design = self.problem.design(blocks)
        whole, left = left_out_coefficients(self.problem, design, self.sigma, self.target)
        n = len(left)
        error = np.sqrt((n - 1) / n * np.sum((left - left.mean(0)) ** 2, axis=0))
        new = sum(c.width for c in hypothesis.candidates)
        t = np.max(np.abs(whole[-new:]) / np.maximum(error[-new:], 1e-300))
        return float(2 * student_t.sf(t, n - 1))

    def settle(self) -> None:
        """Take back what no longer holds beside all that was added after it."""
        while True:
            judged = [h for h in self.findings if h.errors is not None]
            chances = [
                self.chance(h, [c for c in self.chosen if c not in h.candidates]) for h in judged
            ]
            if not judged or max(chances) <= self.settings.least_chance:
                return
            weakest = judged[int(np.argmax(chances))]
            self.findings.remove(weakest)
            self.chosen = [c for c in self.chosen if c not in weakest.candidates]
            self.refit()

    def add(self, best: Hypothesis) -> None:
        if best.torque is not None:
            self.ripple = self.ripple + best.torque
        else:
            self.chosen += best.candidates
        self.findings.append(best)
        taken = {c.site for c in best.candidates}
        self.pool = [c for c in self.pool if c.site not in taken]

    def prune(self, newest: Hypothesis, first: Array) -> None:
        """Drop an earlier kind that the newest one made needless."""
        reach = {j for c in newest.candidates for j in (*c.joints, *c.rows)}
        limit = max(30.0, 0.02 * first.sum())
        for old in [h for h in self.findings if h is not newest and h.torque is None]:
            if not reach & set(old.joints):
                continue
            without = [c for c in self.chosen if c not in old.candidates]
            if _family(old) and _family(old) == _family(newest) and old.joints == newest.joints:
                # A richer member of the family takes the place of the simpler one.
                self.chosen = without
                self.findings.remove(old)
                continue
            errors = [
                profile_error(
                    self.problem,
                    [*map(self.problem.term_rows, self.problem.terms), *(c.rows for c in some)],
                    self.sigma,
                    self.target,
                )
                for some in (without, self.chosen)
            ]
            gain = log_likelihood_gain(errors[0], errors[1], self.problem.rows.counts).sum()
            if gain < limit:
                self.chosen = without
                self.findings.remove(old)

    # ---------------------------------------------------------------- ranking
    def rank(self) -> list[Hypothesis]:
        """Explanations of the residual, best first."""
        rough = self._greedy_by_kind() + self._splits()
        rough.sort(key=lambda item: item[1])
        ranking = self._finals([candidates for candidates, _ in rough[: self.settings.finalists]])
        ranking += [self._against_functions(h, ranking) for h in self._ripples()]
        ranking += self._offsets_between_recordings()
        return sorted(ranking, key=lambda h: -h.score)

    def pick(self, ranking: list[Hypothesis]) -> Hypothesis | None:
        """The best explanation, or a simpler one that is as good within its standard error."""
        if not ranking:
            return None
        best = ranking[0]
        for rival in ranking[1:]:
            if best.errors is None or rival.errors is None:
                continue
            if rival.n_parameters > best.n_parameters or _simplicity(rival) >= _simplicity(best):
                continue
            variance = best.errors.sum(0) / np.maximum(self.problem.rows.counts, 1)
            variance = np.where(variance > 0, variance, 1.0)  # a joint that rests
            behind = ((rival.errors - best.errors) / variance).sum(1)
            error = behind.std(ddof=1) * np.sqrt(len(behind))
            cap = self.settings.simpler_share * best.score
            if behind.sum() < min(max(error, 6.0), cap):
                best = rival
        return self._simplest_of_family(best, ranking)

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

    def _limit(self, n_columns: int, joints: Sequence[int], n_rows: int) -> float:
        """Least drop of squared error (in noise units) that is not chance."""
        chance = float(chi2.isf(self.settings.significance / self.n_tests, n_columns))
        inflated = float(self.inflation[list(joints)].max()) * chance
        return max(inflated, 2 * self.settings.relative_gate * n_rows)

    def _candidate_limit(self, candidate: Candidate) -> float:
        counts = self.problem.rows.counts
        n_rows = int(counts[list(candidate.joints)].sum())
        return self._limit(candidate.width, tuple(candidate.rows), n_rows)

    def _greedy_by_kind(self) -> list[tuple[list[Candidate], float]]:
        """For each kind, terms added joint by joint while each lowers the held-out error."""
        screen = Screen(self.problem, self.sigma, self.pool, self.target)
        kinds = np.array([c.kind for c in self.pool])
        base_model = screen.model(self.blocks)
        base = screen.held_out(base_model)
        first = screen.step(base_model)
        found = []
        for kind in track(list(dict.fromkeys(kinds)), f"{self._round}: screening effects"):
            chosen, drop = self._greedy(screen, kinds == kind, base, first)
            if chosen:
                found.append((chosen, -(drop - 2 * sum(c.width for c in chosen))))
        return found

    def _greedy(
        self, screen: Screen, wanted: Mask, base: Array, first: Array
    ) -> tuple[list[Candidate], float]:
        pool, errors, now = wanted.copy(), first, base
        chosen: list[Candidate] = []
        # Nameless functions have very different widths: the price that they pay in the end.
        dear = 3 * float(self.inflation.max())
        prices = np.array([2 * c.width * (dear if c.kind == UNKNOWN else 1.0) for c in self.pool])
        while pool.any():
            drops = np.where(pool, now.sum() - errors.sum(1) - prices, -np.inf)
            i = int(np.argmax(drops))
            candidate, drop = self.pool[i], now - errors[i]
            agree = float((drop > 0).mean())
            if drop.sum() <= self._candidate_limit(candidate):
                break
            if agree < self.settings.agreeing_folds:
                break
            chosen.append(candidate)
            now = errors[i]
            pool &= self._still_open(candidate, chosen)
            if pool.any():
                model = screen.model([*self.blocks, *(c.rows for c in chosen)])
                errors = screen.step(model, pool)
        return chosen, float(base.sum() - now.sum())

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
        if any(get_effect(c.term.kind).search == "trajectories" for c in self.chosen):
            return []
        found = []
        n_joints, n_rows = self.problem.n_joints, int(self.problem.rows.counts.sum())
        splits = split_effects(self.problem, self.kinds, self.blocks, self.sigma, self.target)
        for split in splits:
            candidate = split.candidate
            limit = 1.5 * self._limit(candidate.width, range(n_joints), n_rows)
            if split.drop.sum() > limit and np.all(split.drop > 0):
                count = candidate.width + len(np.unique(self.problem.signals.trajectory)) // 2
                found.append(([candidate], -(float(split.drop.sum()) - 2 * count)))
        return found

    def _finals(self, rough: list[list[Candidate]]) -> list[Hypothesis]:
        """Compare the best kinds with their shape refined and the noise re-estimated."""
        before = profile_error(self.problem, self.blocks, self.sigma, self.target)
        price = 2 * float(self.inflation.max())
        ranking = []
        for i, candidates in enumerate(track(rough, f"{self._round}: refining the best")):
            kind = candidates[0].kind
            if i < self.settings.refined:
                candidates = refine(self.problem, self.blocks, candidates, self.sigma, self.target)
            blocks = [*self.blocks, *(c.rows for c in candidates)]
            after = profile_error(self.problem, blocks, self.sigma, self.target)
            gain = log_likelihood_gain(before, after, self.problem.rows.counts)
            count = self._n_parameters(candidates)
            score = float(gain.sum()) - price * count
            if kind == UNKNOWN:
                score = score * (1 - self.settings.unknown_handicap) - 2 * price * count
            ranking.append(Hypothesis(kind, tuple(candidates), gain, score, count, after))
        return ranking

    def _n_parameters(self, candidates: Sequence[Candidate]) -> int:
        count = sum(c.width + c.n_shapes for c in candidates)
        if any("trajectories" in c.term.shape for c in candidates):
            count += len(np.unique(self.problem.signals.trajectory)) // 2
        return count

    def _ripples(self) -> list[Hypothesis]:
        """Torque ripple, judged on the residual at the full rate."""
        if "torque_ripple" not in self.kinds:
            return []
        problem = self.problem
        terms = (*problem.terms, *(c.term for c in self.chosen))
        fit = replace(self.fit, terms=terms)
        residual = problem.torque - self.ripple - problem.explained(fit)
        best: dict[int, Any] = {}
        known = [c for h in self.findings for c in h.candidates if c.kind == "torque_ripple"]
        for line in find_lines(problem, residual):
            old = [c for c in known if c.joints == (line.joint,)]
            if any(abs(c.term.shape["N"] - line.waves) < 1 for c in old):
                continue
            if line.waves < RESOLVED and self._follows_position(line.joint):
                continue  # what the nameless function left of its own edges
            n_rows = int(problem.rows.counts[line.joint])
            strong = line.gain.sum() > max(40.0, 2 * self.settings.relative_gate * n_rows)
            agree = _chance_of_mean(line.gain) < self.settings.least_chance
            if (
                strong
                and agree
                and (line.joint not in best or line.gain.sum() > best[line.joint].gain.sum())
            ):
                best[line.joint] = line
        if not best:
            return []
        gain, torque = np.zeros(problem.n_joints), np.zeros_like(problem.torque)
        candidates = []
        for joint, line in best.items():
            gain[joint] = line.gain.sum()
            term = Term("torque_ripple", (joint,), {"N": line.waves})
            columns = get_effect("torque_ripple").columns(problem.signals, joint, N=line.waves)
            torque[:, joint] = columns @ line.coefficients
            candidates.append(Candidate("torque_ripple", term, problem.term_rows(term)))
        count = 3 * len(candidates)
        score = float(gain.sum()) - 2 * count
        return [Hypothesis("torque_ripple", tuple(candidates), gain, score, count, None, torque)]

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
        if not rivals:
            return ripple
        before = profile_error(self.problem, self.blocks, self.sigma, self.target)
        blocks = [*self.blocks, *(c.rows for c in ripple.candidates)]
        after = profile_error(self.problem, blocks, self.sigma, self.target)
        score = float(log_likelihood_gain(before, after, self.problem.rows.counts).sum())
        if score > self.settings.ripple_share * max(h.score for h in rivals):
            return ripple
        return replace(ripple, score=min(score, ripple.score))

    def _offsets_between_recordings(self) -> list[Hypothesis]:
        """A sensor that was zeroed anew before some recording."""
        if "offset" not in self.kinds or any("trajectory" in c.term.shape for c in self.chosen):
            return []
        found = trajectory_offsets(self.problem, self.blocks, self.target)
        found = {j: item for j, item in found.items() if item[1] > 60}
        if not found:
            return []
        gain = np.zeros(self.problem.n_joints)
        for j, (_, value) in found.items():
            gain[j] = value
        candidates = tuple(c for some, _ in found.values() for c in some)
        score = 0.8 * float(gain.sum()) - 10 * len(found)
        return [Hypothesis("offset", candidates, gain, score, len(candidates))]


def replace_torque(problem: Problem, torque: Array) -> Problem:
    """The same problem with another torque to explain."""
    return replace(problem, torque=torque)


def _uses_the_fit(candidate: Candidate) -> bool:
    effect = get_effect(candidate.term.kind)
    return bool({"robot", "model_torque"} & set(effect.needs)) and effect.search == "grid"


def _chance_of_mean(values: Array) -> float:
    """Chance of such a mean over folds if it were zero (one-sided Student's t)."""
    if len(values) < 2:
        return 1.0
    error = np.std(values, ddof=1) / np.sqrt(len(values))
    return float(student_t.sf(values.mean() / max(error, 1e-300), len(values) - 1))


def _family(hypothesis: Hypothesis) -> str:
    return "" if hypothesis.kind == UNKNOWN else get_effect(hypothesis.kind).family


def _simplicity(hypothesis: Hypothesis) -> int:
    if hypothesis.kind == UNKNOWN:
        return 100
    return get_effect(hypothesis.kind).simplicity


def _nameless_candidates(problem: Problem, residual: Array) -> list[Candidate]:
    """Nameless functions of the signals for every joint."""
    joints = range(problem.n_joints)
    followed = [followed_signals(problem, j, residual[:, j]) for j in joints]
    candidates = []
    for kind in nameless_kinds():
        effect = get_effect(kind)
        assert isinstance(effect, NamelessEffect)
        for joint in range(problem.n_joints):
            if effect.not_shown(problem.signals, joint):
                continue
            shapes = effect.grid(problem.signals, (joint,))
            if isinstance(effect, FunctionOfSignals):
                sets = [names for names in followed[joint] if len(names) == effect.n_signals]
                shapes = [effect.shape_of(problem.signals, names) for names in sets]
            if effect.search == "clock":
                line = clock_line(
                    problem.signals,
                    residual[:, joint],
                    problem.rows.sliding[:, joint],
                    problem.motion.rate,
                )
                shapes = [] if line is None else [{"frequency": line}]
            for shape in shapes:
                term = Term(kind, (joint,), shape)
                names = effect.variables(joint, shape)
                candidates.append(Candidate(UNKNOWN, term, problem.term_rows(term), names))
    return candidates
