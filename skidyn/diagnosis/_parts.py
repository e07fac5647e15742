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
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln

from skidyn._signals import Array
from skidyn.diagnosis._candidates import Candidate, rows_within
from skidyn.diagnosis._rule import ROUNDS
from skidyn.diagnosis._tester import Tester
from skidyn.evidence import Problem

#: Fewest recordings of which a part is looked for, and fewest recordings of a part: a single one
#: does not show that an effect returns with the same shape.
FEWEST, LEAST_PART = 3, 2
#: Shapes of a kind on the same joints that are tried in full.
SHAPES = 3
#: Largest share of what the part explains that the same effect in all recordings may explain.
MOST_IN_ALL = 0.8
#: Share of the largest drop from which a shape is refined together with its part, and share of what
#: an effect explains in its best part from which it acts in the part of another joint.
NEAR, SAME_PART = 0.5, 0.9
#: Parts whose squared error, in units of the noise, differs by less are equally good.
EQUAL = 1.0
#: A recording whose information about an effect is a smaller share of the largest has no estimate.
BLIND = 1e-3
#: Approximate number of products of columns that are computed at a time.
MOST_VALUES = 2**20
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
        self._inside = [of_joint.astype(float) for of_joint in inside]
        self._rows = [[np.flatnonzero(own) for own in of_joint] for of_joint in inside]
        pairs = list(zip(self._rows, tester.felt, strict=True))
        self._felt = [[felt.rows[here] for here in of_joint] for of_joint, felt in pairs]

    def roughly(self, candidates: Sequence[Candidate]) -> Array:
        """Squared error that separate sizes would remove if the model could not follow them."""
        n, drops = len(self.names), np.zeros(len(candidates))
        for index, joints, k in self._batches(candidates):
            own, score = np.zeros((n, len(index) * k)), np.zeros((n, len(index) * k))
            for j in joints:
                block = self._block([candidates[i] for i in index], j)
                score += self._inside[j] @ (block * self.tester.residual[j][:, None])
                own += self._inside[j] @ np.square(block, out=block)
            seen = own > BLIND * own.max(axis=0)
            removed = np.where(seen, score**2 / np.where(seen, own, 1.0), 0.0)
            drops[index] = removed.sum(0).reshape(-1, k).sum(1)
        return drops

    def parts(self, candidates: Sequence[Candidate]) -> list[Part | None]:
        """The best part for each candidate, None if the effect in all explains as much."""
        n, model = len(self.names), self.tester
        found: list[Part | None] = [None] * len(candidates)
        for index, joints, k in self._batches(candidates):
            count, width = len(index), len(model.inverse)
            score, own = np.zeros((n, count, k)), np.zeros((n, count, k, k))
            cross = np.zeros((n, width, count * k))
            for j in joints:
                block = self._block([candidates[i] for i in index], j)
                for i, here in enumerate(self._rows[j]):
                    b = block[here]
                    apart = b.reshape(len(b), count, k).transpose(1, 0, 2)
                    own[i] += apart.transpose(0, 2, 1) @ apart
                    score[i] += (model.residual[j][here] @ b).reshape(count, k)
                    cross[i, model.felt[j].places] += self._felt[j][i].T @ b
            mimic = model.inverse @ cross
            parted = [x.reshape(n, width, count, k).transpose(2, 0, 3, 1) for x in (cross, mimic)]
            left, right = (x.reshape(count, n * k, width) for x in parted)
            shared = (left @ right.transpose(0, 2, 1)).reshape(count, n, k, n, k)
            products = score.transpose(1, 0, 2), own.transpose(1, 0, 2, 3)
            best = best_parts(self.names, *products, shared.transpose(0, 1, 3, 2, 4))
            for place, part in zip(index, best, strict=True):
                found[place] = part
        return found

    def _batches(
        self, candidates: Sequence[Candidate]
    ) -> Iterator[tuple[list[int], tuple[int, ...], int]]:
        """Indices of candidates on the same joints with the same number of columns."""
        groups: dict[tuple[tuple[int, ...], int], list[int]] = defaultdict(list)
        for i, candidate in enumerate(candidates):
            groups[tuple(candidate.rows), candidate.width].append(i)
        for (joints, k), index in groups.items():
            columns = len(self.names) * k
            most = max(1, MOST_VALUES // (columns * (columns + len(self.tester.inverse))))
            for start in range(0, len(index), most):
                yield index[start : start + most], joints, k

    def _block(self, candidates: Sequence[Candidate], joint: int) -> Array:
        """Columns of candidates side by side, in units of the noise."""
        block = np.hstack([c.rows[joint] for c in candidates])
        block /= self.tester.sigma[joint]
        return block


def best_parts(
    names: NDArray[np.int64], score: Array, own: Array, shared: Array | None = None
) -> list[Part | None]:
    """The best part of the recordings for each of some effects with as many columns.

    Of parts that are equally good it is the smallest. It is None if the effect in all of them
    explains as much.

    Parameters
    ----------
    names : ndarray of shape (n,)
        Numbers of the trajectories.
    score : ndarray of shape (n_effects, n, k)
        Products of an effect's columns and the residual in every trajectory.
    own : ndarray of shape (n_effects, n, k, k)
        Products of the columns with themselves.
    shared : ndarray of shape (n_effects, n, n, k, k), optional
        The part of them that the model can represent, of each trajectory with each.

    Returns
    -------
    list of Part or None
    """
    count, n, k = score.shape
    size = np.sqrt(np.maximum(np.einsum("eikk->ek", own), 1e-300))
    scale = size[:, :, None] * size[:, None]
    own, score = own / scale[:, None], score / size[:, None]
    joint = np.zeros((count, n, n, k, k)) if shared is None else -shared / scale[:, None, None]
    joint[:, np.arange(n), np.arange(n)] += own
    weight = np.einsum("eikk->ei", own)
    seen = weight > BLIND * weight.max(axis=1, keepdims=True)
    in_all = _drops(score.sum(1), joint.sum((1, 2)))
    orders = _orders(score, weight, joint, seen)
    effect = np.arange(count)[:, None, None]
    # what each recording adds to the products of those before it, in both orders
    rank = np.argsort(orders, axis=2).transpose(0, 2, 1)
    before = rank[:, None] < rank[:, :, None]
    mixed = before.transpose(0, 1, 3, 2) @ joint.reshape(count, n, n, k * k)
    mixed = mixed.reshape(count, n, 2, k, k)
    added = mixed + mixed.transpose(0, 1, 2, 4, 3)
    added += joint[:, np.arange(n), np.arange(n)][:, :, None]
    grams = added[effect, orders, np.arange(2)[:, None]].cumsum(2)
    sizes = np.arange(1, n + 1)
    prices = np.array([price_of_part(n, m) for m in sizes])
    drops = _drops(score[effect, orders].cumsum(2), grams) - prices
    possible = (sizes >= LEAST_PART) & (sizes < seen.sum(1, keepdims=True))
    drops = np.where(possible[:, None], drops, -np.inf).reshape(count, 2 * n)
    found: list[Part | None] = []
    # where the model follows the effect in all recordings, the others are as good a part
    equal = drops >= drops.max(axis=1, keepdims=True) - EQUAL
    for e, best in enumerate(np.where(equal, np.tile(sizes, 2), 2 * n).argmin(axis=1)):
        drop, (way, m) = float(drops[e, best]), divmod(int(best), n)
        recordings = tuple(sorted(names[orders[e, way, : m + 1]].tolist()))
        own_part = np.isfinite(drop) and in_all[e] < MOST_IN_ALL * drop
        found.append(Part(recordings, drop) if own_part else None)
    return found


def _drops(scores: Array, grams: Array) -> Array:
    """Squared error removed with equal size in each of some sets of recordings."""
    ridge = 1e-9 * np.eye(scores.shape[-1])
    solution = np.linalg.solve(grams + ridge, scores[..., None])[..., 0]
    return np.asarray(np.sum(scores * solution, axis=-1))


def _orders(score: Array, weight: Array, joint: Array, seen: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Recordings in the order of their estimates, from both ends, shape (n_effects, 2, n).

    Those without an estimate are last.
    """
    count, n, k = score.shape
    both = (seen[:, :, None] & seen[:, None])[:, :, :, None, None]
    gram = np.where(both, joint, 0.0).transpose(0, 1, 3, 2, 4).reshape(count, n * k, n * k)
    score = np.where(seen[:, :, None], score, 0.0).reshape(count, n * k, 1)
    # the model absorbs an effect of equal size in all recordings: only differences count
    estimate = np.linalg.solve(gram + 1e-4 * np.eye(n * k), score).reshape(count, n, k)
    along = estimate[:, :, 0]
    if k > 1:
        spread = np.linalg.svd(estimate * np.sqrt(weight)[:, :, None], full_matrices=False)[2]
        along = (estimate @ spread[:, 0, :, None])[:, :, 0]
    order = np.argsort(np.where(seen, -along, np.inf), axis=1, kind="stable")
    place, last = np.arange(n), seen.sum(1, keepdims=True) - 1
    back = np.take_along_axis(order, np.where(place <= last, last - place, place), axis=1)
    return np.stack([order, back], axis=1)


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
) -> tuple[list[list[Candidate]], set[int]]:
    """Of every kind and form, its terms in the best part of the recordings.

    Parameters
    ----------
    pool : sequence of Candidate
        Effects that may be missing in a part, in all recordings.
    tester : Tester
        Tests given the present model.
    significant : callable
        Function that returns whether the p-value of a candidate is small enough.
    refined : callable
        Function that returns a candidate with its shape refined.
    least : float
        Squared error that an effect must remove, in units of the noise.

    Returns
    -------
    explanations : list of list of Candidate
        Best first.
    joints : set of int
        Joints, from 0, with an effect that is significant in any part.
    """
    problem = tester.problem
    if not pool or len(problem.rows.recordings) < FEWEST:
        return [], set()
    scan = PartScan(tester)
    sites: dict[tuple[_Form, tuple[int, ...]], list[tuple[float, Candidate]]] = defaultdict(list)
    for rough, candidate in zip(scan.roughly(pool).tolist(), pool, strict=True):
        if rough > least:
            form = candidate.kind, candidate.form
            sites[form, candidate.joints].append((rough, candidate))
    best = {
        site: [c for _, c in sorted(own, key=lambda item: -item[0])[:SHAPES]]
        for site, own in sites.items()
    }
    tried = list(chain.from_iterable(best.values()))
    part_of = dict(zip(tried, scan.parts(tried), strict=True))
    offered: list[tuple[_Form, Part, Candidate]] = []
    for (form, _), own in best.items():
        parts = [(part, c) for c in own if (part := part_of[c]) is not None]
        if not parts:
            continue
        # twice the number of coefficients is what they remove from noise, and lose where held out
        part, candidate = max(parts, key=lambda item: item[0].drop - 2.0 * item[1].width)
        if part.drop <= least:
            continue
        inside = within(problem, candidate, part.recordings)

        def passes(chance: float, inside: Candidate = inside) -> bool:
            return significant(chance, inside)

        if passes(tester.test(inside.rows, inside.zeros, passes).chance):
            offered.append((form, part, inside))
    largest = max((part.drop for _, part, _ in offered), default=0.0)
    found: dict[_Form, list[tuple[float, Candidate]]] = defaultdict(list)
    for form, part, inside in offered:
        # the others are at best second findings, which the next round refines
        near = part.drop > NEAR * largest
        settled = _settled(scan, refined, part, inside) if near else (part.drop, inside)
        found[form].append(settled)
    best_first = sorted(found.values(), key=lambda of_form: -max(drop for drop, _ in of_form))
    joints = {j for _, _, inside in offered for j in inside.rows}
    return [_same_part(tester, of_form) for of_form in best_first], joints


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
        (again,) = scan.parts([everywhere])
        if again is None or again.drop <= part.drop:
            break
        same = again.recordings == part.recordings
        part, inside = again, within(problem, everywhere, again.recordings)
        if same:
            break
    return part.drop, inside


def _same_part(tester: Tester, found: list[tuple[float, Candidate]]) -> list[Candidate]:
    """The best candidate of a kind, and those of other joints that act in the same recordings.

    Where the model follows an effect of all recordings, such as an offset, the other recordings
    with the opposite sign are as good a part on each joint: one part of several joints decides.
    """
    found = sorted(found, key=lambda item: -item[0])
    most, best = -np.inf, [found[0][1]]
    for part in dict.fromkeys(c.term.trajectories or () for _, c in found):
        total, taken, own = 0.0, set[int](), list[Candidate]()
        for drop, candidate in found:
            if taken.isdisjoint(candidate.joints):
                there, inside = _in_part(tester, drop, candidate, part)
                if there > SAME_PART * drop:
                    total += there
                    own.append(inside)
                    taken |= set(inside.joints)
        if total > most:
            most, best = total, own
    return best


def _in_part(
    tester: Tester, drop: float, candidate: Candidate, part: tuple[int, ...]
) -> tuple[float, Candidate]:
    """What a candidate removes in another part of the recordings, and the candidate there."""
    if candidate.term.trajectories == part:
        return drop, candidate
    everywhere = candidate.term.everywhere
    rows = tester.problem.term_rows(everywhere)
    inside = within(tester.problem, replace(candidate, term=everywhere, rows=rows), part)
    price = price_of_part(len(tester.problem.rows.recordings), len(part))
    return tester.test(inside.rows).drop - price, inside


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
