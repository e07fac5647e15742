# SPDX-License-Identifier: BSD-3-Clause
"""Whether effects that were found are the same throughout the log.

An effect with a wrong name may fit some recordings, or some of the motion, better than others. The
torque of each effect is therefore tested times simple functions in addition to the completed model:
of each part of the recordings [1]_, of the time since the start of the recording, and of position
and speed [2]_. The same is done with the friction of its joints over time. An effect that differs
significantly, by more than a small share of what it explains, is less sure.

References
----------
.. [1] G. C. Chow (1960), Tests of equality between sets of coefficients in two linear regressions,
   Econometrica 28(3).
.. [2] J. B. Ramsey (1969), Tests for specification errors in classical linear least-squares
   regression analysis, Journal of the Royal Statistical Society B 31(2).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from skidyn._signals import Array
from skidyn.diagnosis._hypothesis import UNKNOWN, SearchResult
from skidyn.diagnosis._rule import CHANGE_LEVEL, CHANGE_PARTS, Tester
from skidyn.diagnosis._search_state import replace_torque
from skidyn.effects import Term
from skidyn.evidence import Problem

#: Columns by joint.
_Block = dict[int, Array]


def changes(problem: Problem, result: SearchResult) -> dict[str, float]:
    """How much better the effects that were found explain the log if they may change.

    Parameters
    ----------
    problem : Problem
        Rows.
    result : SearchResult
        Findings and the final fit.

    Returns
    -------
    dict of str to float
        By kind, the squared error that a significant change removes, as a share of that which the
        kind removes; 0 if no change is significant.
    """
    named = [h for h in result.findings if h.kind != UNKNOWN and h.torque is None]
    if not named:
        return {}
    bare = replace_torque(problem, problem.torque - result.ripple)
    terms, sigma = list(result.fit.terms), result.fit.noise
    blocks = {term: bare.term_rows(term) for term in terms}
    own = dict(result.fit.terms.slices(len(bare.rigid_index)))
    whole = Tester(bare, list(blocks.values()), sigma, bare.target)
    found: dict[str, list[tuple[float, float]]] = {}
    explained: dict[str, float] = {}
    for kind in dict.fromkeys(h.kind for h in named):
        alike = [c.term for h in named if h.kind == kind for c in h.candidates if c.term in own]
        rest = [rows for term, rows in blocks.items() if term not in alike]
        without = Tester(bare, rest, sigma, bare.target)
        explained[kind] = sum(without.test(blocks[term]).drop for term in alike)
        found[kind] = []
        for term in alike:
            torque = {j: b @ result.fit.coefficients[own[term]] for j, b in blocks[term].items()}
            for block in _variants(bare, term, torque, blocks):
                test = whole.test(block)
                found[kind].append((test.chance, test.drop))
    level = CHANGE_LEVEL / max(1, sum(map(len, found.values())))
    return {
        kind: max((d for chance, d in tests if chance < level), default=0.0)
        / max(explained[kind], np.finfo(float).tiny)
        for kind, tests in found.items()
    }


def _variants(
    problem: Problem, term: Term, torque: _Block, blocks: dict[Term, _Block]
) -> Iterator[_Block]:
    """The torque of a term, and the friction on its joints, times functions of time and motion."""
    signals = problem.signals
    parts = _parts(problem, term.trajectories)
    later = _since_start(problem)
    if len(parts) > 1:
        yield {j: f[:, None] * _inside(problem, j, parts[1:]) for j, f in torque.items()}
    yield {j: (f * later[j])[:, None] for j, f in torque.items()}
    motion = {}
    for j, f in torque.items():
        position, speed = (
            _standard(_means(problem, x, j)) for x in (signals.q[:, j], np.abs(signals.dq[:, j]))
        )
        motion[j] = f[:, None] * np.column_stack([position, speed, position**2, speed**2])
    yield motion
    every = _parts(problem, None)
    for j in torque:
        own = [blocks[t][j] for t in problem.terms if t.places == (j,) and t.effect.by_recording]
        if not own:
            continue
        rows = np.hstack(own)
        if len(every) > 1:
            yield {j: np.hstack([rows * x[:, None] for x in _inside(problem, j, every[1:]).T])}
        yield {j: rows * later[j][:, None]}


def _parts(problem: Problem, trajectories: Sequence[int] | None) -> list[Array]:
    """Successive recordings of an effect, in a few parts of nearly equal size."""
    names = problem.rows.recordings
    inside = names if trajectories is None else names[np.isin(names, trajectories)]
    return np.array_split(inside, min(len(inside), CHANGE_PARTS))


def _inside(problem: Problem, joint: int, parts: Sequence[Array]) -> Array:
    """Whether the rows of a joint belong to each part of the recordings, (n_rows_j, n_parts)."""
    own = problem.rows.trajectory[joint]
    return np.column_stack([np.isin(own, part) for part in parts]).astype(float)


def _since_start(problem: Problem) -> list[Array]:
    """Time of every row since the middle of its recording, as a share of the length, by joint."""
    edges = np.cumsum([len(t) for t in problem.rows.time])[:-1]
    return np.split(problem.rows.spans[2] - 0.5, edges)


def _means(problem: Problem, signal: Array, joint: int) -> Array:
    """Mean of a signal over the window of every row of a joint."""
    rows = problem.rows
    return rows.average(signal, joint) / rows.average(np.ones_like(signal), joint)


def _standard(values: Array) -> Array:
    return (values - values.mean()) / max(float(values.std()), 1e-12) if len(values) else values
