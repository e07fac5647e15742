# SPDX-License-Identifier: BSD-3-Clause
"""Findings that are worth their terms, judged by held-out errors on samples and rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidyn._progress import track
from skidyn._signals import Array
from skidyn.diagnosis._comparison import Comparison
from skidyn.diagnosis._held_out import held_out_residual
from skidyn.diagnosis._hypothesis import Hypothesis, SearchResult, found_terms
from skidyn.diagnosis._intervals import parameter_intervals
from skidyn.diagnosis._noise import sensor_noise
from skidyn.diagnosis._remainder import position_noises, root_mean_square
from skidyn.diagnosis._rule import Settings
from skidyn.diagnosis._search_state import replace_torque
from skidyn.diagnosis._withdrawal import to_withdraw, unsupported, useless, without
from skidyn.effects import Term
from skidyn.evidence import Problem


@dataclass(frozen=True)
class Judged:
    """Findings that are worth their terms, and the errors after each of them.

    Attributes
    ----------
    problem, result : Problem, SearchResult
        Rows, and the findings with the final fit.
    comparisons, history, averages : list
        Of the given model and after each finding: comparison, errors on samples, and errors of
        averaged rows by joint.
    residual : ndarray of shape (n_samples, n_joints), N m or N
        Held-out residual of the last model.
    own_torque : dict
        Torque of every finding's term by joint.
    noise : tuple of three ndarrays of shape (n_joints,), N m or N
        Noise of the torque sensor, of positions, and of these in averaged rows.
    """

    problem: Problem
    result: SearchResult
    comparisons: list[Comparison]
    history: list[dict[str, Any]]
    averages: list[list[float]]
    residual: Array
    own_torque: dict[Term, dict[int, Array]]
    noise: tuple[Array, Array, Array]

    @property
    def terms(self) -> list[Term]:
        """Terms of the model and of all findings."""
        return [*self.problem.terms, *found_terms(self.problem, self.result.findings)]

    @property
    def errors(self) -> list[list[list[float]]]:
        """Absolute, squared and averaged error by joint after each number of findings."""
        return [
            [_mean_error(c), entry["rmse"], average]
            for c, entry, average in zip(self.comparisons, self.history, self.averages, strict=True)
        ]


def worth_their_terms(
    problem: Problem,
    result: SearchResult,
    torque: Array,
    sliding: NDArray[np.bool_],
    settings: Settings,
    withdrawn: bool,
) -> Judged:
    """Findings without those that are useless, vague, impossible or no longer significant.

    Parameters
    ----------
    problem : Problem
        Rows and folds on which effects are judged.
    result : SearchResult
        Findings and the final fit.
    torque : ndarray of shape (n_samples, n_joints)
        Measured torque, N m or N.
    sliding : ndarray of shape (n_samples, n_joints) of bool
        Samples away from rest and reversals.
    settings : Settings
        Level, and share of the error of samples that a finding must remove.
    withdrawn : bool
        Whether a finding was withdrawn, so that others may no longer be significant.

    Returns
    -------
    Judged
    """
    tried_last: list[Hypothesis] = []
    while True:
        judged = _judged(problem, result, torque, sliding)
        needless = useless(problem, result, judged.errors, judged.noise[:2], settings.least_drop)
        if needless is not None and all(
            h is not needless[0] for h in [*tried_last, result.findings[-1]]
        ):
            # Without a later finding it may increase the error that it reduces beside it.
            tried_last.append(needless[0])
            order = sorted(result.findings, key=lambda h: h is needless[0])
            result = replace(result, findings=order)
            continue
        fixed = parameter_intervals(problem, judged.terms, result.fit.noise, shapes=False)
        wrong = needless or to_withdraw(problem, result, fixed)
        if wrong is None and withdrawn:
            wrong = unsupported(problem, result, settings.level)
        if wrong is None:
            return judged
        result, withdrawn = without(problem, result, *wrong), True


def _judged(
    problem: Problem, result: SearchResult, torque: Array, sliding: NDArray[np.bool_]
) -> Judged:
    """Comparison and errors of the given model and after each finding."""
    comparisons, history, averages = [], [], []
    dry = [t for t in problem.terms if t.is_dry]
    for k in track(range(len(result.findings) + 1), "Judging what was found"):
        found = found_terms(problem, result.findings[:k])
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
    noise = (
        sensor_noise(problem.signals, residual, problem.measured),
        *position_noises(problem, result.fit),
    )
    # All terms at every sample would need most of the memory for a long log.
    own_torque = {t: own[t] for t in found}
    return Judged(problem, result, comparisons, history, averages, residual, own_torque, noise)


def _held_out(
    problem: Problem, terms: Sequence[Term], result: SearchResult, keep: Sequence[Term]
) -> tuple[Array, dict[Term, dict[int, Array]]]:
    """Held-out residual; the torque of a line that was found comes from every sample."""
    torque = problem.torque
    waves: dict[Term, dict[int, Array]] = {}
    for hypothesis in result.findings:
        line = hypothesis.torque
        if line is None or hypothesis.candidates[0].term not in terms:
            continue
        torque = torque - line
        places = [(c.term, c.term.places[0]) for c in hypothesis.candidates]
        waves |= {term: {place: line[:, place]} for term, place in places}
    rest = [t for t in terms if t not in waves]
    bare = replace_torque(problem, torque) if waves else problem
    # Joints weigh by the errors of these terms, as where a model with them is fitted.
    own = result.fit if set(rest) == set(result.fit.terms) else bare.fit(rest)
    residual, held = held_out_residual(bare, rest, own.sigma, keep)
    return residual, held | waves


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


def _mean_error(comparison: Comparison) -> list[float]:
    """Mean absolute error of every joint on the samples judged, N m or N."""
    use = comparison.sliding if comparison.judged is None else comparison.judged
    total = np.where(use, np.abs(comparison.residual), 0.0).sum(0)
    return [float(x) for x in total / np.maximum(use.sum(0), 1)]
