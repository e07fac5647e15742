# SPDX-License-Identifier: BSD-3-Clause
"""Noise floor: the part of the residual that no smooth function of the motion predicts.

A flexible learner (random Fourier features of position, velocity, direction and acceleration of all
joints, ridge regression; Rahimi, Recht 2007) is trained on the residual rows of all folds but one.
The part that it predicts on the held-out fold is explainable; the rest is called noise. This is an
upper bound, since it includes effects with memory.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from skidyn._cores import each
from skidyn._signals import Array
from skidyn.diagnosis._variables import average_at_rows, ridge_solution
from skidyn.evidence import Problem, fold_slices

FEATURES = 200
#: Lengths over which the learned function varies, in standard deviations of its inputs.
LENGTHS = (2.0, 6.0)
RIDGES = 10.0 ** np.arange(-3.0, 4.0)
#: Number of successive ridges that must be worse than a stronger one before weaker ones are
#: skipped.
WORSE = 2


def predictable_share(problem: Problem, residual: Sequence[Array]) -> Array:
    """Share of the residual rows' squared error that is predictable on held-out folds.

    Parameters
    ----------
    problem : Problem
        Rows and folds.
    residual : sequence of ndarray of shape (n_rows_j,)
        Residual rows of every joint.

    Returns
    -------
    ndarray of shape (n_joints,)
        Between 0 and 1.
    """

    def of_joint(j: int) -> float:
        r = residual[j]
        if len(r) < 4 * problem.n_folds:
            return 0.0
        inputs = _inputs(problem, j)
        best = 0.0
        for length in LENGTHS:
            rng = np.random.default_rng(0)
            frequency = rng.normal(size=(inputs.shape[1], FEATURES // 2)) / length
            phase = inputs @ frequency
            features = np.column_stack([inputs, np.cos(phase), np.sin(phase)])
            best = max(best, _held_out_share(features, r, problem.fold[j], problem.n_folds))
        return best

    return np.array(each(of_joint, range(problem.n_joints)))


def _inputs(problem: Problem, joint: int) -> Array:
    """Averaged signals at the rows of a joint, standardised."""
    s = problem.signals
    raw = s.q, s.dq, s.sign[:, joint], s.ddq[:, joint]
    x = np.column_stack([average_at_rows(problem, joint, values) for values in raw])
    scale = x.std(0)
    keep = scale > 1e-9
    scaled: Array = (x[:, keep] - x[:, keep].mean(0)) / scale[keep]
    return scaled


def _held_out_share(features: Array, r: Array, fold: NDArray[np.int64], n_folds: int) -> float:
    """Best share over ridges, with errors summed over the held-out folds."""
    parts = [(features[rows], r[rows]) for rows in fold_slices(fold, n_folds)]
    grams = np.array([x.T @ x for x, _ in parts])
    cross = np.array([x.T @ y for x, y in parts])
    held, right = grams.sum(0) - grams, cross.sum(0) - cross
    best, behind = 0.0, 0
    for ridge in RIDGES[::-1]:
        drop = 0.0
        for gram, own, others, along in zip(grams, cross, held, right, strict=True):
            b = ridge_solution(others, along, ridge * len(r) / n_folds)
            drop += float(2 * b @ own - b @ gram @ b)
        best, behind = max(best, drop), 0 if drop > best else behind + 1
        if behind == WORSE:
            break  # a weaker ridge follows more of the noise
    return min(1.0, best / max(float(r @ r), 1e-300))
