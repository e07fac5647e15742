# SPDX-License-Identifier: BSD-3-Clause
"""Effects that some trajectories have and others do not: payloads and tool forces.

Leaving whole trajectories out cannot judge them: what a trajectory carries is seen in that
trajectory alone. They are judged on interleaved quarters of every trajectory instead.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array
from skidyn.diagnosis._candidates import Candidate
from skidyn.diagnosis._profile import QUARTERS
from skidyn.effects import Term, get_effect
from skidyn.evidence import Problem, left_out_errors

#: Largest gaps between the sorted estimates that are tried as the border of the split.
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
    """

    candidate: Candidate
    drop: Array


def split_effects(
    problem: Problem,
    kinds: Sequence[str],
    blocks: Sequence[dict[int, Array]],
    sigma: Array,
    target: Sequence[Array],
) -> list[Split]:
    """Best split of the trajectories for each kind of effect that needs one.

    Parameters
    ----------
    problem : Problem
        Rows.
    kinds : sequence of str
        Kinds to try; those without ``search = "trajectories"`` are passed over.
    blocks : sequence of dict
        Columns of the model beside the rigid body.
    sigma : ndarray of shape (n_joints,)
        Noise of one row.
    target : sequence of ndarray
        Averaged torque.
    """
    names = np.unique(np.concatenate(problem.rows.trajectory))
    if problem.robot is None or len(names) < 2:
        return []
    design = [a / s for a, s in zip(problem.design(blocks), sigma, strict=True)]
    y = [t / s for t, s in zip(target, sigma, strict=True)]
    found = []
    for kind in kinds:
        effect = get_effect(kind)
        if effect.search != "trajectories":
            continue
        term = Term.at(kind, tuple(range(problem.n_joints)))
        rows = {j: b / sigma[j] for j, b in problem.term_rows(term).items()}
        own = _own_estimates(problem, design, y, rows, names, effect.leading or term.width)
        best: tuple[Array, list[Any]] | None = None
        for chosen in _splits(effect.grows, own, names):
            drop = _quarter_drop(problem, design, y, rows, chosen)
            if best is None or drop.sum() > best[0].sum():
                best = drop, chosen
        if best is not None:
            shape = {"trajectories": tuple(sorted(int(name) for name in best[1]))}
            split = term.with_shape(**shape)
            found.append(Split(Candidate(kind, split, _within(problem, term, best[1])), best[0]))
    return found


def _within(problem: Problem, term: Term, names: Iterable[Any]) -> dict[int, Array]:
    """Averaged columns of a term in some trajectories only; no window reaches into another."""
    own = list(names)
    return {
        j: np.where(np.isin(problem.rows.trajectory[j], own)[:, None], block, 0.0)
        for j, block in problem.term_rows(term).items()
    }


def _own_estimates(
    problem: Problem,
    design: list[Array],
    y: list[Array],
    rows: dict[int, Array],
    names: NDArray[Any],
    leading: int,
) -> Array:
    """The effect's leading coefficients, estimated for every trajectory with a common model."""
    p = design[0].shape[1]
    size = p + leading * len(names)
    gram, cross = np.zeros((size, size)), np.zeros(size)
    for j, block in rows.items():
        for i, name in enumerate(names):
            here = problem.rows.trajectory[j] == name
            a = np.hstack([design[j][here], block[here, :leading]])
            index = np.r_[np.arange(p), p + leading * i + np.arange(leading)]
            gram[np.ix_(index, index)] += a.T @ a
            cross[index] += a.T @ y[j][here]
    scale = np.sqrt(np.diag(gram))
    scale[scale == 0] = 1.0
    # A payload in all trajectories is part of the arm: only differences can be estimated.
    ridge = np.r_[np.full(p, 1e-9), np.full(size - p, 1e-4)]
    scaled = np.linalg.solve(gram / scale[:, None] / scale + np.diag(ridge), cross / scale)
    solution: Array = scaled / scale
    return solution[p:].reshape(len(names), leading)


def _splits(grows: bool, own: Array, names: NDArray[Any]) -> list[list[Any]]:
    """Groups of trajectories worth trying: those beyond a gap in the estimates."""
    away = own - np.median(own, axis=0)
    moved = away @ np.linalg.svd(away, full_matrices=False)[2][0]
    groups = _beyond_gaps(moved, names, sides=2)
    if not grows:
        return groups  # a force acts in the smaller group
    # A payload adds mass, be it to most of the trajectories.
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


def _quarter_drop(
    problem: Problem,
    design: list[Array],
    y: list[Array],
    rows: dict[int, Array],
    chosen: Sequence[Any],
) -> Array:
    """Held-out drop of squared error by quarter when the chosen trajectories get the effect."""
    p = design[0].shape[1]
    k = next(iter(rows.values())).shape[1]
    grams = np.zeros((QUARTERS, p + k + 1, p + k + 1))
    for j in range(problem.n_joints):
        inside = np.isin(problem.rows.trajectory[j], chosen).astype(float)[:, None]
        a = np.column_stack([design[j], rows[j] * inside, y[j]])
        for f in range(QUARTERS):
            here = a[problem.rows.quarter[j] == f]
            grams[f] += here.T @ here
    without = np.r_[:p, p + k]
    return left_out_errors(grams[:, without][:, :, without]) - left_out_errors(grams)
