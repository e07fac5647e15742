# SPDX-License-Identifier: BSD-3-Clause
"""Effects whose size changes steadily: a load that empties, a base that sinks.

The size is a straight line over the whole log or over each recording. For given coefficients, its
values at the two ends follow from a fit of the constant and of the growing torque, so that both are
determined in turn. Where the constant torque cannot be told from the model, as a mass from the
identified bodies, the size starts at zero, or ends there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from skidyn._signals import Array
from skidyn.diagnosis._candidates import Candidate
from skidyn.diagnosis._parts import PartScan, n_parts
from skidyn.diagnosis._recordings import everywhere
from skidyn.diagnosis._rule import COURSE_ROUNDS
from skidyn.diagnosis._tester import Tester
from skidyn.effects import get_effect
from skidyn.evidence import Problem


def course_candidates(
    problem: Problem,
    kinds: Sequence[str],
    tester: Tester,
    possible: Callable[[Candidate], bool],
    significant: Callable[[float, Candidate], bool],
    least: float,
    among: Callable[[Candidate], bool] = lambda _: True,
) -> list[list[Candidate]]:
    """Of every kind that may change steadily, its terms that do so.

    Parameters
    ----------
    problem : Problem
        Rows.
    kinds : sequence of str
        Kinds to try.
    tester : Tester
        Tests given the present model.
    possible : callable
        Function that returns whether the coefficients of a candidate are physically possible.
    significant : callable
        Function that returns whether the p-value of a candidate is small enough.
    least : float
        Squared error that an effect must remove, in units of the noise, in addition to that which
        it removes with constant size, also in the best part of the recordings.
    among : callable, optional
        Function that returns whether an effect of all recordings is tried; all by default.
    """
    names = tuple(map(int, problem.rows.recordings))
    signals = problem.signals
    times = [signals.clock[signals.trajectory == name] for name in names]
    ends = np.array([(time.min(), time.max()) for time in times])
    within = _Course(problem, ends, np.zeros(len(names)), np.ones(len(names)))
    passed = np.concatenate([[0.0], np.cumsum(np.ptp(ends, axis=1))])
    passed /= max(float(passed[-1]), 1e-300)
    over = _Course(problem, ends, passed[:-1], passed[1:])
    scan = PartScan(tester)
    found: dict[str, list[Candidate]] = {}
    drifting = [kind for kind in kinds if get_effect(kind).drifts]
    wholes = list(filter(among, everywhere(problem, drifting)))
    parts = [scan.parts([whole])[0] for whole in wholes]
    loads = [whole.term.effect.search == "trajectories" for whole in wholes]
    # a load that some recordings carry; which they are may show for another kind of load only
    carried = {p.recordings for p, load in zip(parts, loads, strict=True) if load and p is not None}
    # where the bodies have taken the load, the recordings without it differ
    carried |= {tuple(name for name in names if name not in some) for some in carried}
    for whole, part, is_load in zip(wholes, parts, loads, strict=True):
        constant = tester.estimate(whole.rows)[1]
        tried = [(over, names)] * (len(names) > 1) + [(within, names)]
        if part is not None:
            constant = max(constant, part.drop)
        if is_load:
            tried += [(within, own) for own in sorted(carried)]
        fits = [(*course.fitted(tester, whole, own), course, own) for course, own in tried]
        drop, sizes, course, own = max(fits, key=lambda fit: fit[0])
        if drop < constant + least:
            continue
        candidate = course.candidate(whole, own, sizes, len(tried))
        less = whole.term.effect.grows and tester.estimate(candidate.rows)[0][0] < 0
        if sizes == (0.0, 1.0) and (less or not possible(candidate)):
            candidate = course.candidate(whole, own, (1.0, 0.0), len(tried))

        def passes(chance: float, candidate: Candidate = candidate) -> bool:
            return significant(chance, candidate)

        chance = tester.test(candidate.rows, candidate.zeros, passes).chance
        if passes(chance) and possible(candidate):
            found.setdefault(candidate.kind, []).append(candidate)
    return list(found.values())


@dataclass(frozen=True)
class _Course:
    """A straight line over every recording, from 0 at its start to 1 at its end.

    Attributes
    ----------
    problem : Problem
        Rows.
    ends : ndarray of shape (n_recordings, 2), s
        Start and end of every recording.
    first, last : ndarray of shape (n_recordings,)
        Values at the start and at the end of every recording.
    """

    problem: Problem
    ends: Array
    first: Array
    last: Array

    def rows(self, rows: dict[int, Array], recordings: Sequence[int]) -> dict[int, Array]:
        """Columns times the line, and zero in other recordings."""
        place = self.problem.rows.spans[0]
        start, length = self.ends[place, 0], np.ptp(self.ends, axis=1)[place]
        share = (np.concatenate(self.problem.rows.time) - start) / np.maximum(length, 1e-300)
        line = self.first[place] + (self.last - self.first)[place] * share
        line = np.where(np.isin(self.problem.rows.recordings[place], recordings), line, 0.0)
        own = self.problem.rows.split(line)
        return {j: block * own[j][:, None] for j, block in rows.items()}

    def inside(self, rows: dict[int, Array], recordings: Sequence[int]) -> dict[int, Array]:
        """Columns that are zero in other recordings."""
        of = self.problem.rows.trajectory
        return {j: block * np.isin(of[j], recordings)[:, None] for j, block in rows.items()}

    def fitted(
        self, tester: Tester, whole: Candidate, recordings: Sequence[int]
    ) -> tuple[float, tuple[float, float]]:
        """Squared error that the effect removes, and its sizes at 0 and 1 of the line."""
        still = self.inside(whole.rows, recordings)
        growing = self.rows(whole.rows, recordings)
        sizes, best = (0.0, 1.0), (0.0, (0.0, 1.0))
        for _ in range(COURSE_ROUNDS):
            start, rise = sizes[0], sizes[1] - sizes[0]
            rows = {j: start * still[j] + rise * growing[j] for j in still}
            coefficients, drop = tester.estimate(rows)
            if drop <= best[0] + 1.0:
                break
            best = drop, sizes
            torque = {
                j: np.column_stack([still[j] @ coefficients, growing[j] @ coefficients])
                for j in still
            }
            (begin, more), _ = tester.estimate(torque)
            ends = np.maximum(np.array([begin, begin + more]), 0.0)
            if not ends.max() > 0:
                break
            sizes = (float(ends[0] / ends.max()), float(ends[1] / ends.max()))
        return best

    def candidate(
        self, whole: Candidate, recordings: Sequence[int], sizes: tuple[float, float], tried: int
    ) -> Candidate:
        """The effect with these sizes at 0 and 1 of the line."""
        course, names = [], self.problem.rows.recordings
        values = np.column_stack([self.first, self.last])
        for name, (start, end), own in zip(names, self.ends, values, strict=True):
            if name in recordings:
                begin, finish = (float(sizes[0] + (sizes[1] - sizes[0]) * x) for x in own)
                course.append((int(name), float(start), begin, float(end), finish))
        shape: dict[str, object] = {"course": tuple(course)}
        if len(course) < len(names):
            shape["trajectories"] = tuple(map(int, recordings))
        term = whole.term.with_shape(**shape)
        parts = tried * n_parts(len(names), len(course))
        return replace(whole, term=term, rows=self.problem.term_rows(term), n_parts=parts)
