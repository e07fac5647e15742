# SPDX-License-Identifier: BSD-3-Clause
"""From the search's result to a diagnosis: held-out errors, intervals, curves, words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidyn._progress import track
from skidyn._signals import Array
from skidyn.diagnosis._failures import Comparison
from skidyn.diagnosis._findings import (
    Finding,
    effect_curves,
    make_finding,
    q_values,
    rivals_of,
)
from skidyn.diagnosis._floor import predictable_share
from skidyn.diagnosis._held_out import HeldOut, held_out_residual
from skidyn.diagnosis._hypothesis import UNKNOWN, Hypothesis, SearchResult
from skidyn.diagnosis._intervals import parameter_intervals
from skidyn.diagnosis._limits import Limit
from skidyn.diagnosis._result import Diagnosis, Verdict
from skidyn.diagnosis._search import replace_torque
from skidyn.diagnosis._unknown import UnknownTorque, describe_unknowns
from skidyn.effects import Term
from skidyn.evidence._problem import Problem

#: Share of the error of samples that a finding must remove to be worth a word.
LEAST_DROP = 0.002


def conclude(
    problem: Problem,
    result: SearchResult,
    limits: list[Limit],
    sliding: NDArray[np.bool_],
    torque: Array,
    notes: list[str],
    model: Any,
    data: tuple[Any, Any],
) -> Diagnosis:
    """Put the result of a search into a diagnosis.

    Parameters
    ----------
    problem : Problem
        Rows and folds on which effects are judged.
    result : SearchResult
        Findings and the final fit.
    limits : list of Limit
        What could still hide.
    sliding : ndarray of shape (n_samples, n_joints) of bool
        Samples away from rest and reversals.
    torque : ndarray of shape (n_samples, n_joints)
        Measured torque, N m or N.
    notes : list of str
        Remarks on the data.
    model : regressor
        The model as given.
    data : tuple
        X and torque as given.

    Returns
    -------
    Diagnosis
    """
    robot = problem.robot
    assert robot is not None
    steps = _steps(problem, result, torque, sliding)
    while harmful := [h for h in result.findings if _harms(h, result.findings, steps)]:
        result = _without(problem, result, harmful[-1])
        steps = _steps(problem, result, torque, sliding)
    terms = [*problem.terms, *_found_terms(problem, result.findings)]
    held = steps[-1].held
    history = [step.entry for step in steps]
    intervals = parameter_intervals(problem, terms, result.fit.noise)
    q = q_values(result.findings, result.inflation, max(1, len(result.candidates)))
    rivals = {id(s.added): rivals_of(s) for s in result.steps if s.added is not None}
    unknowns = _unknowns(problem, result, terms)
    findings = []
    for i, hypothesis in enumerate(result.findings):
        drop = _drop(history[i]["rmse"], history[i + 1]["rmse"], hypothesis.joints)
        own = [u for u in unknowns if hypothesis.kind == UNKNOWN]
        finding = make_finding(
            problem, hypothesis, rivals[id(hypothesis)], q[i], drop, intervals, own
        )
        finding.curves.extend(effect_curves(problem, finding.terms, held.torque, held.residual))
        findings.append(finding)
    share = predictable_share(problem, result.fit.residual)
    floor = np.array(history[-1]["rmse"]) * np.sqrt(1 - share)
    return Diagnosis(
        _verdict(findings),
        robot.joint_names,
        findings,
        steps[0].comparison,
        steps[-1].comparison,
        history,
        floor,
        _unexplained(findings, unknowns),
        limits,
        notes + _fold_notes(problem),
        model,
        data,
        problem,
        result,
        share,
        unknowns,
    )


@dataclass(frozen=True)
class _Step:
    """The model after a finding: its held-out residual and errors."""

    held: HeldOut
    comparison: Comparison
    entry: dict[str, Any]


def _steps(
    problem: Problem, result: SearchResult, torque: Array, sliding: NDArray[np.bool_]
) -> list[_Step]:
    """The model as given, and after each finding."""
    steps = []
    for k in track(range(len(result.findings) + 1), "Judging what was found"):
        found = _found_terms(problem, result.findings[:k])
        keep = found if k == len(result.findings) else ()
        held = _held_out(problem, [*problem.terms, *found], result, keep)
        comparison = _comparison(problem, torque, held, sliding)
        last = result.findings[k - 1] if k else None
        kind, joints = (last.kind, last.joints) if last else (None, ())
        steps.append(_Step(held, comparison, _entry(comparison, kind, joints)))
    return steps


def _found_terms(problem: Problem, findings: Sequence[Hypothesis]) -> list[Term]:
    """Terms of findings, each once, without those of the given model."""
    terms = dict.fromkeys(c.term for h in findings for c in h.candidates)
    return [t for t in terms if t not in problem.terms]


def _harms(hypothesis: Hypothesis, findings: Sequence[Hypothesis], steps: Sequence[_Step]) -> bool:
    """Whether a finding leaves the error of samples as large, though it helped averaged rows.

    Neither the mean absolute error nor the squared one, which few samples rule, may stay.
    """
    k = [h is hypothesis for h in findings].index(True)
    errors = [(_mean_error(step.comparison), step.entry["rmse"]) for step in steps[k : k + 2]]
    drops = [_drop(a, b, hypothesis.joints) for a, b in zip(*errors, strict=True)]
    return min(drops) < LEAST_DROP


def _mean_error(comparison: Comparison) -> list[float]:
    """Mean absolute error of every joint on the samples judged, N m or N."""
    use = comparison.sliding if comparison.judged is None else comparison.judged
    total = np.where(use, np.abs(comparison.residual), 0.0).sum(0)
    return [float(x) for x in total / np.maximum(use.sum(0), 1)]


def _without(problem: Problem, result: SearchResult, wrong: Hypothesis) -> SearchResult:
    """The result with a finding taken back and the rest fitted again."""
    findings = [h for h in result.findings if h is not wrong]
    ripple = result.ripple if wrong.torque is None else result.ripple - wrong.torque
    rest = [t for t in _found_terms(problem, findings) if t.kind != "torque_ripple"]
    bare = replace_torque(problem, problem.torque - ripple)
    fit = bare.fit((*problem.terms, *rest), sigma=result.fit.noise)
    return replace(result, findings=findings, fit=fit, ripple=ripple)


def _unknowns(problem: Problem, result: SearchResult, terms: Sequence[Term]) -> list[UnknownTorque]:
    """What is known about the nameless terms, the ripple taken off."""
    nameless = [c.term for h in result.findings if h.kind == UNKNOWN for c in h.candidates]
    if not nameless:
        return []
    rest = [t for t in terms if t.kind != "torque_ripple"]
    bare = replace_torque(problem, problem.torque - result.ripple)
    return describe_unknowns(bare, rest, nameless, result.fit.noise)


def _held_out(
    problem: Problem, terms: Sequence[Term], result: SearchResult, keep: Sequence[Term]
) -> HeldOut:
    """Held-out residual; a ripple's coefficients come from the residual at the full rate."""
    waves = [t for t in terms if t.kind == "torque_ripple"]
    rest = [t for t in terms if t.kind != "torque_ripple"]
    if not waves:
        return held_out_residual(problem, rest, result.fit.sigma, keep)
    torque = problem.torque - result.ripple
    held = held_out_residual(replace_torque(problem, torque), rest, result.fit.sigma, keep)
    for t in waves:
        own = np.zeros_like(torque)
        own[:, t.joints[0]] = result.ripple[:, t.joints[0]]
        held.torque[t] = own
    return held


def _comparison(
    problem: Problem, torque: Array, held: HeldOut, sliding: NDArray[np.bool_]
) -> Comparison:
    assert problem.robot is not None
    return Comparison(
        problem.signals,
        torque,
        torque - held.residual,
        sliding,
        problem.robot.joint_names,
        problem.rows.sliding,
    )


def _entry(comparison: Comparison, added: str | None, joints: Sequence[int]) -> dict[str, Any]:
    rmse = [float(x) for x in comparison.rmse(judged=True)]
    return {"added": added, "joints": [j + 1 for j in joints], "rmse": rmse}


def _drop(before: Sequence[float], after: Sequence[float], joints: Sequence[int]) -> float:
    """Share of the squared error removed, on the joints of the effect, each in its own unit."""
    pairs = [(before[j], after[j]) for j in joints if before[j] > 0]
    if not pairs:
        return 0.0
    return float(np.mean([1 - (a / b) ** 2 for b, a in pairs]))


def _verdict(findings: Sequence[Finding]) -> Verdict:
    if not findings:
        return "complete"
    return "unknown" if any(f.kind == UNKNOWN for f in findings) else "missing"


def _unexplained(
    findings: Sequence[Finding], unknowns: Sequence[UnknownTorque]
) -> dict[str, Any] | None:
    for finding in findings:
        if finding.kind == UNKNOWN:
            return {
                "joints": list(finding.joints),
                "variables": list(finding.variables),
                "share": finding.error_drop,
                "torques": [u.to_dict() for u in unknowns],
            }
    return None


def _fold_notes(problem: Problem) -> list[str]:
    if problem.whole_trajectories:
        return []
    names = np.unique(problem.signals.trajectory)
    count = "one trajectory" if len(names) == 1 else f"{len(names)} trajectories"
    return [
        f"The log has only {count}: errors are held out by {problem.n_folds} blocks of time with "
        "a guard between them, not by whole trajectories, and may flatter the model."
    ]
