# SPDX-License-Identifier: BSD-3-Clause
"""A second search at the reversals, which the search on sliding samples leaves out.

Sliding friction does not describe reversals, so a search that judges it must exclude them. But
friction that builds up over a thousandth of a radian is visible only there. If the completed model
fails close to reversals, the members of the hysteresis family are compared again with rows that
reach up to them. Only the standstill itself is excluded, because a joint that sticks can have any
friction torque.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from skidyn.diagnosis._candidates import Candidate
from skidyn.diagnosis._hypothesis import SearchResult, terms_on_rows
from skidyn.diagnosis._rule import (
    REVERSAL_AWAY,
    REVERSAL_FEWEST_ROWS,
    REVERSAL_LEAST_SHARE,
    REVERSAL_SHARE_OF_FRICTION,
    REVERSAL_STANDS_OUT,
    Settings,
)
from skidyn.diagnosis._search import search
from skidyn.effects import get_effect
from skidyn.evidence import (
    SHORT_MARGIN,
    Problem,
    hysteresis_joints,
    sliding_samples,
    window_rows,
    with_reversals,
)

FAMILY = "hysteresis"


def look_at_reversals(
    problem: Problem, result: SearchResult, kinds: list[str], settings: Settings
) -> tuple[Problem, SearchResult]:
    """Search for hysteresis with the reversals among the rows.

    Parameters
    ----------
    problem : Problem
        Problem of the sliding samples.
    result : SearchResult
        Findings of the sliding samples.
    kinds : list of str
        Kinds of the catalogue to try.
    settings : Settings
        Thresholds of the search.

    Returns
    -------
    problem : Problem
        Problem with rows at reversals if hysteresis was found there, else as given.
    result : SearchResult
        Result with the findings of both searches.
    """
    family = [k for k in kinds if _is_hysteresis(k)]
    others = [h for h in result.findings if not _is_hysteresis(h.kind)]
    room = settings.max_findings - len(others)
    # A delayed torque is late at every reversal, for any friction.
    lags = "time_delay" in [t.kind for t in problem.terms] + [h.kind for h in others]
    if not family or room < 1 or lags or problem.signals.time is None:
        return problem, result
    own = set(hysteresis_joints(problem.terms))
    before = {j for h in result.findings if _is_hysteresis(h.kind) for j in h.joints}
    new = set(failing_joints(problem, result)) - own - before
    if not new:
        return problem, result
    # The findings of the sliding samples have to be found again with the same kinds.
    joints = sorted(new | before)
    terms = (*problem.terms, *terms_on_rows(others))
    wider = with_reversals(problem, terms, joints)
    wider.torque = problem.torque - result.ripple
    gates = replace(settings, least_share=REVERSAL_LEAST_SHARE, max_findings=room)
    given = problem.terms

    def among(candidate: Candidate) -> bool:
        return set(candidate.joints) <= set(joints)

    second = search(wider, family, gates, nameless=False, among=among, given=given)
    if not new & {j for h in second.findings for j in h.joints}:
        return problem, result
    wider = replace(wider, terms=problem.terms, torque=problem.torque)
    return wider, replace(
        second,
        findings=others + second.findings,
        ripple=result.ripple,
        candidates=result.candidates,
    )


def failing_joints(problem: Problem, result: SearchResult) -> list[int]:
    """Joints with a significant error close to reversals.

    Parameters
    ----------
    problem : Problem
        Problem of the sliding samples.
    result : SearchResult
        Its fit.

    Returns
    -------
    list of int
        Joints, from 0.
    """
    motion, n = problem.signals, problem.signals.n_samples
    close = sliding_samples(motion, motion.usable, SHORT_MARGIN)
    rows = window_rows(motion, close)
    residual = problem.torque - result.ripple - problem.explained(result.fit)
    dry = [t for t in result.fit.terms if t.is_dry or _is_hysteresis(t.kind)]
    friction = problem.term_torque(result.fit, dry)
    failing = []
    for j in range(problem.n_joints):
        weight = rows.average(np.ones(n), j)
        away = rows.average(problem.rows.sliding[:, j].astype(float), j) / weight
        square = (rows.average(residual[:, j], j) / weight) ** 2
        turning = away < REVERSAL_AWAY
        if min(turning.sum(), (~turning).sum()) < REVERSAL_FEWEST_ROWS:
            continue
        error, sliding = square[turning].mean(), square[~turning].mean()
        level = np.mean(friction[close[:, j], j] ** 2)
        if (
            error > REVERSAL_STANDS_OUT * sliding
            and error > REVERSAL_SHARE_OF_FRICTION**2 * level > 0
        ):
            failing.append(j)
    return failing


def _is_hysteresis(kind: str) -> bool:
    return kind != "unknown" and get_effect(kind).family == FAMILY
