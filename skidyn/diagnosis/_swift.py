# SPDX-License-Identifier: BSD-3-Clause
"""A second search in short windows, for effects that last hundredths of a second.

A link crosses its play within hundredths of a second, and oscillates on its gear ten or twenty
times per second; an average over an eighth of a second contains little of this. Slow effects are
found in the long windows, in which the noise of the derivatives averages out; then effects that
move the link are searched in windows as short as the sampling permits.

Short windows contain noise of the accelerations, which resembles a link that oscillates below its
frequency. A separate column of every joint represents this noise, and an oscillation must be
significant in addition to it: the evidence is its transition from following the load to lagging
behind it. If the noise of the positions causes more torque than the torque sensor's own noise,
oscillations are not searched in short windows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from skidyn.diagnosis._candidates import Candidate
from skidyn.diagnosis._hypothesis import Hypothesis, SearchResult, terms_on_rows
from skidyn.diagnosis._noise import sensor_noise
from skidyn.diagnosis._remainder import position_noise
from skidyn.diagnosis._rule import SHORT_IN_PERIODS, SHORT_WINDOW, Settings
from skidyn.diagnosis._search import search
from skidyn.effects import TermSum, get_effect, make_terms
from skidyn.evidence import FEWEST_SAMPLES, Problem, with_short_windows


def look_at_swift(
    problem: Problem, result: SearchResult, kinds: list[str], settings: Settings
) -> tuple[Problem, SearchResult]:
    """Search for fast effects in short windows.

    Parameters
    ----------
    problem : Problem
        Problem of the long windows.
    result : SearchResult
        Findings of the long windows.
    kinds : list of str
        Kinds of the catalogue to try.
    settings : Settings
        Thresholds of the search.

    Returns
    -------
    problem : Problem
        Problem with short windows if an effect was found in them, else as given.
    result : SearchResult
        Result with the findings of both searches.
    """
    cutoffs = problem.signals.cutoff
    lowest = np.inf if cutoffs is None else float(cutoffs.min())
    window = max(SHORT_WINDOW, SHORT_IN_PERIODS / lowest)
    family = _seen_within(problem, result, kinds, window)
    if not family:
        return problem, result
    before = {j: h.kind for h in result.findings if h.kind in family for j in h.joints}
    others = result
    for _ in range(2):
        slow = [h for h in others.findings if h.kind not in family]
        room = settings.max_findings - len(slow)
        if room < 1:
            return problem, result
        short = _short_windows(problem, others, slow, window)
        moved = _moved(problem, short, result, slow, family, replace(settings, max_findings=room))
        now = {j: h.kind for h in moved.findings for j in h.joints}
        fastest = [
            c.term.effect.fastest(c.term.shape) for h in moved.findings for c in h.candidates
        ]
        # Smoothing weakens higher frequencies, which resembles an oscillating link.
        if max(fastest, default=0.0) > lowest:
            return problem, result
        # A link that oscillates in the long windows, too, does not cross a play.
        if not now or not before.items() <= now.items():
            return problem, result
        # Earlier findings may have been due to this effect.
        found = terms_on_rows(moved.findings)
        beside = replace(problem, terms=TermSum((*problem.terms, *found)), _cache={})
        room = settings.max_findings - len(moved.findings)
        slower = [k for k in kinds if k not in family]
        others = search(beside, slower, replace(settings, max_findings=room), given=problem.terms)
        if _sites(others.findings) == _sites(slow):
            break
    known = terms_on_rows(others.findings)
    fit = short.fit((*problem.terms, *known, *found), sigma=moved.fit.sigma)
    short = replace(short, terms=problem.terms, torque=problem.torque)
    return short, replace(
        moved,
        findings=sorted([*others.findings, *moved.findings], key=lambda h: -h.score),
        fit=fit,
        ripple=others.ripple,
        candidates=result.candidates,
    )


def _seen_within(
    problem: Problem, result: SearchResult, kinds: Sequence[str], window: float
) -> list[str]:
    """Kinds that move the link, and of which windows of some width in s can show anything."""
    family = [k for k in kinds if get_effect(k).moves_link]
    clocked = problem.signals.time is not None and problem.robot is not None
    if not family or not clocked or problem.signals.rate * window < FEWEST_SAMPLES:
        return []
    residual = problem.torque - problem.explained(result.fit)
    sensor = np.nan_to_num(sensor_noise(problem.signals, residual, problem.measured))
    if np.any(position_noise(problem, result.fit) > sensor):  # coarse positions
        return [k for k in family if not get_effect(k).follows_acceleration]
    return family


def _short_windows(
    problem: Problem, others: SearchResult, slow: Sequence[Hypothesis], window: float
) -> Problem:
    """Rows of short windows, with the slow effects and the noise of accelerations as terms."""
    noise = make_terms(["acceleration_noise"], problem.n_joints)
    terms = (*problem.terms, *terms_on_rows(slow), *noise)
    short = with_short_windows(problem, terms, window)
    short.torque = problem.torque - others.ripple
    return short


def _moved(
    problem: Problem,
    short: Problem,
    result: SearchResult,
    slow: Sequence[Hypothesis],
    family: Sequence[str],
    settings: Settings,
) -> SearchResult:
    """Effects that move the link, from short windows."""
    # Errors of smoothing are equally large in short windows, and more significant in more windows.
    more = short.rows.counts.sum() / problem.rows.counts.sum()
    gates = replace(
        settings,
        least_gain=more * settings.least_gain,
        size_share=settings.size_share_short,
    )
    slowed = {j for h in slow for c in h.candidates if c.term.effect.is_slow for j in c.joints}
    moving = [h for h in result.findings if h.kind in family]
    among = partial(_is_tried, slowed=slowed, known=moving)
    return search(
        short, family, gates, nameless=False, among=among, earlier=slow, given=problem.terms
    )


def _is_tried(candidate: Candidate, slowed: set[int], known: Sequence[Hypothesis]) -> bool:
    """Whether an effect is searched in short windows, where some slow ones are known.

    Noise of accelerations resembles a form without an oscillation, so that it must have been found
    in long windows, too.
    """
    slow = candidate.term.effect.without_swing & set(candidate.term.shape)
    found = any(
        slow <= set(c.term.shape) for h in known for c in h.candidates if c.site == candidate.site
    )
    return not slowed & set(candidate.joints) and (not slow or found)


def _sites(findings: Sequence[Hypothesis]) -> set[tuple[str, tuple[int, ...]]]:
    return {c.site for h in findings for c in h.candidates}
