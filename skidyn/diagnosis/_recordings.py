# SPDX-License-Identifier: BSD-3-Clause
"""Effects of some recordings only: increased friction, a new zero of a sensor.

They cannot be judged by leaving out whole trajectories, because only the trajectory itself shows
its effect. They are judged on interleaved quarters of every trajectory instead.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np

from skidyn.diagnosis._candidates import Candidate, rows_together, rows_within
from skidyn.diagnosis._tester import Tester
from skidyn.effects import Term, get_effect
from skidyn.evidence import Problem

#: Number of candidates tested in full in every step, those with the largest drop alone.
TESTED = 8
#: Most terms of one kind.
MOST_TERMS = 24
#: Fewest recordings in each of which an effect may have another size.
FEWEST = 3
#: Kinds of friction that may change together, and the kind of such a change.
FRICTION, DRIFT = ("viscous", "coulomb"), "friction_drift"
#: Share of the whole gain from which a single recording is treated alone.
MOSTLY = 0.8


def groups_of_recordings(problem: Problem) -> list[tuple[int, ...]]:
    """Sets of recordings: each alone, and all from each of them on.

    Parameters
    ----------
    problem : Problem
        Rows.

    Returns
    -------
    list of tuple of int
        Numbers of trajectories; empty with fewer than two.
    """
    names = problem.rows.recordings.tolist()
    if len(names) < 2:
        return []
    later = [tuple(names[k:]) for k in range(1, len(names) - 1)]
    return [(n,) for n in names] + later


def recording_candidates(problem: Problem, kinds: Iterable[str]) -> list[Candidate]:
    """Terms of some recordings for every effect that may differ between them.

    Parameters
    ----------
    problem : Problem
        Rows.
    kinds : iterable of str
        Kinds to try.
    """
    candidates = []
    for whole in terms_by_recording(problem, kinds):
        if not all(_mostly_both_ways(problem, j) for j in whole.places):
            continue
        candidates += _in_groups(problem, whole, groups_of_recordings(problem))
    return candidates


def _in_groups(problem: Problem, whole: Term, groups: Iterable[tuple[int, ...]]) -> list[Candidate]:
    """A term of all recordings, in each of some groups of them."""
    rows = problem.term_rows(whole)
    return [
        Candidate(
            whole.kind,
            whole.with_shape(trajectories=group),
            rows_within(problem, rows, group),
        )
        for group in groups
    ]


def terms_by_recording(problem: Problem, kinds: Iterable[str]) -> list[Term]:
    """Terms, in all recordings, of every effect that may differ between them and is shown.

    Parameters
    ----------
    problem : Problem
        Rows.
    kinds : iterable of str
        Kinds to try.
    """
    return [
        Term.at(kind, joints)
        for kind in kinds
        if (effect := get_effect(kind)).by_recording
        for joints in effect.sites(problem.few)
        if effect.not_shown(problem.few, joints[0]) is None
    ]


def everywhere(problem: Problem, kinds: Iterable[str]) -> list[Candidate]:
    """The effects that may differ between recordings or change within them, in all of them.

    Parameters
    ----------
    problem : Problem
        Rows.
    kinds : iterable of str
        Kinds to try.
    """
    kinds = list(kinds)
    terms = terms_by_recording(problem, kinds)
    for kind in kinds:
        effect = get_effect(kind)
        if effect.scope == "robot" and (effect.drifts or effect.search == "trajectories"):
            terms += _of_whole_robot(problem, kind)
    return [Candidate(term.kind, term, problem.term_rows(term)) for term in terms]


def _of_whole_robot(problem: Problem, kind: str) -> list[Term]:
    """Terms of a kind on all joints together, in all recordings."""
    effect, joints = get_effect(kind), tuple(range(problem.n_joints))
    if problem.robot is None or ("time" in effect.needs and problem.signals.time is None):
        return []
    return [Term.at(kind, joints, shape) for shape in effect.grid(problem.few, joints)]


def every_recording(problem: Problem, kinds: Iterable[str]) -> list[list[Candidate]]:
    """Effects of all joints with another size in each recording.

    Parameters
    ----------
    problem : Problem
        Rows.
    kinds : iterable of str
        Kinds to try.
    """
    names = problem.rows.recordings.tolist()
    if not FEWEST <= len(names) <= MOST_TERMS:
        return []
    found = []
    for kind in kinds:
        if get_effect(kind).sizes_by_recording:
            plain = _of_whole_robot(problem, kind)[:1]
            found += [_in_groups(problem, whole, [(name,) for name in names]) for whole in plain]
    return found


def own_effects(
    problem: Problem, kinds: Iterable[str], found: Iterable[Term] = ()
) -> list[Candidate]:
    """Friction and offsets of the given model, which may differ in a part of the recordings.

    Each kind by itself, and the friction of a joint together as friction of another level.

    Parameters
    ----------
    problem : Problem
        Rows.
    kinds : iterable of str
        Kinds to try.
    found : iterable of Term, optional
        Effects that were found, of which plain friction may differ as well.
    """
    tried = set(kinds)
    own, known = {*FRICTION, "offset"} & tried, [*problem.terms, *found]
    terms = [t for t in known if t.kind in own and not t.is_open and t.trajectories is None]
    terms += _other_levels(problem, tried, range(problem.n_joints), known)
    return [Candidate(term.kind, term, problem.term_rows(term)) for term in terms]


def drifting(
    problem: Problem, kinds: Iterable[str], same: Sequence[Candidate], known: Sequence[Term]
) -> list[Candidate]:
    """Friction of a joint with several sizes in different recordings, as friction that drifts.

    Parameters
    ----------
    problem : Problem
        Rows.
    kinds : iterable of str
        Kinds to try.
    same : sequence of Candidate
        Terms of one kind on one joint, each of some recordings.
    known : sequence of Term
        Terms of the present model.

    Returns
    -------
    list of Candidate
        None if they are not friction of the model, or have only one size.
    """
    if len(same) < 2 or same[0].kind not in FRICTION:
        return []
    found = []
    for whole in _other_levels(problem, set(kinds), same[0].joints, known):
        found += _in_groups(problem, whole, (c.term.trajectories or () for c in same))
    return found


def _other_levels(
    problem: Problem, kinds: set[str], joints: Iterable[int], known: Iterable[Term]
) -> list[Term]:
    """Other levels of the whole friction of joints that is in the model."""
    own = {(t.kind, t.places) for t in known if t.kind in FRICTION and t.trajectories is None}
    if DRIFT not in kinds:
        return []
    return [
        Term.at(DRIFT, (j,), {"level": 1.0})
        for j in joints
        if all((kind, (j,)) in own for kind in FRICTION)
        and get_effect(DRIFT).not_shown(problem.few, j) is None
    ]


def choose(
    candidates: Sequence[Candidate],
    tester_beside: Callable[[Sequence[Candidate]], Tester],
    significant: Callable[[float], bool],
) -> list[Candidate]:
    """Terms of one kind, added one by one while each is significant.

    Parameters
    ----------
    candidates : sequence of Candidate
        Of one kind.
    tester_beside : callable
        Function that returns the tester of the model with some candidates.
    significant : callable
        Function that returns whether a p-value is small enough.
    """
    chosen = _zeroed_anew(candidates, tester_beside([]), significant)
    left = [c for c in candidates if not any(c is other for other in chosen)]
    while left and len(chosen) < MOST_TERMS:
        tester = tester_beside(chosen)
        drops = np.array([_drop_alone(tester, c) for c in left])
        tests = [
            (left[i], tester.test(left[i].rows, left[i].zeros, significant))
            for i in np.argsort(-drops)[:TESTED]
        ]
        found = [(t.drop, c) for c, t in tests if significant(t.chance)]
        if not found:
            break
        best = max(found, key=lambda item: item[0])[1]
        chosen.append(best)
        left = [c for c in left if c is not best]
    return chosen


def _zeroed_anew(
    candidates: Sequence[Candidate], tester: Tester, significant: Callable[[float], bool]
) -> list[Candidate]:
    """Terms of every single recording of a joint, if only all of them together are significant.

    If every recording differs, the residual of the others hides each of them.
    """
    chosen: list[Candidate] = []
    for joints in dict.fromkeys(c.joints for c in candidates):
        own = [c for c in candidates if c.joints == joints and len(c.term.trajectories or ()) == 1]
        if not 1 < len(own) <= MOST_TERMS or own[0].width > 1:
            continue
        rows = rows_together(own, tester.problem.rows.counts)
        together, alone = tester.test_each(rows, significant)
        if not significant(together.chance):
            continue
        # One that explains nearly all of it is significant alone.
        strongest = max((t.drop for t in alone if significant(t.chance)), default=0.0)
        if strongest < MOSTLY * together.drop:
            chosen += own
    return chosen


def _drop_alone(tester: Tester, candidate: Candidate) -> float:
    """Squared error that a candidate would remove from the unchanged model."""
    drop = 0.0
    for j, rows in candidate.rows.items():
        block = rows / tester.sigma[j]
        gram = block.T @ block
        if np.trace(gram) > 0:
            score = block.T @ tester.residual[j]
            drop += float(score @ np.linalg.lstsq(gram, score, rcond=1e-9)[0])
    return drop


def _mostly_both_ways(problem: Problem, joint: int) -> bool:
    """Whether most recordings have motion in both directions; else an offset is friction."""
    direction = problem.rows.average(problem.signals.sign[:, joint], joint)
    trajectory = problem.rows.trajectory[joint]
    shares = [float(np.mean(direction[trajectory == n] > 0)) for n in np.unique(trajectory)]
    return bool(shares) and float(np.mean([0.1 < s < 0.9 for s in shares])) > 0.5
