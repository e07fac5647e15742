# SPDX-License-Identifier: BSD-3-Clause
"""Effects that begin or end within recordings: a load that is gripped, a spring that is hooked on.

For given coefficients, the times at which an effect acts in a recording are those of the interval
in which it removes most of the squared error. The coefficients and the intervals are determined in
turn, from the effect in the second half of every recording, and from the effect in the best part of
the recordings.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array
from skidyn.diagnosis._candidates import Candidate
from skidyn.diagnosis._parts import PartScan, n_parts
from skidyn.diagnosis._recordings import everywhere
from skidyn.diagnosis._rule import JOINTS_OF_LOAD, LEAST_RECORDINGS, SPAN_ROUNDS
from skidyn.diagnosis._tester import Tester
from skidyn.effects import get_effect
from skidyn.evidence import Problem

#: Interval of a recording: its number, first and last time in s.
Span = tuple[int, float, float]
#: Kinds that with intervals of their own in many recordings follow any torque: all five of these in
#: logs of three examiners were another effect.
FOLLOWS_ANY = ("offset", "viscous", "coulomb")


def span_candidates(
    problem: Problem,
    kinds: Sequence[str],
    tester: Tester,
    significant: Callable[[float, Candidate], bool],
    least: float,
    among: Callable[[Candidate], bool] = lambda _: True,
) -> list[list[Candidate]]:
    """Of every kind that may differ between recordings, its terms that act in intervals.

    Parameters
    ----------
    problem : Problem
        Rows.
    kinds : sequence of str
        Kinds to try.
    tester : Tester
        Tests given the present model.
    significant : callable
        Function that returns whether the p-value of a candidate is small enough.
    least : float
        Squared error that an effect must remove, in units of the noise, in addition to that which
        it removes in whole recordings.
    among : callable, optional
        Function that returns whether an effect of all recordings is tried; all by default.
    """
    times = _Times(problem)
    if len(times.names) < 2:
        return []
    scan = PartScan(tester)
    found: dict[str, list[Candidate]] = defaultdict(list)
    effects = map(get_effect, kinds)
    passing = [e.kind for e in effects if e.by_recording or e.search == "trajectories"]
    for whole in filter(among, everywhere(problem, passing)):
        best, drop = None, -np.inf
        (part,) = scan.parts([whole])
        recordings = None if part is None else part.recordings
        for start in [times.halves, *([] if recordings is None else [times.within(recordings)])]:
            inside, removed = _alternated(tester, times, whole, start)
            if removed > drop:
                best, drop = inside, removed
        if best is not None and whole.term.effect.grows:
            best, drop = _carried(tester, times, whole, best, drop)
        plain = max(0.0, 0.0 if part is None else part.drop)
        if best is None or drop - times.price(best) < plain + least:
            continue
        candidate = times.candidate(whole, best)
        if candidate is None:
            continue

        def passes(chance: float, candidate: Candidate = candidate) -> bool:
            return significant(chance, candidate)

        if passes(tester.test(candidate.rows, candidate.zeros, passes).chance):
            found[candidate.kind].append(candidate)
    return list(found.values())


class _Times:
    """The rows of all joints in the order of time, recording by recording."""

    def __init__(self, problem: Problem) -> None:
        self.problem, self.names = problem, problem.rows.recordings
        rows = problem.rows
        self.time, self.of = np.concatenate(rows.time), np.concatenate(rows.trajectory)
        clock, recording = problem.signals.clock, problem.signals.trajectory
        logged = {name: clock[recording == name] for name in self.names.tolist()}
        # first and last sample of every recording, which rows do not reach
        self.ends = {name: (float(t.min()), float(t.max())) for name, t in logged.items()}
        order = np.lexsort((self.time, self.of))
        borders = np.flatnonzero(np.diff(self.of[order])) + 1
        self.runs: list[NDArray[np.int64]] = np.split(order, borders)
        self.halves = rows.spans[2] > 0.5
        # moments at which an effect may begin in a recording
        self.moments = max(2, max(len(np.unique(self.time[run])) for run in self.runs))

    def within(self, recordings: Sequence[int]) -> NDArray[np.bool_]:
        """Whether rows belong to some recordings, all joints one after another."""
        return np.isin(self.of, recordings)

    def cut(self, rows: dict[int, Array], inside: NDArray[np.bool_]) -> dict[int, Array]:
        """Columns that are zero outside some times."""
        own = self.problem.rows.split(inside)
        return {j: block * own[j][:, None] for j, block in rows.items()}

    def best(self, excess: Array) -> NDArray[np.bool_]:
        """The interval of largest sum in every recording, if it is worth its two ends."""
        inside = np.zeros(len(excess), dtype=bool)
        least = 4.0 * np.log(self.moments)
        for run in self.runs:
            total = np.concatenate([[0.0], np.cumsum(excess[run])])
            rise = total - np.minimum.accumulate(total)
            end = int(np.argmax(rise))
            if rise[end] < least:
                continue
            start = int(np.argmin(total[: end + 1]))
            # up to the ends of the recording unless its own end is worth a choice
            start = 0 if -total[start] < least / 2 else start
            end = len(run) if total[end] - total[-1] < least / 2 else end
            inside[run[start:end]] = True
        return inside

    def spans(self, inside: NDArray[np.bool_]) -> tuple[tuple[int, ...], tuple[Span, ...]]:
        """Recordings with some of these rows, and the intervals of those with a part of theirs."""
        recordings, spans = [], []
        for run in self.runs:
            own, time = inside[run], self.time[run]
            if not own.any():
                continue
            name = int(self.of[run[0]])
            recordings.append(name)
            if not own.all():
                half = 0.5 * self.problem.rows.hop
                begin, end = self.ends[name]
                first = begin if own[0] else float(time[own].min()) - half
                last = end if own[-1] else float(time[own].max()) + half
                spans.append((name, first, last))
        return tuple(recordings), tuple(spans)

    def price(self, inside: NDArray[np.bool_]) -> float:
        """Twice the logarithm of the number of choices of ends."""
        return 4.0 * len(self.spans(inside)[1]) * float(np.log(self.moments))

    def candidate(self, whole: Candidate, inside: NDArray[np.bool_]) -> Candidate | None:
        """The effect at these times; None if it fills whole recordings.

        A load shows by its torques on several joints what it is, also in a single recording.
        """
        recordings, spans = self.spans(inside)
        least = 1 if len(whole.rows) >= JOINTS_OF_LOAD else LEAST_RECORDINGS
        if not spans or len(recordings) < least:
            return None
        term = whole.term.with_shape(trajectories=recordings, spans=spans)
        tried = n_parts(len(self.names), len(recordings)) * self.moments
        rows = self.problem.term_rows(term)
        return replace(whole, term=term, rows=rows, n_parts=tried)


def _carried(
    tester: Tester, times: _Times, whole: Candidate, inside: NDArray[np.bool_], drop: float
) -> tuple[NDArray[np.bool_], float]:
    """The times of a load, or the others if its mass is negative in these.

    The bodies identified from all rows contain part of it, so that both explain equally much.
    """
    coefficients, _ = tester.estimate(times.cut(whole.rows, inside))
    if coefficients[0] >= 0:
        return inside, drop
    others, removed = _alternated(tester, times, whole, ~inside)
    return (inside, drop) if others is None or removed < drop / 2 else (others, removed)


def _alternated(
    tester: Tester, times: _Times, whole: Candidate, inside: NDArray[np.bool_]
) -> tuple[NDArray[np.bool_] | None, float]:
    """Times at which an effect acts, found in turn with its coefficients, and what it removes."""
    best: NDArray[np.bool_] | None = None
    drop = 0.0
    for _ in range(SPAN_ROUNDS):
        rows = times.cut(whole.rows, inside)
        coefficients, removed = tester.estimate(rows)
        if removed <= drop + 1.0:
            break
        best, drop = inside, removed
        left = tester.beside([rows]).residual
        excess = []
        for j, own in enumerate(times.problem.rows.split(inside)):
            if j not in whole.rows:
                excess.append(np.zeros(len(own)))
                continue
            torque = whole.rows[j] @ coefficients / tester.sigma[j]
            excess.append((2 * (left[j] + own * torque) - torque) * torque)
        inside = times.best(np.concatenate(excess))
        if not inside.any():
            break
    return best, drop
