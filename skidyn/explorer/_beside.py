# SPDX-License-Identifier: BSD-3-Clause
"""Effects that cannot be judged on averaged rows in folds: ripples and loads of a recording.

A torque ripple is faster than the windows over which rows are averaged, so it is fitted to samples.
A payload or a force at the tool in some recordings cannot be known to a fit that left these
recordings out, so it is judged on interleaved quarters of every recording, as in a diagnosis.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array
from skidyn.diagnosis import Candidate, find_lines, split_effects
from skidyn.effects import Term, searched_kinds
from skidyn.evidence import Problem, solve_left_out

#: Chance above which a line of the spectrum is noise.
CHANCE = 1e-3
QUARTERS = 4
#: Share of the squared error of its joints that a load has to remove to be offered.
LEAST = 0.02


@dataclass(frozen=True)
class Offer:
    """An effect that could be added, with the share of each joint's squared error that it removes.

    The error is that of samples for a ripple, otherwise of averaged rows.
    """

    candidate: Candidate
    drop: Array


@dataclass(frozen=True)
class Ripple:
    """A ripple fitted to samples, N m.

    ``torque`` is that of the fit that left the sample's fold out; ``left_out``, of shape (n_folds,
    2), and ``whole`` are coefficients of the fits without each fold and to all.
    """

    torque: Array
    left_out: Array
    whole: Array


def fit_ripple(problem: Problem, term: Term, residual: Array, fold: NDArray[np.int64]) -> Ripple:
    """Fit a ripple to the sliding samples of its joint, each fold left out once.

    The residual is of shape (n_samples, n_joints), N m; ``fold`` is that of every sample.
    """
    (joint,) = term.places
    columns = term.torque_columns(problem.signals)[joint]
    use = problem.rows.sliding[:, joint]
    a, y, of = columns[use], residual[use, joint], fold[use]
    grams = np.array([a[of == f].T @ a[of == f] for f in range(problem.n_folds)])
    cross = np.array([a[of == f].T @ y[of == f] for f in range(problem.n_folds)])
    whole, left = solve_left_out(grams, cross)
    return Ripple(np.sum(columns * left[fold], axis=1), left, whole)


def ripples(problem: Problem, residual: Array, fold: NDArray[np.int64]) -> list[Offer]:
    """The strongest ripple of every joint if it is significant, from the held-out residual, N m."""
    best: dict[int, Offer] = {}
    for line in find_lines(problem, residual):
        if line.chance > CHANCE:
            continue
        term = line.term
        use = problem.rows.sliding[:, line.joint]
        before = residual[use, line.joint]
        after = before - fit_ripple(problem, term, residual, fold).torque[use]
        drop = np.zeros(problem.n_joints)
        drop[line.joint] = 1 - np.sum(after**2) / max(float(np.sum(before**2)), 1e-300)
        old = best.get(line.joint)
        if old is None or drop[line.joint] > old.drop[line.joint]:
            best[line.joint] = Offer(Candidate(term.kind, term, {}), drop)
    return list(best.values())


def loads(
    problem: Problem, blocks: Sequence[dict[int, Array]], sigma: Array, target: Sequence[Array]
) -> list[Offer]:
    """A payload or a force at the tool in the recordings in which it is largest.

    ``blocks`` are columns of the model beside the rigid body and ``sigma`` the noise of one row of
    each joint. Effects are judged on interleaved quarters of every recording.
    """
    design = problem.design(blocks)
    offers = []
    for split in split_effects(problem, searched_kinds(), blocks, sigma, target):
        if split.apart:
            continue  # offered as one effect
        rows = split.candidate.rows
        before = _quarters(problem, design, sigma, target)
        wider = [np.hstack([a, rows[j]]) if j in rows else a for j, a in enumerate(design)]
        if any(a.shape[1] != wider[0].shape[1] for a in wider):
            continue  # the joint does not move the tool
        after = _quarters(problem, wider, sigma, target)
        offers.append(Offer(split.candidate, 1 - after / np.maximum(before, 1e-300)))
    return [offer for offer in offers if offer.drop.max() >= LEAST]


def _quarters(
    problem: Problem, design: Sequence[Array], sigma: Array, target: Sequence[Array]
) -> Array:
    """Squared error of every joint on quarters that the fit left out, (n_joints,)."""
    p = design[0].shape[1]
    grams, cross = np.zeros((QUARTERS, p, p)), np.zeros((QUARTERS, p))
    for a, y, quarter, s in zip(design, target, problem.rows.quarter, sigma, strict=True):
        for f in range(QUARTERS):
            own = a[quarter == f] / s
            grams[f] += own.T @ own
            cross[f] += own.T @ (y[quarter == f] / s)
    _, fits = solve_left_out(grams, cross)
    errors = []
    for a, y, quarter in zip(design, target, problem.rows.quarter, strict=True):
        left = [y[quarter == f] - a[quarter == f] @ fits[f] for f in range(QUARTERS)]
        errors.append(sum(float(np.sum(r**2)) for r in left))
    return np.array(errors)
