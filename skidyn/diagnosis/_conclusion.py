# SPDX-License-Identifier: BSD-3-Clause
"""Conversion of a search result to a diagnosis: held-out errors, intervals, curves, texts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array
from skidyn._text import joints_told, listed, span_told
from skidyn.diagnosis._confidence import confidence, mostly_stays
from skidyn.diagnosis._constancy import Change, changes
from skidyn.diagnosis._correction import is_physics, refitted_errors
from skidyn.diagnosis._episodes import (
    Episode,
    acting,
    away_from_reversals,
    find_episodes,
    not_of_positions,
)
from skidyn.diagnosis._findings import (
    Finding,
    effect_curves,
    make_finding,
)
from skidyn.diagnosis._floor import predictable_share
from skidyn.diagnosis._hypothesis import (
    UNKNOWN,
    SearchResult,
    found_terms,
)
from skidyn.diagnosis._imitation import coarse_joints
from skidyn.diagnosis._intervals import parameter_intervals
from skidyn.diagnosis._judged import Judged, worth_their_terms
from skidyn.diagnosis._limits import Limit
from skidyn.diagnosis._noise import noise_of_recordings
from skidyn.diagnosis._remainder import (
    Remainder,
    find_remainder,
    torque_range,
)
from skidyn.diagnosis._result import Diagnosis, Verdict
from skidyn.diagnosis._rule import (
    CHANGE_SHARE,
    EPISODE_LEAST_HELD,
    EPISODE_LEAST_NOISE,
    EPISODE_LEAST_RANGE,
    MUCH,
    Settings,
    false_discovery_rate,
)
from skidyn.diagnosis._search_state import replace_torque
from skidyn.diagnosis._unknown import UnknownTorque, describe_unknowns
from skidyn.diagnosis._wandering import find_wandering, wandering_torque
from skidyn.diagnosis._withdrawal import (
    drop_of,
    guess,
    slight,
    without,
)
from skidyn.effects import Term, get_effect
from skidyn.evidence import Problem


def conclude(
    problem: Problem,
    result: SearchResult,
    limits: list[Limit],
    sliding: NDArray[np.bool_],
    torque: Array,
    notes: list[str],
    settings: Settings,
    model: Any,
    data: tuple[Any, ...],
    withdrawn: bool = False,
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
    settings : Settings
        Thresholds: level, and share of the error of samples that a finding must remove.
    model : regressor
        The model as given.
    data : tuple
        X and torque as given.
    withdrawn : bool, default=False
        Whether a finding was withdrawn, so that others may no longer be significant.
    """
    robot = problem.robot
    assert robot is not None
    judged = worth_their_terms(problem, result, torque, sliding, settings, withdrawn)
    result = judged.result
    shown, remarks = [entry["rmse"] for entry in judged.history], list(notes)
    if not is_physics(model):
        shown, remark = _refitted(problem, result, model, data, shown)
        remarks.append(remark)
    unknowns = _unknowns(problem, result, judged.terms)
    findings, unlisted = _listed(judged, shown, unknowns)
    remarks += unlisted
    share = predictable_share(problem, result.fit.residual)
    rmse = np.array(judged.history[-1]["rmse"])
    parts = find_remainder(problem, result.fit, judged.noise, judged.comparisons[-1], share)
    findings += _in_time(judged, parts, torque, sliding)
    ends = np.array(judged.history[0]["rmse"]), rmse
    whole = problem.whole_trajectories
    changed = changes(problem, result)
    for i, finding in enumerate(findings):
        change = changed.get(finding.kind, Change())
        findings[i] = replace(finding, change=change.share, instead=change.instead)
    findings = [_sure(f, findings, parts, ends, whole) for f in findings]
    diagnosis = Diagnosis(
        _verdict(findings, parts),
        robot.joint_names,
        findings,
        judged.comparisons[0],
        judged.comparisons[-1],
        judged.history,
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
    seem_soft = _seem_soft(judged, findings)
    wrong = guess(diagnosis, seem_soft)
    if wrong is None:
        return diagnosis
    rest = without(problem, result, *wrong)
    other = conclude(problem, rest, limits, sliding, torque, notes, settings, model, data, True)
    # "Nothing is missing" would be wrong: something is, and this is the most likely name.
    only = len(result.findings) == 1 and other.verdict == "complete" and not seem_soft
    return diagnosis if only and max(f.error_drop for f in findings) > MUCH else other


def _listed(
    judged: Judged, shown: Sequence[Any], unknowns: Sequence[UnknownTorque]
) -> tuple[list[Finding], list[str]]:
    """Findings, one for every term, and remarks on those that are too small to be listed."""
    problem, result = judged.problem, judged.result
    intervals = parameter_intervals(problem, judged.terms, result.fit.noise)
    unlisted = slight(problem, result.findings, intervals, judged.history[-1]["rmse"])
    findings = []
    for i, hypothesis in enumerate(result.findings):
        for candidate, chance in zip(hypothesis.candidates, hypothesis.chances, strict=True):
            if candidate.term in unlisted:
                continue
            reached = tuple(candidate.rows)
            drop = drop_of(shown[i], shown[i + 1], reached)
            averaged = drop_of(judged.averages[i], judged.averages[i + 1], reached)
            joints = [j + 1 for j in candidate.joints]
            own = [u for u in unknowns if hypothesis.kind == UNKNOWN and u.joint in joints]
            q = false_discovery_rate(chance, hypothesis.tried)
            finding = make_finding(
                problem, hypothesis, candidate, q, drop, averaged, intervals, own
            )
            finding.when.extend(acting(problem, candidate.term, judged.own_torque))
            curves = effect_curves(
                problem, finding.terms, judged.own_torque, judged.residual, finding.variables
            )
            finding.curves.extend(curves)
            findings.append(finding)
    return findings, list(dict.fromkeys(unlisted.values()))


def _seem_soft(judged: Judged, findings: Sequence[Finding]) -> list[Finding]:
    """Findings that move a link whose positions are mostly noise, which makes it seem soft."""
    moving = [f for f in findings if any(term.effect.moves_link for term in f.terms)]
    if not moving:
        return []
    coarse = coarse_joints(judged.problem, judged.result.fit, judged.residual)
    return [f for f in moving if coarse & {j - 1 for j in f.joints}]


def _in_time(
    judged: Judged, parts: Remainder, torque: Array, sliding: NDArray[np.bool_]
) -> list[Finding]:
    """Torques that come and go, and that change over time, where nothing else was found."""
    problem, result = judged.problem, judged.result
    findings = []
    least = np.maximum(
        EPISODE_LEAST_RANGE * torque_range(torque), EPISODE_LEAST_NOISE * parts.noise
    )
    smooth = away_from_reversals(problem, result.fit.residual, sliding)
    # On a joint with a finding, large local residuals are errors of its imperfect formula.
    taken = {j for h in result.findings for c in h.candidates for j in c.rows}
    inexact = [t for t in problem.terms if not t.effect.is_exact]
    taken.update(j for t in inexact for j in problem.term_rows(t))
    held = [np.inf if j in taken else EPISODE_LEAST_HELD for j in range(problem.n_joints)]
    share_held = np.array(held)
    loud = noise_of_recordings(problem.signals, judged.residual)
    episodes, inside = find_episodes(problem, smooth, least, share_held, loud)
    if episodes:
        real = not_of_positions(problem, result.fit, smooth, inside)
        if not real.all():
            share_held = np.where(real, share_held, np.inf)
            episodes, inside = find_episodes(problem, smooth, least, share_held, loud)
    if episodes:
        findings.append(_episodic(episodes, inside, result.fit.residual))
        taken.update(j - 1 for e in episodes for j in e.joints)
    free = [j for j in np.flatnonzero(parts.material).tolist() if j not in taken]
    if wandering := find_wandering(problem, result.fit.residual, free):
        findings.append(wandering_torque(wandering))
    return findings


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
    steps = [found_terms(problem, found[:k]) for k in range(len(found) + 1)]
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
    lines = {c.term for h in result.findings if h.torque is not None for c in h.candidates}
    rest = [t for t in terms if t not in lines]
    bare = replace_torque(problem, problem.torque - result.ripple)
    return describe_unknowns(bare, rest, nameless, result.fit.noise)


def _sure(
    finding: Finding,
    findings: Sequence[Finding],
    parts: Remainder,
    errors: tuple[Array, Array],
    whole: bool,
) -> Finding:
    """The finding with its score and the probability that it is identified correctly."""
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
    in_some = any(t.trajectories is not None for t in finding.terms)
    likely = partial(
        confidence,
        finding.margin,
        float(parts.inflation[joints].max()),
        max(f.error_drop for f in findings if f.kind == finding.kind),
        q_value=min(f.q_value or 0.0 for f in findings if f.kind == finding.kind),
        lead=finding.lead,
        nameless=finding.kind != UNKNOWN and (beside or bool(parts.material[joints].any())),
        whole_recordings=whole,
        alike=finding.alike,
        rivalled=bool(finding.rivals),
        in_some=in_some,
        few=in_some and all(t.effect.by_recording for t in finding.terms),
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
    # Only one of several equivalent joints or pairs of joints is right.
    places = 1 + len(finding.elsewhere)
    return replace(
        finding,
        sentence=told,
        score=likely(calibrate=False) / places,
        confidence=likely() / places,
    )


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
        f"{span_told(e.start, e.end, 2)} of trajectory {e.trajectory}" for e in episodes[:4]
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
        f"The error of {names[j]} on what was left out, {errors[j]:.3g}, is due to extrapolation: "
        "the rest of the log does not determine the model there, and fitted to the whole log the "
        "model explains its torque up to noise. Record more motion of this joint."
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
