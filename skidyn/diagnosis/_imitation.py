# SPDX-License-Identifier: BSD-3-Clause
"""The log as it would be if the present model were complete and only its positions were noisy.

Accelerations from coarse encoders have an error that depends on the motion: the rounding of a slow
joint is a slow sawtooth, and the same for equal motion. It is correlated with columns that are
computed from the same positions, so that its torque looks like an effect, and no test on the
residual tells them apart. It can be imitated, since the rounding is known [1]_: the model is
evaluated along a slow motion without noise, whose positions are then rounded, or made as noisy as
those of the log, and smoothed in the same way. What a candidate removes there is due to the
positions.

References
----------
.. [1] B. Efron, R. J. Tibshirani (1993), An introduction to the bootstrap, Chapman & Hall, chapter
   16.4 (testing with a model of the null hypothesis).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from skidyn._signals import Array
from skidyn.diagnosis._noise import as_measured, sensor_noise
from skidyn.diagnosis._remainder import position_noise, position_noises
from skidyn.diagnosis._rule import SLOW_MOTION
from skidyn.evidence import Fit, Problem, make_problem, smooth_motion

#: What keeps a ratio to a noise of zero finite, N m or N.
TINY = 1e-300


def coarse_joints(problem: Problem, fit: Fit, residual: Array) -> set[int]:
    """Joints, from 0, most of whose noise is that of positions.

    Parameters
    ----------
    problem : Problem
        Motion and logged positions.
    fit : Fit
        A model.
    residual : ndarray of shape (n_samples, n_joints)
        Its residual, N m or N.
    """
    logged = problem.logged
    if logged is None or problem.signals.q is logged.q:
        return set()  # derivatives do not come from positions
    if problem.robot is None or problem.of_residual:
        return set()
    sensor = np.nan_to_num(sensor_noise(problem.signals, residual, problem.measured))
    return set(np.flatnonzero(2 * position_noise(problem, fit) ** 2 > sensor**2).tolist())


def power_of_positions(problem: Problem, fit: Fit, sigma: Array) -> Array:
    """Square of the torque that the noise of positions causes in averaged rows, (n_joints,).

    Over that of the noise of a row, as what an explanation removes; no explanation can remove more.

    Parameters
    ----------
    problem : Problem
        Motion and logged positions.
    fit : Fit
        A model.
    sigma : ndarray of shape (n_joints,)
        Noise of the rows, N m or N.
    """
    if problem.of_residual:
        return np.zeros(problem.n_joints)
    return np.asarray(
        problem.rows.counts * (position_noises(problem, fit)[1] / np.maximum(sigma, TINY)) ** 2
    )


def imitate(problem: Problem, fit: Fit) -> Problem:
    """The problem of a log that a model explains except for the noise of its positions.

    Parameters
    ----------
    problem : Problem
        Rows, motion and logged positions.
    fit : Fit
        The model, with its terms.

    Returns
    -------
    Problem
        The same terms on imitated positions, with the torque of the model, and the same windows.
    """
    logged, robot = problem.logged, problem.robot
    assert logged is not None
    assert robot is not None
    slow = smooth_motion(logged, SLOW_MOTION)
    kept = {name: getattr(slow, name) for name in ("q", "dq", "ddq")}
    along = replace(problem, signals=problem.signals.with_(**kept), _cache={}, _thinned={})
    along.set_fit(fit)
    torque = along.explained(fit) + robot.inverse_dynamics(slow.q, slow.dq, slow.ddq)
    q = as_measured(logged, problem.signals, slow.q, shifted=False)
    imitated = make_problem(
        logged.with_(q=q, dq=slow.dq, ddq=slow.ddq, cutoff=problem.signals.cutoff),
        torque,
        robot=robot,
        rigid_body=problem.rigid_body,
        terms=fit.terms,
    )
    if problem.with_like_rows is not None:
        imitated = problem.with_like_rows(imitated, imitated.terms)
    imitated.fit_own()
    return imitated
