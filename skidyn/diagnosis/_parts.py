# SPDX-License-Identifier: BSD-3-Clause
"""Effects of any kind in a part of the recordings, which is found together with the effect.

An end stop that only some recordings reach, a cable that was attached in between, friction of a
gear that was cold at first: every effect of the catalogue that may come and go is tried with equal
size in a part of the recordings. Of all parts, the one that removes most of the squared error
consists of the recordings with the largest separate estimates [1]_, so that few have to be tried;
its p-value still counts all parts of its size.

References
----------
.. [1] D. B. Neill (2012), Fast subset scan for spatial pattern detection, Journal of the Royal
   Statistical Society B 74(2).
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln

from skidyn._signals import Array
from skidyn.diagnosis._candidates import Candidate, rows_within
from skidyn.diagnosis._rule import ROUNDS, Tester
from skidyn.evidence import Problem

#: Fewest recordings of which a part is looked for, and fewest recordings of a part: a single one
#: does not show that an effect returns with the same shape.
FEWEST, LEAST_PART = 3, 2
#: Shapes of a kind on the same joints that are tried in full.
SHAPES = 3
#: Largest share of what the part explains that the same effect in all recordings may explain.
MOST_IN_ALL = 0.8
#: Share of the largest drop from which a shape is refined together with its part.
NEAR = 0.5
#: A recording whose information about an effect is a smaller share of the largest has no estimate.
BLIND = 1e-3
#: A kind, and the names of the shape entries that only one of its further forms has.
_Form = tuple[str, frozenset[str]]


@dataclass(frozen=True)
class Part:
    """A part of the recordings in which an effect acts.

    Attributes
    ----------
    recordings : tuple of int
        Numbers of these trajectories.
    drop : float
        Squared error that the effect removes, in units of the noise, minus the price of the choice.
    """

    recordings: tuple[int, ...]
    drop: float


class PartScan:
    """Parts of the recordings for one model.

    Parameters
    ----------
    tester : Tester
        Tests given the model.

    Attributes
    ----------
    names : ndarray of shape (n,)
        Numbers of the trajectories.
    """

    def __init__(self, tester: Tester) -> None:
        self.tester, self.names = tester, tester.problem.rows.recordings
        inside = [t == self.names[:, None] for t in tester.problem.rows.trajectory]
        self._rows = [[np.flatnonzero(own) for own in of_joint] for of_joint in inside]
        self._inside = [of_joint.astype(float) for of_joint in inside]

    def roughly(self, candidate: Candidate) -> float:
        """Squared error that separate sizes would remove if the model could not follow them."""
        n, k = len(self.names), candidate.width
        own, score = np.zeros((n, k)), np.zeros((n, k))
        for j, rows in candidate.rows.items():
            block = rows / self.tester.sigma[j]
            own += self._inside[j] @ block**2
            score += self._inside[j] @ (block * self.tester.residual[j][:, None])
        seen = own > BLIND * own.max(axis=0)
        return float(np.sum(np.where(seen, score**2 / np.where(seen, own, 1.0), 0.0)))

    def part(self, candidate: Candidate) -> Part | None:
        """The best part of the recordings, None if the effect in all of them explains as much."""
        n, k, model = len(self.names), candidate.width, self.tester
        score, cross = np.zeros((n, k)), np.zeros((n, len(model.inverse), k))
        own = np.zeros((n, k, k))
        for j, rows in candidate.rows.items():
            block, felt = rows / model.sigma[j], model.felt[j]
            for i, here in enumerate(self._rows[j]):
                b = block[here]
                own[i] += b.T @ b
                score[i] += b.T @ model.residual[j][here]
                cross[i, felt.places] += felt.rows[here].T @ b
        shared = np.einsum("ipk,pq,jql->ijkl", cross, model.inverse, cross, optimize=True)
        return best_part(self.names, score, own, shared)


def best_part(
    names: NDArray[np.int64], score: Array, own: Array, shared: Array | None = None
) -> Part | None:
    """The best part of the recordings, None if the effect in all of them explains as much.

    Parameters
    ----------
    names : ndarray of shape (n,)
        Numbers of the trajectories.
    score : ndarray of shape (n, k)
        Products of an effect's columns and the residual in every trajectory.
    own : ndarray of shape (n, k, k)
        Products of the columns with themselves.
    shared : ndarray of shape (n, n, k, k), optional
        The part of them that the model can represent, of each trajectory with each.

    Returns
    -------
    Part or None
    """
    n = len(names)
    size = np.sqrt(np.maximum(np.einsum("ikk->k", own), 1e-300))
    own, score = own / size[:, None] / size, score / size
    joint = np.zeros((n, n, *own.shape[1:]))
    if shared is not None:
        joint -= shared / size[:, None] / size
    joint[np.arange(n), np.arange(n)] += own
    weight = np.einsum("ikk->i", own)
    seen = np.flatnonzero(weight > BLIND * weight.max())
    in_all = float(_drops(score.sum(0)[None], joint.sum((0, 1))[None])[0])
    prices = np.array([price_of_part(n, m) for m in range(1, len(seen))])
    best = None
    for order in _orders(score, own, joint, seen):
        grams = (
            joint[np.ix_(order, order)]
            .cumsum(0)
            .cumsum(1)[np.arange(len(order)), np.arange(len(order))]
        )
        drops = (_drops(score[order].cumsum(0), grams)[:-1] - prices)[LEAST_PART - 1 :]
        m = LEAST_PART + int(np.argmax(drops)) if len(drops) else 0
        if m and (best is None or drops[m - LEAST_PART] > best.drop):
            recordings = tuple(sorted(int(names[i]) for i in order[:m]))
            best = Part(recordings, float(drops[m - LEAST_PART]))
    return best if best is not None and in_all < MOST_IN_ALL * best.drop else None


def _drops(scores: Array, grams: Array) -> Array:
    """Squared error removed with equal size in each of some sets of recordings."""
    ridge = 1e-9 * np.eye(scores.shape[1])
    solution = np.linalg.solve(grams + ridge, scores[:, :, None])[:, :, 0]
    return np.asarray(np.sum(scores * solution, axis=1))


def _orders(
    score: Array, own: Array, joint: Array, seen: NDArray[np.int64]
) -> list[NDArray[np.int64]]:
    """Recordings in the order of their estimates, from both ends."""
    n, k = len(seen), score.shape[1]
    gram = joint[np.ix_(seen, seen)].transpose(0, 2, 1, 3).reshape(n * k, n * k)
    # the model absorbs an effect of equal size in all recordings: only differences count
    estimate = np.linalg.solve(gram + 1e-4 * np.eye(n * k), score[seen].ravel()).reshape(n, k)
    along = estimate[:, 0]
    if k > 1:
        weight = np.sqrt(np.einsum("ikk->i", own[seen]))
        along = estimate @ np.linalg.svd(estimate * weight[:, None], full_matrices=False)[2][0]
    order = seen[np.argsort(-along, kind="stable")]
    return [order, order[::-1]]


def price_of_part(n: int, m: int) -> float:
    """Twice the logarithm of the number of parts of m of n recordings, of any size equally."""
    return 2.0 * float(np.log(n_parts(n, m)))


def n_parts(n: int, m: int) -> float:
    """Number of parts of m of n recordings, times the number of sizes."""
    return n * float(np.exp(gammaln(n + 1) - gammaln(m + 1) - gammaln(n - m + 1)))


def part_candidates(
    pool: Sequence[Candidate],
    tester: Tester,
    significant: Callable[[float, Candidate], bool],
    refined: Callable[[Candidate], Candidate],
    least: float,
) -> list[list[Candidate]]:
    """Of every kind and form, its terms in the best part of the recordings.

    Parameters
    ----------
    pool : sequence of Candidate
        Effects that may be missing, in all recordings.
    tester : Tester
        Tests given the present model.
    significant : callable
        Function that returns whether the p-value of a candidate is small enough.
    refined : callable
        Function that returns a candidate with its shape refined.
    least : float
        Squared error that an effect must remove, in units of the noise.
    """
    problem, scan = tester.problem, PartScan(tester)
    if len(scan.names) < FEWEST:
        return []
    sites: dict[tuple[_Form, tuple[int, ...]], list[tuple[float, Candidate]]] = defaultdict(list)
    for candidate in pool:
        effect = candidate.term.effect
        if effect.comes_and_goes and candidate.term.trajectories is None:
            rough = scan.roughly(candidate)
            if rough > least:
                form = candidate.kind, effect.form_names & set(candidate.term.shape)
                sites[form, candidate.joints].append((rough, candidate))
    offered: list[tuple[_Form, Part, Candidate]] = []
    for (form, _), own in sites.items():
        own = sorted(own, key=lambda item: -item[0])[:SHAPES]
        parts = [(part, c) for _, c in own if (part := scan.part(c)) is not None]
        if not parts:
            continue
        part, candidate = max(parts, key=lambda item: item[0].drop)
        inside = within(problem, candidate, part.recordings)
        if part.drop > least and significant(tester.test(inside.rows, inside.zeros).chance, inside):
            offered.append((form, part, inside))
    largest = max((part.drop for _, part, _ in offered), default=0.0)
    found: dict[_Form, list[tuple[float, Candidate]]] = defaultdict(list)
    for form, part, inside in offered:
        # the others are at best second findings, which the next round refines
        near = part.drop > NEAR * largest
        settled = _settled(scan, refined, part, inside) if near else (part.drop, inside)
        found[form].append(settled)
    best_first = sorted(found.values(), key=lambda of_form: -max(drop for drop, _ in of_form))
    return [_same_part(of_form) for of_form in best_first]


def _settled(
    scan: PartScan,
    refined: Callable[[Candidate], Candidate],
    part: Part,
    inside: Candidate,
) -> tuple[float, Candidate]:
    """A part and its candidate, each found again with the other until they stay the same.

    On the grid, the shape may hide the effect in recordings where it is weak.
    """
    problem = scan.tester.problem
    for _ in range(ROUNDS if inside.n_shapes else 0):
        term = refined(inside).term.everywhere
        everywhere = replace(inside, term=term, rows=problem.term_rows(term))
        again = scan.part(everywhere)
        if again is None or again.drop <= part.drop:
            break
        same = again.recordings == part.recordings
        part, inside = again, within(problem, everywhere, again.recordings)
        if same:
            break
    return part.drop, inside


def _same_part(found: list[tuple[float, Candidate]]) -> list[Candidate]:
    """The best candidate of a kind, and those of other joints that act in the same recordings."""
    found = sorted(found, key=lambda item: -item[0])
    best = found[0][1]
    taken, own = set(best.joints), [best]
    for _, candidate in found[1:]:
        if candidate.term.trajectories == best.term.trajectories and taken.isdisjoint(
            candidate.joints
        ):
            own.append(candidate)
            taken |= set(candidate.joints)
    return own


def within(problem: Problem, candidate: Candidate, recordings: tuple[int, ...]) -> Candidate:
    """A candidate that acts in some recordings only."""
    tried = n_parts(len(problem.rows.recordings), len(recordings))
    term = candidate.term.with_shape(trajectories=recordings)
    return replace(
        candidate,
        term=term,
        rows=rows_within(problem, candidate.rows, recordings),
        n_parts=tried,
    )
