# SPDX-License-Identifier: BSD-3-Clause
"""Instrumental variables: identification when the motion itself is noisy.

Noise in positions enters velocities, accelerations and so every column; least squares then is
biased toward zero, however long the log. Instruments are the same columns along a motion whose
errors are independent of those of the log: the reference of the controller, a closed-loop
simulation of the model (IDIM-IV), or another run of the same motion.

References
----------
A. Janot, P.-O. Vandanjon, M. Gautier (2014), A generic instrumental variable approach for
industrial robot identification, IEEE Trans. Control Systems Technology 22(1), 132-145.
A. Janot, P.-O. Vandanjon, M. Gautier (2014), A Durbin-Wu-Hausman test for industrial robot
identification, IEEE ICRA, 2956-2961.
"""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.stats import t as student_t

from skidyn._columns import with_columns
from skidyn._exceptions import SkidynError
from skidyn._order import order_in_time
from skidyn._signals import Array, Signals
from skidyn.evidence import (
    Fit,
    Problem,
    jackknife,
    left_out_coefficients,
    read_motion,
    regressor_rows,
)
from skidyn.identification._regression import PASSES, Regression, Solution

#: Names of the columns that hold motion.
_MOTION = re.compile(r"d{0,2}q(\d+$|_)")


def instrumental(regression: Regression, prior_std: float | None = None) -> Solution:
    """Instrumental-variable estimate, with a test of the bias of least squares."""
    if regression.instruments is None:
        raise ValueError(
            "estimator='instrumental' needs fit(X, y, instruments=...): a table like X of a "
            "motion whose errors are independent of those of X, such as the reference positions"
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
    """The columns of a fit along another motion, averaged like those of the problem, by joint.

    With ``smooth``, velocity and acceleration are derived from the positions. A ValueError is
    raised if the motion does not have the rows of the log.
    """
    own = problem.signals
    if signals.n_samples != own.n_samples:
        raise ValueError(
            "instruments must have the rows of X, in its trajectories: "
            f"{signals.n_samples} rows for {own.n_samples}"
        )
    other_order = order_in_time(signals.trajectory, signals.time) is not None
    if other_order or not np.array_equal(signals.trajectory, own.trajectory):
        raise ValueError(
            "instruments must have the rows of X, in the same order: their trajectories and times "
            "follow in another one; give instruments.loc[X.index], or sort both by trajectory and "
            "time"
        )
    motion = read_motion(signals, smooth, problem.torque)
    moved = motion.with_(robot=problem.robot)
    other = replace(problem, signals=moved, _cache={})
    other.set_fit(fit)
    (other.rigid_rows,) = regressor_rows([other], problem.rigid_index)
    return other.design([other.term_rows(t) for t in fit.terms])


def durbin_wu_hausman(difference: Array, left_out: Array) -> dict[str, Array]:
    """Test whether instrumental variables and least squares differ significantly.

    If the noise of the columns is independent of the residual, both are consistent and differ only
    by chance. The standard error is computed from the differences without one fold each, which is
    valid under autocorrelation inside a fold.
    """
    std = jackknife(left_out)
    statistic = np.abs(difference) / np.maximum(std, 1e-300)
    return {
        "difference": difference,
        "std": std,
        "p_value": 2 * student_t.sf(statistic, max(1, len(left_out) - 1)),
    }


def repetition_instruments(X: Any, trajectory: str = "trajectory") -> Any:
    """Instruments from a motion that was run several times.

    Sensor errors differ between runs, but the motion does not: the mean of the other runs is an
    instrument for each run.

    Parameters
    ----------
    X : DataFrame
        Runs of one motion, each a trajectory with the same number of rows; pandas or polars.
    trajectory : str, default="trajectory"
        Column of the number of the run.

    Returns
    -------
    DataFrame
        Like X; positions, velocities and accelerations of every run are those of the mean of the
        other runs.

    Raises
    ------
    SkidynError
        Fewer than two runs, or runs of different length.

    See Also
    --------
    RBDRegressor : ``fit(X, y, instruments=...)`` with ``estimator="instrumental"``.

    Notes
    -----
    A controller repeats a motion only approximately; differences between runs other than sensor
    noise make the instruments weaker, but not invalid.

    References
    ----------
    A. Janot, P.-O. Vandanjon, M. Gautier (2014), A generic instrumental variable approach for
    industrial robot identification, IEEE Trans. Control Systems Technology 22(1), 132-145.

    Examples
    --------
    >>> import pandas as pd
    >>> X = pd.DataFrame({"trajectory": [0, 0, 1, 1], "q1": [1.0, 2.0, 3.0, 4.0]})
    >>> repetition_instruments(X)["q1"].tolist()
    [3.0, 4.0, 1.0, 2.0]
    """
    number = np.asarray(X[trajectory])
    runs = [np.flatnonzero(number == name) for name in np.unique(number)]
    lengths = sorted({len(rows) for rows in runs})
    if len(runs) < 2 or len(lengths) > 1:
        raise SkidynError(
            f"{len(runs)} run(s) of {' and '.join(map(str, lengths))} rows; at least two of one "
            "length are expected, cut to the same part of the motion"
        )
    names = [str(name) for name in X.columns if _MOTION.match(str(name))]
    values = np.column_stack([np.asarray(X[name], dtype=float) for name in names])
    stacked = np.array([values[rows] for rows in runs])
    others = (stacked.sum(0) - stacked) / (len(runs) - 1)
    for rows, mean in zip(runs, others, strict=True):
        values[rows] = mean
    return with_columns(X, dict(zip(names, values.T, strict=True)))
