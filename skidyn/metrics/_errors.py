# SPDX-License-Identifier: BSD-3-Clause
"""Errors per joint and their mean over joints, as functions and as scikit-learn scorers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.metrics import make_scorer

Array = NDArray[np.float64]


def _pair(y_true: ArrayLike, y_pred: ArrayLike) -> tuple[Array, Array]:
    """Check both arrays and return them with shape (n_samples, n_joints)."""
    true, pred = (np.asarray(y, dtype=np.float64) for y in (y_true, y_pred))
    if true.shape != pred.shape:
        raise ValueError(
            f"y_true has shape {true.shape} and y_pred {pred.shape}; give both as "
            "(n_samples, n_joints), or (n_samples,) for one joint."
        )
    if true.ndim > 2 or true.size == 0:
        raise ValueError(f"expected at least one row of shape (n_joints,), got {true.shape}.")
    for name, values in (("y_true", true), ("y_pred", pred)):
        bad = np.flatnonzero(~np.isfinite(values.reshape(len(values), -1)).all(axis=1))
        if len(bad):
            raise ValueError(f"{name} is not finite in row {bad[0]}; remove such rows first.")
    return true.reshape(len(true), -1), pred.reshape(len(pred), -1)


def _reduced(per_joint: Array, multioutput: str) -> Any:
    if multioutput == "raw_values":
        return per_joint
    if multioutput == "uniform_average":
        return float(per_joint.mean())
    raise ValueError(
        f"multioutput={multioutput!r}; use 'raw_values' (one per joint) or 'uniform_average'."
    )


def rmse_over_range(
    y_true: ArrayLike,
    y_pred: ArrayLike,
    *,
    torque_range: ArrayLike | None = None,
    multioutput: str = "uniform_average",
) -> Any:
    """Root mean squared error as a fraction of the range of the measured torque.

    Parameters
    ----------
    y_true, y_pred : array-like of shape (n_samples,) or (n_samples, n_joints), N m (N if prismatic)
        Measured and modelled torque.
    torque_range : array-like of shape (n_joints,), N m, default=None
        Range of each joint; the largest minus the smallest of `y_true` if None. Give the range of
        the whole log when `y_true` is one fold of it.
    multioutput : {"uniform_average", "raw_values"}, default="uniform_average"
        Mean over joints, or one value per joint.

    Returns
    -------
    error : float or ndarray of shape (n_joints,)
        Dimensionless.

    Raises
    ------
    ValueError
        If shapes differ, values are not finite, or a joint's torque never changes.

    References
    ----------
    .. [1] "Semiparametric Deep Learning Manipulator Inverse Dynamics Modeling Method for Smart
       City and Industrial Applications", table 3.

    Examples
    --------
    >>> rmse_over_range([0.0, 2.0, 4.0], [1.0, 3.0, 5.0])
    0.25
    """
    true, pred = _pair(y_true, y_pred)
    span = np.ptp(true, axis=0) if torque_range is None else np.atleast_1d(torque_range)
    still = np.flatnonzero(~(np.asarray(span) > 0))
    if len(still):
        raise ValueError(
            f"the torque of joint {still[0] + 1} is constant and has no range; give torque_range, "
            "or use the RMSE."
        )
    return _reduced(np.sqrt(((true - pred) ** 2).mean(axis=0)) / span, multioutput)


def max_absolute_error(
    y_true: ArrayLike, y_pred: ArrayLike, *, multioutput: str = "uniform_average"
) -> Any:
    """Largest absolute error.

    Parameters
    ----------
    y_true, y_pred : array-like of shape (n_samples,) or (n_samples, n_joints), N m (N if prismatic)
        Measured and modelled torque.
    multioutput : {"uniform_average", "raw_values"}, default="uniform_average"
        Mean over joints, or one value per joint.

    Returns
    -------
    error : float or ndarray of shape (n_joints,), N m
        The error, or one per joint.

    Examples
    --------
    >>> max_absolute_error([0.0, 1.0], [0.5, 3.0])
    2.0
    """
    true, pred = _pair(y_true, y_pred)
    return _reduced(np.abs(true - pred).max(axis=0), multioutput)


def min_absolute_error(
    y_true: ArrayLike, y_pred: ArrayLike, *, multioutput: str = "uniform_average"
) -> Any:
    """Smallest absolute error; values near 1e-12 show test rows among the training rows.

    Parameters
    ----------
    y_true, y_pred : array-like of shape (n_samples,) or (n_samples, n_joints), N m (N if prismatic)
        Measured and modelled torque.
    multioutput : {"uniform_average", "raw_values"}, default="uniform_average"
        Mean over joints, or one value per joint.

    Returns
    -------
    error : float or ndarray of shape (n_joints,), N m
        The error, or one per joint.

    Examples
    --------
    >>> min_absolute_error([0.0, 1.0], [0.5, 3.0])
    0.5
    """
    true, pred = _pair(y_true, y_pred)
    return _reduced(np.abs(true - pred).min(axis=0), multioutput)


def percent_improvement(before: ArrayLike, after: ArrayLike) -> Any:
    """Reduction of an error in per cent of its previous value.

    Parameters
    ----------
    before, after : array-like of shape (n_joints,)
        Errors without and with the compensation, in the same unit.

    Returns
    -------
    improvement : float or ndarray of shape (n_joints,), %
        Negative if the error grew.

    Examples
    --------
    >>> percent_improvement(0.8, 0.2)
    75.0
    """
    old, new = np.asarray(before, dtype=np.float64), np.asarray(after, dtype=np.float64)
    if (old <= 0).any():
        raise ValueError(
            "an error before the compensation is not positive, so that the ratio is undefined."
        )
    improvement = 100.0 * (1.0 - new / old)
    return float(improvement) if improvement.ndim == 0 else improvement


def joint_error_table(
    y_true: ArrayLike, y_pred: ArrayLike, *, joint_names: Sequence[str] | None = None
) -> dict[str, dict[str, float]]:
    """All errors of the papers' tables, for each joint and as mean over joints.

    Parameters
    ----------
    y_true, y_pred : array-like of shape (n_samples,) or (n_samples, n_joints), N m (N if prismatic)
        Measured and modelled torque.
    joint_names : sequence of str, default=None
        Names of the joints; ``J1, J2, ..`` if None.

    Returns
    -------
    table : dict of dict
        ``table["RMSE"]["J1"]``; rows MSE, RMSE, MAE, R2, RMSE/range, max, min; columns the joints
        and ``"mean"``. ``pandas.DataFrame(table).T`` prints it. R2 and RMSE/range are nan for a
        joint whose torque never changes.

    Examples
    --------
    >>> table = joint_error_table([[0.0], [2.0]], [[0.0], [1.0]])
    >>> table["MAE"]
    {'J1': 0.5, 'mean': 0.5}
    """
    true, pred = _pair(y_true, y_pred)
    names = [f"J{j + 1}" for j in range(true.shape[1])] if joint_names is None else joint_names
    if len(names) != true.shape[1]:
        raise ValueError(f"{len(names)} joint names for {true.shape[1]} joints of torque.")
    error = true - pred
    mse = (error**2).mean(axis=0)
    variance, span = true.var(axis=0), np.ptp(true, axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        rows = {
            "MSE": mse,
            "RMSE": np.sqrt(mse),
            "MAE": np.abs(error).mean(axis=0),
            "R2": np.where(variance > 0, 1.0 - mse / variance, np.nan),
            "RMSE/range": np.where(span > 0, np.sqrt(mse) / span, np.nan),
            "max": np.abs(error).max(axis=0),
            "min": np.abs(error).min(axis=0),
        }
    return {
        row: {**dict(zip(names, map(float, values), strict=True)), "mean": float(values.mean())}
        for row, values in rows.items()
    }


def joint_scores(estimator: Any, X: Any, y: ArrayLike) -> dict[str, float]:
    """Score every joint: a scorer of many metrics for scikit-learn's ``scoring``.

    Parameters
    ----------
    estimator : estimator
        A fitted regressor.
    X : DataFrame or array-like of shape (n_samples, n_features)
        Samples.
    y : array-like of shape (n_samples,) or (n_samples, n_joints), N m (N if prismatic)
        Measured torque.

    Returns
    -------
    scores : dict of float
        Greater is better: the mean over joints under the names of :data:`SCORERS`, such as
        ``"neg_mean_absolute_error"``, and each joint under the name followed by ``"_J1"``, ...

    Examples
    --------
    >>> import numpy as np
    >>> from sklearn.linear_model import LinearRegression
    >>> from sklearn.model_selection import cross_validate
    >>> X = np.random.default_rng(0).normal(size=(30, 2))
    >>> scores = cross_validate(LinearRegression(), X, X**3, scoring=joint_scores, cv=3)
    >>> scores["test_neg_mean_absolute_error_J2"].shape
    (3,)
    """
    table = joint_error_table(y, estimator.predict(X))
    scores = {}
    for name, row in _ROWS.items():
        sign = -1.0 if name.startswith("neg_") else 1.0
        for joint, value in table[row].items():
            scores[name if joint == "mean" else f"{name}_{joint}"] = sign * value
    return scores


#: Rows of the table by the names of the scorers.
_ROWS = {
    "r2": "R2",
    "neg_mean_squared_error": "MSE",
    "neg_root_mean_squared_error": "RMSE",
    "neg_mean_absolute_error": "MAE",
    "neg_rmse_over_range": "RMSE/range",
    "neg_max_absolute_error": "max",
    "neg_min_absolute_error": "min",
}

#: Scorers for ``cross_validate(scoring=SCORERS)`` and ``GridSearchCV``: greater is better.
SCORERS: dict[str, Any] = {
    "r2": "r2",
    "neg_mean_squared_error": "neg_mean_squared_error",
    "neg_root_mean_squared_error": "neg_root_mean_squared_error",
    "neg_mean_absolute_error": "neg_mean_absolute_error",
    "neg_rmse_over_range": make_scorer(rmse_over_range, greater_is_better=False),
    "neg_max_absolute_error": make_scorer(max_absolute_error, greater_is_better=False),
    "neg_min_absolute_error": make_scorer(min_absolute_error, greater_is_better=False),
}
