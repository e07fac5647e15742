# SPDX-License-Identifier: BSD-3-Clause
"""A further search without the beginnings of recordings, in which links may swing already.

A link on an elastic gear that is in motion when a recording begins oscillates at first in a way
that no logged signal predicts: that of its motion before. This decays within seconds. If a link
that oscillates was found, or the model fails more in the beginnings than later, the search is
repeated without them. Its result counts if it finds such a link, and fails in the beginnings.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array
from skidyn._text import joints_told
from skidyn.diagnosis._hypothesis import SearchResult
from skidyn.diagnosis._rule import (
    BEGINNING_ALIKE,
    BEGINNING_DAMPING,
    BEGINNING_LEFT,
    BEGINNING_RESONANCE,
    BEGINNING_STANDS_OUT,
)
from skidyn.effects import get_effect
from skidyn.evidence import Problem, with_reversals

#: Result of the first search, the problem of the closer ones, and their result.
Searched = tuple[SearchResult, Problem, SearchResult]


def look_after_beginnings(
    problem: Problem,
    searched: Searched,
    kinds: Iterable[str],
    search: Callable[[Problem], Searched],
) -> tuple[Problem, Searched, str]:
    """Search again without the beginnings of recordings if a link may swing there.

    Parameters
    ----------
    problem : Problem
        Problem of all samples.
    searched : tuple of SearchResult, Problem and SearchResult
        What was found in it.
    kinds : iterable of str
        Kinds of the catalogue to try; without one of a link that oscillates, nothing is searched.
    search : callable
        All searches in a problem.

    Returns
    -------
    problem : Problem
        Problem without the beginnings if links swing there, else as given.
    searched : tuple of SearchResult, Problem and SearchResult
        What was found in it.
    note : str
        What was left out, and why; empty if nothing was.
    """
    if problem.signals.time is None or not any(get_effect(k).follows_acceleration for k in kinds):
        return problem, searched, ""
    swing = _slowest_swing(searched)
    sliding, signals = problem.rows.sliding, problem.signals
    for _ in range(2):  # again if the swing that is found is slower
        length = BEGINNING_LEFT / (2 * np.pi * BEGINNING_DAMPING * (swing or BEGINNING_RESONANCE))
        early = _beginnings(problem, length)[:, None]
        if not swing:
            ratio = _standing_out(searched, sliding & early, sliding & ~early)
            if not np.any(ratio > BEGINNING_STANDS_OUT):
                return problem, searched, ""
        settled = signals.with_(valid=signals.usable & ~early)
        later = with_reversals(replace(problem, signals=settled), problem.terms, ())
        if not later.rows.counts.any():
            return problem, searched, ""
        found = search(later)
        slower = _slowest_swing(found)
        if not slower or slower > BEGINNING_ALIKE * (swing or BEGINNING_RESONANCE):
            break
        swing = slower
    ratio = _standing_out(found, sliding & early, later.rows.sliding)
    joints = [j for j in _swinging(found) if ratio[j] > BEGINNING_STANDS_OUT]
    if not joints:
        return problem, searched, ""
    where = joints_told(j + 1 for j in joints)
    times = float(np.sqrt(ratio[joints].max()))
    note = (
        f"The first {length:.1f} s of the recordings, at most half of each, are not judged: "
        f"{where} {'swings' if len(joints) == 1 else 'swing'} there already when a recording "
        f"begins, with up to {times:.1f} times the error of later motion, which no logged signal "
        "predicts. Begin recordings at rest to use them."
    )
    return later, found, note


def _beginnings(problem: Problem, length: float) -> NDArray[np.bool_]:
    """Samples in the first seconds of the recordings, but in no more than half of each.

    Parameters
    ----------
    problem : Problem
        Problem with a clock.
    length : float, s
        How long a beginning is.

    Returns
    -------
    ndarray of shape (n_samples,) of bool
    """
    clock, trajectory = problem.signals.clock, problem.signals.trajectory
    early = np.zeros(len(clock), dtype=bool)
    for name in np.unique(trajectory):
        own = np.flatnonzero(trajectory == name)
        since = clock[own] - clock[own].min()
        early[own] = since < min(length, since.max() / 2)
    return early


def _slowest_swing(searched: Searched) -> float:
    """Lowest resonance of the links that were found to swing, Hz; 0 without one."""
    first, _, last = searched
    terms = [c.term for h in (*first.findings, *last.findings) for c in h.candidates]
    return min(filter(None, (term.effect.fastest(term.shape) for term in terms)), default=0.0)


def _swinging(searched: Searched) -> list[int]:
    """Joints, from 0, whose link swings."""
    candidates = [c for h in searched[2].findings for c in h.candidates]
    return sorted({j for c in candidates if c.term.effect.fastest(c.term.shape) for j in c.joints})


def _standing_out(searched: Searched, early: NDArray[np.bool_], later: NDArray[np.bool_]) -> Array:
    """Mean square of what is left early over that later, by joint."""
    _, problem, result = searched
    left = problem.torque - result.ripple - problem.explained(result.fit)
    return np.asarray(_mean_squares(left, early) / (_mean_squares(left, later) + 1e-300))


def _mean_squares(values: Array, use: NDArray[np.bool_]) -> Array:
    """Mean square of every joint on the samples that are used; 0 without any."""
    total = np.sum(np.where(use, values**2, 0.0), axis=0)
    return np.asarray(total / np.maximum(use.sum(axis=0), 1))
