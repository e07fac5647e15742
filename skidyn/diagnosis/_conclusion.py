# SPDX-License-Identifier: BSD-3-Clause
"""Conversion of a search result to a diagnosis: held-out errors, intervals, curves, texts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidyn._progress import track
from skidyn._signals import Array
from skidyn._text import joints_told, listed
from skidyn.diagnosis._candidates import Candidate
from skidyn.diagnosis._comparison import Comparison
from skidyn.diagnosis._confidence import confidence, mostly_stays
from skidyn.diagnosis._constancy import Change, changes
from skidyn.diagnosis._correction import is_physics, refitted_errors
from skidyn.diagnosis._episodes import (
    Episode,
    acting,
    away_from_reversals,
    find_episodes,
)
from skidyn.diagnosis._findings import (
    Finding,
    effect_curves,
    make_finding,
    rivals_of,
)
from skidyn.diagnosis._floor import predictable_share
from skidyn.diagnosis._held_out import folds_alone, held_out_residual
from skidyn.diagnosis._hypothesis import UNKNOWN, Hypothesis, SearchResult
from skidyn.diagnosis._intervals import parameter_intervals
from skidyn.diagnosis._limits import Limit
from skidyn.diagnosis._noise import sensor_noise
from skidyn.diagnosis._remainder import (
    Remainder,
    find_remainder,
    position_noise,
    root_mean_square,
    torque_range,
)
from skidyn.diagnosis._result import Diagnosis, Verdict
from skidyn.diagnosis._rule import (
    CHANGE_SHARE,
    EPISODE_LEAST_HELD,
    EPISODE_LEAST_NOISE,
    EPISODE_LEAST_RANGE,
    GUESS,
    LITTLE,
    MUCH,
    SURE_OF_LITTLE,
    false_discovery_rate,
)
from skidyn.diagnosis._search_state import replace_torque
from skidyn.diagnosis._unknown import UnknownTorque, describe_unknowns
from skidyn.effects import Term, get_effect
from skidyn.evidence import Problem


def conclude(
    problem: Problem,
    result: SearchResult,
    limits: list[Limit],
    sliding: NDArray[np.bool_],
    torque: Array,
    notes: list[str],
    least_drop: float,
    model: Any,
    data: tuple[Any, ...],
) -> Diagnosis:
    """Make a diagnosis from the result of a search.

    Parameters
    ----------
    problem : Problem
        Rows and folds on which effects are judged.
    result : SearchResult
        Findings and the final fit.
    limits : list of Limit
        Limits of undetected effects.
    sliding : ndarray of shape (n_samples, n_joints) of bool
        Samples away from rest and reversals.
    torque : ndarray of shape (n_samples, n_joints)
        Measured torque, N m or N.
    notes : list of str
        Remarks on the data.
    least_drop : float
        Share of the error of samples that a finding must remove.
    model : regressor
        The model as given.
    data : tuple
        X and torque as given.
    """
    robot = problem.robot
    assert robot is not None
    while True:
        comparisons, history, averages, residual, own_torque = _steps(
            problem, result, torque, sliding
        )
        terms = [*problem.terms, *_found_terms(problem, result.findings)]
        fixed = parameter_intervals(problem, terms, result.fit.noise, shapes=False)
        errors = [
            [_mean_error(c), entry["rmse"], average]
            for c, entry, average in zip(comparisons, history, averages, strict=True)
        ]
        noise = sensor_noise(problem.signals, residual), position_noise(problem, result.fit)
        useless = _useless(problem, result, errors, noise, least_drop)
        useless = useless or _vague(problem, result.findings, fixed)
        useless = useless or _impossible(result.findings, fixed)
        if useless is None:
            break
        result = _without(problem, result, *useless)
    intervals = parameter_intervals(problem, terms, result.fit.noise)
    shown, remarks = [entry["rmse"] for entry in history], list(notes)
    if not is_physics(model):
        shown, remark = _refitted(problem, result, model, data, shown)
        remarks.append(remark)
    rivals = {h.kind: rivals_of(h) for h in result.findings}
    unknowns = _unknowns(problem, result, terms)
    slight = _slight(problem, result.findings, intervals)
    remarks += slight.values()
    findings = []
    for i, hypothesis in enumerate(result.findings):
        if i in slight:
            continue
        others = rivals.get(hypothesis.kind, ())
        for candidate, chance in zip(hypothesis.candidates, hypothesis.chances, strict=True):
            drop = _drop(shown[i], shown[i + 1], tuple(candidate.rows))
            joints = [j + 1 for j in candidate.joints]
            own = [u for u in unknowns if hypothesis.kind == UNKNOWN and u.joint in joints]
            q = false_discovery_rate(chance, hypothesis.tried)
            finding = make_finding(problem, hypothesis, candidate, others, q, drop, intervals, own)
            finding.when.extend(acting(problem, candidate.term, own_torque))
            curves = effect_curves(problem, finding.terms, own_torque, residual)
            finding.curves.extend(curves)
            findings.append(finding)
    share = predictable_share(problem, result.fit.residual)
    rmse = np.array(history[-1]["rmse"])
    parts = find_remainder(problem, result.fit, noise, torque, rmse, share)
    least = np.maximum(
        EPISODE_LEAST_RANGE * torque_range(torque), EPISODE_LEAST_NOISE * parts.noise
    )
    smooth = away_from_reversals(problem, result.fit.residual, sliding)
    # On a joint with a finding, large local residuals are errors of its imperfect formula.
    taken = {j for h in result.findings for c in h.candidates for j in c.rows}
    share_held = np.array([np.inf if j in taken else EPISODE_LEAST_HELD for j in range(len(rmse))])
    episodes, inside = find_episodes(problem, smooth, least, share_held)
    if episodes:
        findings.append(_episodic(episodes, inside, result.fit.residual))
    ends = np.array(history[0]["rmse"]), rmse
    whole = problem.whole_trajectories
    scores = {h.kind: h.score for h in result.findings}
    changed = changes(problem, result)
    for i, finding in enumerate(findings):
        change = changed.get(finding.kind, Change())
        findings[i] = replace(finding, change=change.share, instead=change.instead)
    findings = [
        _sure(f, findings, parts, ends, whole, f.margin * scores.get(f.kind, np.inf))
        for f in findings
    ]
    diagnosis = Diagnosis(
        _verdict(findings, parts),
        robot.joint_names,
        findings,
        comparisons[0],
        comparisons[-1],
        history,
        parts.noise,
        _unexplained(findings, unknowns, parts, rmse),
        limits,
        remarks + _joint_notes(problem, parts, rmse) + _fold_notes(problem),
        model,
        data,
        problem,
        result,
        share,
        unknowns,
        parts=parts,
    )
    guess = _guess(diagnosis)
    if guess is None:
        return diagnosis
    rest = _without(problem, result, *guess)
    without = conclude(problem, rest, limits, sliding, torque, notes, least_drop, model, data)
    # "Nothing is missing" would be wrong: something is, and this is the most likely name.
    only = len(result.findings) == 1 and without.verdict == "complete"
    return diagnosis if only and max(f.error_drop for f in findings) > MUCH else without


def _refitted(
    problem: Problem, result: SearchResult, model: Any, data: tuple[Any, ...], errors: list[Any]
) -> tuple[list[Any], str]:
    """Errors of a model without physics, and notes on its identified effects."""
    assert problem.robot is not None
    remark = (
        "This model is not a rigid-body model: the effects below describe the error of this "
        "model on this log, and the robot need not have them. "
    )
    found = result.findings
    steps = [_found_terms(problem, found[:k]) for k in range(len(found) + 1)]
    again = refitted_errors(model, problem.robot, steps, *data) if found else None
    if again is None:
        return (
            errors,
            remark + "The error that an effect removes was measured on this model without "
            "refitting it.",
        )
    return (
        [[float(e) for e in step] for step in again],
        remark
        + "The error that an effect removes was measured on held-out rows, with copies of the "
        "model that were refitted with the effect.",
    )


def _steps(
    problem: Problem, result: SearchResult, torque: Array, sliding: NDArray[np.bool_]
) -> tuple[
    list[Comparison],
    list[dict[str, Any]],
    list[list[float]],
    Array,
    dict[Term, dict[int, Array]],
]:
    """Comparison and errors of the given model and after each finding.

    Also returns the errors of averaged rows, the held-out residual of the last model, and the
    torque of its findings.
    """
    comparisons, history, averages = [], [], []
    dry = [t for t in problem.terms if t.is_dry]
    for k in track(range(len(result.findings) + 1), "Judging what was found"):
        found = _found_terms(problem, result.findings[:k])
        keep = [*dry, *(found if k == len(result.findings) else ())]
        residual, own = _held_out(problem, [*problem.terms, *found], result, keep)
        comparison = _comparison(problem, torque, residual, sliding, [own[t] for t in dry])
        last = result.findings[k - 1] if k else None
        kind, joints = (last.kind, last.joints) if last else (None, ())
        comparisons.append(comparison)
        history.append(_entry(comparison, kind, joints))
        averages.append(
            [root_mean_square(problem.rows.average(r, j)) for j, r in enumerate(residual.T)]
        )
    # All terms at every sample would need most of the memory for a long log.
    return comparisons, history, averages, residual, {t: own[t] for t in found}


def _found_terms(problem: Problem, findings: Sequence[Hypothesis]) -> list[Term]:
    """Terms of findings, each once, without those of the given model."""
    terms = dict.fromkeys(c.term for h in findings for c in h.candidates)
    return [t for t in terms if t not in problem.terms]


def _useless(
    problem: Problem,
    result: SearchResult,
    errors: Sequence[Sequence[Sequence[float]]],
    noise: tuple[Array, Array],
    least: float,
) -> tuple[Hypothesis, list[Candidate]] | None:
    """The last finding with terms that do not reduce the error of samples, and these terms.

    They reduced the error of averaged rows. The squared error, which few samples may dominate, and
    the mean absolute one are both used; terms that do not lower the squared error at all are
    included. Terms of some recordings need to remove less, by the share of samples of these.

    Where the noise of positions exceeds that of the torque, it dominates the error of samples, and
    changes with the inertia of the model: there the held-out error of averaged rows counts.
    """
    sensor, position = noise
    coarse = position > np.nan_to_num(sensor)
    for k in reversed(range(len(result.findings))):
        terms = []
        for candidate in result.findings[k].candidates:
            # A compliant link moves everything that it carries: other joints may be affected more.
            joints = tuple(candidate.rows)
            absolute, squared, averaged = (
                _drop(a, b, joints) for a, b in zip(errors[k], errors[k + 1], strict=True)
            )
            if all(coarse[j] for j in joints):
                absolute = squared = averaged
            share = _share_of_samples(problem, candidate.term.trajectories)
            if (absolute + squared) / 2 < least * share or squared <= 0:
                terms.append(candidate)
        if terms:
            return result.findings[k], terms
    return None


def _share_of_samples(problem: Problem, trajectories: tuple[int, ...] | None) -> float:
    """Share of the samples that belong to some trajectories."""
    if trajectories is None:
        return 1.0
    return float(np.isin(problem.signals.trajectory, trajectories).mean())


def _vague(
    problem: Problem, findings: Sequence[Hypothesis], intervals: dict[Term, dict[str, Any]]
) -> tuple[Hypothesis, list[Candidate]] | None:
    """The last finding with terms whose coefficient is zero within its jackknife interval."""
    for hypothesis in reversed(findings):
        if hypothesis.kind == UNKNOWN or hypothesis.torque is not None:
            continue  # a line is judged on samples; averaged rows may not contain it
        terms = []
        for candidate in hypothesis.candidates:
            if folds_alone(problem, candidate.term).any():
                continue  # without the fold that determines it, its value is arbitrary
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
    findings: Sequence[Hypothesis], intervals: dict[Term, dict[str, Any]]
) -> tuple[Hypothesis, list[Candidate]] | None:
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
            if len(found) == len(values) and not candidate.allows(np.array(found)):
                terms.append(candidate)
        if terms:
            return hypothesis, terms
    return None


def _slight(
    problem: Problem, findings: Sequence[Hypothesis], intervals: dict[Term, dict[str, Any]]
) -> dict[int, str]:
    """Indices of findings that are too small to be significant for the robot, with remarks.

    They remain in the completed model, with which later effects were found.
    """
    remarks = {}
    for i, hypothesis in enumerate(findings):
        reasons = []
        for candidate in hypothesis.candidates:
            told = intervals[candidate.term]
            found = {name: v for name, v in told.items() if isinstance(v, tuple)}
            reasons.append(candidate.term.effect.too_small(found, problem.signals))
        if reasons and all(reasons):
            where = joints_told(j + 1 for j in hypothesis.joints)
            remarks[i] = (
                f"{get_effect(hypothesis.kind).title} on {where}: {reasons[0]}. It is part of the "
                "completed model and is not counted as a finding."
            )
    return remarks


def _guess(diagnosis: Diagnosis) -> tuple[Hypothesis, list[Candidate]] | None:
    """The last finding with terms that are more likely wrong than right, and these terms.

    If an explanation on other joints is equally good, one of the two is right, and both are
    reported. A finding that removes most of an error is kept as its best explanation, as is (in
    :func:`conclude`) one that removes much of it where all else is noise; one that removes very
    little needs a high confidence. An effect whose times were chosen has to be constant within
    them: otherwise they only show where the error of another effect is large. One that another
    formula of another finding would explain has to be likely by itself.
    """

    def is_sure(finding: Finding) -> bool:
        if finding.change > CHANGE_SHARE and any(term.spans for term in finding.terms):
            return False
        if finding.instead is not None:
            return finding.confidence is None or finding.confidence >= GUESS
        likely = (finding.confidence or 1.0) * (2 if finding.alike else 1)
        likely *= 1 + len(finding.elsewhere)
        drop = max(f.error_drop for f in diagnosis.findings if f.kind == finding.kind)
        little = LITTLE * _share_of_samples(diagnosis.problem, finding.trajectories)
        if drop < little and likely < SURE_OF_LITTLE:
            return False
        return max(likely, finding.error_drop) >= GUESS

    sure = {term: is_sure(f) for f in diagnosis.findings for term in f.terms}
    for hypothesis in reversed(diagnosis.result.findings):
        terms = [c for c in hypothesis.candidates if not sure.get(c.term, True)]
        if terms:
            return hypothesis, terms
    return None


def _mean_error(comparison: Comparison) -> list[float]:
    """Mean absolute error of every joint on the samples judged, N m or N."""
    use = comparison.sliding if comparison.judged is None else comparison.judged
    total = np.where(use, np.abs(comparison.residual), 0.0).sum(0)
    return [float(x) for x in total / np.maximum(use.sum(0), 1)]


def _without(
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
    known = [t for t in _found_terms(problem, findings) if not _on_samples(t)]
    bare = replace_torque(problem, problem.torque - ripple)
    fit = bare.fit((*problem.terms, *known), sigma=result.fit.noise)
    doubted = (*result.doubted, *(c.term for c in terms if wrong.torque is None))
    return replace(result, findings=findings, fit=fit, ripple=ripple, doubted=doubted)


def _unknowns(problem: Problem, result: SearchResult, terms: Sequence[Term]) -> list[UnknownTorque]:
    """Results for the unknown terms, after subtraction of the ripple."""
    nameless = [
        c.term
        for h in result.findings
        if h.kind == UNKNOWN and h.torque is None
        for c in h.candidates
        if c.term.effect.nameless
    ]
    if not nameless:
        return []
    rest = [t for t in terms if not _on_samples(t)]
    bare = replace_torque(problem, problem.torque - result.ripple)
    return describe_unknowns(bare, rest, nameless, result.fit.noise)


def _held_out(
    problem: Problem, terms: Sequence[Term], result: SearchResult, keep: Sequence[Term]
) -> tuple[Array, dict[Term, dict[int, Array]]]:
    """Held-out residual; a line's coefficients come from the residual at the full rate."""
    waves = [t for t in terms if _on_samples(t)]
    rest = [t for t in terms if not _on_samples(t)]
    if not waves:
        return held_out_residual(problem, rest, result.fit.sigma, keep)
    torque = problem.torque - result.ripple
    bare = replace_torque(problem, torque)
    residual, held = held_out_residual(bare, rest, result.fit.sigma, keep)
    for hypothesis in result.findings:
        if hypothesis.torque is None:
            continue
        for t in (c.term for c in hypothesis.candidates if c.term in waves):
            held[t] = {t.places[0]: hypothesis.torque[:, t.places[0]]}
    return residual, held


def _on_samples(term: Term) -> bool:
    """Whether a term is a line in a spectrum, which averaged rows do not contain."""
    return term.effect.search == "spectrum"


def _comparison(
    problem: Problem,
    torque: Array,
    residual: Array,
    sliding: NDArray[np.bool_],
    dry: Sequence[dict[int, Array]],
) -> Comparison:
    assert problem.robot is not None
    friction = None
    if dry:
        friction = np.zeros_like(torque)
        for own in dry:
            for j, part in own.items():
                friction[:, j] += part
    return Comparison(
        problem.signals,
        torque,
        torque - residual,
        sliding,
        problem.robot.joint_names,
        problem.rows.sliding,
        friction,
    )


def _entry(comparison: Comparison, added: str | None, joints: Sequence[int]) -> dict[str, Any]:
    rmse = [float(x) for x in comparison.rmse(judged=True)]
    return {"added": added, "joints": [j + 1 for j in joints], "rmse": rmse}


def _drop(before: Sequence[float], after: Sequence[float], joints: Sequence[int]) -> float:
    """Share of the squared error removed on the joints of the effect, each in its own unit."""
    pairs = [(before[j], after[j]) for j in joints if before[j] > 0]
    if not pairs:
        return 0.0
    return float(np.mean([1 - (a / b) ** 2 for b, a in pairs]))


def _sure(
    finding: Finding,
    findings: Sequence[Finding],
    parts: Remainder,
    errors: tuple[Array, Array],
    whole: bool,
    lead: float,
) -> Finding:
    """The finding with the probability that it is identified correctly."""
    if not finding.terms:
        return finding
    joints = _reached(finding)
    others = [f for f in findings if f is not finding and f.kind == UNKNOWN]
    beside = any({j - 1 for j in f.joints} & set(joints) for f in others)
    same = sorted({j for f in findings if f.kind == finding.kind for j in _reached(f)})
    before, after = (error[same] for error in errors)
    # Noise that is correlated in time is larger than its fast part, and similar on all joints; a
    # single joint does not show this.
    ratio = errors[1] / np.maximum(parts.noise, np.finfo(float).tiny)
    alike = max(1.0, float(ratio.min())) if len(ratio) > 1 else 1.0
    probability = confidence(
        finding.margin,
        float(parts.inflation[joints].max()),
        max(f.error_drop for f in findings if f.kind == finding.kind),
        lead=lead,
        nameless=finding.kind != UNKNOWN and (beside or bool(parts.material[joints].any())),
        whole_recordings=whole,
        alike=finding.alike,
        rivalled=bool(finding.rivals),
        in_some=finding.trajectories is not None,
        few=finding.trajectories is not None and all(t.effect.by_recording for t in finding.terms),
        stays=finding.kind != UNKNOWN and mostly_stays(before, after, alike * parts.noise[same]),
        change=finding.change,
        instead=finding.instead is not None,
        has_name=finding.kind != UNKNOWN,
    )
    told = finding.sentence
    if finding.change > CHANGE_SHARE:
        told += (
            f" It would remove {max(finding.change, 0.01):.0%} more if it could change over the "
            "log or with the motion, which makes the name less certain."
        )
    if finding.instead is not None:
        told += (
            f" The finding of {get_effect(finding.instead).title.lower()} would explain most of it "
            "if its formula were different, which makes the name less certain."
        )
    # Only one of several equivalent pairs of joints is right.
    return replace(finding, sentence=told, confidence=probability / (1 + len(finding.elsewhere)))


def _reached(finding: Finding) -> list[int]:
    """Joints, from 0, with the torque of an effect: a payload on the last link reaches all."""
    return sorted({j for term in finding.terms for j in term.places})


def _episodic(
    episodes: list[Episode], inside: Sequence[NDArray[np.bool_]], residual: Sequence[Array]
) -> Finding:
    """An intermittent torque as a finding; no model predicts it."""
    joints = tuple(sorted({j for e in episodes for j in e.joints}))
    shares = [
        float(np.sum(residual[j - 1][inside[j - 1]] ** 2) / np.sum(residual[j - 1] ** 2))
        for j in joints
    ]
    numbers = sorted({e.trajectory for e in episodes})
    times = ", ".join(
        f"{e.start:.2f} to {e.end:.2f} s of trajectory {e.trajectory}" for e in episodes[:4]
    )
    more = f" and {len(episodes) - 4} more" if len(episodes) > 4 else ""
    links = {e.link for e in episodes if e.link is not None}
    push = (
        f" A force at link {', '.join(sorted(links))} explains all these joints." if links else ""
    )
    sentence = (
        f"An intermittent torque acts on {joints_told(joints)}: {times}{more}. It accounts for "
        f"{np.mean(shares):.0%} of the remaining squared error there, and no logged signal "
        f"predicts it.{push}"
    )
    return Finding(
        UNKNOWN,
        "Intermittent torque",
        joints,
        {},
        ("time",),
        float(np.mean(shares)),
        0.0,
        (),
        "the same motion again, since a random disturbance does not recur at the same place",
        sentence,
        "diagnosis.findings[-1].when",
        (),
        trajectories=tuple(numbers),
        when=episodes,
    )


def _verdict(findings: Sequence[Finding], parts: Remainder) -> Verdict:
    if any(f.kind == UNKNOWN for f in findings) or parts.material.any():
        return "unknown"
    return "missing" if findings else "complete"


def _unexplained(
    findings: Sequence[Finding],
    unknowns: Sequence[UnknownTorque],
    parts: Remainder,
    rmse: Array,
) -> dict[str, Any] | None:
    """The unexplained part: all unknown findings together, else a material remainder."""
    nameless = [f for f in findings if f.kind == UNKNOWN]
    if nameless:
        return {
            "joints": sorted({j for f in nameless for j in f.joints}),
            "variables": sorted({v for f in nameless for v in f.variables}),
            "share": float(np.mean([f.error_drop for f in nameless])),
            "torques": [u.to_dict() for u in unknowns],
            "when": [e.to_dict() for f in nameless for e in f.when],
        }
    if not parts.material.any():
        return None
    joints = np.flatnonzero(parts.material)
    share = float(np.mean(parts.left[joints] ** 2 / rmse[joints] ** 2))
    numbers = [int(j) + 1 for j in joints]
    return {"joints": numbers, "variables": [], "share": share, "torques": [], "when": []}


def _joint_notes(problem: Problem, parts: Remainder, errors: Array) -> list[str]:
    """Notes on joints that slide too little to be judged, or to be judged on new motion."""
    robot, extrapolated = problem.robot, parts.extrapolated
    if robot is None:
        return []
    names = [f"joint {j + 1} ({name})" for j, name in enumerate(robot.joint_names)]
    resting = [names[j] for j in np.flatnonzero(problem.rows.counts == 0)]
    notes = []
    if resting:
        notes.append(
            f"The torque of {listed(resting)} was not judged: too few samples are left in which "
            "the joint slides, away from rest and reversals."
        )
    return notes + [
        f"The error of {names[j]} on recordings that were left out, {errors[j]:.3g}, is due to "
        "extrapolation: the joint slides in few recordings, and fitted to all of them the model "
        "explains its torque up to noise. Record more motion of this joint."
        for j in np.flatnonzero(extrapolated if extrapolated is not None else [])
    ]


def _fold_notes(problem: Problem) -> list[str]:
    if problem.whole_trajectories:
        return []
    names = np.unique(problem.signals.trajectory)
    count = "one trajectory" if len(names) == 1 else f"{len(names)} trajectories"
    return [
        f"The log has only {count}: errors are held out by {problem.n_folds} blocks of time with "
        "a guard between them instead of whole trajectories, and may be underestimated."
    ]
