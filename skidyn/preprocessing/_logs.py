# SPDX-License-Identifier: BSD-3-Clause
"""Functions on whole logs that change rows or targets and cannot be steps of a Pipeline."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from sklearn.base import clone
from sklearn.utils import _safe_indexing

from skidyn._keys import keys_of
from skidyn.model_selection import held_out_folds

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]

#: Names of columns that hold positions.
POSITION = re.compile(r"q(\d+$|_)")
#: Share of the variance of positions, beyond which repetitions are other motions: those of half the
#: size of the motion.
OTHER_MOTION = 0.25
#: Differences of positions in rad or m up to which a robot may be at rest, with noise only.
NOISE = 1e-3


def average_repetitions(frame: pd.DataFrame, *, period: float | None = None) -> pd.DataFrame:
    """Average runs of the same motion, which lowers noise by the root of their number.

    Parameters
    ----------
    frame : DataFrame
        A log. Without `period` its trajectories are repetitions of one motion with the same
        number of rows.
    period : float, s, default=None
        Cut a single trajectory into repetitions of this length; an incomplete last one is an error
        unless it is shorter than half a period, in which case it is not used. All repetitions are
        interpolated to the times of the first.

    Returns
    -------
    average : DataFrame
        One trajectory, with the number of the first and its times.

    Raises
    ------
    ValueError
        If repetitions differ in length, or in position by more than half of the motion, or if
        `period` is given for several trajectories.

    References
    ----------
    .. [1] J. Swevers, W. Verdonck, J. De Schutter, "Dynamic Model Identification for Industrial
       Robots", IEEE Control Systems Magazine 27(5), 2007.

    Examples
    --------
    >>> import pandas as pd
    >>> from skidyn.preprocessing import average_repetitions
    >>> log = pd.DataFrame({"time": [0.0, 1, 0, 1], "trajectory": [0, 0, 1, 1],
    ...                     "tau1": [1.0, 2, 3, 4]})
    >>> average_repetitions(log)["tau1"].tolist()
    [2.0, 3.0]
    """
    if period is not None:
        return _average_periods(frame, period)
    runs = [run for _, run in frame.groupby("trajectory", sort=False)]
    lengths = [len(run) for run in runs]
    if len(set(lengths)) > 1:
        raise ValueError(
            f"the repetitions have {min(lengths)} to {max(lengths)} rows; cut them to the same "
            "motion first, or give period for one periodic recording."
        )
    average = runs[0].reset_index(drop=True).copy()
    signals = [name for name in frame.columns if name not in ("time", "trajectory")]
    places = [name for name in signals if POSITION.match(str(name))]
    _refuse_other_motions(
        places,
        np.array([run[places].to_numpy(float) for run in runs]),
        "Average trajectories that repeat one motion from the same point on, or give period for "
        "one periodic recording",
    )
    average[signals] = np.mean([run[signals].to_numpy(float) for run in runs], axis=0)
    return average


def _average_periods(frame: pd.DataFrame, period: float) -> pd.DataFrame:
    names = frame["trajectory"].unique() if "trajectory" in frame else np.zeros(1)
    if len(names) > 1:
        raise ValueError(
            f"period cuts one trajectory into repetitions, and the log has {len(names)}; give one "
            f"at a time, such as log[log['trajectory'] == {names[0]}]."
        )
    if not period > 0:
        raise ValueError(f"period={period!r}; a time above 0 s is expected.")
    time = frame["time"].to_numpy(float)
    if (np.diff(time) <= 0).any():
        raise ValueError("time must increase from row to row; sort the log by time.")
    start, span = time[0], time[-1] - time[0]
    n_periods = int(np.floor(span / period))
    if n_periods < 2:
        raise ValueError(f"the recording of {span:.4g} s has fewer than two periods of {period} s.")
    if span / period - n_periods > 0.5:
        raise ValueError(
            f"the last {span - n_periods * period:.4g} s are not a whole period; cut them."
        )
    average: pd.DataFrame = frame[time < start + period].reset_index(drop=True).copy()
    own = average["time"].to_numpy(float)
    repeated = {
        name: np.array(
            [
                np.interp(own + k * period, time, frame[name].to_numpy(float))
                for k in range(n_periods)
            ]
        )
        for name in frame.columns
        if name not in ("time", "trajectory")
    }
    places = [name for name in repeated if POSITION.match(str(name))]
    _refuse_other_motions(
        places,
        np.stack([repeated[name] for name in places], axis=-1) if places else np.zeros((1, 1, 0)),
        f"Give the period of the motion in s; period={period:g} is none",
    )
    for name, values in repeated.items():
        average[name] = np.mean(values, axis=0)
    return average


def _refuse_other_motions(places: list[str], repetitions: Array, remedy: str) -> None:
    """Refuse positions, shape (n_repetitions, n_rows, n_joints), that repeat no motion."""
    apart = np.var(repetitions, axis=0).mean(axis=0)
    whole = np.var(repetitions, axis=(0, 1))
    if apart.sum() <= max(OTHER_MOTION * whole.sum(), NOISE**2):
        return
    worst = int(np.argmax(apart))
    raise ValueError(
        f"the repetitions are different motions: {places[worst]} differs between them by "
        f"{np.sqrt(apart[worst]):.3g} (root mean square), and varies by "
        f"{np.sqrt(whole[worst]):.3g} in all. {remedy}."
    )


def cross_fitted_residual(physics: Any, X: Any, y: Any, *, cv: Any = 5) -> Array:
    """Residual of a physical model on held-out trajectories.

    Parameters
    ----------
    physics : estimator
        A scikit-learn regressor; cloned.
    X : DataFrame or array-like of shape (n_samples, n_features)
        Samples; trajectories are given by a column named ``trajectory``.
    y : array-like of shape (n_samples,) or (n_samples, n_joints), N m (N if prismatic)
        Torque.
    cv : int or cross-validator, default=5
        Folds by trajectory, at most as many as trajectories, or a cross-validator that tests every
        row exactly once.

    Returns
    -------
    residual : ndarray of the shape of y, N m (N if prismatic)
        Measured minus modelled.

    Examples
    --------
    >>> import numpy as np
    >>> from sklearn.linear_model import LinearRegression
    >>> from skidyn.model_selection import TrajectoryKFold
    >>> from skidyn.preprocessing import cross_fitted_residual
    >>> X = np.c_[np.repeat([0, 1, 2], 10), np.arange(30.0)]
    >>> folds = TrajectoryKFold(3, trajectory=0)
    >>> residual = cross_fitted_residual(LinearRegression(), X, 2 * X[:, 1], cv=folds)
    >>> bool(np.abs(residual).max() < 1e-9)
    True
    """
    y = np.asarray(y, dtype=np.float64)
    if hasattr(cv, "split"):
        folds = list(cv.split(X, y))
    else:
        table = np.asarray(X, dtype=np.float64)
        folds = held_out_folds(keys_of(X).trajectories(table), cv)
    residual: Array = np.full_like(y, np.nan)
    for train, test in folds:
        fitted = clone(physics).fit(_safe_indexing(X, train), y[train])
        residual[test] = y[test] - np.reshape(
            fitted.predict(_safe_indexing(X, test)), y[test].shape
        )
    if np.isnan(residual).any():
        raise ValueError("cv must test every row exactly once, as KFold does.")
    return residual
