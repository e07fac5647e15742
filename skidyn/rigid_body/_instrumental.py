# SPDX-License-Identifier: BSD-3-Clause
"""Instrumental variables: identification when the motion itself is noisy.

Noise in positions enters velocities, accelerations and so every column; least squares then is
biased toward zero, however long the log. Instruments are the same columns along a motion whose
errors have nothing to do with those of the log: the reference of the controller, a closed-loop
simulation of the model (IDIM-IV), or another run of the same motion.

References
----------
A. Janot, P.-O. Vandanjon, M. Gautier (2014), A generic instrumental variable approach for
industrial robot identification, IEEE Trans. Control Systems Technology 22(1), 132-145.
A. Janot, P.-O. Vandanjon, M. Gautier (2014), A Durbin-Wu-Hausman test for industrial robot
identification, IEEE ICRA, 2956-2961.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.stats import t as student_t

from skidyn._signals import Array, Signals
from skidyn.evidence._folded import left_out_coefficients
from skidyn.evidence._problem import Fit, Problem, read_motion, regressor_rows
from skidyn.rigid_body._regression import PASSES, Regression, Solution


def instrumental(regression: Regression, prior_std: float | None = None) -> Solution:
    """Instrumental-variable estimate, with what tells whether it was needed."""
    if regression.instruments is None:
        raise ValueError(
            "estimator='instrumental' needs fit(X, y, instruments=...): a table like X of a motion "
            "whose errors have nothing to do with those of X, such as the reference positions"
        )
    noise = regression.own_noise()
    for _ in range(PASSES):
        coefficients, left = left_out_coefficients(
            regression, regression.design, noise, regression.target, regression.instruments
        )
        weights, noise = noise, regression.noise(coefficients)
    plain, plain_left = left_out_coefficients(
        regression, regression.design, weights, regression.target
    )
    test = durbin_wu_hausman(coefficients - plain, left - plain_left)
    return Solution(coefficients, left, noise, attributes={"hausman_": test})


def instrument_rows(problem: Problem, fit: Fit, signals: Signals, smooth: bool) -> list[Array]:
    """The columns of a fit along another motion, averaged like those of the problem.

    Parameters
    ----------
    problem : Problem
        Rows of the log.
    fit : Fit
        Terms, and the model whose torque some of them see.
    signals : Signals
        The motion of the instruments.
    smooth : bool
        Derive velocity and acceleration from the positions.

    Returns
    -------
    list of ndarray of shape (n_rows_j, n_coefficients)

    Raises
    ------
    ValueError
        The motion has not the rows of the log.
    """
    own = problem.motion.signals
    same = signals.n_samples == own.n_samples
    if not (same and np.array_equal(signals.trajectory, own.trajectory)):
        raise ValueError(
            "instruments must have the rows of X, in its trajectories: "
            f"{signals.n_samples} rows for {own.n_samples}"
        )
    motion = read_motion(signals, smooth, problem.torque)
    moved = motion.signals.with_(robot=problem.robot)
    other = replace(problem, motion=motion, signals=moved, _cache={})
    other.with_fit(fit)
    other.rigid_rows = regressor_rows(other, problem.rigid_index)
    return other.design([other.term_rows(t) for t in fit.terms])


def durbin_wu_hausman(difference: Array, left_out: Array) -> dict[str, Array]:
    """Whether instrumental variables and least squares differ by more than chance.

    Where the columns are free of noise that also sits in the residual, both are consistent and
    differ by chance only. How much chance can do is read from the differences without one fold
    each, which autocorrelation inside a fold does not fool.

    Parameters
    ----------
    difference : ndarray of shape (n_coefficients,)
        Instrumental-variable estimate less least squares.
    left_out : ndarray of shape (n_folds, n_coefficients)
        The same without one fold each.

    Returns
    -------
    dict of str to ndarray
        ``difference``, ``std`` and ``p_value`` of every coefficient.
    """
    n = len(left_out)
    std = np.sqrt((n - 1) / n * np.sum((left_out - left_out.mean(0)) ** 2, axis=0))
    statistic = np.abs(difference) / np.maximum(std, 1e-300)
    return {
        "difference": difference,
        "std": std,
        "p_value": 2 * student_t.sf(statistic, max(1, n - 1)),
    }
