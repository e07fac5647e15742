# SPDX-License-Identifier: BSD-3-Clause
"""Effects of some trajectories only: payloads and tool forces.

They cannot be judged by leaving out whole trajectories, because only the trajectory itself shows
its load. They are judged on interleaved quarters of every trajectory instead.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array
from skidyn.diagnosis._candidates import Candidate, rows_within
from skidyn.diagnosis._confidence import SEPARATES
from skidyn.diagnosis._profile import QUARTERS
from skidyn.effects import Term, get_effect
from skidyn.evidence import Problem, column_sizes, felt_columns, left_out_errors

#: Number of largest gaps between the sorted estimates that are tried as the border of the split.
CUTS = 3


@dataclass(frozen=True)
class Split:
    """An effect in some trajectories.

    Attributes
    ----------
    candidate : Candidate
        Term with its trajectories.
    drop : ndarray of shape (4,)
        Held-out drop of squared error by quarter, in units of the noise.
    apart : bool
        Whether its trajectories were chosen for effects with a separate size in each.
    """

    candidate: Candidate
    drop: Array
    apart: bool = False


def _terms(problem: Problem, kind: str) -> tuple[list[Term], list[Term]]:
    """Effects of a kind in all recordings, at their usual places and elsewhere."""
    effect, joints, few = get_effect(kind), tuple(range(problem.n_joints)), problem.few
    if effect.search != "trajectories" or problem.robot is None:
        return [], []
    usual = [Term.at(kind, joints, shape) for shape in effect.grid(few, joints)]
    return usual, [Term.at(kind, joints, shape) for shape in effect.elsewhere(few)]


def prepare_splits(problem: Problem, kinds: Iterable[str]) -> None:
    """Compute the columns that :func:`split_effects` needs, on all cores that may be used.

    Parameters
    ----------
    problem : Problem
        Rows; keeps the columns.
    kinds : iterable of str
        Kinds to try.
    """
    if len(problem.rows.recordings) > 1:
        problem.prepare([t for kind in kinds for some in _terms(problem, kind) for t in some])


def split_effects(
    problem: Problem,
    kinds: Sequence[str],
    blocks: Sequence[dict[int, Array]],
    sigma: Array,
    target: Sequence[Array],
    known: Sequence[Candidate] = (),
) -> list[Split]:
    """Best splits of the trajectories for each kind of effect that needs one.

    One for the same effect in all of its trajectories, and one for separate sizes.

    Parameters
    ----------
    problem : Problem
        Rows.
    kinds : sequence of str
        Kinds to try; those without ``search = "trajectories"`` are skipped.
    blocks : sequence of dict
        Columns of the model beside the rigid body.
    sigma : ndarray of shape (n_joints,)
        Noise of one row.
    target : sequence of ndarray
        Averaged torque.
    known : sequence of Candidate
        Effects of the model that were found. The trajectories of a payload are not split again:
        another payload is one of other trajectories.
    """
    names = problem.rows.recordings
    if problem.robot is None or len(names) < 2:
        return []
    y = [t / s for t, s in zip(target, sigma, strict=True)]
    model = _Model.of(problem, blocks, sigma, y)
    found = []
    for kind in kinds:
        usual, others = _terms(problem, kind)
        free = ~recordings_with(kind, known, names)
        if not usual or free.sum() < 2:
            continue
        most, of_kind = 0.0, list[tuple[Split, _Products]]()
        for term in [*usual, *others]:
            rows = {j: b / sigma[j] for j, b in problem.term_rows(term).items()}
            products = model.with_effect(rows)
            splits = _best_splits(problem, term, products, names, free)
            if term in usual:
                most = max([most, *(float(split.drop.sum()) for split in splits)])
            else:
                least = term.effect.elsewhere_must_gain * most
                splits = [split for split in splits if float(split.drop.sum()) > least]
            of_kind += [(split, products) for split in splits]
        found += _best_exchanged(problem, of_kind, names, free)
    return found


def _best_exchanged(
    problem: Problem,
    splits: Sequence[tuple[Split, _Products]],
    names: NDArray[Any],
    free: NDArray[np.bool_],
) -> list[Split]:
    """Splits of a kind, of which the best one has had its trajectories exchanged one by one.

    The estimate of a single trajectory may be arbitrary in some directions, if few joints move or
    all of them move little, so that gaps between estimates may miss it.
    """
    found = [split for split, _ in splits]
    drops = [-np.inf if split.apart else float(split.drop.sum()) for split in found]
    best = int(np.argmax(drops)) if drops else 0
    if not drops or drops[best] <= SEPARATES:
        return found
    split, products = splits[best]
    chosen = np.isin(names, split.candidate.term.trajectories or ())

    def worth(chosen: NDArray[np.bool_]) -> float:
        return products.explained(chosen) - SEPARATES * float(chosen.sum())

    most = worth(chosen)
    while True:
        others = [chosen ^ step for step in np.eye(len(names), dtype=bool)[free]]
        others = [o for o in others if o.any() and not np.all(o >= free)]
        worths = [worth(o) for o in others]
        if not worths or max(worths) <= most:
            break
        most = max(worths)
        chosen = others[worths.index(most)]
    term = split.candidate.term.with_shape(trajectories=tuple(names[chosen].tolist()))
    rows = problem.term_rows(term)
    found[best] = Split(Candidate(term.kind, term, rows), products.drop(chosen))
    return found


def _best_splits(
    problem: Problem,
    term: Term,
    products: _Products,
    names: NDArray[Any],
    free: NDArray[np.bool_],
) -> list[Split]:
    """The best split for the same effect in its trajectories, and that for separate sizes."""
    own = products.own_estimates(term.effect.leading or term.width, free)
    groups = _splits(term.effect.grows, own, names[free])
    together = [(products.drop(np.isin(names, group)), group) for group in groups]
    # Separate sizes in most recordings can be due to any missing slow torque.
    few = [group for group in groups if 3 * len(group) <= 2 * len(names)]
    alone = {name: products.drop(names == name) for name in {n for g in few for n in g}}
    apart = [(np.sum([alone[name] for name in group], axis=0), group) for group in few]
    found = []
    for drops, is_apart in ((together, False), (apart, True)):
        if not drops:
            continue
        most = max(float(drop.sum()) for drop, _ in drops)
        # bodies may follow a force in all trajectories, so that its absence from some is equal
        equal = [item for item in drops if float(item[0].sum()) > most - SEPARATES]
        drop, chosen = min(equal, key=lambda item: (len(item[1]), -float(item[0].sum())))
        split = term.with_shape(trajectories=tuple(sorted(int(name) for name in chosen)))
        rows = rows_within(problem, problem.term_rows(term), chosen)
        found.append(Split(Candidate(term.kind, split, rows), drop, is_apart))
    return found


def recordings_with(
    kind: str, candidates: Sequence[Candidate], names: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Which of some recordings have an effect of a kind among some candidates, (n_recordings,)."""
    own = [c.term.trajectories for c in candidates if c.kind == kind]
    return np.isin(names, [k for some in own for k in (names if some is None else some)])


@dataclass(frozen=True)
class _Model:
    """The model without an effect, which all effects share.

    Attributes
    ----------
    places : list of ndarray of shape (n_columns_j + 1,)
        Places of [columns that act on the joint | torque] among all of the model, by joint.
    cells : list of dict of (int, int) to (ndarray of int, ndarray)
        Rows of every trajectory and quarter, and these columns there, by joint.
    n_trajectories : int
        Number of trajectories.
    gram : ndarray of shape (4, p + 1, p + 1)
        Products of [model | torque] by quarter.
    """

    places: list[NDArray[np.int64]]
    cells: list[dict[tuple[int, int], tuple[NDArray[np.intp], Array]]]
    n_trajectories: int
    gram: Array

    @classmethod
    def of(
        cls,
        problem: Problem,
        blocks: Sequence[dict[int, Array]],
        sigma: Array,
        y: Sequence[Array],
    ) -> _Model:
        felt, p = felt_columns(problem, blocks, sigma)
        names = problem.rows.recordings
        places = [np.append(own.places, p) for own in felt]
        cells, gram = [], np.zeros((QUARTERS, p + 1, p + 1))
        for j, (own, torque, place) in enumerate(zip(felt, y, places, strict=True)):
            both, quarter = np.column_stack([own.rows, torque]), problem.rows.quarter[j]
            for f in range(QUARTERS):
                part = both[quarter == f]
                gram[f][np.ix_(place, place)] += part.T @ part
            cell = np.searchsorted(names, problem.rows.trajectory[j]) * QUARTERS + quarter
            inside = {c: np.flatnonzero(cell == c) for c in np.unique(cell).tolist()}
            cells.append({divmod(c, QUARTERS): (at, both[at]) for c, at in inside.items()})
        return cls(places, cells, len(names), gram)

    @cached_property
    def errors(self) -> Array:
        """Held-out squared error by quarter, (4,)."""
        return left_out_errors(self.gram)

    def with_effect(self, rows: dict[int, Array]) -> _Products:
        """Products with the columns of an effect, by joint and in units of the noise."""
        k = next(iter(rows.values())).shape[1]
        cross = np.zeros((self.n_trajectories, QUARTERS, self.gram.shape[1], k))
        own = np.zeros((self.n_trajectories, QUARTERS, k, k))
        for j in sorted(rows):
            for (i, f), (at, both) in self.cells[j].items():
                block = rows[j][at]
                cross[i, f, self.places[j]] += both.T @ block
                own[i, f] += block.T @ block
        return _Products(self, cross, own)


@dataclass(frozen=True)
class _Products:
    """Products of the model's columns, an effect's and the torque.

    An effect in some trajectories needs only those of these trajectories, so that any choice of
    them is a sum.

    Attributes
    ----------
    model : _Model
        The model without the effect.
    cross : ndarray of shape (n_trajectories, 4, p + 1, k)
        Of [model | torque] with the effect, by trajectory and quarter.
    own : ndarray of shape (n_trajectories, 4, k, k)
        Of the effect.
    """

    model: _Model
    cross: Array
    own: Array

    def own_estimates(self, leading: int, free: NDArray[np.bool_]) -> Array:
        """The effect's leading coefficients, estimated for the free trajectories, each its own."""
        p, n = self.model.gram.shape[1] - 1, int(free.sum())
        size = p + leading * n
        gram, right = np.zeros((size, size)), np.zeros(size)
        whole, cross = self.model.gram.sum(0), self.cross[free].sum(1)[:, :, :leading]
        gram[:p, :p], right[:p] = whole[:p, :p], whole[:p, p]
        gram[:p, p:] = cross[:, :p].transpose(1, 0, 2).reshape(p, -1)
        gram[p:, :p] = gram[:p, p:].T
        right[p:] = cross[:, p].ravel()
        for i, own in enumerate(self.own[free].sum(1)):
            place = slice(p + leading * i, p + leading * (i + 1))
            gram[place, place] = own[:leading, :leading]
        scale = column_sizes(gram)
        # A payload in all trajectories is part of the arm: only differences can be estimated.
        ridge = np.r_[np.full(p, 1e-9), np.full(size - p, 1e-4)]
        scaled = np.linalg.solve(gram / scale[:, None] / scale + np.diag(ridge), right / scale)
        solution: Array = scaled / scale
        return solution[p:].reshape(n, leading)

    def explained(self, chosen: NDArray[np.bool_]) -> float:
        """What the model explains when chosen trajectories get the effect, without a part held out.

        What is left out in turn is predicted badly where few trajectories determine the bodies;
        sets of trajectories have equally many coefficients and need no such comparison.
        """
        grams = self._with_effect(chosen).sum(0)
        gram, right = grams[:-1, :-1], grams[:-1, -1]
        scale = column_sizes(gram)
        scaled = gram / scale[:, None] / scale + 1e-9 * np.eye(len(gram))
        return float(right / scale @ np.linalg.solve(scaled, right / scale))

    def drop(self, chosen: NDArray[np.bool_]) -> Array:
        """Held-out drop of squared error by quarter when chosen trajectories get the effect."""
        return self.model.errors - left_out_errors(self._with_effect(chosen))

    def _with_effect(self, chosen: NDArray[np.bool_]) -> Array:
        """Products of [model | effect in chosen trajectories | torque] by quarter."""
        p, k = self.model.gram.shape[1] - 1, self.own.shape[2]
        place = np.append(np.arange(p), p + k)  # the torque comes last
        effect = slice(p, p + k)
        grams = np.zeros((QUARTERS, p + k + 1, p + k + 1))
        grams[:, place[:, None], place] = self.model.gram
        cross = self.cross[chosen].sum(0)
        grams[:, place, effect] = cross
        grams[:, effect, place] = cross.transpose(0, 2, 1)
        grams[:, effect, effect] = self.own[chosen].sum(0)
        return grams


def _splits(grows: bool, own: Array, names: NDArray[Any]) -> list[list[Any]]:
    """Groups of trajectories to try: those beyond a gap in the estimates."""
    away = own - np.median(own, axis=0)
    moved = away @ np.linalg.svd(away, full_matrices=False)[2][0]
    groups = _beyond_gaps(moved, names, sides=2)
    if not grows:
        # forces of several directions are all far from the rest
        far = _beyond_gaps(np.linalg.norm(away, axis=1), names, sides=1)
        far = [group for group in far if len(group) <= len(names) / 2]
        others = [[name for name in names.tolist() if name not in group] for group in groups]
        return groups + far + others
    # A payload adds mass, possibly in most of the trajectories.
    mass = own[:, 0]
    lighter = [mass[inside].mean() < mass[~inside].mean() for inside in _members(groups, names)]
    groups = [g for g, light in zip(groups, lighter, strict=True) if not light]
    return _beyond_gaps(mass, names, sides=1) + groups


def _members(groups: list[list[Any]], names: NDArray[Any]) -> list[NDArray[np.bool_]]:
    return [np.isin(names, group) for group in groups]


def _beyond_gaps(score: Array, names: NDArray[Any], sides: int) -> list[list[Any]]:
    """Trajectories above the largest gaps of a score; with two sides, the smaller groups."""
    order = np.argsort(score)
    groups = []
    for cut in np.argsort(-np.diff(score[order]))[:CUTS]:
        above, below = names[order[cut + 1 :]], names[order[: cut + 1]]
        small = [list(g) for g in (above, below) if len(g) <= len(names) / 2]
        groups += [list(above)] if sides == 1 else small
    return groups
