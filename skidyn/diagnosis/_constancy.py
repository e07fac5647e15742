# SPDX-License-Identifier: BSD-3-Clause
"""Whether effects that were found are the same throughout the log.

An effect with a wrong name may fit some recordings, or some of the motion, better than others. The
torque of each effect is therefore tested times simple functions in addition to the completed model:
of each part of the recordings [1]_, of the time since the start of the recording, and of position,
speed and, if it is logged, temperature [2]_. The same is done with the friction of its joints over
time. An effect that differs significantly, by more than a small share of what it explains, is less
sure.

The torque of an effect with another formula than the given one is not removed entirely, and what is
left may look like a second, smaller effect. Such a second effect is less sure if the first one,
times functions of time and motion, would explain most of it.

References
----------
.. [1] G. C. Chow (1960), Tests of equality between sets of coefficients in two linear regressions,
   Econometrica 28(3).
.. [2] J. B. Ramsey (1969), Tests for specification errors in classical linear least-squares
   regression analysis, Journal of the Royal Statistical Society B 31(2).
.. [3] G. E. Mizon, J.-F. Richard (1986), The encompassing principle and its application to testing
   non-nested hypotheses, Econometrica 54(3).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from skidyn._signals import Array
from skidyn.diagnosis._hypothesis import UNKNOWN, SearchResult
from skidyn.diagnosis._rule import CHANGE_INSTEAD, CHANGE_LEVEL, CHANGE_PARTS
from skidyn.diagnosis._search_state import replace_torque
from skidyn.diagnosis._tester import Tester
from skidyn.diagnosis._variables import average_at_rows
from skidyn.effects import Term
from skidyn.evidence import Problem

#: Columns by joint.
_Block = dict[int, Array]


@dataclass(frozen=True)
class Change:
    """What changes of effects explain.

    Attributes
    ----------
    share : float
        Squared error that a significant change of an effect removes, as a share of that which the
        effect removes; 0 if no change is significant.
    instead : str or None
        Kind of another effect that was found, whose change would remove most of the squared error
        that the effect removes.
    """

    share: float = 0.0
    instead: str | None = None


def changes(problem: Problem, result: SearchResult) -> dict[str, Change]:
    """How much better the effects that were found explain the log if they may change.

    Parameters
    ----------
    problem : Problem
        Rows.
    result : SearchResult
        Findings and the final fit.

    Returns
    -------
    dict of str to Change
        By kind.
    """
    named = [h for h in result.findings if h.kind != UNKNOWN and h.torque is None]
    if not named:
        return {}
    bare = replace_torque(problem, problem.torque - result.ripple)
    sigma, target = result.fit.noise, bare.target
    blocks = {term: bare.term_rows(term) for term in result.fit.terms}
    own = dict(result.fit.terms.slices(len(bare.rigid_index)))
    # What a withdrawn name explained is still there, and is no change of another effect.
    doubted = [bare.term_rows(t) for t in result.doubted if t not in blocks]
    whole = Tester(bare, [*blocks.values(), *doubted], sigma, target)
    torques: dict[str, dict[Term, _Block]] = {}
    for hypothesis in named:
        of_kind = torques.setdefault(hypothesis.kind, {})
        for term in (c.term for c in hypothesis.candidates if c.term in own):
            size = result.fit.coefficients[own[term]]
            of_kind[term] = {j: block @ size for j, block in blocks[term].items()}
    tests: dict[str, list[tuple[float, float]]] = {}
    explained, instead = {}, {}

    def beside(*kinds: str) -> Tester:
        """Tests given the model without some kinds."""
        gone = {term for kind in kinds for term in torques[kind]}
        rest = [rows for term, rows in blocks.items() if term not in gone]
        return Tester(bare, rest, sigma, target)

    for kind, of_kind in torques.items():
        without = beside(kind)
        explained[kind] = sum(without.test(blocks[term]).drop for term in of_kind)
        of_blocks = [blocks[term] for term in of_kind]
        other = _instead(bare, torques, kind, (without, whole), explained[kind], of_blocks)
        if other is not None:
            # a formula does not leave more than it removes
            joints = {j for torque in of_kind.values() for j in torque}
            there = [t for t, torque in torques[other].items() if joints & set(torque)]
            removed = sum(beside(kind, other).test(blocks[term]).drop for term in there)
            other = other if removed > explained[kind] else None
        instead[kind] = other
        variants = [v for t, torque in of_kind.items() for v in _variants(bare, t, torque, blocks)]
        tests[kind] = [(test.chance, test.drop) for test in map(whole.test, variants)]
    level = CHANGE_LEVEL / max(1, sum(map(len, tests.values())))
    least = np.finfo(float).tiny
    return {
        kind: Change(
            max((drop for chance, drop in found if chance < level), default=0.0)
            / max(explained[kind], least),
            instead[kind],
        )
        for kind, found in tests.items()
    }


def _instead(
    problem: Problem,
    torques: dict[str, dict[Term, _Block]],
    kind: str,
    testers: tuple[Tester, Tester],
    explained: float,
    own: Sequence[_Block],
) -> str | None:
    """Kind of another effect on the same joints whose change explains most of what a kind does.

    A change that explains nothing in addition to this kind, though this kind explains more in
    addition to the change, only imitates it [3]_.
    """
    joints = {j for torque in torques[kind].values() for j in torque}
    without, whole = testers
    best, most = None, CHANGE_INSTEAD * explained
    for other, of_kind in torques.items():
        if other == kind:
            continue
        there = [torque for torque in of_kind.values() if joints & set(torque)]
        for block in (b for torque in there for b in _reshaped(problem, torque)):
            drop = without.test(block).drop
            if drop > most and not _imitates(block, own, without, whole):
                best, most = other, drop
    return best


def _imitates(block: _Block, own: Sequence[_Block], without: Tester, whole: Tester) -> bool:
    """Whether a change explains nothing beside an effect, which explains more beside the change."""
    if whole.test(block).chance < CHANGE_LEVEL:
        return False
    beside = without.beside([block])
    return any(beside.test(rows).chance < CHANGE_LEVEL for rows in own)


def _variants(
    problem: Problem, term: Term, torque: _Block, blocks: dict[Term, _Block]
) -> Iterator[_Block]:
    """The torque of a term, and the friction on its joints, times functions of time and motion."""
    parts = _parts(problem, term.trajectories)
    later = _since_start(problem)
    if len(parts) > 1:
        yield {j: f[:, None] * _inside(problem, j, parts[1:]) for j, f in torque.items()}
    yield from _reshaped(problem, torque)
    every = _parts(problem, None)
    for j in torque:
        own = [blocks[t][j] for t in problem.terms if t.places == (j,) and t.effect.by_recording]
        if not own:
            continue
        rows = np.hstack(own)
        if len(every) > 1:
            yield {j: np.hstack([rows * x[:, None] for x in _inside(problem, j, every[1:]).T])}
        yield {j: rows * later[j][:, None]}


def _reshaped(problem: Problem, torque: _Block) -> Iterator[_Block]:
    """The torque of a term times functions of time, and of position, speed and temperature."""
    signals, later = problem.signals, _since_start(problem)
    yield {j: (f * later[j])[:, None] for j, f in torque.items()}
    motion = {}
    for j, f in torque.items():
        own = [signals.q[:, j], np.abs(signals.dq[:, j])]
        own += [] if signals.temperature is None else [signals.temperature[:, j]]
        rows = average_at_rows(problem, j, np.column_stack(own))
        functions = np.column_stack([_standard(x) for x in rows.T])
        motion[j] = f[:, None] * np.hstack([functions, functions**2])
    yield motion


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
    return problem.rows.split(problem.rows.spans[2] - 0.5)


def _standard(values: Array) -> Array:
    return (values - values.mean()) / max(float(values.std()), 1e-12) if len(values) else values
