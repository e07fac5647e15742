# SPDX-License-Identifier: BSD-3-Clause
"""Residual of every sample under a model that never saw its fold."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array
from skidyn.effects import Term, get_effect
from skidyn.evidence._folded import left_out_coefficients
from skidyn.evidence._problem import Problem, term_columns


def sample_folds(problem: Problem) -> NDArray[np.int64]:
    """Fold of every sample, from the rows of its trajectory nearest in time."""
    signals = problem.signals
    fold = np.zeros(signals.n_samples, dtype=np.int64)
    joint = int(np.argmax(problem.rows.counts))
    for name in np.unique(signals.trajectory):
        rows = np.flatnonzero(problem.rows.trajectory[joint] == name)
        here = np.flatnonzero(signals.trajectory == name)
        if not len(rows):
            continue  # no row of it entered the fit: any fold leaves it out
        order = rows[np.argsort(problem.rows.time[joint][rows])]
        middle = problem.rows.time[joint][order]
        edges = (middle[1:] + middle[:-1]) / 2
        fold[here] = problem.fold[joint][order][np.searchsorted(edges, signals.clock[here])]
    return fold


@dataclass(frozen=True)
class HeldOut:
    """Held-out prediction of a model.

    Attributes
    ----------
    residual : ndarray of shape (n_samples, n_joints)
        Torque less the prediction of a model fitted without the sample's fold, N m or N.
    torque : dict of Term to ndarray of shape (n_samples, n_joints)
        Contribution of the terms asked for, fitted to all data, N m or N.
    """

    residual: Array
    torque: dict[Term, Array]


def held_out_residual(
    problem: Problem, terms: Sequence[Term], sigma: Array, keep: Sequence[Term] = ()
) -> HeldOut:
    """Residual of every sample under the model fitted without its fold.

    Parameters
    ----------
    problem : Problem
        Rows, folds and torque.
    terms : sequence of Term
        Every effect of the model.
    sigma : ndarray of shape (n_joints,)
        Noise of one row.
    keep : sequence of Term, default=()
        Terms whose own contribution is wanted.

    Returns
    -------
    HeldOut
    """
    design = problem.design([problem.term_rows(t) for t in terms])
    whole, left = left_out_coefficients(problem, design, sigma, problem.target)
    fold = sample_folds(problem)
    prediction = np.zeros_like(problem.torque)
    n_rigid = len(problem.rigid_index)
    if problem.rigid_body and problem.robot is not None:
        s = problem.signals
        for f, coefficients in enumerate(left):
            here = fold == f
            prediction[here] = problem.robot.inverse_dynamics(
                s.q[here], s.dq[here], s.ddq[here], parameters=problem.correction(coefficients)
            )
    torque = {}
    wanted = set(keep)
    at = n_rigid
    for term in terms:
        k = len(get_effect(term.kind).coefficients)
        own = np.zeros_like(problem.torque) if term in wanted else None
        for j, block in term_columns(problem.signals, term).items():
            # What one recording alone can tell is not held out with it.
            own_only = "trajectory" in term.shape
            coefficients = whole[None, at : at + k] if own_only else left[fold, at : at + k]
            prediction[:, j] += (block * coefficients).sum(1)
            if own is not None:
                own[:, j] += block @ whole[at : at + k]
        if own is not None:
            torque[term] = own
        at += k
    return HeldOut(problem.torque - prediction, torque)
