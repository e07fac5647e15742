# SPDX-License-Identifier: BSD-3-Clause
"""Withdrawal of findings: everything that was found is judged again beside all others.

A finding is withdrawn if it does not reduce the error of samples (:func:`useless`), if its size may
be zero or cannot be (:func:`to_withdraw`), if it is more likely wrong than right (:func:`guess`),
or if it is not significant without another one that was withdrawn (:func:`unsupported`). One that
is too small to matter stays in the completed model without being listed (:func:`slight`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from skidyn._signals import Array
from skidyn._text import joints_told, listed
from skidyn.diagnosis._candidates import Candidate
from skidyn.diagnosis._confidence import ABOVE, of_significant
from skidyn.diagnosis._findings import Finding
from skidyn.diagnosis._held_out import folds_alone
from skidyn.diagnosis._hypothesis import (
    UNKNOWN,
    Hypothesis,
    SearchResult,
    found_terms,
    is_vibration,
    on_samples,
    within_recordings,
)
from skidyn.diagnosis._remainder import root_mean_square
from skidyn.diagnosis._result import Diagnosis
from skidyn.diagnosis._rule import (
    CHANGE_SHARE,
    GUESS,
    LITTLE,
    LITTLE_OF_DERIVATIVES,
    MUCH,
    NOISE_REMOVED,
    SURE_OF_LITTLE,
    UNDETERMINED,
    UNLIKELY,
    false_discovery_rate,
)
from skidyn.diagnosis._search_state import replace_torque
from skidyn.diagnosis._tester import Tester
from skidyn.effects import Term, get_effect
from skidyn.evidence import Problem

#: What is said of findings that are not listed.
UNLISTED = "It is not counted as a finding."
#: Terms of one finding that are to be withdrawn.
Withdrawal = tuple[Hypothesis, list[Candidate]]


def to_withdraw(
    problem: Problem, result: SearchResult, intervals: dict[Term, dict[str, Any]]
) -> Withdrawal | None:
    """The last finding with terms that are vague or impossible, and these terms.

    Parameters
    ----------
    problem : Problem
        Rows and folds on which effects are judged.
    result : SearchResult
        Findings and the final fit.
    intervals : dict
        Parameters of every term, with intervals for fixed shapes.
    """
    findings = result.findings
    return _vague(problem, findings, intervals) or _impossible(problem, findings, intervals)


def useless(
    problem: Problem,
    result: SearchResult,
    errors: Sequence[Sequence[Sequence[float]]],
    noise: tuple[Array, Array],
    least: float,
) -> Withdrawal | None:
    """The last finding with terms that do not reduce the error of samples, and these terms.

    Parameters
    ----------
    problem : Problem
        Rows and folds on which effects are judged.
    result : SearchResult
        Findings and the final fit.
    errors : sequence of sequence of sequence of float
        After each number of findings: absolute, squared and averaged error by joint.
    noise : tuple of ndarray of shape (n_joints,)
        Noise of the torque sensor and of positions, N m or N.
    least : float
        Share of the error of samples that a finding must remove.

    Notes
    -----
    Terms of findings have reduced the error of averaged rows. The squared error, which few samples
    may dominate, and the mean absolute one are both used; terms that do not lower the squared error
    at all are included. Terms of some recordings need to remove less, by the share of samples of
    these.

    Where the noise of positions exceeds that of the torque, it dominates the error of samples, and
    changes with the inertia of the model: there the held-out error of averaged rows counts. An
    effect that lowers the error of samples there to less than this noise filters it.
    """
    sensor, position = noise
    coarse = position > np.nan_to_num(sensor)
    for k in reversed(range(len(result.findings))):
        terms = []
        for candidate in result.findings[k].candidates:
            # A compliant link moves everything that it carries: other joints may be affected more.
            joints = tuple(candidate.rows)
            absolute, squared, averaged = (
                drop_of(a, b, joints) for a, b in zip(errors[k], errors[k + 1], strict=True)
            )
            if all(coarse[j] for j in joints):
                absolute = squared = averaged
            share = _share_of_samples(problem, candidate.term.trajectories)
            little = (absolute + squared) / 2 < least * share or squared <= 0
            if little or _removes_noise(candidate, errors[k][1], errors[k + 1][1], noise):
                terms.append(candidate)
        if terms:
            return result.findings[k], terms
    return None


def _removes_noise(
    candidate: Candidate,
    before: Sequence[float],
    after: Sequence[float],
    noise: tuple[Array, Array],
) -> bool:
    """Whether an effect that moves the link removes little else than the noise of positions.

    In a soft joint, accelerations are filtered together with their noise.
    """
    joints = list(candidate.rows)
    sensor, position = np.nan_to_num(noise[0])[joints], noise[1][joints]
    if not (candidate.term.effect.moves_link and (position > sensor).any()):
        return False
    square = np.maximum(sensor**2 + position**2, np.finfo(float).tiny)
    had, has = (np.array(error)[joints] ** 2 / square for error in (before, after))
    return bool(np.sum(had - has) > NOISE_REMOVED * np.sum(np.maximum(had - 1, 0.0)))


def unsupported(problem: Problem, result: SearchResult, level: float) -> Withdrawal | None:
    """The last finding with terms that are not significant without what was withdrawn.

    Parameters
    ----------
    problem : Problem
        Rows and folds on which effects are judged.
    result : SearchResult
        Findings and the final fit, after a withdrawal.
    level : float
        Probability of a false finding over all tested candidates.
    """
    target = replace_torque(problem, problem.torque - result.ripple).target
    known = [t for t in found_terms(problem, result.findings) if not on_samples(t)]
    for hypothesis in reversed(result.findings):
        together = len(hypothesis.candidates) > 2 and within_recordings(hypothesis)
        if hypothesis.torque is not None or together:
            continue  # judged on samples, or together
        terms = []
        for candidate in hypothesis.candidates:
            others = [t for t in (*problem.terms, *known) if t != candidate.term]
            blocks = [problem.term_rows(t) for t in others]
            tester = Tester(problem, blocks, result.fit.noise, target)
            chance = tester.test(problem.term_rows(candidate.term), candidate.zeros).chance
            if false_discovery_rate(chance, hypothesis.tried) > level:
                terms.append(candidate)
        if terms:
            return hypothesis, terms
    return None


def _vague(
    problem: Problem, findings: Sequence[Hypothesis], intervals: dict[Term, dict[str, Any]]
) -> Withdrawal | None:
    """The last finding with terms whose coefficient is zero within its jackknife interval."""
    for hypothesis in reversed(findings):
        if hypothesis.kind == UNKNOWN or hypothesis.torque is not None:
            continue  # a line is judged on samples; averaged rows may not contain it
        terms = []
        for candidate in hypothesis.candidates:
            if folds_alone(problem, candidate.term).any():
                continue  # parts of all recordings judged it when it was accepted
            effect = candidate.term.effect
            sizes = [c for c in effect.coefficients if not c.is_zero]
            if len(sizes) > 1:
                continue  # each of them may be zero given the others, but not all together
            others = {s.name for s in effect.shapes}
            found = [
                value
                for name, value in intervals[candidate.term].items()
                if name not in others and isinstance(value, tuple)
            ]
            if found and all(low <= 0 <= high for _, low, high in found):
                terms.append(candidate)
        if terms:
            return hypothesis, terms
    return None


def _impossible(
    problem: Problem, findings: Sequence[Hypothesis], intervals: dict[Term, dict[str, Any]]
) -> Withdrawal | None:
    """The last finding with terms whose coefficients are physically impossible given all others.

    A sign that was right when an effect was found may change if a later finding, or an unknown
    function on the same joint, takes its place.
    """
    for hypothesis in reversed(findings):
        terms = []
        for candidate in hypothesis.candidates:
            told = intervals[candidate.term]
            values = [told.get(c.name) for c in candidate.term.coefficients]
            found = [v[0] for v in values if isinstance(v, tuple)]
            if len(found) == len(values) and not candidate.can_have(np.array(found), problem.few):
                terms.append(candidate)
        if terms:
            return hypothesis, terms
    return None


def slight(
    problem: Problem,
    findings: Sequence[Hypothesis],
    intervals: dict[Term, dict[str, Any]],
    errors: Sequence[float],
) -> dict[Term, str]:
    """Terms of findings that are too small to be significant for the robot, with remarks.

    They remain in the model with which later effects were found and errors are stated, and are not
    part of :attr:`Diagnosis.model`.

    Parameters
    ----------
    problem : Problem
        Rows and folds on which effects are judged.
    findings : sequence of Hypothesis
        Findings.
    intervals : dict
        Parameters of every term, with intervals.
    errors : sequence of float
        Error of every joint with all findings, N m or N.
    """
    remarks: dict[Term, str] = {}
    signals = problem.signals if problem.logged is None else problem.logged
    for hypothesis in findings:
        if is_vibration(hypothesis) and _in_the_noise(hypothesis, errors):
            small = [c.term for c in hypothesis.candidates]
            lines = {f"{term.shape['frequency']:.3g}" for term in small}
            waves = listed(sorted(lines, key=float))
            remark = (
                f"The torque of {joints_told(j + 1 for j in hypothesis.joints)} contains a wave of "
                f"{waves} Hz that is smaller than the noise, such as hum in a sensor"
            )
        else:
            reasons: dict[Term, str] = {}
            for term in (c.term for c in hypothesis.candidates):
                found = {name: v for name, v in intervals[term].items() if isinstance(v, tuple)}
                reason = term.effect.too_small(found, signals) or _undetermined(found)
                if reason is not None:
                    reasons[term] = reason
            if not reasons:
                continue
            small = list(reasons)
            where = joints_told(sorted({j for term in small for j in term.joints}))
            remark = f"{get_effect(hypothesis.kind).title} on {where}: {reasons[small[0]]}"
        remarks |= dict.fromkeys(small, f"{remark}. {UNLISTED}")
    return remarks


def _undetermined(intervals: dict[str, tuple[float, float, float]]) -> str | None:
    """Reason why an effect with a single number is none, in words: the number may be any.

    Shapes of other effects, which do not count when an effect is found, may take its place.
    """
    if len(intervals) != 1:
        return None
    ((_, low, high),) = intervals.values()
    least, most = sorted((abs(low), abs(high)))
    if most <= UNDETERMINED * least or low * high <= 0:
        return None
    return (
        f"its size is not determined beside the other effects, with an interval from {low:.2g} to "
        f"{high:.2g}"
    )


def _in_the_noise(hypothesis: Hypothesis, errors: Sequence[float]) -> bool:
    """Whether a vibration is smaller than the rest of the noise on every joint.

    Mains hum and fans are in the signals of sensors, without a torque.
    """
    waves = hypothesis.torque
    assert waves is not None
    return all(root_mean_square(waves[:, j]) < errors[j] for j in hypothesis.joints)


def guess(diagnosis: Diagnosis, seem_soft: Sequence[Finding] = ()) -> Withdrawal | None:
    """The last finding with terms that are more likely wrong than right, and these terms.

    If an explanation of much of an error on other joints, or another one on the same joints, is
    equally good, one of the two is right, and both are reported. A finding that removes most of an
    error is kept as its best explanation unless it is unlikely, as is (in :func:`conclude`) one
    that removes much of it where all else is noise; one that removes less has to be likely by
    itself, and one that removes very little needs a high confidence. An effect whose
    times were chosen has to be constant within them: otherwise they only show where the error of
    another effect is large. One that another formula of another finding would explain has to be
    likely by itself, as has one that moves a link whose positions are mostly noise (``seem_soft``):
    they make it seem soft, which is significant.

    Parameters
    ----------
    diagnosis : Diagnosis
        The diagnosis with all findings.
    seem_soft : sequence of Finding, default=()
        Findings of it that move such a link.
    """

    def is_sure(finding: Finding) -> bool:
        if finding.change > CHANGE_SHARE and any(term.spans for term in finding.terms):
            return False
        if finding.instead is not None:
            return finding.score is None or finding.score >= GUESS
        of_kind = [f for f in diagnosis.findings if f.kind == finding.kind]
        likely = 1.0 if finding.score is None else finding.score
        if likely < UNLIKELY:
            return False
        moves = any(term.effect.moves_link for term in finding.terms)
        drop = max(f.error_drop for f in of_kind)
        if drop > 0 and not (moves or finding.kind == UNKNOWN):
            # of samples, of which most is noise, or of averaged rows
            drop = max([drop, *(f.averaged_drop or 0.0 for f in of_kind)])
        if drop >= MUCH:
            soft = any(finding is f for f in seem_soft)
            if finding.kind != UNKNOWN and not soft:
                likely = of_significant(likely, min(f.q_value or 0.0 for f in of_kind))
            equalled = bool(finding.rivals) and finding.margin < ABOVE
            likely *= (1 + finding.alike + equalled) * (1 + len(finding.elsewhere))
        little = LITTLE_OF_DERIVATIVES if moves or finding.kind == UNKNOWN else LITTLE
        little *= _share_of_samples(diagnosis.problem, finding.trajectories)
        if drop < little and (moves or likely < SURE_OF_LITTLE):
            return False
        return likely >= GUESS or finding.error_drop >= GUESS

    sure = {term: is_sure(f) for f in diagnosis.findings for term in f.terms}
    for hypothesis in reversed(diagnosis.result.findings):
        terms = [c for c in hypothesis.candidates if not sure.get(c.term, True)]
        if terms:
            return hypothesis, terms
    return None


def without(
    problem: Problem, result: SearchResult, wrong: Hypothesis, terms: Sequence[Candidate]
) -> SearchResult:
    """The result with terms of a finding removed and the rest fitted again."""
    pairs = zip(wrong.candidates, wrong.chances, strict=True)
    kept = [(c, p) for c, p in pairs if c not in terms]
    rest = replace(wrong, candidates=tuple(c for c, _ in kept), chances=tuple(p for _, p in kept))
    ripple = result.ripple
    if wrong.torque is not None:
        torque = wrong.torque.copy()
        torque[:, [j for c in terms for j in c.joints]] = 0.0
        ripple = ripple - wrong.torque + torque
        rest = replace(rest, torque=torque)
    findings = [rest if h is wrong else h for h in result.findings if h is not wrong or kept]
    known = [t for t in found_terms(problem, findings) if not on_samples(t)]
    bare = replace_torque(problem, problem.torque - ripple)
    fit = bare.fit((*problem.terms, *known), sigma=result.fit.noise)
    doubted = (*result.doubted, *(c.term for c in terms if wrong.torque is None))
    return replace(result, findings=findings, fit=fit, ripple=ripple, doubted=doubted)


def _share_of_samples(problem: Problem, trajectories: tuple[int, ...] | None) -> float:
    """Share of the samples that belong to some trajectories."""
    if trajectories is None:
        return 1.0
    return float(np.isin(problem.signals.trajectory, trajectories).mean())


def drop_of(before: Sequence[float], after: Sequence[float], joints: Sequence[int]) -> float:
    """Share of the squared error removed on the joints of the effect, each in its own unit."""
    pairs = [(before[j], after[j]) for j in joints if before[j] > 0]
    if not pairs:
        return 0.0
    return float(np.mean([1 - (a / b) ** 2 for b, a in pairs]))
