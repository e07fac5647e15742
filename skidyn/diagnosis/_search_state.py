# SPDX-License-Identifier: BSD-3-Clause
"""State of a search: the present model, its fit, the pool of candidates, and their tests."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidyn._last import LastResults
from skidyn._signals import Array
from skidyn.diagnosis._absorbed import absorbed_directions
from skidyn.diagnosis._blocks import variance_inflation
from skidyn.diagnosis._candidates import Candidate, catalogue_candidates
from skidyn.diagnosis._held_out import shares_of_folds
from skidyn.diagnosis._hypothesis import UNKNOWN, Hypothesis, terms_on_rows, uses_the_fit
from skidyn.diagnosis._imitation import imitate, power_of_positions
from skidyn.diagnosis._looked_at import SAME, LookedAt
from skidyn.diagnosis._nameless_candidates import nameless_candidates
from skidyn.diagnosis._profile import profile_error
from skidyn.diagnosis._recordings import recording_candidates
from skidyn.diagnosis._rule import CONFINED, Settings, false_discovery_rate
from skidyn.diagnosis._tester import Tester
from skidyn.effects import Term, TermSum
from skidyn.evidence import Problem


class Kept(NamedTuple):
    """State that is restored after a trial."""

    chosen: list[Candidate]
    findings: list[Hypothesis]
    pool: list[Candidate]
    ripple: Array
    sigma: Array
    left: Array
    start: Array
    ranked: list[Candidate]
    drops: Array


class SearchState:
    """The present model, and its residual."""

    def __init__(
        self,
        problem: Problem,
        kinds: Sequence[str],
        settings: Settings,
        nameless: bool,
    ) -> None:
        self.problem = problem
        self.settings = settings
        self.kinds = list(kinds)
        self.vibration = nameless
        self.ripple = np.zeros_like(problem.torque)
        self.chosen: list[Candidate] = []
        self.findings: list[Hypothesis] = []
        #: Findings of another search, which the problem's terms contain.
        self.earlier: list[Hypothesis] = []
        base = problem.fit_own()
        self.fit, self.sigma = base, base.noise
        self.pool = catalogue_candidates(problem, self.kinds, settings.size_share)
        self.nameless = nameless and bool(settings.max_findings)
        if self.nameless:
            self._followed = problem.torque - problem.explained(base)
            self.pool += nameless_candidates(problem, self._followed, self._absorbed)
        self.by_recording = recording_candidates(problem, self.kinds)
        self.n_tests = max(1, len(self.pool) + len(self.by_recording))
        self.whole_pool = self.pool
        self._last = LastResults()
        self.start = self.left = np.zeros(problem.n_joints)
        #: Candidates that the last ranking compared, and the held-out gain of each.
        self.ranked: list[Candidate] = []
        self.drops = np.zeros(0)
        #: What earlier rankings found, and those of known effects alone.
        self.looked, self.looked_alone = (LookedAt(problem.n_joints) for _ in range(2))
        self._reconsidering = False
        self._within: dict[Term, bool] = {}

    @property
    def target(self) -> list[Array]:
        """Averaged torque of every joint to be explained, without lines of spectra."""

        def averaged() -> list[Array]:
            rows, torque = self.problem.rows, self.problem.torque - self.ripple
            return [rows.average(torque[:, j], j) for j in range(self.problem.n_joints)]

        target: list[Array] = self._last.get("target", [self.problem.torque, self.ripple], averaged)
        return target

    @property
    def terms(self) -> TermSum:
        """Terms of the present model."""
        return self.problem.terms + (c.term for c in self.chosen)

    @property
    def _absorbed(self) -> list[Array]:
        return absorbed_directions(self.problem, self.terms, self.fit.noise)

    @property
    def blocks(self) -> list[dict[int, Array]]:
        """Columns of the present model."""
        return self.blocks_with(self.chosen)

    def blocks_with(self, candidates: Sequence[Candidate]) -> list[dict[int, Array]]:
        """Columns of the given model, and of some candidates."""
        own = [self.problem.term_rows(term) for term in self.problem.terms]
        return own + [c.rows for c in candidates]

    def refit(self) -> None:
        problem = replace_torque(self.problem, self.problem.torque - self.ripple)
        self.fit = problem.fit(self.terms, sigma=self.fit.noise)
        if not any(uses_the_fit(c) for c in self.chosen):
            return
        # Their columns were computed with the model without them, which was biased by their
        # absence.
        for _ in range(self.settings.repeated):
            before = self.fit.noise
            self.renew(self.chosen)
            problem = replace_torque(self.problem, self.problem.torque - self.ripple)
            self.fit = problem.fit(self.terms, sigma=before)
            if np.allclose(self.fit.noise, before, rtol=0.01):
                break

    def renew(self, candidates: Sequence[Candidate]) -> None:
        """Compute the columns that depend on the fit with the present one."""
        self.problem.set_fit(self.fit)
        for candidate in filter(uses_the_fit, candidates):
            candidate.rows.update(self.problem.term_rows(candidate.term))

    def weights(self) -> Array:
        """Noise by which joints are weighted in tests: that of the fit, or of each joint alone."""
        problem = replace_torque(self.problem, self.problem.torque - self.ripple)
        return np.minimum(self.fit.noise, problem.own_noise(self.terms))

    @property
    def _round(self) -> str:
        return f"Round {len(self.findings) + 1}"

    def _state(self) -> Kept:
        return Kept(
            self.chosen,
            list(self.findings),
            self.pool,
            self.ripple,
            self.sigma,
            self.left,
            self.start,
            self.ranked,
            self.drops,
        )

    def _restore(self, kept: Kept) -> None:
        for name, value in kept._asdict().items():
            setattr(self, name, value)
        self.findings = list(kept.findings)  # it may be restored again
        self.refit()

    def add(self, best: Hypothesis) -> None:
        if best.torque is not None:
            self.ripple = self.ripple + best.torque
        else:
            self.chosen = [*self.chosen, *best.candidates]
        self.findings.append(best)
        self.pool = still_free(self.pool, best.candidates)

    @property
    def residual(self) -> Array:
        """Residual of the present model at every sample, shape (n_samples, n_joints)."""
        fit = replace(self.fit, terms=self.terms)
        return self.problem.torque - self.ripple - self.problem.explained(fit)

    def follow_fit(self) -> None:
        """Columns of candidates that depend on the load or torque of the model, computed anew.

        A payload in some recordings, for example, also loads the gears there; without it, friction
        that depends on the load could not be found beside it.
        """
        before = self.problem.signals
        self.problem.set_fit(self.fit)
        after = self.problem.signals
        changed = set()
        for name in ("load", "model_torque"):
            old, new = getattr(before, name), getattr(after, name)
            moved = np.mean((new - old) ** 2, axis=0) > SAME * np.mean(old**2, axis=0)
            changed |= {(name, j) for j in np.flatnonzero(moved).tolist()}

        def is_stale(c: Candidate) -> bool:
            reads = {*c.joints, c.term.shape.get("other", c.joints[0])}
            return any((name, j) in changed for name in c.term.effect.needs for j in reads)

        pool = list(filter(is_stale, dict.fromkeys([*self.whole_pool, *self.by_recording])))
        self.looked.forget(pool)
        self.looked_alone.forget(pool)
        terms = [c.term for c in sorted(pool, key=lambda c: (c.term.effect.needs, c.joints))]
        rows = dict(zip(terms, self.problem.prepare(terms, screening=True), strict=True))
        for c in pool:
            c.rows.update(rows[c.term])

    def follow_again(self) -> None:
        """Add functions of signals on which the residual now depends, which others had hidden."""
        if not self.nameless:
            return
        residual, before = self.residual, self._followed
        change = np.mean((residual - before) ** 2, axis=0)
        joints = np.flatnonzero(change > SAME * np.mean(before**2, axis=0)).tolist()
        self._followed = before.copy()
        self._followed[:, joints] = residual[:, joints]
        if not joints:
            return
        known = {c.term for c in self.whole_pool}
        found = nameless_candidates(self.problem, residual, self._absorbed, followed_on=joints)
        new = [c for c in found if c.term not in known]
        self.pool, self.whole_pool = [*self.pool, *new], [*self.whole_pool, *new]
        self.n_tests += len(new)

    def significant(self, chance: float, candidate: Candidate | None = None) -> bool:
        """Whether a candidate is significant among all that were tried."""
        return false_discovery_rate(chance, self.tried(candidate)) <= self.settings.level

    def tried(self, candidate: Candidate | None = None) -> float:
        """Number of candidates tried.

        Unknown functions were also chosen among products of functions, and a further form of an
        effect among all possible forms; an effect in a part of the recordings among all parts.
        """
        if candidate is None:
            return float(self.n_tests)
        one_of_many = candidate.kind == UNKNOWN or candidate.is_further_form
        forms = max(self.settings.nameless_tried if one_of_many else 1, candidate.n_chosen)
        return self.n_tests * forms * candidate.n_parts

    def power_of_positions(self, joints: Collection[int]) -> float:
        """The most that an explanation can remove of the noise of positions on some joints."""

        def make() -> Array:
            return power_of_positions(self.problem, self.fit, self.sigma)

        power: Array = self._last.get("power of positions", self._made_of, make)
        return float(power[list(joints)].sum())

    def imitation(self) -> Tester:
        """Tests on the log as it would be if the present model lacked nothing."""

        def make() -> Tester:
            imitated = imitate(self.problem, replace(self.fit, terms=self.terms))
            blocks = [imitated.term_rows(term) for term in imitated.terms]
            return Tester(imitated, blocks, self.sigma, imitated.target)

        tester: Tester = self._last.get("imitation", self._made_of, make)
        return tester

    def chance(self, candidate: Candidate, others: Sequence[Candidate]) -> float:
        """P-value of a candidate's coefficients given the model and other candidates."""
        return self.tester(others).test(candidate.rows, candidate.zeros).chance

    def tester(self, others: Sequence[Candidate]) -> Tester:
        """Tests given the model and some candidates; those given only the model are cached."""
        further = others[len(self.chosen) :]
        if list(others[: len(self.chosen)]) != self.chosen:
            return Tester(self.problem, self.blocks_with(others), self.sigma, self.target)
        tester: Tester = self._last.get(
            "tester",
            self._made_of,
            lambda: Tester(self.problem, self.blocks, self.sigma, self.target),
        )
        return tester.beside([c.rows for c in further]) if further else tester

    def is_judged_within(self, candidate: Candidate) -> bool:
        """Whether a candidate is held out by parts of recordings, since it acts mostly in one.

        The other recordings do not determine it. Each of many coefficients may act elsewhere.
        """
        term = candidate.term
        if term.trajectories is not None:
            return True
        if term.effect.nameless:
            return False
        if term not in self._within:
            shares = shares_of_folds(self.problem, candidate.rows)
            self._within[term] = bool(shares.max() > CONFINED)
        return self._within[term]

    @property
    def _made_of(self) -> list[Array]:
        """Arrays on which fits of the present model depend."""
        return [self.sigma, self.ripple, *(b[j] for b in self.blocks for j in b)]

    def errors_now(self, within: bool = False) -> Array:
        """Held-out errors of the present model on the folds of single recordings, or of all."""
        errors: Array = self._last.get(
            f"errors, {within=}",
            self._made_of,
            lambda: profile_error(
                self.problem, self.blocks, self.sigma, self.target, within=within
            ),
        )
        return errors

    def _left(self) -> Array:
        """Held-out squared error of every joint with all findings so far."""
        left: Array = self.errors_now().sum(0)
        return left

    def left_without(self, findings: Sequence[Hypothesis]) -> Array:
        """Held-out squared error of every joint without some terms of the problem's model.

        Parameters
        ----------
        findings : sequence of Hypothesis
            Findings with these terms; 0 is returned if there are none.
        """
        found = set(terms_on_rows(findings))
        if not found:
            return np.zeros(self.problem.n_joints)
        blocks = [self.problem.term_rows(t) for t in self.problem.terms if t not in found]
        error: Array = profile_error(self.problem, blocks, self.sigma, self.target).sum(0)
        return error

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

    def _price(self, candidates: Sequence[Candidate], others: Sequence[Candidate] = ()) -> float:
        """Penalty of a parameter: the inflation of the variance with the candidates."""
        fitted = self.tester([*self.chosen, *others, *candidates])
        joints = sorted({j for c in candidates for j in c.joints})
        left = [fitted.residual[j] for j in joints]
        return float(np.max(variance_inflation(self.problem, left, joints)))

    def _n_parameters(self, candidates: Sequence[Candidate]) -> int:
        # The load of a tool is determined by its first coefficients; the others only accompany
        # them.
        count = sum((c.term.effect.leading or c.width) + c.n_shapes for c in candidates)
        if any("trajectories" in c.term.shape for c in candidates):
            count += len(np.unique(self.problem.signals.trajectory)) // 2
        count += 2 * sum(len(c.term.spans) for c in candidates)
        count += 2 * any(c.term.course for c in candidates)
        return count


def still_free(pool: Sequence[Candidate], chosen: Sequence[Candidate]) -> list[Candidate]:
    """Candidates at sites that are not taken yet.

    What acts on the whole robot and may change, as a tilted base, may be another one in a part of
    the recordings.
    """
    taken = {
        c.site for c in chosen if c.term.effect.scope != "robot" or not c.term.effect.comes_and_goes
    }
    return [c for c in pool if c.site not in taken]


def replace_torque(problem: Problem, torque: Array) -> Problem:
    """The same problem with another torque to explain."""
    return replace(problem, torque=torque)
